"""From an estimate to what another program is told: term by term, by name, or not at all."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from export_samples import estimate_of

from sample_arms import planar_truth
from tauhat.dynamics import TERMS, Offset, TorqueModel, inverse_dynamics
from tauhat.dynamics.terms import CouplingDahl, GasSpring, LoadDahl
from tauhat.dynamics.terms.presliding import LENGTHS
from tauhat.dynamics.terms.simplified import InertiaWithoutProducts
from tauhat.errors import ArrayError, ExportError
from tauhat.estimation import identify
from tauhat.export import (
    CoupledMotors,
    StandardParameters,
    check_parameters,
    model_parameters,
    plain_parameters,
    standard_parameters,
)
from tauhat.export.parameters import body_defect
from tauhat.recordings.processing import Processing
from tauhat.robots.shared_motor import SharedMotor


def truth_with(*keys: str) -> TorqueModel:
    robot = planar_truth().model.robot
    return TorqueModel(robot=robot, terms=tuple(TERMS[key]() for key in keys))


def test_parameters_are_sorted_into_links_rotors_and_laws():
    truth = planar_truth()
    found = standard_parameters(estimate_of(truth.model, truth.standard))
    np.testing.assert_array_equal(found.inertia.ravel(), truth.standard[:20])
    np.testing.assert_array_equal(found.rotor, [0.05, 0.02])
    assert [law.key for law in found.friction] == ["viscous", "coulomb", "offset"]
    np.testing.assert_array_equal(found.law("coulomb").coefficients, [[1.4, 0.7]])
    np.testing.assert_array_equal(found.law("coulomb").shape, truth.model.terms[3].widths)
    assert found.law("offset").coefficients[0, 1] == -0.2
    assert found.law("cube-root") is None
    assert not found.springs.any()
    assert (found.gas_spring, found.motors, found.with_memory, found.left_out) == (None, None, (), ())


def test_the_parts_make_the_torque_of_the_model():
    truth = planar_truth()
    found = standard_parameters(estimate_of(truth.model, truth.standard))
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 30, 2))
    viscous, coulomb, offset = (law.coefficients for law in found.friction)
    friction = viscous * dq + coulomb * np.tanh(dq / found.friction[1].shape) + offset
    rigid = inverse_dynamics(truth.model.robot, q, dq, ddq, inertia=found.inertia) + found.rotor * ddq
    np.testing.assert_allclose(rigid + friction, truth.torque(q, dq, ddq), rtol=1e-12)


def test_an_estimate_of_base_parameters_is_refused_with_the_remedy():
    truth = planar_truth()
    settings = Processing(cutoff=10.0, motion_cutoff=30.0)
    estimate = identify(truth.model, [truth.recording(seconds=5.0)], processing=settings)
    with pytest.raises(ExportError, match=r"planar: the estimate has base parameters only.*identify with --physical"):
        standard_parameters(estimate)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind(Offset):
    """A term that no other program knows."""

    key: ClassVar[str] = "wind"


def test_a_term_that_no_program_knows_is_refused_by_name_and_can_be_left_out():
    model = TorqueModel(robot=planar_truth().model.robot, terms=(TERMS["inertia"](), TERMS["viscous"](), Wind()))
    estimate = estimate_of(model, np.concatenate([model.robot.inertia.ravel(), np.ones(4)]))
    with pytest.raises(ExportError, match=r"term wind cannot be told to another program.*`--without wind`"):
        standard_parameters(estimate)
    found = standard_parameters(estimate, without=["wind"])
    assert found.left_out == ("wind",)
    assert [law.key for law in found.friction] == ["viscous"]


def test_springs_motors_and_laws_of_the_load_are_sorted_with_all_they_need():
    robot, motors = planar_truth().model.robot, (SharedMotor(1, 0, 0.5),)
    loaded = tuple(np.arange(20.0))
    gas = GasSpring(joint=0, distance=0.5, lever=0.2, angle=0.3, area=2e-3, volume=3e-3)
    terms = (TERMS["inertia"](), TERMS["spring"](), gas, CouplingDahl(motors=motors), LoadDahl(inertia=loaded))
    model = TorqueModel(robot=robot, terms=terms)
    found = model_parameters(model, np.concatenate([robot.inertia.ravel(), np.arange(1.0, 10.0)]))
    np.testing.assert_array_equal(found.springs, [1.0, 2.0])
    assert (found.gas_spring.spring, found.gas_spring.energy) == (gas, 3.0)
    assert found.motors.motors == motors
    np.testing.assert_array_equal([*found.motors.inertia, *found.motors.viscous, *found.motors.dry[0]], [4, 5, 6, 7])
    np.testing.assert_array_equal(found.law("load-dahl").coefficients, [[8.0, 9.0]])
    np.testing.assert_array_equal(found.law("load-dahl").load.ravel(), loaded)
    assert found.with_memory == ("load-dahl", "coupling-dahl")
    assert found.law("load-dahl").lengths(1) == LENGTHS[:1]
    less = model_parameters(model, np.ones(model.n_p), without=["spring", "gas-spring", "coupling-dahl"])
    assert (less.gas_spring, less.motors, less.left_out) == (None, None, ("spring", "gas-spring", "coupling-dahl"))
    assert not less.springs.any()


def test_motors_without_widths_or_with_strange_friction_are_refused():
    given = {"motors": (SharedMotor(1, 0, 0.5),), "inertia": np.ones(1), "viscous": np.ones(1)}
    with pytest.raises(ExportError, match="one width a motor is needed"):
        CoupledMotors(**given, dry=np.ones((1, 1)), widths=(0.1, 0.2))
    with pytest.raises(ExportError, match="one sign or two Dahl states"):
        CoupledMotors(**given, dry=np.ones((1, 3)))
    with pytest.raises(ArrayError, match="inertia has the wrong shape"):
        CoupledMotors(**{**given, "inertia": np.ones(2)}, dry=np.ones((1, 1)))


def test_a_law_on_some_joints_is_zero_on_the_others():
    model = TorqueModel(
        robot=planar_truth().model.robot, terms=(TERMS["inertia"](), TERMS["cube-root"](joints=(False, True)))
    )
    found = model_parameters(model, np.arange(21.0))
    np.testing.assert_array_equal(found.law("cube-root").coefficients, [[0.0, 20.0]])


def test_links_without_products_of_inertia_have_zeros_there():
    model = TorqueModel(robot=planar_truth().model.robot, terms=(InertiaWithoutProducts(),))
    found = model_parameters(model, np.arange(1.0, 15.0))
    np.testing.assert_array_equal(found.inertia[1], [8, 9, 10, 11, 12, 0, 13, 0, 0, 14])


def test_what_cannot_be_left_out_or_is_missing_is_said():
    truth = planar_truth()
    estimate = estimate_of(truth.model, truth.standard)
    for name in ("dahl", "inertia", "rotor"):
        with pytest.raises(ExportError, match=f"no such term to leave out.*viscous, coulomb, offset, got {name}"):
            standard_parameters(estimate, without=[name])
    friction = truth_with("viscous")
    with pytest.raises(ExportError, match="the model has no inertia to export"):
        standard_parameters(estimate_of(friction, np.ones(2)))


def test_point_masses_rods_and_plates_are_bodies_and_less_is_not():
    point = np.array([2.0, 0.0, 0.0, 0.0, *[0.0] * 6])
    rod = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.3])
    plate = np.array([2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.2, 0.0, 0.0, 0.3])
    assert [body_defect(body) for body in (np.zeros(10), point, rod, plate)] == [""] * 4
    assert "spread negatively" in body_defect(plate + np.eye(10)[9] * 0.01)
    assert "mass is 0 kg" in body_defect(plate * [0, *[1] * 9])
    assert "mass is -1 kg" in body_defect(plate - 3.0 * np.eye(10)[0])
    off_centre = np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.24, 0.0, 0.0, 0.25])  # less than m c^2 about y
    assert "spread negatively" in body_defect(off_centre)


def test_parameters_are_copied_read_only_and_checked():
    robot = planar_truth().model.robot
    rotor = np.array([0.1, 0.2])
    made = plain_parameters(robot.inertia, rotor=rotor, coulomb=rotor, widths=rotor)
    rotor[0] = 9.0
    assert made.rotor[0] == made.friction[0].shape[0] == 0.1
    assert not any(array.flags.writeable for array in (made.inertia, made.rotor, made.friction[0].shape))
    with pytest.raises(ArrayError, match="rotor has the wrong shape"):
        StandardParameters(inertia=robot.inertia, rotor=np.ones(3))
    check_parameters(robot, made)
    with pytest.raises(ExportError, match="planar: parameters of another robot"):
        check_parameters(robot, replace(made, inertia=np.ones((3, 10)), rotor=np.ones(3), springs=(), friction=()))
