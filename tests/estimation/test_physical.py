"""A consistent fit is feasible, proven optimal, and equal to the free fit where that is physical."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from physical_problems import PULLS, assert_physical, pendulum, problem, solved
from scipy.optimize import brentq

from synthetic_evidence import arm, given, plain_model, sampled
from tauhat.dynamics import base_parameters
from tauhat.errors import ModelError
from tauhat.estimation import (
    EntropicPull,
    GaussianPull,
    LinkConstraints,
    PhysicalConstraints,
    WeightedLeastSquares,
    consistent,
)
from tauhat.estimation.conic_solver import certificate, solve_conic
from tauhat.estimation.consistency_objective import objective_of
from tauhat.estimation.log_cholesky import log_cholesky_fit
from tauhat.estimation.physical import solve_consistency


@pytest.mark.parametrize("pull", PULLS, ids=str)
@pytest.mark.parametrize("name", ["ur10e", "panda"])
def test_noisy_evidence_gives_a_feasible_robot_that_is_proven_optimal(name, pull):
    sample = arm(name, 0.3)
    free = WeightedLeastSquares().solve(sample.evidence)
    solution = solved(sample, PhysicalConstraints(pull=pull))
    assert_physical(sample, solution.standard)
    assert solution.margins.min() >= 1e-6 * (1 - 1e-6)
    assert np.allclose(solution.values, sample.base.projection @ solution.standard, rtol=0, atol=1e-12)
    assert 0 < solution.cost < 0.01
    assert any("margin" in words for words in solution.binding) == (pull.key == "gaussian")  # log det keeps off it
    assert abs(solution.certificate.gap) < 1e-6 * solution.certificate.primal
    assert solution.certificate.violation < 1e-9
    assert np.abs(free.values - solution.values).max() > 1e-3  # or nothing was constrained


@pytest.mark.parametrize("seed", range(4))
def test_constraints_bring_base_parameters_nearer_to_a_physical_truth(seed):
    sample = arm("ur10e", 0.3, seed)
    free = WeightedLeastSquares().fit(sample.evidence)
    expected = sample.base.projection @ sample.truth
    size = np.sqrt(np.diag(free.covariance))
    ours = np.linalg.norm((solved(sample).values - expected) / size)
    assert ours < np.linalg.norm((free.values - expected) / size)
    assert ours / np.sqrt(sample.base.n_b) < 1.2  # about a standard error each


def test_clean_evidence_of_a_physical_robot_gives_the_free_fit_and_the_true_base_parameters():
    sample = arm("ur10e", 0.0)
    solution = solved(sample)
    free = WeightedLeastSquares().solve(sample.evidence).values
    assert np.allclose(solution.values, free, rtol=0, atol=1e-6)
    assert np.allclose(solution.values, sample.base.projection @ sample.truth, rtol=0, atol=1e-6)
    assert solution.binding == ()
    assert solution.cost < 1e-6


def test_the_nominal_robot_comes_back_whole_from_its_own_torque():
    model = plain_model("ur10e")
    robot = model.robot
    friction = [getattr(joint, name) for name in ("rotor_inertia", "viscous", "coulomb") for joint in robot.joints]
    truth = np.concatenate([robot.inertia.ravel(), friction, np.zeros(robot.n_v)])
    solution = solved(sampled(model, truth, noise=0.0))
    assert np.allclose(solution.standard, truth, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "noise", "deviation"),
    [("ur10e", 0.05, 0.1), ("ur10e", 0.3, 0.3), ("panda", 0.05, 0.1), ("panda", 0.3, 0.1)],
)
def test_log_cholesky_gauss_newton_finds_the_same_optimum_where_it_is_interior(name, noise, deviation):
    sample = arm(name, noise)
    convex = problem(sample, PhysicalConstraints(pull=GaussianPull(deviation=deviation)))
    found = solve_consistency(convex, names=sample.model.robot.joint_names)
    assert not any("margin" in words for words in found.binding)
    second = log_cholesky_fit(convex)
    objective = objective_of(convex)
    assert objective.value(second) == pytest.approx(objective.value(found.coordinates), rel=1e-9)
    assert np.abs(second - found.coordinates).max() < 1e-6


def test_log_cholesky_refuses_a_pull_that_is_no_sum_of_squares():
    with pytest.raises(ModelError, match="Gaussian"):
        log_cholesky_fit(problem(arm("two_link", 0.1), PhysicalConstraints(pull=EntropicPull())))


@pytest.mark.parametrize("pull", PULLS, ids=str)
def test_no_feasible_robot_is_better_than_the_dual_bound(pull):
    sample = arm("ur10e", 0.3)
    convex = problem(sample, PhysicalConstraints(pull=pull))
    objective = objective_of(convex)
    found = solve_consistency(convex, names=sample.model.robot.joint_names)
    rng = np.random.default_rng(0)
    n_u, values = convex.coordinates.n_u, []
    for size in np.geomspace(1e-6, 1.0, 60):
        turn = np.where(np.arange(n_u) < 60, 0.02 * rng.normal(size=n_u), 0.0)
        trial = (1 - size) * found.coordinates + size * (convex.coordinates.nominal + turn)
        if all(feasible(row.cone, row.matrix @ trial + row.offset) for row in convex.rows):
            values.append(objective.value(trial))
    assert len(values) > 10
    assert min(values) > found.certificate.dual
    assert min(values) - found.certificate.dual < 1.0  # trials come close


def feasible(cone: str, value: np.ndarray) -> bool:
    if cone == "semidefinite":
        matrix = np.zeros((4, 4))
        places = [(row, column) for column in range(4) for row in range(column + 1)]
        for (row, column), entry in zip(places, value, strict=True):
            matrix[row, column] = matrix[column, row] = entry if row == column else entry / np.sqrt(2.0)
        return bool(np.linalg.eigvalsh(matrix).min() >= 0)
    return bool(value.min() >= 0)


@pytest.mark.parametrize("pull", PULLS, ids=str)
def test_wrong_multipliers_only_weaken_the_bound(pull):
    convex = problem(arm("ur10e", 0.3), PhysicalConstraints(pull=pull, margin=1e-3))
    objective = objective_of(convex)
    result = solve_conic(objective, convex.rows, unit=pull.deviation)
    good = certificate(objective, convex.rows, result, result.coordinates)
    wrong = result._replace(multipliers=tuple(1.01 * value for value in result.multipliers))
    bad = certificate(objective, convex.rows, wrong, result.coordinates)
    assert bad.dual < good.dual <= good.primal + 1e-6
    assert bad.gap > 100 * abs(good.gap)


def test_one_link_of_bounded_mass_is_projected_onto_its_paraboloid():
    model = pendulum()
    base = base_parameters(model)
    names = [base.names[index] for index in base.independent]
    assert sorted(names) == ["Izz_1", "mx_1", "my_1"]
    wanted = {"Izz_1": 0.0, "mx_1": 0.8, "my_1": 0.6}
    sample = given(model, np.array([wanted[name] for name in names]), sharpness=1e3)
    link = LinkConstraints(joint="swing", mass=(0.0, 1.0))
    constraints = PhysicalConstraints(margin=1e-9, links=(link,), pull=GaussianPull(deviation=1e3))
    solution = consistent(sample.evidence, model, base, weights=np.ones(1), constraints=constraints)
    # nearest point to I = 0, h = 1 on I m = h^2 with m = 1: d/dh (h^4 + (h - 1)^2) = 0
    length = brentq(lambda h: 2 * h**3 + h - 1, 0.0, 1.0)
    found = dict(zip(names, solution.values, strict=True))
    assert found["mx_1"] == pytest.approx(0.8 * length, abs=1e-4)
    assert found["my_1"] == pytest.approx(0.6 * length, abs=1e-4)
    assert found["Izz_1"] == pytest.approx(length**2, abs=1e-4)
    assert any("a mass of at most 1 kg" in words for words in solution.binding)


@pytest.mark.parametrize("pull", PULLS, ids=str)
def test_what_the_torque_does_not_show_stays_nominal(pull):
    model = pendulum()
    base = base_parameters(model)
    nominal = model.robot.inertia.ravel()
    sample = given(model, base.projection @ nominal, sharpness=1e3)
    constraints = PhysicalConstraints(pull=pull)
    solution = consistent(sample.evidence, model, base, weights=np.ones(1), constraints=constraints)
    assert np.allclose(solution.standard, nominal, rtol=0, atol=1e-4)


def test_a_weak_pull_costs_the_fit_less_than_a_thousandth():
    for name in ("ur10e", "panda"):
        sample = arm(name, 0.1)
        costs = [
            solved(sample, PhysicalConstraints(pull=GaussianPull(deviation=deviation))).cost
            for deviation in (1000.0, 10.0, 1.0)
        ]
        assert costs[0] <= costs[1] + 1e-9 <= costs[2]
        assert costs[1] - costs[0] < 1e-3


@pytest.mark.parametrize("pull", [GaussianPull, EntropicPull])
def test_a_stronger_pull_ends_nearer_to_the_nominal_robot(pull):
    sample = arm("panda", 0.1)
    distances = []
    for deviation in (10.0, 1.0, 0.1, 0.01):
        convex = problem(sample, PhysicalConstraints(pull=pull(deviation=deviation)))
        found = solve_consistency(convex, names=sample.model.robot.joint_names)
        distances.append(np.linalg.norm((found.coordinates - convex.coordinates.nominal)[:70]))
    assert distances == sorted(distances, reverse=True)
    assert distances[-1] < 0.1 * distances[0]


def test_trust_in_one_link_keeps_that_link_nominal():
    sample = arm("ur10e", 0.1)
    joint = sample.model.robot.joint_names[3]
    plain = solved(sample).standard[30:40]
    trusted = solved(sample, PhysicalConstraints(links=(LinkConstraints(joint=joint, trust=1e6),))).standard[30:40]
    nominal = sample.model.robot.inertia[3]
    assert np.abs(trusted - nominal).max() < 0.05 * np.abs(plain - nominal).max()


def test_the_entropic_pull_keeps_links_thick_without_a_margin():
    sample = arm("ur10e", 0.3)
    thin = solved(sample, PhysicalConstraints(margin=1e-12)).margins.min()
    thick = solved(sample, PhysicalConstraints(margin=1e-12, pull=EntropicPull())).margins.min()
    assert thin < 1e-9
    assert thick > 1e-5


def test_the_estimate_does_not_depend_on_the_unit_of_the_weights():
    sample = arm("ur10e", 0.3)
    weights = WeightedLeastSquares().solve(sample.evidence).weights
    one, other = (
        consistent(sample.evidence, sample.model, sample.base, weights=factor * weights) for factor in (1.0, 1e3)
    )
    assert np.allclose(one.standard, other.standard, rtol=0, atol=1e-5)


def test_evidence_without_torque_is_refused():
    sample = arm("two_link", 0.1)
    factors = tuple(np.column_stack([part[:, :-1], 0 * part[:, -1]]) for part in sample.evidence.total.factors)
    silent = replace(sample.evidence, blocks=(replace(sample.evidence.total, factors=factors),))
    with pytest.raises(ModelError, match="torque is zero"):
        consistent(silent, sample.model, sample.base, weights=np.ones(2))


def test_arrays_of_a_solution_are_read_only():
    solution = solved(arm("two_link", 0.1))
    for array in (solution.standard, solution.values, solution.margins, solution.joint_rms):
        assert not array.flags.writeable
