"""What a polisher keeps whatever it is shown: speeds, depths, and that what is given up stays so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tauhat.control.force import (
    ContactRule,
    ForceReading,
    MeasuredForce,
    PolishCommand,
    Polisher,
    PolishLimits,
    PolishMemory,
    PolishTask,
)

ROUNDING = 1e-9
POLISHER = Polisher(
    task=PolishTask(half=0.01, settle=0.02, force_rate=500.0),
    limits=PolishLimits(height=2e-3, misplaced=1.9e-3, deepest=4e-3, approach_speed=0.02, search_travel=5e-4),
    contact=ContactRule(hold=0.004, lost_after=0.02),
    source=MeasuredForce(frozen_after=12, patience=0.02),
)
numbers = st.one_of(
    st.floats(), st.floats(-10.0, 70.0), st.sampled_from([np.nan, np.inf, -np.inf, 1e308, -1e308, 0.0, 30.0])
)
readings = st.one_of(
    st.none(),
    st.builds(ForceReading, numbers, numbers),
    st.builds(ForceReading, st.floats(0.0, 59.0), st.floats(0.0, 2.0)),
)
# each for a while, so that jobs get further than the first fault
stretches = st.lists(st.tuples(readings, st.integers(1, 40), st.floats(0.0, 1.0)), max_size=25)
Stretches = list[tuple[ForceReading | None, int, float]]


def run(given_readings: Stretches, seed: int) -> list[tuple[PolishMemory, PolishCommand]]:
    """Return all steps of a job on a spring whose readings are sometimes replaced."""
    rng, memory, steps = np.random.default_rng(seed), POLISHER.start(), []
    for reading, count, share in given_readings:
        for _ in range(count):
            spring = ForceReading(1e4 * max(0.0, memory.depth) + float(rng.normal()) * 0.1, 0.1)
            memory, command = POLISHER.step(memory, reading if rng.random() < share else spring)
            steps.append((memory, command))
    return steps


@settings(max_examples=150, deadline=None)
@given(given_readings=stretches, seed=st.integers(0, 1000))
def test_depth_and_feed_keep_their_bounds_whatever_comes(given_readings: Stretches, seed: int):
    limits, task, period = POLISHER.limits, POLISHER.task, POLISHER.period
    before = POLISHER._command(POLISHER.start())
    for _, command in run(given_readings, seed):
        assert np.isfinite(command[:4]).all()
        assert -limits.height <= command.depth <= limits.deepest
        assert -POLISHER.lift_speed - ROUNDING <= command.ddepth <= POLISHER.press_speed + ROUNDING
        if command.phase not in {"retract", "done", "stopped"}:
            assert command.ddepth - before.ddepth <= limits.depth_acceleration * period + ROUNDING
        assert abs(command.depth - before.depth) <= period * POLISHER.lift_speed + ROUNDING
        assert abs(command.s) <= task.half + ROUNDING
        assert abs(command.ds) <= task.feed + ROUNDING
        assert abs(command.s - before.s) <= period * task.feed + ROUNDING
        before = command


@settings(max_examples=150, deadline=None)
@given(given_readings=stretches, seed=st.integers(0, 1000))
def test_a_job_that_leaves_the_surface_never_goes_back(given_readings: Stretches, seed: int):
    steps = [command for _, command in run(given_readings, seed)]
    phases = [command.phase for command in steps]
    ended = {"retract", "done", "stopped"}
    first = next((k for k, phase in enumerate(phases) if phase in ended), len(phases))
    assert set(phases[first:]) <= ended
    assert len({command.reason for command in steps[first:]}) <= 1
    depths = np.array([command.depth for command in steps[first:]])
    assert (np.diff(depths) <= 0.0).all()
    last = next((k for k, phase in enumerate(phases) if phase in {"done", "stopped"}), len(phases))
    assert len(set(steps[last:])) <= 1


@given(given_readings=stretches, seed=st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_a_step_is_pure(given_readings: Stretches, seed: int):
    for memory, _ in run(given_readings, seed)[::7]:
        again = replace(POLISHER)
        reading = ForceReading(20.0, 0.5)
        assert POLISHER.step(memory, reading) == again.step(memory, reading)


def test_garbage_takes_jobs_into_every_phase():
    rng, seen = np.random.default_rng(4), set()
    for seed in range(40):
        kinds = [None, ForceReading(0.0, 0.1), ForceReading(float(rng.uniform(0, 65)), 0.1), ForceReading(5.0, 99.0)]
        chosen: Stretches = [(kinds[int(rng.integers(4))], int(rng.integers(1, 40)), 0.6) for _ in range(25)]
        seen |= {command.phase for _, command in run([(None, 120, 0.0), *chosen], seed)}
    assert seen == {"approach", "contact", "pass", "search", "hold", "retract", "stopped"}
    assert run([(None, 2000, 0.0)], 0)[-1][1].phase == "done"
