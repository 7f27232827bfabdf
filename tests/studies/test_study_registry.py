"""Studies by name: each under its own key, with as many random cases as are asked for."""

from __future__ import annotations

import pytest

from tauhat.errors import ModelError
from tauhat.studies.crs_a465 import CrsA465Study
from tauhat.studies.registry import STUDIES, study_named


@pytest.mark.parametrize("key", sorted(STUDIES))
def test_a_study_stands_under_its_own_key_and_takes_seeds(key: str) -> None:
    assert STUDIES[key].key == key
    assert STUDIES[key].title
    assert study_named(key) == STUDIES[key]()
    assert study_named(key, seeds=3) != STUDIES[key]()


def test_seeds_reach_the_study() -> None:
    assert study_named("crs-a465", seeds=7) == CrsA465Study(seeds=7)


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ModelError, match=r"unknown study; expected .*crs-a465.*, got nothing"):
        study_named("nothing")
