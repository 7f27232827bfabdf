"""Collision geometry of a URDF: kept as it stands, found where it lies, never in the way of what does not need it."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.errors import RobotError
from tauhat.robots import Robot, Solid, builtin_names, load_robot, robot_from_urdf
from tauhat.robots.solid import find_mesh

ARM = """<robot name="arm"><link name="base"/>
<link name="body"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>{collisions}</link>
<joint name="j" type="revolute"><parent link="base"/><child link="body"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


def arm(*geometries: str, origin: str = "") -> Robot:
    parts = "".join(f"<collision>{origin}<geometry>{inner}</geometry></collision>" for inner in geometries)
    return robot_from_urdf(ARM.format(collisions=parts))


def test_every_shape_arrives_with_its_size_and_place() -> None:
    shapes = ['<box size="1 2 3"/>', '<sphere radius="4"/>', '<cylinder radius="5" length="6"/>']
    shapes += ['<capsule radius="7" length="8"/>', '<mesh filename="a.stl" scale="1 2 3"/>']
    solids = arm(*shapes, origin='<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>').solids
    assert [solid.kind for solid in solids] == ["box", "sphere", "cylinder", "capsule", "mesh"]
    assert [solid.size.tolist() for solid in solids] == [[1, 2, 3], [4], [5, 6], [7, 8], [1, 2, 3]]
    for solid in solids:
        assert solid.frame == "body"
        assert solid.translation.tolist() == [1, 2, 3]
        np.testing.assert_allclose(solid.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert solids[4].file == "a.stl"


@pytest.mark.parametrize(
    ("geometry", "defect"),
    [
        ('<box size="1 2"/>', "size has the wrong length"),
        ("<box/>", "<box> has no size"),
        ('<sphere radius="-1"/>', "the size of the <sphere> is absurd"),
        ('<sphere radius="nan"/>', "radius is not finite"),
        ('<cylinder radius="1"/>', "<cylinder> has no length"),
        ('<mesh filename="a.stl" scale="0 1 1"/>', "the size of the <mesh> is absurd"),
        ('<torus radius="1"/>', "unknown geometry"),
        ("", "<collision> needs one geometry"),
        ('<sphere radius="1"/><sphere radius="1"/>', "<collision> needs one geometry"),
    ],
)
def test_geometry_that_makes_no_sense_does_not_stop_a_robot_and_keeps_its_reason(geometry: str, defect: str) -> None:
    (solid,) = arm(geometry).solids
    assert solid.kind == "unreadable"
    assert defect in solid.defect


def test_absurdly_many_solids_are_refused() -> None:
    with pytest.raises(RobotError, match="absurd number of <collision>"):
        arm(*(2001 * ['<sphere radius="1"/>']))


def test_solids_follow_their_link_when_its_joint_is_locked() -> None:
    text = ARM.format(collisions='<collision><geometry><sphere radius="1"/></geometry></collision>')
    more = """<link name="tip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
<collision><origin xyz="0 0 1"/><geometry><sphere radius="1"/></geometry></collision></link>
<joint name="k" type="revolute"><parent link="body"/><child link="tip"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="1"/></joint></robot>"""
    robot = robot_from_urdf(text.replace("</robot>", more), locked={"k": np.pi / 2})
    frames = {frame.name: frame for frame in robot.frames}
    tip = frames[robot.solids[1].frame]
    assert tip.joint == 0
    np.testing.assert_allclose(tip.rotation @ robot.solids[1].translation + tip.translation, [1, 0, 0], atol=1e-15)


def test_built_in_robots_and_plain_data_have_no_solids() -> None:
    assert not any(load_robot(name).solids for name in builtin_names())
    robot = arm('<sphere radius="1"/>')
    assert "solids" not in robot.to_dict()
    assert Robot.from_dict(robot.to_dict()).solids == ()


def test_a_solid_needs_a_frame_a_kind_and_a_size() -> None:
    robot = arm()
    with pytest.raises(RobotError, match="a frame that is not there"):
        Robot(name="a", joints=robot.joints, solids=(Solid(frame="x", kind="sphere", size=np.ones(1)),))
    with pytest.raises(RobotError, match="unknown kind of solid"):
        Solid(frame="x", kind="torus", size=np.ones(1))  # type: ignore[arg-type]
    with pytest.raises(RobotError, match="size is not positive"):
        Solid(frame="x", kind="sphere", size=np.zeros(1))


def test_meshes_are_found_beside_the_file_in_its_package_and_on_the_paths_of_ros(tmp_path, monkeypatch) -> None:
    inside = tmp_path / "work" / "my_robot" / "meshes" / "a.stl"
    outside = tmp_path / "ros" / "share" / "other" / "b.stl"
    for path in (inside, outside):
        path.parent.mkdir(parents=True)
        path.write_text("solid")
    folder = tmp_path / "work" / "my_robot" / "urdf"
    folder.mkdir()
    assert find_mesh("../meshes/a.stl", folder=str(folder)).samefile(inside)
    assert find_mesh("package://my_robot/meshes/a.stl", folder=str(folder)).samefile(inside)
    assert find_mesh(f"file://{inside}", folder="").samefile(inside)
    assert find_mesh(str(inside), folder="").samefile(inside)
    assert find_mesh("package://other/b.stl", folder=str(folder)) is None
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ros"))
    assert find_mesh("package://other/b.stl", folder=str(folder)).samefile(outside)
    for address in ("gone.stl", "http://host/a.stl", "package://", "a\0b", "x" * 5000, ""):
        assert find_mesh(address, folder=str(folder)) is None
    assert find_mesh("a.stl", folder="") is None


def test_a_robot_from_a_file_knows_where_its_meshes_lie(tmp_path) -> None:
    (tmp_path / "a.stl").write_text("solid")
    (tmp_path / "arm.urdf").write_text(
        ARM.format(collisions='<collision><geometry><mesh filename="a.stl"/></geometry></collision>')
    )
    assert load_robot(tmp_path / "arm.urdf").solids[0].path.samefile(tmp_path / "a.stl")
    assert arm('<mesh filename="a.stl"/>').solids[0].path is None
