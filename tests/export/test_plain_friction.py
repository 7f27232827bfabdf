"""Damping and dry friction for simulators: the nearest to what was identified, never negative, and said how near."""

from __future__ import annotations

import warnings
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from export_samples import SOLID_URDF, estimate_of, every_value, some_parameters
from scipy.optimize import lsq_linear

from sample_arms import planar_arm, planar_truth
from tauhat.arrays import FloatArray
from tauhat.dynamics import TERMS, Term, TorqueModel, gravity_torque, random_motion, torque_model
from tauhat.dynamics.terms import Coupling, LoadCoulomb, LoadDahl
from tauhat.errors import TauhatWarning
from tauhat.estimation import Estimate
from tauhat.export import (
    FrictionLaw,
    PlainFriction,
    StandardParameters,
    fill_urdf,
    mjcf,
    new_urdf,
    plain_parameters,
    standard_parameters,
)
from tauhat.robots import Robot, load_robot, robot_from_urdf
from tauhat.robots.shared_motor import SharedMotor

TOP = 3.0  # [rad/s] speed limit of both joints of the planar arm
SPEEDS = np.linspace(0.05, 1.0, 20) * TOP


def planar_estimate(*terms: Term, friction: list[float], deviation: float = 0.01) -> Estimate:
    model = TorqueModel(robot=planar_arm(), terms=(TERMS["inertia"](), *terms))
    return estimate_of(model, np.concatenate([model.robot.inertia.ravel(), friction]), deviation=deviation)


def told(estimate: Estimate, *without: str) -> PlainFriction:
    return standard_parameters(estimate, without=without).plain_friction


def test_textbook_friction_is_told_as_it_is():
    truth = planar_truth()
    found = told(estimate_of(truth.model, truth.standard))
    np.testing.assert_array_equal([found.damping, found.dry_friction], [[0.9, 0.5], [1.4, 0.7]])
    assert found.approximations == ()
    nothing = told(planar_estimate(TERMS["offset"](), friction=[1.0, 2.0]))
    assert nothing.of_joint(0) == (None, None)


def test_friction_that_is_a_line_over_all_speeds_is_found_exactly():
    found = told(planar_estimate(TERMS["viscous"](), TERMS["dahl"](), friction=[2.0, 3.0, 0.5, 0.25, 1.0, 0.0]))
    np.testing.assert_allclose(found.damping, [2.0, 3.0], rtol=1e-9)
    np.testing.assert_allclose(found.dry_friction, [0.75, 1.0], rtol=1e-9)
    assert max(one.deviation for one in found.approximations) < 1e-9
    assert [(one.joint, one.unit) for one in found.approximations] == [("j1", "Nm"), ("j2", "Nm")]
    assert (found.approximations[0].slowest, found.approximations[0].fastest) == (0.05 * TOP, TOP)


