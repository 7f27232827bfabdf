"""A log from end to end: passes in air, bodies that are carried, hidden directions, warmth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sensed_arms import frictionless, motion

from tauhat.errors import SensingError
from tauhat.recordings import Recording
from tauhat.report.contact_words import zero_words
from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
from tauhat.sensing.hidden import hidden_along
from tauhat.sensing.judged_log import judged_log
from tauhat.sensing.learnt_error import error_of
from tauhat.sensing.observers import observer_named
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.wrench import DIRECTIONS, WrenchSolver
from tauhat.sensing.zero import AirPass, air_pass, without_air, zeroed

RATE = 125.0
MODEL = frictionless()
SOLVER = WrenchSolver(robot=MODEL.robot)
SENSOR = ForceSensor(model=MODEL, rate=RATE, wrench=SOLVER)
LIMITS = assumed_contact_thresholds(SENSOR)


def log(begin: float, end: float) -> Recording:
    """Return a stretch of a motion whose torque is off by what belongs to the place."""
    q, tau = motion(MODEL.robot, seconds=20.0, rate=RATE)
    t = np.arange(len(q)) / RATE
    kept = (t >= begin) & (t < end)
    return Recording(
        t=t[kept] - begin, q=q[kept], tau=(tau - 2.0 * np.cos(3.0 * q))[kept], joint_names=MODEL.robot.joint_names
    )


def test_a_pass_in_air_is_taken_off_though_the_logs_begin_apart():
    known = air_pass(SENSOR.along(log(0.0, 12.0)))
    sensed = SENSOR.along(log(1.3, 11.0))
    left = without_air(sensed, known, solver=SOLVER)
    assert np.abs(sensed.tau[sensed.settled]).max() > 1.5
    assert np.abs(left.tau[left.t > 1.5]).max() < 0.01  # later than what is left of the start
    assert (left.settled == sensed.settled).all()


def test_nothing_is_told_where_the_pass_had_ended():
    known = air_pass(SENSOR.along(log(0.0, 8.0)))
    sensed = SENSOR.along(log(0.0, 10.0))
    left = without_air(sensed, known, solver=SOLVER)
    assert left.settled[(left.t > 0.5) & (left.t < 8.0)].all()
    assert not left.settled[left.t > 8.2].any()
    assert np.abs(left.tau[(left.t > 1.5) & (left.t < 7.9)]).max() < 1e-6


def test_a_log_from_long_before_the_pass_is_refused():
    known = air_pass(SENSOR.along(log(0.0, 12.0)))
    late = AirPass(
        progress=known.progress + 30.0, torque=known.torque, wrench=known.wrench, q=known.q
    )  # fmt: skip
    with pytest.raises(SensingError, match="none within it"):
        without_air(SENSOR.along(log(0.0, 5.0)), late, solver=SOLVER)


def test_another_motion_and_a_pass_without_positions_are_refused():
    known, sensed = air_pass(SENSOR.along(log(0.0, 8.0))), SENSOR.along(log(0.0, 8.0))
    with pytest.raises(SensingError, match="not the motion of the pass in air"):
        without_air(replace(sensed, q=sensed.q[::-1].copy()), known, solver=SOLVER)
    blind = AirPass(progress=known.progress, torque=known.torque, wrench=known.wrench)
    with pytest.raises(SensingError, match="without positions"):
        without_air(sensed, blind, solver=SOLVER)


def test_thresholds_behind_a_pass_are_refused_without_one():
    with pytest.raises(SensingError, match="behind a pass in air"):
        judged_log(SENSOR, log(0.0, 5.0), replace(LIMITS, taken_off="air"))


def test_error_bars_behind_a_standing_zero_are_refused_where_it_is_not_taken_off():
    limits = replace(LIMITS, error=error_of(SENSOR, zero="standing"))
    with pytest.raises(SensingError, match="behind a standing zero"):
        judged_log(SENSOR, log(0.0, 5.0), limits)
    assert judged_log(SENSOR, log(0.0, 5.0), limits, zero="standing").zero == "standing"


def weighing(mass: float, begin: float) -> Recording:
    free = log(0.0, 16.0)
    weight = np.array([SOLVER.jacobian(q)[0][:3].T @ [0.0, 0.0, -9.81 * mass] for q in free.q])
    q, tau = motion(MODEL.robot, seconds=16.0, rate=RATE)
    return replace(free, q=q, tau=tau - weight * (free.t >= begin)[:, None])


def test_a_long_event_says_what_body_explains_it_and_a_short_one_nothing():
    found = judged_log(SENSOR, weighing(2.0, 4.0), LIMITS)
    longest = max(found.contacts.events, key=lambda event: event.end - event.start)
    assert longest.payload is not None
    assert longest.payload.verdict == "payload"
    assert longest.payload.mass == pytest.approx(2.0, abs=0.2)  # the motion is faster than the check would have it
    assert longest.to_dict()["payload"]["verdict"] == "payload"
    given = weighing(2.0, 4.0)
    short = replace(given, tau=np.where((given.t > 5.0)[:, None], weighing(0.0, 0.0).tau, given.tau))
    assert {event.payload for event in judged_log(SENSOR, short, LIMITS).contacts.events} == {None}


def test_a_peak_has_the_error_bar_of_its_direction():
    (event, *_) = judged_log(SENSOR, weighing(3.0, 4.0), LIMITS).contacts.events
    sensed = SENSOR.along(weighing(3.0, 4.0))
    inside = (sensed.t >= event.start) & (sensed.t <= event.end)
    errors = sensed.wrench_std[inside, :3]
    assert errors.min() <= event.peak_std <= errors.max()


@pytest.mark.parametrize("solver", [SOLVER, WrenchSolver(robot=MODEL.robot, directions=DIRECTIONS["force"])])
def test_the_error_of_a_force_along_a_direction_is_that_of_its_whole_covariance(solver):
    sensed = replace(SENSOR, wrench=solver).along(weighing(3.0, 4.0))
    again = zeroed(sensed, np.zeros_like(sensed.tau), solver=solver)
    along = np.random.default_rng(3).normal(size=(sensed.n_t, 3))
    rows = slice(100, 400)
    covariance = sensed.solved_by(solver, rows).covariance[:, :3, :3]
    unit = along[rows] / np.linalg.norm(along[rows], axis=1)[:, None]
    expected = np.sqrt(np.einsum("ti,tij,tj->t", unit, covariance, unit))
    apart = np.linalg.norm(unit * sensed.wrench_std[rows, :3], axis=1)
    assert np.abs(expected / apart - 1.0).max() > 0.2
    for log in (sensed, again):
        assert log.force_std(along[rows], rows) == pytest.approx(expected, rel=1e-6)
    assert sensed.force_std(np.zeros((300, 3)), rows).tolist() == [0.0] * 300


def test_a_peak_has_the_error_of_its_own_direction():
    given = weighing(3.0, 4.0)
    sensed = SENSOR.along(given)
    for event in judged_log(SENSOR, given, LIMITS).contacts.events:
        inside = np.flatnonzero((sensed.t >= event.start) & (sensed.t <= event.end))
        force = sensed.wrench[inside, :3] - sensed.wrench[max(0, inside[0] - 25), :3]
        at = int(np.linalg.norm(force, axis=1).argmax())
        covariance = sensed.solved_by(SOLVER, inside[at : at + 1]).covariance[0, :3, :3]
        assert event.peak_std == pytest.approx(np.sqrt(force[at] @ covariance @ force[at]) / event.peak, rel=1e-6)


def test_what_stands_is_told_less_its_zero():
    q = np.repeat(MODEL.robot.n_v * [[0.4]], 1, axis=1).T.repeat(800, axis=0)
    still = Recording(
        t=np.arange(800) / RATE, q=q, tau=np.tile(motion(MODEL.robot, 0.1, RATE)[1][0], (800, 1)),
        joint_names=MODEL.robot.joint_names,
    )  # fmt: skip
    plain, less = (judged_log(SENSOR, still, LIMITS, zero=zero) for zero in ("as sensed", "standing"))
    assert np.abs(plain.sensed.tau[-1]).max() > 1.0
    assert zero_words(plain) == ""
    assert zero_words(less) == "Torque and force are less what was sensed as the arm came to rest."
    assert less.sensed.tau == pytest.approx(plain.sensed.tau - plain.contacts.zero)
    again = zeroed(plain.sensed, plain.contacts.zero, solver=SOLVER)
    assert (less.sensed.wrench == again.wrench).all()


def test_directions_are_hidden_as_long_as_the_solver_says():
    planar = ForceSensor(model=frictionless("two_link"), rate=RATE)
    q, tau = motion(planar.model.robot, seconds=4.0, rate=RATE)
    sensed = planar.along(
        Recording(t=np.arange(len(q)) / RATE, q=q, tau=tau, joint_names=planar.model.robot.joint_names)
    )
    found = hidden_along(sensed, planar.solver)
    assert found.share == 1.0
    assert found.parts[[1, 3, 5]] == pytest.approx(1.0)  # two joints about y tell neither fy nor the moments beside it
    assert set(found.mostly) >= {"fy", "mx", "mz"}
    one = WrenchSolver(robot=planar.model.robot, directions=DIRECTIONS["fy"])
    assert hidden_along(sensed, one).parts.tolist() == [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    seven = WrenchSolver(robot=MODEL.robot, directions=DIRECTIONS["force"])
    told = hidden_along(SENSOR.along(log(0.0, 5.0)), seven)
    assert (told.share, told.mostly) == (0.0, ())
    sensed = SENSOR.along(log(0.0, 5.0))
    assert (
        hidden_along(replace(sensed, lag=np.full_like(sensed.lag, 1e4)), seven).share == 1.0
    )  # the lag's doubt counts


def test_warmth_along_a_log_is_that_behind_each_sample():
    sensor = ForceSensor(model=MODEL, rate=RATE, observer=observer_named("thermal"))
    run = log(0.0, 4.0)
    found = judged_log(sensor, run, LIMITS)
    assert found.warmth is not None
    assert found.warm_times is not None
    memory = sensor.start()
    told = {}
    for t, q, tau in zip(run.t, run.q, run.tau, strict=True):
        memory, _, _ = sensor.take(memory, t, q, tau)
        told[t] = sensor.warmth(memory)
    for k in (0, len(found.warm_times) // 2, -1):
        there = told[found.warm_times[k]]
        assert (found.warmth.theta[k] == there.theta).all()
        assert (found.warmth.variance[k] == there.variance).all()
    assert judged_log(SENSOR, run, LIMITS).warmth is None
    with pytest.raises(SensingError, match="follows no warmth"):
        SENSOR.warmth_along(run)
