"""True parameters: any perturbation of a body is a body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tauhat.errors import ArrayError, SimulationError
from tauhat.robots.joint import central_inertia, inertia_at_origin
from tauhat.robots.robot import Robot
from tauhat.simulation import TrueParameters, nominal_parameters, perturbed


def with_inertia(robot: Robot, index: int, inertia: np.ndarray) -> Robot:
    joints = list(robot.joints)
    joints[index] = replace(joints[index], inertia=inertia)
    return replace(robot, joints=tuple(joints))


@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0.0, 1.0))
@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_perturbed_links_have_positive_density(make_robot: Callable[..., Robot], seed: int, spread: float) -> None:
    truth = perturbed(make_robot(), np.random.default_rng(seed), spread=spread)
    for link in truth.inertia:
        mass, _, central = central_inertia(link)
        moments = np.linalg.eigvalsh(central)
        assert mass > 0.0
        assert moments[0] > 0.0
        assert moments[0] + moments[1] > moments[2]
    assert min(truth.rotor.min(), truth.viscous.min(), truth.coulomb.min()) > 0.0


def test_no_spread_gives_the_nominal_parameters(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot()
    truth, nominal = perturbed(robot, np.random.default_rng(0), spread=0.0), nominal_parameters(robot)
    for name in ("inertia", "rotor", "viscous", "coulomb", "offset"):
        np.testing.assert_allclose(getattr(truth, name), getattr(nominal, name), atol=1e-13)


def test_spread_is_the_relative_scatter_of_masses_and_friction(make_robot: Callable[..., Robot]) -> None:
    robot, rng = make_robot(), np.random.default_rng(1)
    truths = [perturbed(robot, rng, spread=0.1) for _ in range(400)]
    nominal = nominal_parameters(robot)
    masses = np.array([truth.inertia[:, 0] for truth in truths]) / nominal.inertia[:, 0]
    viscous = np.array([truth.viscous for truth in truths]) / nominal.viscous
    offsets = np.array([truth.offset for truth in truths]) / nominal.coulomb
    for scatter in (np.log(masses), np.log(viscous), offsets):
        assert scatter.std() == pytest.approx(0.1, rel=0.1)


def test_what_is_zero_stays_zero(make_robot: Callable[..., Robot]) -> None:
    truth = perturbed(make_robot(friction=0.0), np.random.default_rng(2), spread=0.3)
    assert not truth.viscous.any()
    assert not truth.coulomb.any()
    assert not truth.offset.any()


def test_a_rod_can_be_perturbed(make_robot: Callable[..., Robot]) -> None:
    rod = inertia_at_origin(mass=1.0, com=np.zeros(3), inertia_at_com=np.diag([0.1, 0.1, 1e-15]))
    truth = perturbed(with_inertia(make_robot(), 1, rod), np.random.default_rng(3), spread=0.1)
    moments = np.linalg.eigvalsh(central_inertia(truth.inertia[1])[2])
    assert moments[0] > 0.0


@pytest.mark.parametrize(
    ("inertia", "message"),
    [
        (np.zeros(10), "axis 2: the link has no mass"),
        (np.array([1.0, 0, 0, 0, 0.1, 0, 0.1, 0, 0, 0.3]), "axis 2: .*triangle"),
        (np.array([1.0, 0, 0, 0, 0.1, 0, 0.1, 0, 0, -0.1]), "axis 2: .*not positive definite"),
    ],
)
def test_a_link_that_is_no_body_is_named(make_robot: Callable[..., Robot], inertia: np.ndarray, message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        perturbed(with_inertia(make_robot(), 2, inertia), np.random.default_rng(0))


def test_true_parameters_are_checked_and_read_only(make_robot: Callable[..., Robot]) -> None:
    nominal = nominal_parameters(make_robot())
    with pytest.raises(SimulationError, match="joint 3: viscous is negative"):
        replace(nominal, viscous=np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0]))
    with pytest.raises(ArrayError, match="rotor has the wrong shape"):
        replace(nominal, rotor=np.ones(5))
    with pytest.raises(ArrayError, match="inertia has the wrong shape"):
        TrueParameters(inertia=np.ones((6, 9)), rotor=[1], viscous=[1], coulomb=[1], offset=[1])
    with pytest.raises(ValueError, match="read-only"):
        nominal.inertia[0] = 1.0