def weighed(torque: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the best damping and dry friction by SciPy's bounded least squares."""
    columns = np.column_stack([SPEEDS, np.ones_like(SPEEDS)])
    return lsq_linear(columns / errors[:, None], torque / errors, bounds=(0.0, np.inf), tol=1e-15).x


def test_bent_friction_is_told_as_the_nearest_line_by_its_standard_errors():
    estimate = planar_estimate(TERMS["viscous"](), TERMS["cube-root"](), friction=[0.2, 0.0, 3.0, 1.0])
    steady = [estimate.friction(np.full(2, speed)) for speed in SPEEDS]
    torque, errors = (np.array([getattr(one, name) for one in steady]) for name in ("torque", "standard_errors"))
    np.testing.assert_allclose(torque[:, 0], 0.2 * SPEEDS + 3.0 * np.cbrt(SPEEDS), rtol=1e-12)
    assert errors[-1, 0] > 2.0 * errors[0, 0]
    found = told(estimate)
    for joint in range(2):
        best = weighed(torque[:, joint], errors[:, joint])
        np.testing.assert_allclose(found.of_joint(joint), best, rtol=1e-6)
        apart = np.abs(best[0] * SPEEDS + best[1] - torque[:, joint])
        one = found.approximations[joint]
        assert one.deviation == pytest.approx(apart.max(), rel=1e-6)
        assert one.share == pytest.approx((apart / torque[:, joint]).max(), rel=1e-6)
        assert (one.damping, one.dry_friction) == found.of_joint(joint)
        assert one.worst_speed == SPEEDS[np.argmax(apart / torque[:, joint])]


def test_errors_of_zero_weigh_all_speeds_alike():
    estimate = planar_estimate(TERMS["cube-root"](), friction=[3.0, 0.0], deviation=0.0)
    found = told(estimate)
    np.testing.assert_allclose(found.of_joint(0), weighed(3.0 * np.cbrt(SPEEDS), np.ones(20)), rtol=1e-6)
    assert found.of_joint(1) == (0.0, 0.0)
    assert found.approximations[1].share == 0.0


def test_friction_that_falls_with_speed_has_no_negative_damping_and_driving_friction_is_zero():
    estimate = planar_estimate(TERMS["viscous"](), TERMS["dahl"](), friction=[-0.5, -1.0, 4.0, 1.0, 0.0, 0.0])
    found = told(estimate)
    assert found.damping[0] == found.damping[1] == found.dry_friction[1] == 0.0
    assert 3.5 < found.dry_friction[0] < 5.0
    assert found.approximations[1].deviation == pytest.approx(TOP)
    assert found.approximations[1].share == pytest.approx(1.0)
    plain = planar_estimate(TERMS["viscous"](), friction=[-0.5, 1.0])
    np.testing.assert_allclose(told(plain).damping, [0.0, 1.0], atol=1e-12)


def test_what_is_left_out_does_not_brake():
    terms = (TERMS["viscous"](), TERMS["cube-root"](), TERMS["dahl"]())
    estimate = planar_estimate(*terms, friction=[1.0, 2.0, 3.0, 3.0, 0.5, 0.5, 0.5, 0.5])
    np.testing.assert_allclose(told(estimate, "cube-root").dry_friction, [1.0, 1.0], rtol=1e-9)
    np.testing.assert_array_equal(told(estimate, "cube-root", "dahl").damping, [1.0, 2.0])
    assert told(estimate, "cube-root", "dahl").approximations == ()


@pytest.mark.parametrize("term", [LoadDahl(), LoadCoulomb()], ids=lambda term: term.key)
def test_the_load_is_the_mean_of_gravity_over_all_poses(term):
    found = told(planar_estimate(term, friction=[0.1, 0.2]))
    poses = random_motion(planar_arm(), 40_000, np.random.default_rng(1)).q.T
    mean = np.abs(gravity_torque(planar_arm(), poses)).mean(axis=0)
    np.testing.assert_allclose(found.dry_friction, (0.1, 0.2) * mean, rtol=0.05)
    np.testing.assert_allclose(found.damping, 0.0, atol=1e-9)


def test_a_joint_without_speed_limit_is_compared_up_to_one():
    robot = planar_arm()
    free = replace(robot, joints=tuple(replace(joint, limits=type(joint.limits)()) for joint in robot.joints))
    model = TorqueModel(robot=free, terms=(TERMS["inertia"](), TERMS["cube-root"]()))
    found = told(estimate_of(model, np.concatenate([free.inertia.ravel(), [1.0, 1.0]])))
    assert {(one.slowest, one.fastest) for one in found.approximations} == {(0.05, 1.0)}


def models(robot: Robot, parameters: StandardParameters) -> list[object]:
    return [new_urdf(robot, parameters), mjcf(robot, parameters), fill_urdf(SOLID_URDF, robot, parameters)]


def test_what_is_negative_is_set_to_zero_and_said_in_every_format():
    robot = robot_from_urdf(SOLID_URDF, locked={"grip": 0.0})
    given = some_parameters(robot)
    plain = PlainFriction(damping=np.array([-1.0, 2.0, 3.0]), dry_friction=np.array([1.0, -2.0, 3.0]))
    negative = replace(given, rotor=np.array([-0.5, 0.0, 0.1]), plain=plain)
    with pytest.warns(TauhatWarning, match=r"set to zero: rotor of waist \(-0.5\), damping of waist \(-1\)"):
        written = models(robot, negative)
    expected = {"rotor of waist": -0.5, "damping of waist": -1.0, "dry friction of slide": -2.0}
    assert [one.set_to_zero for one in written] == [expected] * 3
    model = mujoco.MjModel.from_xml_string(written[1].text)
    assert model.dof_armature.tolist() == [0.0, 0.0, 0.1]
    assert model.dof_damping.tolist() == [0.0, 2.0, 3.0]
    assert model.dof_frictionloss.tolist() == [1.0, 0.0, 3.0]
    assert b'friction=\'1\' damping="0" armature="0"' in written[2].content
    assert [one.set_to_zero for one in models(robot, given)] == [{}] * 3


def test_a_deviation_of_more_than_a_fifth_is_a_warning_with_its_joint_and_number():
    bent = planar_estimate(TERMS["viscous"](), TERMS["stribeck"](speeds=(0.5, 0.5)), friction=[1.0, 5.0, 9.0, 0.1])
    parameters = standard_parameters(bent)
    shares = [one.share for one in parameters.plain_friction.approximations]
    assert shares[0] > 0.2 > shares[1]
    for writer in (mjcf, new_urdf):
        with pytest.warns(TauhatWarning, match=rf"friction: j1 \({100 * shares[0]:.0f} % at 1 rad/s\); the C code"):
            writer(bent.robot, parameters)
    near = standard_parameters(planar_estimate(TERMS["viscous"](), TERMS["dahl"](), friction=[2.0] * 6))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mjcf(bent.robot, near)


def test_terms_without_a_word_are_left_out_by_name_and_fitted_ones_are_not():
    robot = planar_arm()
    coupled = Coupling(motors=(SharedMotor(1, 0, 1.0),), widths=(0.1,))
    terms = (TERMS["inertia"](), TERMS["spring"](), coupled, *(TERMS[key]() for key in ("viscous-asymmetry", "dahl")))
    model = TorqueModel(robot=robot, terms=terms)
    values = [1.0, -4.0, 0.3, 0.2, 0.1, 0.5, 0.6, *[2.0] * 4]
    parameters = standard_parameters(estimate_of(model, np.concatenate([robot.inertia.ravel(), values])))
    assert mjcf(robot, parameters).left_out == {"viscous-asymmetry": 0.6, "spring": 4.0, "coupling": 0.3}


def test_friction_by_direction_is_told_as_its_mean_and_half_the_difference_is_left_out():
    estimate = planar_estimate(
        TERMS["asymmetric"](widths=(1e-3, 1e-3)), friction=[1.0, 3.0, 2.0, 4.0, 1.0, 1.0, 2.0, 2.5]
    )
    parameters = standard_parameters(estimate)
    np.testing.assert_allclose(parameters.plain_friction.damping, [2.0, 1.0], rtol=1e-9)
    np.testing.assert_allclose(parameters.plain_friction.dry_friction, [3.0, 2.25], rtol=1e-9)
    assert mjcf(planar_arm(), parameters).left_out == {"asymmetric": 1.0}


def test_laws_given_by_hand_are_left_out_unless_they_are_the_textbooks():
    law = FrictionLaw(key="cube-root", coefficients=np.array([[0.1, -0.3]]))
    robot = load_robot("two_link")
    by_hand = replace(plain_parameters(robot.inertia, viscous=[1.0, 2.0]), friction=(law,))
    assert new_urdf(robot, by_hand).left_out == {"cube-root": 0.3}


def test_mujoco_brakes_a_robust_model_as_told():
    robot = load_robot("two_link").with_gravity((0.0, 0.0, 0.0))
    model = torque_model(robot, "inertia,rotor,viscous,cube-root,dahl,load-dahl,offset")
    parameters = standard_parameters(estimate_of(model, every_value(model, np.random.default_rng(2))))
    simulated = mujoco.MjModel.from_xml_string(mjcf(robot, parameters).text)
    data = mujoco.MjData(simulated)
    data.qvel[:] = (0.8, -0.5)
    mujoco.mj_inverse(simulated, data)
    bias = np.zeros(2)
    mujoco.mj_rne(simulated, data, 0, bias)
    plain = parameters.plain_friction
    np.testing.assert_allclose(
        data.qfrc_inverse - bias, plain.damping * data.qvel + plain.dry_friction * (1.0, -1.0), rtol=1e-6
    )
