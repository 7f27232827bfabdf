"""Springs and gas springs against the energy that they hold and a published geometry."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sample_arms import chain, planar_arm
from tauhat.dynamics import Motion, TorqueModel, base_parameters, torque_model
from tauhat.dynamics.terms import GasSpring, Inertia, Offset, Spring
from tauhat.errors import ModelError

# github.com/JonasWeigand/Robot_Identification: KUKA KR300 R2500 ultra, second axis
KR300 = GasSpring(
    joint=1, distance=0.8, lever=0.2, angle=np.radians(5.0), area=np.pi * (0.055**2 - 0.03**2) / 4, volume=2 * 0.00048
)


def column(term: GasSpring | Spring, q: object) -> np.ndarray:
    """Return the term's column of the second joint of the planar arm at positions, (n,)."""
    turned = np.asarray(q, dtype=float)
    path = np.array([np.zeros_like(turned), turned])
    columns, _ = term.columns(planar_arm(), Motion(q=path, dq=np.zeros_like(path), ddq=np.zeros_like(path)), None)
    return columns[1][0]


def energy(term: GasSpring, q: float) -> float:
    """Work per unit of pV that went into the gas at constant temperature: the integral of -p dV, V the gas's volume."""
    pin = term.lever * np.array([np.cos(q + term.angle), np.sin(q + term.angle)])
    length = np.linalg.norm(pin - [term.distance, 0.0])
    return -np.log(term.volume - term.area * (length - (term.distance - term.lever)))


@given(
    q=st.floats(-6.0, 6.0),
    distance=st.floats(0.3, 2.0),
    part=st.floats(0.05, 0.95),
    angle=st.floats(-3.0, 3.0),
    used=st.floats(0.05, 0.9),
)
def test_a_gas_spring_is_the_slope_of_its_energy(
    q: float, distance: float, part: float, angle: float, used: float
) -> None:
    lever, area = part * distance, 1e-3
    volume = 2.0 * lever * area / used
    term = GasSpring(joint=1, distance=distance, lever=lever, angle=angle, area=area, volume=volume)
    step = 1e-5
    slope = (energy(term, q + step) - energy(term, q - step)) / (2 * step)
    assert column(term, [q])[0] == pytest.approx(slope, rel=1e-6, abs=1e-8)


def test_a_gas_spring_pulls_towards_the_pose_in_which_it_is_shortest() -> None:
    poses = np.array([-0.5, 0.5]) - KR300.angle
    needed = column(KR300, poses)
    assert needed[0] < 0.0 < needed[1]  # what the drive must add to hold the joint there
    assert column(KR300, [-KR300.angle])[0] == pytest.approx(0.0, abs=1e-12)


def test_the_published_geometry_of_a_kr300_gives_the_published_torque() -> None:
    q2 = np.radians(np.linspace(-10.0, 40.0, 26))
    d, k = 0.8, 0.2
    shortest, area = d - k, np.pi * (0.055**2 - 0.03**2) / 4
    change = np.sqrt(d**2 + k**2 - 2 * d * k * np.cos(q2 + np.radians(5.0))) - shortest
    gas = 1.01 * 296.8 * 328 * 2 * 0.0795
    published = np.sin(q2 + np.radians(5.0)) * d * k / (change + shortest) * area * gas / (2 * 0.00048 - change * area)
    np.testing.assert_allclose(gas * column(KR300, q2), published, rtol=1e-12)


def test_its_parameter_is_pressure_times_volume_of_its_joint_alone() -> None:
    (parameter,) = KR300.parameters(planar_arm())
    assert (parameter.name, parameter.unit, parameter.lower) == ("Gs_2", "J", 0.0)
    assert [support.size for support in KR300.support(planar_arm())] == [0, 1]


def test_a_spring_is_in_proportion_to_the_position() -> None:
    assert column(Spring(), [0.0, 0.5, -2.0]).tolist() == [0.0, 0.5, -2.0]
    units = [p.unit for p in Spring().parameters(chain(np.random.default_rng(0), "RP"))]
    assert units == ["Nm/rad", "N/m"]


def test_springs_are_told_from_gravity_and_from_each_other() -> None:
    model = TorqueModel(robot=planar_arm(), terms=(Inertia(), Spring(), KR300, Offset()))
    base = base_parameters(model)
    assert {"Ks_1", "Ks_2", "Gs_2", "To_1", "To_2"} <= {base.names[k] for k in base.independent}


GOOD = {"joint": 1, "distance": 0.8, "lever": 0.2, "angle": 0.1, "area": 1e-3, "volume": 1e-3}


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"lever": 0.0}, "must be positive"),
        ({"area": -1e-3}, "must be positive"),
        ({"volume": np.nan}, "must be positive"),
        ({"angle": np.inf}, "must be positive"),
        ({"lever": 0.9}, "the lever must be shorter than the distance"),
        ({"volume": 4e-4}, "its stroke less than the volume"),
        ({"joint": 0.5}, "the joint is not an index; got 0.5"),
    ],
)
def test_a_cylinder_that_cannot_be_built_is_refused(change: dict[str, float], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        GasSpring(**{**GOOD, **change})


def test_a_joint_that_is_not_there_is_refused() -> None:
    with pytest.raises(ModelError, match="term gas-spring: no such joint; expected 0 to 1, got 2"):
        GasSpring(**{**GOOD, "joint": 2}).parameters(planar_arm())


def test_without_its_geometry_there_is_no_gas_spring() -> None:
    with pytest.raises(
        ModelError, match=r"term gas-spring needs joint, distance, lever, .*; give them in a model file"
    ):
        torque_model(planar_arm(), "inertia,gas-spring")
