"""What becomes of readings: each trouble present and absent, and when it becomes a fault."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tauhat.control.force import BelievedForce, Expected, ForceReading, MeasuredForce, Sight
from tauhat.errors import ControlError

PERIOD, FORCE = 0.004, 30.0
SOURCE = MeasuredForce(patience=0.02, frozen_after=3, uncertain_part=0.5)
GOOD = [ForceReading(10.0 + 0.1 * k, 1.0) for k in range(100)]


def sights(source: MeasuredForce, readings: Sequence[ForceReading | None]) -> list[Sight]:
    memory, seen = source.start(), []
    for reading in readings:
        memory, sight = source.step(memory, reading, expected=Expected(0.0, FORCE), period=PERIOD)
        seen.append(sight)
    return seen


def test_good_readings_are_handed_on():
    assert [sight.reading for sight in sights(SOURCE, GOOD)] == GOOD
    assert {(sight.trouble, sight.fault) for sight in sights(SOURCE, GOOD)} == {("", "")}


@pytest.mark.parametrize(
    ("reading", "trouble"),
    [
        (None, "reading_missing"),
        (ForceReading(np.nan, 1.0), "reading_invalid"),
        (ForceReading(-np.inf, 1.0), "reading_invalid"),
        (ForceReading(1.0, np.nan), "reading_invalid"),
        (ForceReading(1.0, -1.0), "reading_invalid"),
        (ForceReading(1.0, 0.501 * FORCE), "untrusted"),
    ],
)
def test_a_reading_of_no_use_is_named_at_once_and_a_fault_behind_the_patience(
    reading: ForceReading | None, trouble: str
):
    seen = sights(SOURCE, [*GOOD[:3], *[reading] * 3, *GOOD[3:20]])
    assert [sight.trouble for sight in seen] == [""] * 3 + [trouble] * 3 + [""] * 17
    lasting = sights(MeasuredForce(patience=0.02, frozen_after=100), [reading] * 8)
    assert [sight.fault for sight in lasting] == [""] * 5 + [trouble] * 3


def test_an_error_bar_just_small_enough_is_trusted():
    assert sights(SOURCE, [ForceReading(1.0, 0.5 * FORCE)])[0].trouble == ""


def test_readings_that_repeat_to_the_bit_are_frozen_and_those_that_nearly_do_are_not():
    stuck = sights(SOURCE, [ForceReading(10.0, 1.0)] * 10)
    assert [sight.trouble for sight in stuck] == [""] * 3 + ["reading_frozen"] * 7
    assert [sight.fault for sight in stuck] == [""] * 8 + ["reading_frozen"] * 2
    nearly = [ForceReading(np.nextafter(10.0, 11.0) if k % 3 else 10.0, 1.0) for k in range(50)]
    assert {sight.trouble for sight in sights(SOURCE, nearly)} == {""}


def test_a_sensor_that_fails_every_other_time_is_found_out_and_one_that_fails_every_tenth_is_not():
    often = [None if k % 2 else reading for k, reading in enumerate(GOOD)]
    seldom = [None if k % 10 == 9 else reading for k, reading in enumerate(GOOD)]
    assert any(sight.fault for sight in sights(SOURCE, often))
    assert not any(sight.fault for sight in sights(SOURCE, seldom))


def test_believed_force_is_that_of_a_spring_and_never_looks_at_a_reading():
    source = BelievedForce(stiffness=1e4)
    for depth, force in ((-0.01, 0.0), (0.0, 0.0), (0.003, 30.0)):
        for reading in (None, ForceReading(np.nan, 1.0), ForceReading(7.0, 1.0)):
            sight = source.step(source.start(), reading, expected=Expected(depth, FORCE), period=PERIOD)[1]
            assert sight == Sight(ForceReading(force, 0.0), "", "")


def test_impossible_sources_are_refused():
    with pytest.raises(ControlError, match="MeasuredForce: patience is not positive"):
        MeasuredForce(patience=0.0)
    with pytest.raises(ControlError, match="MeasuredForce: uncertain_part is not positive"):
        MeasuredForce(uncertain_part=-1.0)
    with pytest.raises(ControlError, match="MeasuredForce: frozen_after is too small"):
        MeasuredForce(frozen_after=0)
    with pytest.raises(ControlError, match="BelievedForce: stiffness is not positive"):
        BelievedForce(stiffness=0.0)
