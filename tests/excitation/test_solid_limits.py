"""Limits with a URDF's own geometry: distances are Pinocchio's, slopes those of differences, lost meshes are told."""

from __future__ import annotations

import warnings
from pathlib import Path

import coal
import numpy as np
import pinocchio
import pytest
from scipy.spatial import ConvexHull

from tauhat.dynamics.motion import Motion
from tauhat.errors import TauhatWarning
from tauhat.excitation import parse_limits
from tauhat.excitation.limits import (
    HalfSpace,
    ObstacleLimit,
    SelfCollision,
    box_obstacle,
    robot_body,
    tool_frame,
)
from tauhat.excitation.limits.collision_limit import FAR
from tauhat.excitation.limits.link_poses import link_poses
from tauhat.robots import Robot, load_robot, robot_from_urdf
from tauhat.robots.transforms import rotation_from_rpy

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
SHAPES = {
    "base": '<origin xyz="0 0 0.1" rpy="0.1 0 0"/><geometry><box size="0.3 0.2 0.2"/></geometry>',
    "one": '<origin xyz="0.1 0 0.1" rpy="0 0.4 0"/><geometry><cylinder radius="0.05" length="0.2"/></geometry>',
    "two": '<origin xyz="0.2 0 0" rpy="0 1.5 0"/><geometry><capsule radius="0.04" length="0.3"/></geometry>',
    "three": '<origin xyz="0.1 0 0" rpy="0.3 0 0"/><geometry><mesh filename="{mesh}" scale="0.1 0.1 0.2"/></geometry>',
    "four": '<origin xyz="0.05 0 0"/><geometry><sphere radius="0.06"/></geometry>',
}
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0")
PLACES = ("0 0 0.25", "0.2 0 0.1", "0.4 0 0", "0.25 0 0")


def urdf(mesh: str) -> str:
    links = "".join(
        f'<link name="{name}">{INERTIAL}<collision>{shape.format(mesh=mesh)}</collision></link>'
        for name, shape in SHAPES.items()
    )
    names = list(SHAPES)
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="{names[k]}"/><child link="{names[k + 1]}"/>'
        f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="2" effort="50"/></joint>'
        for k, (axis, place) in enumerate(zip(AXES, PLACES, strict=True))
    )
    return f'<robot name="arm">{links}{joints}</robot>'


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package with a URDF whose third link is a mesh, a random solid of 60 corners."""
    folder = tmp_path_factory.mktemp("ws") / "arm_description"
    (folder / "meshes").mkdir(parents=True)
    points = np.random.default_rng(0).normal(size=(60, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in points]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in ConvexHull(points).simplices]
    (folder / "meshes" / "solid.obj").write_text("\n".join(lines))
    (folder / "arm.urdf").write_text(urdf("package://arm_description/meshes/solid.obj"))
    return folder


@pytest.fixture(scope="module")
def robot(files: Path) -> Robot:
    return load_robot(files / "arm.urdf")


def poses_of(robot: Robot, n_t: int, seed: int = 0) -> Motion:
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, (robot.n_v, n_t))
    return Motion(q=q, dq=np.zeros_like(q), ddq=np.zeros_like(q))


def geometry_of_pinocchio(files: Path) -> tuple[pinocchio.Model, pinocchio.GeometryModel]:
    """Pinocchio's reading of the URDF; its parser knows no capsules, so that one is added by hand."""
    path = files / "for_pinocchio.urdf"
    path.write_text((files / "arm.urdf").read_text().replace(f"<collision>{SHAPES['two']}</collision>", ""))
    model = pinocchio.buildModelFromUrdf(str(path))
    shapes = pinocchio.buildGeomFromUrdf(
        model, str(path), pinocchio.GeometryType.COLLISION, package_dirs=[str(files.parent)]
    )
    place = pinocchio.SE3(pinocchio.rpy.rpyToMatrix(0.0, 1.5, 0.0), np.array([0.2, 0.0, 0.0]))
    shapes.addGeometryObject(pinocchio.GeometryObject("two_0", 2, place, coal.Capsule(0.04, 0.3)))
    for shape in shapes.geometryObjects:  # Pinocchio reads meshes as they are, the limits as their convex hulls
        if shape.name.startswith("three"):
            shape.geometry.buildConvexHull(True, "Qt")
            shape.geometry = shape.geometry.convex
    return model, shapes


