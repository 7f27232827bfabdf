"""The user's own URDF, filled in: nothing else changes, and two other libraries calculate the same torque."""

from __future__ import annotations

import difflib
import os
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from export_samples import (
    URDF,
    largest_relative,
    mujoco_torque,
    pinocchio_torque,
    some_parameters,
    states,
    without_shapes,
)

from tauhat.dynamics import inverse_dynamics
from tauhat.errors import ExportError, TauhatWarning
from tauhat.export import FrictionLaw, StandardParameters, fill_urdf, plain_parameters
from tauhat.robots import Robot, load_robot, robot_from_urdf

LOCKED = {"grip": 0.0}
DATA = Path(os.environ.get("TAUHAT_REAL_DATA", Path(__file__).parents[3] / "shared" / "data"))
IMPOSSIBLE_BASE = ("kinova_gen3/gen3.urdf",)
REAL = {
    "kinova_gen3/gen3.urdf": {},
    "kr300/kr300_from_dh.urdf": {},
    "panda/panda.urdf": {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0},
    "tx40/tx40_mdh_modified.urdf": {},
    "ur10e/ur10e.urdf": {},
    "ur3/ur3_robot.urdf": {},
    "ur5/ur5_robot.urdf": {},
}


@pytest.fixture(scope="module")
def arm() -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # the forearm has no mass in the file
        return robot_from_urdf(URDF, locked=LOCKED)


@pytest.fixture(scope="module")
def parameters(arm) -> StandardParameters:
    heavier = np.array(arm.inertia)
    heavier[1] = heavier[0]
    return some_parameters(
        replace(arm, joints=tuple(replace(j, inertia=i) for j, i in zip(arm.joints, heavier, strict=True)))
    )


@pytest.fixture(scope="module")
def filled(arm, parameters):
    return fill_urdf(URDF, arm, parameters)


def changed_parts(before: str, after: str) -> list[str]:
    """Return the lines of the result that are not lines of the source."""
    lines = difflib.ndiff(before.splitlines(), after.splitlines())
    return [line[2:] for line in lines if line.startswith("+ ")]


def blanked(text: str) -> str:
    """Return the text without inertials and joint dynamics: what must stay byte for byte."""
    text = re.sub(r"\s*<inertial>(?:(?!</inertial>).)*</inertial>(?:\s*(?=</link>))?", "", text, flags=re.DOTALL)
    return re.sub(r"\s*<dynamics [^>]*/>", "", text)


def test_everything_but_inertials_and_dynamics_stays_byte_for_byte(filled):
    before, after = (blanked(text.partition("<gazebo>")[0]) for text in (URDF, filled.content.decode()))
    assert after.replace('<link name="fore"></link>', '<link name="fore" />') == before
    assert filled.content.decode().partition("<gazebo>")[2] == URDF.partition("<gazebo>")[2]


def test_an_inertial_keeps_its_comments_its_order_and_its_quotes(filled, parameters):
    text = filled.content.decode()
    mass = repr(float(parameters.inertia[0, 0]))
    assert f"      <!-- from CAD -->\n      <mass   value = '{mass}' />\n      <origin rpy=\"0 0 0\" xyz=" in text
    assert re.search(r"<inertia izz=\"[^\"]+\" ixx='[^']+' iyy=\"[^\"]+\"  ixy=\"[^\"]+\" ixz=\"", text)


def test_a_missing_inertial_is_put_in_with_the_documents_indentation(filled):
    text = filled.content.decode()
    assert '  <link name="fore">\n    <inertial>\n      <origin xyz=' in text
    assert '/>\n    </inertial>\n  </link>\n  <link name="hand">' in text


def test_friction_goes_into_the_dynamics_that_are_there_or_new_ones(filled, parameters):
    text = filled.content.decode()
    damping, friction = (law.coefficients[0].tolist() for law in parameters.friction)
    rotor = float(parameters.rotor[0])
    assert f'<dynamics friction=\'{friction[0]!r}\' damping="{damping[0]!r}" armature="{rotor!r}"/>' in text
    assert f'\n    <dynamics damping="{damping[1]!r}" friction="{friction[1]!r}"/>\n    <parent link="plate"/>' in text
    assert f'<joint name="turn" type="revolute"><dynamics damping="{damping[2]!r}"' in text
    assert filled.left_out == {"rotor": parameters.rotor[1:].max()}


def test_fixed_links_are_emptied_and_locked_ones_keep_their_inertia(filled):
    assert filled.filled == ("upper", "fore", "hand")
    assert filled.emptied == ("camera",)
    assert filled.kept == ("finger", "nail")
    text = filled.content.decode()
    for link in ("finger", "nail", "base"):
        assert (
            re.search(rf'<link name="{link}">.*', text).group() == re.search(rf'<link name="{link}">.*', URDF).group()
        )


def test_pinocchio_calculates_our_torque(filled, arm, parameters):
    motion = states(arm)
    expected = inverse_dynamics(arm, *motion, inertia=parameters.inertia)
    found = pinocchio_torque(pin.buildModelFromXML(filled.content.decode()), arm, motion)
    assert largest_relative(found, expected) < 1e-9


def test_mujoco_calculates_our_torque_although_the_plate_has_a_collision_shape(filled, arm, parameters):
    motion = states(arm)
    damped = (
        inverse_dynamics(arm, *motion, inertia=parameters.inertia) + parameters.friction[0].coefficients * motion[1]
    )
    assert largest_relative(mujoco_torque(filled.content.decode(), arm, motion), damped) < 1e-9


