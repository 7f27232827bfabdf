"""A consistent fit is feasible, proven optimal, equal to the free fit where that is physical, and says what is not."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from sample_arms import planar_arm, random_inertia
from synthetic_evidence import Sample, arm, given, plain_model, plain_truth, sampled
from tauhat.dynamics import base_parameters, torque_model
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import InertiaWithoutProducts, Viscous
from tauhat.errors import ModelError
from tauhat.estimation import (
    Box,
    ConsistentSolution,
    Ellipsoid,
    EntropicPull,
    GaussianPull,
    LinkConstraints,
    PhysicalConstraints,
    WeightedLeastSquares,
    consistent,
)
from tauhat.estimation.conic_solver import certificate, solve_conic
from tauhat.estimation.consistency_objective import objective_of
from tauhat.estimation.consistency_problem import ConsistencyProblem, consistency_problem
from tauhat.estimation.log_cholesky import log_cholesky_fit
from tauhat.estimation.physical import solve_consistency
from tauhat.robots import Joint, Robot, load_robot

PULLS = (GaussianPull(), EntropicPull())


def solved(sample: Sample, constraints: PhysicalConstraints | None = None) -> ConsistentSolution:
    weights = WeightedLeastSquares().solve(sample.evidence).weights
    return consistent(sample.evidence, sample.model, sample.base, weights=weights, constraints=constraints)


def problem(sample: Sample, constraints: PhysicalConstraints) -> ConsistencyProblem:
    weights = WeightedLeastSquares().solve(sample.evidence).weights
    return consistency_problem(sample.evidence, sample.model, sample.base, weights=weights, constraints=constraints)


def second_moments(parameters: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre and the second moments of mass about the centre, straight from their definitions."""
    mass, centre = parameters[0], parameters[1:4] / parameters[0]
    xx, xy, yy, xz, yz, zz = parameters[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    about_origin = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return float(mass), centre, about_origin - mass * np.outer(centre, centre)


def assert_physical(sample: Sample, standard: np.ndarray) -> None:
    n_v = sample.model.robot.n_v
    for body in standard[: 10 * n_v].reshape(-1, 10):
        mass, _, moments = second_moments(body)
        assert mass > 0
        assert np.linalg.eigvalsh(moments).min() > 0
    assert standard[10 * n_v : 13 * n_v].min() >= 0  # rotor inertia, viscous and Coulomb friction


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


def pendulum(mass: float = 1.0) -> TorqueModel:
    """Return one link on a joint about z with gravity across: base parameters Izz, mx, my."""
    inertia = np.array([mass, 0.1, 0.0, 0.0, 0.2, 0.0, 0.2, 0.0, 0.0, 0.3])
    joint = Joint(
        name="swing", kind="revolute", parent=-1, rotation=np.eye(3), translation=np.zeros(3),
        axis=np.array([0.0, 0.0, 1.0]), inertia=inertia,
    )  # fmt: skip
    return torque_model(Robot(name="pendulum", joints=(joint,), gravity=np.array([0.0, -9.81, 0.0])), "inertia")


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


def test_bounds_on_a_link_are_kept():
    sample = arm("ur10e", 0.3)
    joint = sample.model.robot.joint_names[2]
    free = solved(sample)
    mass, centre, _ = second_moments(free.standard[20:30])
    box = Box(lower=centre + 0.01, upper=centre + 0.02)
    link = LinkConstraints(joint=joint, mass=(1.2 * mass, 1.3 * mass), centre=box)
    bounded = solved(sample, PhysicalConstraints(links=(link,)))
    assert_physical(sample, bounded.standard)
    new_mass, new_centre, _ = second_moments(bounded.standard[20:30])
    assert 1.2 * mass * (1 - 1e-7) <= new_mass <= 1.3 * mass * (1 + 1e-7)
    assert (new_centre >= box.lower - 1e-7).all()
    assert (new_centre <= box.upper + 1e-7).all()
    assert bounded.cost > free.cost


def test_a_centre_of_mass_stays_inside_its_ellipsoid():
    sample = arm("ur10e", 0.3)
    joint = sample.model.robot.joint_names[2]
    _, centre, _ = second_moments(solved(sample).standard[20:30])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    ellipsoid = Ellipsoid(
        centre=centre + np.array([0.0, 0.05, 0.0]), semi_axes=np.array([0.02, 0.1, 0.1]), rotation=turn
    )
    bounded = solved(sample, PhysicalConstraints(links=(LinkConstraints(joint=joint, centre=ellipsoid),)))
    _, moved, _ = second_moments(bounded.standard[20:30])
    length = np.linalg.norm((turn.T @ (moved - ellipsoid.centre)) / ellipsoid.semi_axes)
    assert length == pytest.approx(1.0, abs=1e-5)  # on its surface: the fit wants out


def test_a_body_inside_an_ellipsoid_spreads_no_further_than_it():
    sample = arm("ur10e", 0.3)
    joint = sample.model.robot.joint_names[5]
    ellipsoid = Ellipsoid(centre=np.array([0.0, 0.0, -0.02]), semi_axes=np.array([0.02, 0.03, 0.02]))
    link = LinkConstraints(joint=joint, mass=(0.3, 2.0), body=ellipsoid)
    mass, centre, moments = second_moments(solved(sample, PhysicalConstraints(links=(link,))).standard[50:60])
    away = centre - ellipsoid.centre
    mean = np.sum((np.diag(moments) / mass + away**2) / ellipsoid.semi_axes**2)
    assert mean <= 1.0 + 1e-6  # mean of |W (p - c)|^2 over the mass
    _, _, wide = second_moments(solved(sample).standard[50:60])
    assert np.trace(wide) > 2 * np.trace(moments)


@pytest.mark.parametrize(
    ("link", "named"),
    [
        (
            {"mass": (2.0, 3.0), "centre": Box(lower=np.full(3, 0.5), upper=np.full(3, 0.6)),
             "body": Ellipsoid(centre=np.zeros(3), semi_axes=np.full(3, 0.1))},
            ["a centre of mass inside its box", "a body inside its ellipsoid"],
        ),
        (
            {"mass": (1.0, 2.0), "body": Ellipsoid(centre=np.zeros(3), semi_axes=np.full(3, 1e-4))},
            ["a body inside its ellipsoid", "a pseudo-inertia with a margin of 1e-06"],
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("pull", PULLS, ids=str)
def test_constraints_that_contradict_each_other_name_link_and_constraints(link, named, pull):
    sample = arm("ur10e", 0.1)
    joint = sample.model.robot.joint_names[4]
    with pytest.raises(ModelError, match=f"link of joint {re.escape(joint)}") as caught:
        solved(sample, PhysicalConstraints(links=(LinkConstraints(joint=joint, **link),), pull=pull))
    message = str(caught.value)
    assert all(words in message for words in named)
    assert "\n" not in message


def test_friction_that_data_want_negative_stops_at_its_bound_and_is_named():
    model = plain_model("ur10e")
    truth = plain_truth(model.robot)
    truth[60 + 6 + 2] = -1.0  # Fv_3
    sample = sampled(model, truth, noise=0.05)
    solution = solved(sample)
    assert solution.standard[68] == 0.0
    assert solution.binding[0] == "Fv_3 of at least 0"
    assert solution.cost > 0.01
    freed = solved(sample, PhysicalConstraints(unbounded=("Fv",)))
    assert freed.standard[68] == pytest.approx(-1.0, abs=0.2)
    assert freed.cost < 0.1 * solution.cost


def test_bounds_of_any_term_are_kept():
    class Sticky(Viscous):
        __slots__ = ()
        smallest = 4.0

    robot = planar_arm()
    model = TorqueModel(robot=robot, terms=(*torque_model(robot, "inertia,offset").terms, Sticky()))
    truth = np.concatenate([robot.inertia.ravel(), [0.1, 0.2], [1.0, 9.0]])
    solution = solved(sampled(model, truth, noise=0.01))
    assert solution.standard[-2] == 4.0
    assert solution.standard[-1] == pytest.approx(9.0, abs=0.1)


def test_a_model_without_products_of_inertia_stays_without_them():
    robot = load_robot("ur10e")
    model = TorqueModel(robot=robot, terms=(InertiaWithoutProducts(), *torque_model(robot, "viscous").terms))
    places = [10 * link + k for link in range(6) for k in (0, 1, 2, 3, 4, 6, 9)]
    sample = sampled(model, np.concatenate([robot.inertia.ravel()[places], np.ones(6)]), noise=0.1)
    solution = solved(sample)
    for body in solution.standard[:42].reshape(6, 7):
        mass, centre = body[0], body[1:4] / body[0]
        moments = np.diag(0.5 * body[4:].sum() - body[4:]) - mass * np.outer(centre, centre)
        assert mass > 0
        assert np.linalg.eigvalsh(moments).min() > 0


def test_a_model_that_takes_a_needed_moment_as_zero_is_refused_by_name():
    robot = load_robot("ur10e")
    model = TorqueModel(robot=robot, terms=(InertiaWithoutProducts(dropped=("Ixx_3",)),))
    kept = [10 * link + k for link in range(6) for k in (0, 1, 2, 3, 4, 6, 9) if (link, k) != (2, 4)]
    with pytest.raises(ModelError, match=r"elbow_joint.*Ixx taken as zero"):
        solved(sampled(model, robot.inertia.ravel()[kept], noise=0.1))


def test_a_robot_without_nominal_masses_gets_physical_links_of_the_right_size():
    named = load_robot("ur10e")
    truth = plain_truth(named)
    bare = replace(named, joints=tuple(replace(joint, inertia=np.zeros(10)) for joint in named.joints))
    sample = sampled(torque_model(bare), truth, noise=0.02)
    solution = solved(sample)
    assert_physical(sample, solution.standard)
    assert solution.cost < 2e-3
    assert 0.2 < solution.standard[:60:10].sum() / truth[:60:10].sum() < 5.0


def test_placeholder_inertias_do_not_spoil_the_fit():
    named = load_robot("ur10e")
    truth = plain_truth(named)
    tiny = np.array([0.01, 0, 0, 0, 1e-6, 0, 1e-6, 0, 0, 1e-6])
    joints = tuple(replace(joint, inertia=tiny) for joint in named.joints)
    sample = sampled(torque_model(replace(named, joints=joints)), truth, noise=0.02)
    for pull in PULLS:
        assert solved(sample, PhysicalConstraints(pull=pull)).cost < 5e-3


def test_a_model_of_friction_alone_needs_no_links():
    robot = planar_arm()
    sample = sampled(torque_model(robot, "viscous,coulomb"), np.array([1.0, -0.5, 2.0, 3.0]), noise=0.0)
    solution = solved(sample)
    assert solution.joints == ()
    assert solution.margins.shape == (0,)
    assert solution.standard[1] == 0.0
    assert solution.standard[0] == pytest.approx(1.0, abs=1e-5)


def test_evidence_without_full_rank_still_gives_one_robot():
    sample = arm("ur10e", 0.1)
    factors = tuple(
        np.column_stack([np.where(support == 3, 0.0, factor[:, :-1]), factor[:, -1]])
        for support, factor in zip(sample.evidence.supports, sample.evidence.total.factors, strict=True)
    )
    block = replace(sample.evidence.total, factors=factors)
    poor = replace(sample.evidence, blocks=(block,))
    solution = consistent(poor, sample.model, sample.base, weights=np.ones(6))
    assert_physical(sample, solution.standard)


@pytest.mark.parametrize("seed", range(3))
def test_random_bodies_are_recovered_from_a_single_link_with_enough_freedom(seed):
    inertia = random_inertia(np.random.default_rng(seed))
    robot = pendulum().robot
    robot = replace(robot, joints=(replace(robot.joints[0], inertia=inertia),))
    sample = sampled(torque_model(robot, "inertia"), inertia, noise=0.0)
    assert np.allclose(solved(sample).standard, inertia, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PhysicalConstraints(margin=0.0), "margin"),
        (lambda: PhysicalConstraints(margin=0.25), "margin"),
        (lambda: PhysicalConstraints(least_mass=0.0), "least share"),
        (lambda: PhysicalConstraints(links=(LinkConstraints(joint="a"),) * 2), "twice"),
        (lambda: LinkConstraints(joint="a", mass=(2.0, 1.0)), "link of joint a: no mass"),
        (lambda: LinkConstraints(joint="a", mass=(0.0, 0.0)), "no mass"),
        (lambda: LinkConstraints(joint="a", trust=0.0), "trust"),
        (lambda: GaussianPull(deviation=0.0), "deviation"),
        (lambda: EntropicPull(deviation=np.inf), "deviation"),
        (lambda: Box(lower=np.ones(3), upper=np.zeros(3)), "below its opposite"),
        (lambda: Ellipsoid(centre=np.zeros(3), semi_axes=np.array([1.0, 0.0, 1.0])), "semi-axes"),
        (lambda: Ellipsoid(centre=np.zeros(3), semi_axes=np.ones(3), rotation=2 * np.eye(3)), "orthonormal"),
    ],
)
def test_settings_that_mean_nothing_are_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_constraints_on_what_is_not_there_are_refused():
    sample = arm("two_link", 0.1)
    with pytest.raises(ModelError, match=r"constrained link does not exist.*got elbow"):
        solved(sample, PhysicalConstraints(links=(LinkConstraints(joint="elbow"),)))
    with pytest.raises(ModelError, match=r"no such parameter.*got Fx"):
        solved(sample, PhysicalConstraints(unbounded=("Fx",)))


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