def gaps_of_pinocchio(files: Path, motion: Motion) -> dict[frozenset[str], list[float]]:
    """Every pair's distance by Pinocchio's own geometry model of the URDF."""
    model, shapes = geometry_of_pinocchio(files)
    shapes.addAllCollisionPairs()
    data, placed = model.createData(), pinocchio.GeometryData(shapes)
    for request in placed.distanceRequests:
        request.enable_signed_distance = True
        request.gjk_tolerance = 1e-9
    gaps: dict[frozenset[str], list[float]] = {}
    for q in motion.q.T:
        pinocchio.computeDistances(model, data, shapes, placed, q.copy())
        for pair, result in zip(shapes.collisionPairs, placed.distanceResults, strict=True):
            names = frozenset(shapes.geometryObjects[k].name[:-2] for k in (pair.first, pair.second))
            gaps.setdefault(names, []).append(result.min_distance)
    return gaps


def test_every_link_is_its_own_geometry_and_no_capsule_is_left(robot: Robot) -> None:
    body = robot_body(robot, tool_frame(robot))
    assert body.capsules == ()
    assert [body.label(index) for index in range(5)] == [f"link {name}" for name in SHAPES]


def test_distances_between_links_are_those_of_pinocchio(files: Path, robot: Robot) -> None:
    motion = poses_of(robot, 600)
    limit = SelfCollision(body=robot_body(robot, tool_frame(robot)), clearance=0.01)
    expected = gaps_of_pinocchio(files, motion)
    assert len(limit.parts) == 6  # ten pairs less four of neighbours
    for part, margins in zip(limit.parts, limit.margins(motion), strict=True):
        gaps = np.array(expected[frozenset(name.removeprefix("link ") for name in part.split(" and "))])
        assert margins.max() == 1.0
        assert margins.min() < 0.8
        outside = gaps > 0.0
        np.testing.assert_allclose(margins[outside], np.minimum((gaps - 0.01) / FAR, 1.0)[outside], atol=1e-5)
        assert (margins[~outside] < 0.0).all()


def test_heights_are_those_of_the_lowest_corner_and_of_distances_to_a_huge_box(files: Path, robot: Robot) -> None:
    motion, normal, offset = poses_of(robot, 100), np.array([0.1, -0.3, 1.0]), -0.9
    limit = HalfSpace(
        body=robot_body(robot, tool_frame(robot)), label="floor", normal=normal, offset=offset, clearance=0.0
    )
    assert limit.parts == ("link one", "link two", "link three", "link four")
    model, shapes = geometry_of_pinocchio(files)
    data, placed = model.createData(), pinocchio.GeometryData(shapes)
    turn = pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), limit.normal).matrix()
    below = coal.Transform3s(turn, (offset - 50.0) * limit.normal)
    for sample, q in enumerate(motion.q.T):
        pinocchio.updateGeometryPlacements(model, data, shapes, placed, q.copy())
        for margin, part in zip(limit.margins(motion)[:, sample], limit.parts, strict=True):
            k = shapes.getGeometryId(f"{part.removeprefix('link ')}_0")
            pose = coal.Transform3s(placed.oMg[k].rotation, placed.oMg[k].translation)
            shape, request = shapes.geometryObjects[k].geometry, coal.DistanceRequest()
            request.gjk_tolerance = 1e-9
            gap = coal.distance(shape, pose, coal.Box(100, 100, 100), below, request, coal.DistanceResult())
            if gap > 0.0:
                assert margin * FAR == pytest.approx(gap, abs=1e-6)


def test_what_only_turns_over_a_plane_is_not_held_against_it() -> None:
    turning = '<origin xyz="0 0 0.1"/><geometry><cylinder radius="0.1" length="0.2"/></geometry>'
    text = urdf("none.obj").replace(SHAPES["one"], turning)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        robot = robot_from_urdf(text)
        body = robot_body(robot, tool_frame(robot))
    floor = HalfSpace(body=body, label="floor", normal=np.array([0.0, 0.0, 1.0]), offset=0.3, clearance=0.0)
    assert "link one" not in floor.parts
    wall = HalfSpace(body=body, label="wall", normal=np.array([1.0, 0.0, 0.0]), offset=-1.0, clearance=0.0)
    assert "link one" not in wall.parts  # its axis is the joint's
    assert "link one" not in {body.label(index) for index in body.moving_parts()}


