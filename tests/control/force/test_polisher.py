"""A polishing job on a spring: its phases, its force, and each fault once present and once absent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from spring_cell import STIFFNESS, Disturbance, Ride, ride

from tauhat.control.force import (
    AdmittanceLaw,
    BelievedForce,
    ContactRule,
    ForceReading,
    MeasuredForce,
    PIForceLaw,
    Polisher,
    PolishLimits,
    PolishTask,
)
from tauhat.control.force.pi_law import PIMemory
from tauhat.errors import ControlError

POLISHER = Polisher(task=PolishTask(half=0.05), limits=PolishLimits(height=0.01), contact=ContactRule(threshold=3.0))
PERIOD = POLISHER.period
PASSING = 1500  # a step in the middle of the first pass


@pytest.fixture(scope="module")
def plain() -> Ride:
    return ride(POLISHER)


def given_up(done: Ride) -> str:
    """Return the reason, behind a check that the job went up and ended."""
    last = done.commands[-1]
    assert done.phases[-2:] == ["retract", "stopped"]
    assert last.depth == pytest.approx(-POLISHER.limits.height, abs=1e-9)
    assert last.ds == last.ddepth == 0.0
    return last.reason


def test_a_job_without_faults_runs_through_its_phases(plain: Ride):
    assert plain.phases == ["approach", "contact", "pass", "retract", "done"]
    assert {command.reason for command in plain.commands} == {""}
    assert plain.commands[PASSING].phase == "pass"


def test_the_force_is_held_along_both_passes(plain: Ride):
    passing = np.array([command.phase == "pass" for command in plain.commands])
    error = plain.forces[passing] - POLISHER.task.force
    assert np.sqrt(np.mean(error**2)) < 0.02 * POLISHER.task.force
    assert plain.forces.max() < 1.1 * POLISHER.task.force


def test_the_feed_goes_there_and_back_and_waits_for_the_force(plain: Ride):
    s = np.array([command.s for command in plain.commands])
    begun = plain.first("pass")
    np.testing.assert_array_equal(s[: begun - 1], -POLISHER.task.half)
    assert s.max() == pytest.approx(POLISHER.task.half, abs=1e-9)
    assert s[-1] == pytest.approx(-POLISHER.task.half, abs=1e-9)
    turned = int(s.argmax())
    assert np.diff(s[: turned + 1]).min() >= 0.0 >= np.diff(s[turned:]).max()


def test_speeds_are_the_derivatives_of_the_positions(plain: Ride):
    s, ds, depth, ddepth = np.array([command[:4] for command in plain.commands]).T
    moving = slice(None, -1)  # at the end both speeds are zero at once
    np.testing.assert_allclose(ddepth[1:][moving], np.diff(depth)[moving] / PERIOD, atol=1e-12)
    np.testing.assert_allclose(0.5 * (ds[1:] + ds[:-1]), np.diff(s) / PERIOD, atol=2e-4)


def test_an_ordinary_retract_runs_along_the_normal_alone(plain: Ride):
    up = plain.commands[plain.first("retract") :]
    assert {command.s for command in up} == {up[0].s}
    assert np.diff([command.depth for command in up]).max() <= 0.0


def test_three_passes_end_at_the_far_side():
    done = ride(replace(POLISHER, task=replace(POLISHER.task, passes=3)))
    assert done.commands[-1].phase == "done"
    assert done.commands[-1].s == pytest.approx(POLISHER.task.half, abs=1e-9)


def test_an_admittance_law_polishes_as_well():
    done = ride(replace(POLISHER, law=AdmittanceLaw.tuned()))
    passing = np.array([command.phase == "pass" for command in done.commands])
    assert done.phases == ["approach", "contact", "pass", "retract", "done"]
    assert np.abs(done.forces[passing] - 30.0).max() < 0.1 * 30.0


def test_in_an_open_loop_the_depth_is_that_of_the_believed_spring_whatever_is_read():
    polisher = replace(POLISHER, source=BelievedForce(stiffness=1e4))
    done = ride(polisher, disturb=lambda _, __: None)
    assert done.phases == ["approach", "contact", "pass", "retract", "done"]
    depths = np.array([command.depth for command in done.commands if command.phase == "pass"])
    assert np.abs(depths - 30.0 / 1e4).max() < 1e-4
    # the truth is half a millimetre lower and tilted by a quarter of one to each side: 22.5 to 27.5 N
    turned = int(np.argmax([command.s for command in done.commands]))
    assert done.forces[turned] == pytest.approx(27.5, abs=0.5)


def spoilt(replacement: Callable[[ForceReading], ForceReading | None], first: int, count: int) -> Disturbance:
    return lambda k, reading: replacement(reading) if first <= k < first + count else reading


@pytest.mark.parametrize(
    ("replacement", "reason"),
    [
        (lambda _: None, "reading_missing"),
        (lambda _: ForceReading(np.nan, 0.3), "reading_invalid"),
        (lambda _: ForceReading(29.9, 0.3), "reading_frozen"),
        (lambda reading: reading._replace(std=16.0), "untrusted"),
    ],
)
@pytest.mark.parametrize("first", [100, PASSING])
def test_readings_of_no_use_are_waited_for_then_given_up(replacement: Any, reason: str, first: int):
    polisher = replace(POLISHER, source=MeasuredForce(frozen_after=3, patience=0.1))
    if first < PASSING and reason == "reading_frozen":
        replacement = lambda _: ForceReading(0.1, 0.3)  # noqa: E731 (in air)
    for_good = ride(polisher, disturb=spoilt(replacement, first, 10**6))
    assert "hold" in for_good.phases
    assert given_up(for_good) == reason
    stopped = for_good.first("retract")
    assert 25 <= stopped - first <= 29
    for_a_while = ride(polisher, disturb=spoilt(replacement, first, 20))
    assert "hold" in for_a_while.phases
    assert for_a_while.commands[-1].phase == "done"


def test_while_it_holds_the_tool_does_not_press_and_the_feed_brakes():
    done = ride(POLISHER, disturb=spoilt(lambda _: None, PASSING, 10**6))
    held = done.commands[PASSING + 5 : done.first("retract")]
    assert len(held) > 15
    assert {command.ddepth for command in held} == {0.0}
    assert np.diff([command.ds for command in held]).max() < 0.0


def test_a_force_above_its_limit_lifts_the_tool_at_once():
    done = ride(POLISHER, disturb=spoilt(lambda reading: reading._replace(force=60.1), PASSING, 1))
    assert given_up(done) == "force_limit"
    assert done.first("retract") == PASSING
    assert done.commands[PASSING].ddepth < 0.0
    below = ride(POLISHER, disturb=spoilt(lambda reading: reading._replace(force=59.9), PASSING, 1))
    assert below.commands[-1].phase == "done"


def test_a_fault_on_the_way_lifts_at_once_while_the_feed_brakes():
    done = ride(POLISHER, disturb=spoilt(lambda reading: reading._replace(force=60.1), PASSING, 1))
    task, before = POLISHER.task, done.commands[PASSING - 1]
    assert abs(before.ds) == pytest.approx(task.feed)
    up = done.commands[PASSING:]
    assert np.diff([before.depth, *(command.depth for command in up)])[:-1].max() < 0.0
    travel = abs(up[-1].s - before.s)
    assert travel == pytest.approx(task.feed**2 / (2.0 * task.acceleration), rel=0.05)
    ds = np.array([command.ds for command in up])
    assert np.abs(np.diff(ds)).max() <= task.acceleration * PERIOD * (1.0 + 1e-9)


def test_even_an_untrusted_force_above_the_limit_counts():
    done = ride(POLISHER, disturb=spoilt(lambda _: ForceReading(-70.0, 50.0), PASSING, 1))
    assert given_up(done) == "force_limit"


def fallen(depth: float, first: int, count: int = 10**6) -> Callable[[int, float], float]:
    return lambda k, _: -depth if first <= k < first + count else 0.0


def test_lost_contact_is_searched_for_a_way_and_then_given_up():
    done = ride(POLISHER, surface=fallen(0.02, PASSING))
    assert given_up(done) == "contact_lost"
    assert done.phases == ["approach", "contact", "pass", "search", "retract", "stopped"]
    depths = [command.depth for command in done.commands]
    # what the law presses in 0.2 s until the loss is sure, and the search
    law = POLISHER.law.speed_limit * POLISHER.contact.lost_after
    assert max(depths[PASSING:]) - depths[PASSING - 1] < law + POLISHER.limits.search_travel + 1e-4


def test_contact_that_is_found_again_goes_on_with_the_pass_where_it_paused():
    lower = ride(POLISHER, surface=fallen(0.004, PASSING))
    start = ["approach", "contact", "pass", "search", "contact", "pass", "retract", "done"]
    assert lower.phases == start
    paused = [command.s for command in lower.commands if command.phase in {"search", "contact"}][-100:]
    assert {round(s, 12) for s in paused} == {round(paused[-1], 12)}
    assert lower.commands[-1].s == pytest.approx(-POLISHER.task.half, abs=1e-9)


def test_a_step_of_the_surface_that_the_law_follows_is_no_loss():
    done = ride(POLISHER, surface=fallen(0.001, PASSING))
    assert done.phases == ["approach", "contact", "pass", "retract", "done"]


def test_contact_that_keeps_being_lost_is_given_up():
    limits = replace(POLISHER.limits, searches=1)
    steps = lambda k, _: -0.004 if k >= PASSING and (k - PASSING) % 800 < 100 else 0.0  # noqa: E731
    done = ride(replace(POLISHER, limits=limits), surface=steps)
    assert given_up(done) == "contact_lost"
    assert done.phases.count("search") == 1


@pytest.mark.parametrize(("height", "reason"), [(-0.009, "surface_misplaced"), (0.006, "surface_misplaced")])
def test_a_surface_that_is_not_where_it_is_believed_is_given_up(height: float, reason: str):
    done = ride(POLISHER, surface=lambda _, __: height)
    assert given_up(done) == reason
    assert done.phases == ["approach", "retract", "stopped"]


@pytest.mark.parametrize("height", [-0.0045, 0.0045])
def test_a_surface_that_is_nearly_there_is_polished(height: float):
    assert ride(POLISHER, surface=lambda _, __: height).commands[-1].phase == "done"


def test_a_surface_that_falls_away_slowly_ends_at_the_deepest_place():
    sinking = lambda k, _: -2e-3 * PERIOD * max(0, k - PASSING)  # noqa: E731
    task = replace(POLISHER.task, passes=9)
    done = ride(replace(POLISHER, task=task), surface=sinking)
    assert given_up(done) == "surface_misplaced"
    assert max(command.depth for command in done.commands) == POLISHER.limits.deepest


@pytest.mark.parametrize("factor", [0.6, 1.8])
def test_a_step_of_stiffness_is_answered_within_the_speed_limits(factor: float):
    done = ride(POLISHER, stiffness=lambda k: STIFFNESS * (factor if k >= PASSING else 1.0))
    assert done.commands[-1].phase == "done"
    ddepth = np.array([command.ddepth for command in done.commands])
    assert ddepth.max() <= POLISHER.press_speed * (1.0 + 1e-9)
    # the stiffness is up to 18 N/mm, so the force changes at most as fast as the tip, but for the step itself
    change = np.abs(np.diff(done.forces))
    change[PASSING - 1] = 0.0
    tilt = 0.005 * POLISHER.task.feed
    assert change[: done.first("retract")].max() <= 1.8 * STIFFNESS * PERIOD * (POLISHER.press_speed + tilt)


def test_contact_needs_newtons_and_standard_errors_for_a_while():
    rule = ContactRule(threshold=3.0, errors=3.0, hold=0.02)
    assert [rule.touches(*pair) for pair in ((3.1, 1.0), (2.9, 0.1), (3.1, 1.1), (6.0, 1.9))] == [
        True,
        False,
        False,
        True,
    ]
    often = ride(POLISHER, disturb=lambda k, r: r._replace(force=9.0) if k < 300 and k % 10 < 4 else r)
    assert often.commands[-1].phase == "done"
    assert often.commands[often.first("contact")].depth > 0.0
    early = ride(POLISHER, disturb=spoilt(lambda r: r._replace(force=9.0 + 1e-3 * r.force), 100, 5))
    assert given_up(early) == "surface_misplaced"


def test_contact_is_lost_by_one_long_dip_of_the_force_and_not_by_many_short_ones():
    def dips(count: int) -> Disturbance:
        dipped = lambda r: r._replace(force=7.0 + 1e-3 * r.force)  # noqa: E731
        return lambda k, r: dipped(r) if k >= PASSING and k % 100 < count else r

    assert "search" not in ride(POLISHER, disturb=dips(48), steps=PASSING + 250).phases
    assert "search" in ride(POLISHER, disturb=dips(60), steps=PASSING + 250).phases


def test_a_law_begins_anew_when_contact_is_found_again():
    wound = POLISHER.start()._replace(phase="search", depth=1e-3, searched_from=1e-3, law=PIMemory(20.0, 5.0))
    for k in range(5):
        assert wound.law == PIMemory(20.0, 5.0)
        wound, _ = POLISHER.step(wound, ForceReading(9.0 + 0.1 * k, 0.3))
    assert wound.phase == "contact"
    assert wound.law == POLISHER.law.start()


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Polisher(period=0.0), "polisher: period is not positive"),
        (lambda: Polisher(contact=ContactRule(threshold=30.0)), "polisher: contact threshold is too high"),
        (lambda: Polisher(limits=PolishLimits(force=30.0)), "polisher: force limit is too low"),
        (lambda: PolishTask(passes=0), "polishing task: too few passes"),
        (lambda: PolishTask(feed=-0.1), "polishing task: feed is not positive"),
        (lambda: PolishTask(force_rate=0.0), "polishing task: force_rate is not positive"),
        (lambda: PolishLimits(searches=-1), "polishing limits: searches is negative"),
        (lambda: PolishLimits(misplaced=0.03), "polishing limits: misplaced is out of reach"),
        (lambda: PolishLimits(deepest=0.0), "polishing limits: deepest is not positive"),
        (lambda: PolishLimits(search_speed=0.0), "polishing limits: search_speed is not positive"),
        (lambda: PolishLimits(retract_speed=0.0), "polishing limits: retract_speed is not positive"),
        (lambda: PolishLimits(search_travel=np.inf), "polishing limits: search_travel is not positive"),
        (lambda: ContactRule(errors=0.0), "contact rule: errors is not positive"),
        (lambda: ContactRule(lost_after=0.0), "contact rule: lost_after is not positive"),
        (lambda: ContactRule(lost_part=1.0), "contact rule: lost_part is no part"),
    ],
)
def test_impossible_settings_are_refused(build: Callable[[], object], message: str):
    with pytest.raises(ControlError, match=message):
        build()


def test_the_law_of_a_job_is_bounded_whatever_it_answers():
    class Wild(PIForceLaw):
        """A law that keeps no limit."""

        def step(self, memory: Any, error: float, period: float) -> tuple[Any, float]:
            return memory, error / period

    done = ride(replace(POLISHER, law=Wild()), steps=3000)
    assert max(abs(command.ddepth) for command in done.commands) <= POLISHER.lift_speed * (1.0 + 1e-9)
    assert max(command.ddepth for command in done.commands) <= POLISHER.press_speed * (1.0 + 1e-9)
