"""IDIM-IV: instruments remove the bias of noisy regressors, honest error bars, and a consistent form."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_logs import LATE, driven, errors_of, problem, relative_bias

from tauhat.control import PID
from tauhat.errors import SimulationError
from tauhat.estimation import OrdinaryLeastSquares, PhysicalConstraints, identify
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.idim_iv import InstrumentalVariables
from tauhat.estimation.solution import solve

NOISE = 5e-5


@pytest.fixture(scope="module")
def plain():
    return np.abs(relative_bias(errors_of(OrdinaryLeastSquares(), position=NOISE)[0])).max()


@pytest.mark.parametrize("loop", [driven().loop, ClosedLoop()], ids=["known law and reference", "measured reference"])
def test_twenty_seeds_of_position_noise_bias_least_squares_and_not_instruments(plain, loop):
    assert plain > 0.3
    errors, inside = errors_of(InstrumentalVariables(loop=loop), position=NOISE)
    assert np.abs(relative_bias(errors)).max() < 0.015
    assert inside.mean() > 0.93


def test_without_position_noise_it_is_least_squares_on_exact_columns():
    arm = driven()
    given = problem(arm.recording(np.random.default_rng(1)))
    method = InstrumentalVariables(loop=arm.loop, inner=OrdinaryLeastSquares())
    ours, plain = method.fit_problem(given), OrdinaryLeastSquares().fit(given.evidence)
    error = np.sqrt(np.diag(plain.covariance))
    assert (np.abs(ours.values - plain.values) < 0.2 * error).all()
    np.testing.assert_allclose(np.sqrt(np.diag(ours.covariance)), error, rtol=0.1)
    assert ours.rank == given.base.n_b
    assert ours.condition == pytest.approx(plain.condition, rel=0.05)


def test_residuals_are_orthogonal_to_the_instruments():
    from tauhat.estimation.simulated_runs import joined, simulated_runs
    from tauhat.estimation.simulating import tried_in

    arm = driven()
    given = problem(arm.recording(np.random.default_rng(1), position=NOISE))
    method = InstrumentalVariables(loop=arm.loop, inner=OrdinaryLeastSquares())
    runs = simulated_runs(given, arm.loop)
    tried = tried_in(runs, arm.values)
    values = method.improved(runs, tried).values
    simulated, measured = joined(runs.rows(runs.runs[0], tried.motions[0])), runs.measured[0]
    score, size = np.zeros(values.size), np.zeros(values.size)
    for joint, support in enumerate(given.evidence.supports):
        part = runs.layout.of_joint(joint)
        instruments = simulated.columns[part]
        residual = measured.tau[joint] - values[support] @ measured.columns[part]
        score[support] += instruments @ residual
        size[support] += np.linalg.norm(instruments, axis=1) * np.linalg.norm(residual)
    assert np.abs(score / size).max() < 1e-10


def test_the_consistent_form_solves_the_same_conditions():
    arm = driven()
    given = problem(arm.recording(np.random.default_rng(2), position=NOISE))
    solution = InstrumentalVariables(loop=arm.loop).fit_problem(given)
    free = solve(solution.evidence, solution.weights, ridge=0.0)
    error = np.sqrt(np.diag(solution.covariance))
    assert (np.abs(free - solution.values) < error).all()


def test_a_physically_consistent_fit_stays_near_the_truth():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=NOISE)
    estimate = identify(
        arm.truth.model, [log], estimator=InstrumentalVariables(loop=arm.loop), processing=LATE,
        constraints=PhysicalConstraints(),
    )  # fmt: skip
    assert min(estimate.physical["margins"]) > 0.0
    assert np.abs(estimate.base.projection @ estimate.standard - estimate.values).max() < 1e-9
    assert np.abs(estimate.values - arm.values).max() < 0.02 * np.abs(arm.values).max()


def test_two_recordings_count_both():
    arm = driven()
    logs = [arm.recording(np.random.default_rng(seed), position=NOISE) for seed in range(2)]
    loop = ClosedLoop(law=arm.loop.law, references=arm.loop.references * 2)
    method = InstrumentalVariables(loop=loop)
    both = identify(arm.truth.model, logs, estimator=method, processing=LATE)
    one = identify(arm.truth.model, logs[:1], estimator=InstrumentalVariables(loop=arm.loop), processing=LATE)
    assert (both.standard_errors < one.standard_errors).mean() > 0.7
    assert np.abs(both.values - arm.values).max() < 0.02 * np.abs(arm.values).max()


def test_an_unstable_controller_stops_with_a_reason():
    law = PID(kp=np.full(2, 500.0), kd=np.full(2, 0.1), ki=np.full(2, 1e5))
    given = problem(driven().recording(np.random.default_rng(0)))
    with pytest.raises(SimulationError, match="the simulated robot went unstable"):
        InstrumentalVariables(loop=ClosedLoop(law=law)).fit_problem(given)
