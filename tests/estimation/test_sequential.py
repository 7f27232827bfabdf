"""Sequential identification: segments are found, friction is read off them, and the rest follows."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from filter_problems import SETTINGS, names, noisy, problem_of, true_values, truth

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.segments import SegmentRules, constant_runs, reversals, tracks
from tauhat.estimation.sequential import SequentialFit, SequentialLeastSquares, identify_sequentially
from tauhat.recordings.recording import Recording

SPEEDS = (0.3, 0.6, 1.2, 2.0)
RATE, REACH = 500.0, 1.4


def one_way(joint: int, speed: float) -> FloatArray:
    """Return accelerations of a run of one joint at constant speed, from rest to rest, (n_t, 2)."""
    ramp = np.sin(np.linspace(0.0, np.pi, round(0.2 * RATE))) ** 2
    ramp *= speed * RATE / ramp.sum()
    steady = np.zeros(round(REACH / abs(speed) * RATE))
    whole = np.zeros((2 * ramp.size + steady.size + 100, 2))
    whole[: 2 * ramp.size + steady.size, joint] = np.concatenate([ramp, steady, -ramp])
    return whole


def runs(*, ripple: float = 0.0, joints: tuple[int, ...] = (0, 1), speeds: tuple[float, ...] = SPEEDS) -> Recording:
    """Return runs both ways at four speeds; `ripple` adds friction that depends on the position."""
    ddq = np.concatenate([one_way(joint, way * v) for joint in joints for v in speeds for way in (1, -1)])
    dq = np.cumsum(ddq, axis=0) / RATE
    q = np.cumsum(dq, axis=0) / RATE
    torque = truth().torque(q, dq, ddq) + ripple * np.sin(3.0 * q) * np.tanh(dq / 0.05)
    return Recording(t=np.arange(q.shape[0]) / RATE, q=q, tau=torque, name="runs")


@lru_cache
def found(seed: int) -> SequentialFit:
    swing = truth().recording(seed=seed, seconds=15.0, rate=RATE)
    return identify_sequentially(problem_of(noisy(runs(), seed), noisy(swing, seed + 50)))


def steady(joint: int, speed: FloatArray) -> FloatArray:
    viscous, coulomb = (truth().standard[-8:][2 * k + joint] for k in (1, 2))
    return viscous * speed + coulomb


def test_every_run_is_found_with_its_joint_and_speed():
    track = tracks(problem_of(runs()))[0]
    segments = constant_runs(track, np.abs(track.dq).max(axis=0), SETTINGS.cutoff, rules=SegmentRules())
    expected = [(joint, way * v) for joint in (0, 1) for v in SPEEDS for way in (1, -1)]
    assert sorted((run.joint, round(run.speed, 3)) for run in segments) == sorted(expected)


def test_reversals_are_those_of_the_motion():
    recording = truth().recording(seconds=15.0, rate=RATE)
    track = tracks(problem_of(recording))[0]
    tops = np.abs(track.dq).max(axis=0)
    turns = reversals(track, tops, rules=SegmentRules())
    for turn in turns:
        speeds = np.interp(turn.t + np.array([-0.1, 0.1]), recording.t, recording.dq[:, turn.joint])
        assert speeds[0] * speeds[1] < 0.0
    assert {turn.joint for turn in turns} == {0, 1}


def test_the_map_shows_friction_at_every_speed_and_gravity_beside_it():
    for own in found(0).maps:
        moving = own.speeds > 0.0
        assert np.allclose(own.friction[moving], steady(own.joint, own.speeds[moving]), atol=0.08)
        assert {round(speed, 1) for speed in own.speeds[moving]} == set(SPEEDS)
        assert abs(np.mean(own.friction[~moving]) - steady(own.joint, np.zeros(1))[0]) < 0.15


def test_the_map_shows_friction_that_depends_on_the_position():
    size = 0.6
    swing = truth().recording(seconds=15.0, rate=RATE)
    fit = identify_sequentially(problem_of(runs(ripple=size), swing))
    for own in fit.maps:
        moving = own.speeds > 0.0
        beyond = own.friction[moving] - steady(own.joint, own.speeds[moving])
        shape = np.sin(3.0 * own.positions[moving])
        assert np.isclose(beyond @ shape / (shape @ shape), size, rtol=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_friction_and_inertia_are_recovered_inside_their_errors(seed):
    solution = found(seed).solution
    error = solution.values - true_values()
    assert (np.abs(error) < 4.5 * np.sqrt(np.diag(solution.covariance))).all()
    assert np.linalg.norm(error) < 0.03 * np.linalg.norm(true_values())


def test_friction_is_what_the_first_step_fits_and_agrees_with_the_joint_fit():
    fit = found(0)
    assert [names()[k] for k in fit.friction] == ["Fv_1", "Fv_2", "Fc_1", "Fc_2"]
    assert np.abs(fit.differences).max() < 4.0
    assert fit.pairs == 2 * len(SPEEDS)


def test_without_noise_both_steps_are_exact():
    fit = identify_sequentially(problem_of(runs(), truth().recording(seconds=15.0, rate=RATE)))
    assert np.abs(fit.solution.values - true_values()).max() < 5e-3


def test_friction_stays_that_of_the_runs_where_the_swing_has_another_and_the_joint_fit_mixes_both():
    warm = truth().recording(seconds=15.0, rate=RATE)
    other = Recording(t=warm.t, q=warm.q, tau=warm.tau - 0.4 * np.tanh(warm.dq / 0.05), name="warm")
    fit = identify_sequentially(problem_of(noisy(runs(), 0), noisy(other, 1)), rules=SegmentRules(window=1e-3))
    dry = [names().index(name) for name in ("Fc_1", "Fc_2")]
    assert np.abs(fit.solution.values - true_values())[dry].max() < 0.03
    assert np.abs(fit.together.values - true_values())[dry].min() > 0.05


def test_the_estimator_hands_on_the_same_solution():
    problem = problem_of(noisy(runs(), 0), noisy(truth().recording(seed=0, seconds=15.0, rate=RATE), 50))
    assert np.array_equal(SequentialLeastSquares().fit_problem(problem).values, found(0).solution.values)


def test_a_joint_without_segments_is_named():
    problem = problem_of(runs(joints=(0,)))
    with pytest.raises(ModelError, match="j2"):
        identify_sequentially(problem)


def test_bad_rules_are_refused():
    with pytest.raises(ModelError, match="rules of segments"):
        SegmentRules(bins=0)
    with pytest.raises(ModelError, match="rules of segments"):
        SegmentRules(window=float("nan"))


def test_viscous_friction_is_left_to_the_second_step_where_there_are_reversals_alone():
    for seed in range(3):
        swing = truth().recording(seed=0, seconds=15.0, rate=RATE)
        fit = identify_sequentially(problem_of(noisy(swing, seed)))
        assert fit.pairs == 0
        assert [names()[k] for k in fit.friction] == ["Fc_1", "Fc_2"]
        error = np.abs(fit.solution.values - true_values())
        assert (error < 4.5 * np.sqrt(np.diag(fit.solution.covariance))).all()


def test_runs_at_one_speed_cannot_tell_viscous_from_dry_friction():
    with pytest.raises(ModelError, match="several constant speeds"):
        identify_sequentially(problem_of(noisy(runs(speeds=(0.6,)), 0)), rules=SegmentRules(window=1e-3))