def test_slopes_of_all_distances_are_those_of_finite_differences(robot: Robot) -> None:
    body = robot_body(robot, tool_frame(robot))
    crate = box_obstacle(
        "crate",
        size=np.array([0.4, 0.5, 0.3]),
        rotation=rotation_from_rpy(0.4, -0.3, 0.8),
        translation=np.full(3, 0.45),
    )
    limits = [
        SelfCollision(body=body, clearance=0.01),
        ObstacleLimit(body=body, obstacle=crate, clearance=0.02),
        HalfSpace(body=body, label="floor", normal=np.array([0.1, 0.2, 1.0]), offset=0.1, clearance=0.01),
    ]
    motion, rng, step = poses_of(robot, 400, seed=1), np.random.default_rng(2), 1e-5
    way = rng.normal(size=motion.q.shape)
    for limit in limits:
        margins, pull = limit.evaluate(motion)
        ahead, behind = (
            limit.margins(Motion(q=motion.q + sign * step * way, dq=motion.dq, ddq=motion.ddq)) for sign in (1, -1)
        )
        # Where links overlap, or within a step of the cap, there is no one slope.
        clear = (margins > 0.02) & (margins < 0.99)
        assert clear.sum() > 20
        bars = np.where(clear, rng.normal(size=margins.shape), 0.0)
        expected = ((ahead - behind) / (2 * step) * bars).sum(axis=0)
        found = (pull(bars).q * way).sum(axis=0)
        apart = np.abs(found - expected)[clear.any(axis=0)] / (1.0 + np.abs(expected[clear.any(axis=0)]))
        assert np.quantile(apart, 0.9) < 1e-3, (limit.name, apart.max())
        assert np.median(apart) < 1e-5, limit.name


def test_a_mesh_that_is_not_found_is_told_by_its_link_and_a_capsule_stands_for_it(files: Path) -> None:
    (files / "lost.urdf").write_text(urdf("package://nowhere/solid.obj"))
    robot = load_robot(files / "lost.urdf")
    text = "[collision]\nclearance = 0.01"
    with pytest.warns(TauhatWarning, match=r"link three: a capsule stands for its collision geometry: .*nowhere/solid"):
        limits = parse_limits(text, robot)
    body = limits.others[0].body
    assert [capsule.link for capsule in body.capsules] == [2]
    assert [solid.label for solid in body.solids] == ["link base", "link one", "link two", "link four"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parse_limits("[tool]\nspeed = 1", robot)  # needs no geometry: nothing to tell
        plain = parse_limits(text + '\ngeometry = "capsules"', robot).others[0].body
    assert plain.solids == ()
    assert len(plain.capsules) == 4


def test_a_mesh_that_is_none_is_told_too(files: Path) -> None:
    (files / "meshes" / "text.obj").write_text("no mesh")
    (files / "broken.urdf").write_text(urdf("meshes/text.obj"))
    robot = load_robot(files / "broken.urdf")
    with pytest.warns(TauhatWarning, match="link three: .*not a mesh of a solid"):
        robot_body(robot, tool_frame(robot))


def test_stated_capsules_and_radii_go_before_the_geometry_of_their_link(robot: Robot) -> None:
    capsule = "[[capsules]]\nlink = 'base'\nfrom = [0, 0, 0]\nto = [0, 0, 0.2]\nradius = 0.1"
    text = f"[collision]\nradius = {{ j1 = 0.2 }}\n{capsule}"
    body = parse_limits(text, robot).others[0].body
    assert sorted((capsule.link, capsule.radius) for capsule in body.capsules) == [(-1, 0.1), (1, 0.2)]
    assert [solid.label for solid in body.solids] == ["link one", "link three", "link four"]


def test_lowest_points_lie_on_the_solids_and_nothing_is_lower(robot: Robot) -> None:
    body, motion = robot_body(robot, tool_frame(robot)), poses_of(robot, 20, seed=4)
    poses, normal = link_poses(robot, motion.q), np.array([0.6, 0.0, 0.8])
    for solid in body.solids:
        height = solid.lowest(poses, normal) @ normal
        corners = solid.placed_corners(poses) @ normal
        widest = solid.disc + solid.ball
        assert (height <= corners.min(axis=0) + 1e-12).all()
        assert (height >= corners.min(axis=0) - widest - 1e-12).all()
