"""Constraints on links and terms are kept, and those that contradict the model or each other are named."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from physical_problems import PULLS, assert_physical, pendulum, second_moments, solved

from sample_arms import planar_arm, random_inertia
from synthetic_evidence import arm, plain_model, plain_truth, sampled
from tauhat.dynamics import torque_model
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import InertiaWithoutProducts, Viscous
from tauhat.errors import ModelError
from tauhat.estimation import (
    Box,
    Ellipsoid,
    EntropicPull,
    GaussianPull,
    LinkConstraints,
    PhysicalConstraints,
    consistent,
)
from tauhat.robots import load_robot


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