def test_the_unfilled_urdf_differs_so_that_the_agreement_means_something(arm, parameters):
    motion = states(arm)
    expected = inverse_dynamics(arm, *motion, inertia=parameters.inertia)
    assert largest_relative(pinocchio_torque(pin.buildModelFromXML(URDF), arm, motion), expected) > 0.05


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "iso-8859-1", "utf-16"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_encoding_and_line_ends_of_a_file_stay(tmp_path, arm, parameters, encoding, newline, filled):
    declared = encoding.removesuffix("-sig")
    text = URDF.replace('encoding="utf-8"', f'encoding="{declared}"').replace("\n", newline)
    path = tmp_path / "made.urdf"
    path.write_bytes(text.encode(encoding))
    written = fill_urdf(path, arm, parameters).content
    assert written[:3] == text.encode(encoding)[:3]
    decoded = written.decode(encoding)
    assert decoded.count("\n") == decoded.count(newline)
    assert decoded.replace(newline, "\n") == filled.content.decode().replace('"utf-8"', f'"{declared}"')


def test_a_second_filling_with_the_same_parameters_changes_nothing(filled, arm, parameters):
    again = fill_urdf(filled.content.decode(), arm, parameters)
    assert largest_relative(robot_from_urdf(again.content.decode(), locked=LOCKED).inertia, parameters.inertia) < 1e-15
    assert len(changed_parts(filled.content.decode(), again.content.decode())) <= 3  # last digits of one link or two


def test_a_locked_gripper_heavier_than_what_was_identified_is_emptied_with_a_warning(arm, parameters):
    lighter = np.array(parameters.inertia)
    lighter[2] *= 1e-3
    with pytest.warns(TauhatWarning, match=r"finger, nail: .* larger than all .* behind turn"):
        filled = fill_urdf(URDF, arm, replace(parameters, inertia=lighter))
    assert filled.emptied == ("camera", "finger", "nail")
    motion = states(arm)
    found = pinocchio_torque(pin.buildModelFromXML(filled.content.decode()), arm, motion)
    assert largest_relative(found, inverse_dynamics(arm, *motion, inertia=lighter)) < 1e-9


def test_a_gripper_locked_elsewhere_is_taken_off_at_its_own_place(parameters):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        arm = robot_from_urdf(URDF, locked={"grip": 0.07})
        filled = fill_urdf(URDF, arm, parameters)
    again = robot_from_urdf(filled.content.decode(), locked={"grip": 0.07})
    assert largest_relative(again.inertia, parameters.inertia) < 1e-12


def test_friction_that_was_not_identified_stays_as_it_was(arm, parameters):
    text = fill_urdf(URDF, arm, plain_parameters(parameters.inertia)).content.decode()
    assert '<dynamics friction=\'0.7\' damping="1.5" armature="0.0"/>'.replace("0.0", "0") in text
    assert text.count("<dynamics") == 1


def test_what_urdf_cannot_say_is_reported_with_its_size(arm, parameters):
    law = FrictionLaw(key="cube-root", coefficients=np.array([[0.0, -0.25, 0.5]]))
    told = fill_urdf(URDF, arm, replace(parameters, rotor=np.zeros(3), friction=(law,)))
    assert told.left_out == {"cube-root": 0.5}


def test_an_unphysical_link_is_refused_by_name(arm, parameters):
    broken = np.array(parameters.inertia)
    broken[1, 4] = 100.0
    with pytest.raises(ExportError, match=r"link of joint slide: no body has this inertia: its mass is spread neg"):
        fill_urdf(URDF, arm, replace(parameters, inertia=broken))
    broken[0, 0] = -1.0
    with pytest.raises(ExportError, match=r"joint waist \(and those of slide\): .* its mass is -1 kg"):
        fill_urdf(URDF, arm, replace(parameters, inertia=broken))


def test_another_robots_urdf_is_refused(arm, parameters):
    with pytest.raises(ExportError, match=r"not identified with this URDF: joints differ; got turn"):
        fill_urdf(URDF.replace('"turn"', '"other"'), arm, parameters)
    with pytest.raises(ExportError, match=r"links differ; got arm"):
        fill_urdf(URDF.replace('"fore"', '"arm"'), arm, parameters)
    with pytest.raises(ExportError, match=r"joint slide is placed otherwise.* 0\.01 apart"):
        fill_urdf(URDF.replace('xyz="0 0.3 0.1"', 'xyz="0 0.31 0.1"'), arm, parameters)


@pytest.mark.real
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no measured data at {DATA} (set TAUHAT_REAL_DATA)")
@pytest.mark.parametrize("name", REAL)
def test_real_urdfs_keep_their_text_and_agree_in_pinocchio_and_mujoco(name):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not in {DATA}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # tensors in the file that no body has
        robot = load_robot(path, locked=REAL[name])
    inertia = load_robot("panda").inertia[: robot.n_v]
    parameters = plain_parameters(inertia, viscous=np.arange(1.0, robot.n_v + 1), coulomb=np.ones(robot.n_v))
    filled = fill_urdf(path, robot, parameters)
    text, motion = filled.content.decode(), states(robot)
    assert blanked(text) == blanked(path.read_bytes().decode())
    expected = inverse_dynamics(robot, *motion, inertia=inertia)
    found = pinocchio_torque(pin.buildModelFromXML(text), robot, motion)
    assert largest_relative(found, expected) < 1e-9
    damped = expected + np.arange(1.0, robot.n_v + 1) * motion[1]
    loadable = without_shapes(text)
    if name in IMPOSSIBLE_BASE:  # the file's own figures for the base, which no log says anything about
        loadable = re.sub(r"<inertial>.*?</inertial>", "", loadable, count=1, flags=re.DOTALL)
    assert largest_relative(mujoco_torque(loadable, robot, motion), damped) < 1e-9
