"""Fields of settings that have to be finite numbers above zero: what passes, what is refused, in which words."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from tauhat.arrays import check_fields
from tauhat.errors import LiveError


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    size: float = 1.0
    noise: float = 0.0
    offset: float = -1.0

    def __post_init__(self) -> None:
        check_fields(self, error=LiveError, name="settings", or_zero=("noise",), signed=("offset",))


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("size", 0.0, "a finite number above zero"),
        ("size", float("inf"), "a finite number above zero"),
        ("size", float("nan"), "a finite number above zero"),
        ("noise", -1e-9, "a finite number, not negative"),
        ("noise", float("nan"), "a finite number, not negative"),
        ("offset", float("-inf"), "a finite number, got"),
    ],
)
def test_a_field_out_of_its_range_is_refused_by_name(field: str, value: float, words: str):
    with pytest.raises(LiveError, match=f"settings, {field}; expected {words}"):
        Settings(**{field: value})


def test_zero_and_signs_pass_where_they_may():
    assert Settings(noise=0.0, offset=-3.0).offset == -3.0
    assert Settings(offset=0.0, size=1).size == 1
