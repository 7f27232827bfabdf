"""The C header compiles without a warning, alone, and calculates what Python does to rounding."""

from __future__ import annotations

import ctypes
import re
import subprocess
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from c_library import COMPILER, STRICT, built, close, code_of, needs_compiler
from export_samples import some_parameters, states

from sample_arms import random_tree
from tauhat.dynamics import bias_torque, gravity_torque, inverse_dynamics, mass_matrix
from tauhat.errors import ArrayError, ExportError
from tauhat.export import FrictionLaw, StandardParameters, c_prefix, ccode, plain_parameters
from tauhat.robots import load_robot, pinocchio_model

pytestmark = needs_compiler


@pytest.mark.parametrize("robot", [load_robot("ur5e"), random_tree(np.random.default_rng(4), 7)], ids=lambda r: r.name)
def test_every_function_is_pythons_to_rounding(tmp_path, robot):
    parameters, (q, dq, ddq) = some_parameters(robot), states(robot, 50)
    call = built(tmp_path, robot, parameters)
    inertia = {"inertia": parameters.inertia}
    with_rotors = inverse_dynamics(robot, q, dq, ddq, **inertia) + parameters.rotor * ddq
    viscous, coulomb = (law.coefficients for law in parameters.friction)
    friction = viscous * dq + coulomb * np.tanh(dq / parameters.friction[1].shape)
    close(call("inverse_dynamics", q, dq, ddq), with_rotors)
    close(call("bias", q, dq), bias_torque(robot, q, dq, **inertia))
    close(call("gravity", q), gravity_torque(robot, q, **inertia))
    close(call("friction", q, dq, ddq), friction)
    close(call("torque", q, dq, ddq), with_rotors + friction)
    close(call("mass_matrix", q), mass_matrix(robot, q, **inertia) + np.diag(parameters.rotor))


def test_the_mass_matrix_is_pinocchios(tmp_path):
    robot = load_robot("panda")
    q, _, _ = states(robot, 20)
    model = pinocchio_model(robot)
    upper = np.array([np.triu(pin.crba(model, model.createData(), row)) for row in q])
    expected = upper + np.triu(upper, 1).transpose(0, 2, 1)
    close(built(tmp_path, robot, plain_parameters(robot.inertia))("mass_matrix", q), expected)


def test_the_plain_sign_is_zero_at_rest(tmp_path):
    robot = load_robot("two_link")
    parameters = plain_parameters(robot.inertia, coulomb=np.array([1.0, 2.5]))
    dq = np.array([[0.3, -1e-9], [0.0, 0.0], [-2.0, 5.0]])
    found = built(tmp_path, robot, parameters)("friction", dq, dq, dq)
    np.testing.assert_array_equal(found, np.sign(dq) * (1.0, 2.5))


def test_results_may_be_written_over_arguments(tmp_path):
    robot = load_robot("two_link")
    parameters = some_parameters(robot)
    call = built(tmp_path, robot, parameters)
    library = ctypes.CDLL(str(tmp_path / "two_link.so"))
    q, dq, ddq = states(robot, 1)
    expected = call("torque", q, dq, ddq)
    pointers = [ctypes.c_void_p(part.ctypes.data) for part in (q, dq, ddq, ddq)]
    library.call_torque(*pointers)
    np.testing.assert_array_equal(ddq, expected)


def test_the_header_needs_nothing_but_mathh_and_may_be_included_twice(tmp_path):
    robot = load_robot("two_link")
    header = ccode(robot, some_parameters(robot)).text
    assert re.findall(r"#include .*", header) == ["#include <math.h>"]
    assert not re.search(r"\b(for|while|malloc|static const|goto)\b", code_of(header))
    (tmp_path / "arm.h").write_text(header)
    (tmp_path / "twice.c").write_text('#include "arm.h"\n#include "arm.h"\nint main(void) { return 0; }\n')
    subprocess.run([COMPILER, *STRICT, "twice.c", "-o", "twice", "-lm"], check=True, cwd=tmp_path)


def test_quarter_turns_cost_nothing():
    twisted = load_robot("ur5e")
    turn = random_tree(np.random.default_rng(0), 1).joints[0].rotation
    odd = replace(twisted, joints=tuple(replace(joint, rotation=turn) for joint in twisted.joints))
    plain, general = (ccode(robot, plain_parameters(robot.inertia)).text.count(" * ") for robot in (twisted, odd))
    assert plain < 0.7 * general
    assert "e-17" not in ccode(twisted, plain_parameters(twisted.inertia)).text.partition("#ifndef")[2]


def test_the_head_tells_joints_units_gravity_model_and_what_is_missing():
    robot = load_robot("panda").with_gravity((0.0, 0.0, 9.81))
    parameters = replace(some_parameters(robot), left_out=("dahl",))
    head = ccode(robot, parameters, fingerprint="abc123").text.partition("*/")[0]
    assert all(f"[{index}] {name}, revolute [rad]" in head for index, name in enumerate(robot.joint_names))
    for text in ("[m/s^2]: 0.0 0.0 9.81", "Model: abc123", "not in here: dahl", "tau is what the motor delivers"):
        assert text in head
    assert repr(float(parameters.inertia[3, 0])) in head


def test_hostile_names_stay_inside_the_comment_and_out_of_the_code(tmp_path):
    robot = load_robot("two_link")
    joint = replace(robot.joints[0], name="*/ int x; /*??/\n#error\\")
    hostile = replace(robot, name="7 Ärm's\n#error", joints=(joint, robot.joints[1]))
    assert c_prefix(hostile.name) == "robot_7_rm_s_error"
    built(tmp_path, hostile, plain_parameters(hostile.inertia))
    assert c_prefix("") == c_prefix("--") == "robot"


def test_bad_prefixes_and_unphysical_links_are_refused():
    robot = load_robot("two_link")
    with pytest.raises(ExportError, match=r"the prefix is no C name.*got 2arm"):
        ccode(robot, plain_parameters(robot.inertia), prefix="2arm")
    inertia = np.array(robot.inertia)
    inertia[0, 9] = 9.0
    with pytest.raises(ExportError, match=f"link of joint {robot.joint_names[0]}: no body has this inertia"):
        ccode(robot, plain_parameters(inertia))


def test_laws_of_friction_are_checked():
    with pytest.raises(ExportError, match="unknown law of friction"):
        FrictionLaw(key="glue", coefficients=np.ones((1, 2)))
    with pytest.raises(ExportError, match="friction coulomb: the shape must be one positive value a joint"):
        FrictionLaw(key="coulomb", coefficients=np.ones((1, 2)), shape=np.array([0.1, -0.1]))
    with pytest.raises(ExportError, match="friction stribeck: the law has no shape yet"):
        FrictionLaw(key="stribeck", coefficients=np.ones((1, 2)))
    with pytest.raises(ArrayError, match="load has the wrong shape"):
        FrictionLaw(key="load-dahl", coefficients=np.ones((1, 2)))
    law = FrictionLaw(key="viscous", coefficients=np.ones((1, 3)))
    with pytest.raises(ExportError, match="friction viscous of another robot; expected 2 joints, got 3"):
        StandardParameters(inertia=load_robot("two_link").inertia, friction=(law,))
    own = FrictionLaw(key="viscous", coefficients=np.ones((1, 2)))
    with pytest.raises(ExportError, match="given twice"):
        StandardParameters(inertia=load_robot("two_link").inertia, friction=(own, own))
