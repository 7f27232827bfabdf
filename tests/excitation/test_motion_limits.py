"""Limits of several joints at once: margins are those of oracles, pullbacks those of finite differences."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio
import pytest

from sample_arms import chain, random_tree
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.rigid_body import inverse_dynamics
from tauhat.errors import ExcitationError, TauhatWarning
from tauhat.excitation.fourier import FourierSeries
from tauhat.excitation.limits import (
    Capsule,
    HalfSpace,
    LimitSet,
    MotionLimit,
    ObstacleLimit,
    SelfCollision,
    ToolBox,
    ToolSpeed,
    TorqueLimit,
    box_obstacle,
    link_capsules,
    mesh_obstacle,
    motion_limits,
    tool_frame,
)
from tauhat.excitation.limits.collision_limit import FAR, nearest_points
from tauhat.excitation.limits.link_poses import link_poses
from tauhat.excitation.space import FourierSpace
from tauhat.robots import Robot, forward_kinematics, load_robot, pinocchio_model
from tauhat.robots.transforms import rotation_from_rpy

TURN = rotation_from_rpy(0.4, -0.3, 0.8)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def random_motion(robot: Robot, n_t: int = 60, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.6, 1.6, (robot.n_v, n_t))
    return Motion(q=q, dq=rng.normal(size=q.shape), ddq=3.0 * rng.normal(size=q.shape))


def sample_arm(name: str) -> Robot:
    rng = np.random.default_rng(3)
    made = {"tree": lambda: random_tree(rng, 6), "sliding": lambda: chain(rng, "RPRPRR")}
    return made[name]() if name in made else load_robot(name)


def all_limits(robot: Robot, folder) -> list[MotionLimit]:
    tool = tool_frame(robot)
    body = link_capsules(robot, tool, radius=0.03)
    mesh = folder / "solid.obj"
    mesh.write_text(TETRAHEDRON)
    place = np.array([0.4, 0.3, 0.2])
    box = box_obstacle("crate", size=np.array([0.5, 0.4, 0.7]), rotation=TURN, translation=place)
    solid = mesh_obstacle("solid", path=mesh, scale=0.6, rotation=TURN, translation=-place)
    limits = [
        TorqueLimit(robot=robot, largest=np.linspace(20.0, 80.0, robot.n_v)),
        ToolBox(robot=robot, frame=tool, lower=np.array([-0.5, -0.4, 0.0]), upper=np.array([0.6, 0.5, 0.8])),
        ToolSpeed(robot=robot, frame=tool, largest=1.5),
        HalfSpace(body=body, label="floor", normal=np.array([0.1, -0.2, 2.0]), offset=-0.1, clearance=0.01),
        ObstacleLimit(body=body, obstacle=box, clearance=0.02),
        ObstacleLimit(body=body, obstacle=solid, clearance=0.02),
        SelfCollision(body=body, clearance=0.01),
    ]
    return list(LimitSet(robot=robot, others=tuple(limits)).others)


@pytest.mark.parametrize("name", ["ur5e", "panda", "two_link", "tree", "sliding"])
def test_the_pullback_of_every_limit_is_that_of_finite_differences(name, tmp_path):
    robot = sample_arm(name)
    motion, rng, step = random_motion(robot), np.random.default_rng(1), 1e-6
    limits = all_limits(robot, tmp_path)
    assert len(limits) >= 6
    for limit in limits:
        margins = limit.margins(motion)
        assert margins.shape == (len(limit.parts), motion.n_t)
        bars, directions = rng.normal(size=margins.shape), rng.normal(size=(3, *motion.q.shape))
        ahead, behind = (
            limit.margins(
                Motion(**{
                    key: getattr(motion, key) + sign * step * way
                    for key, way in zip(("q", "dq", "ddq"), directions, strict=True)
                })
            )
            for sign in (1, -1)
        )  # fmt: skip
        expected = ((ahead - behind) / (2 * step) * bars).sum(axis=0)
        found = sum((part * way).sum(axis=0) for part, way in zip(limit.pull(motion, bars), directions, strict=True))
        apart = np.abs(found - expected) / (1.0 + np.abs(expected))
        # Nearest points jump where segments are parallel or an edge takes over: a few samples may straddle such a jump.
        assert np.quantile(apart, 0.9) < 1e-6, (limit.name, apart.max())
        assert np.median(apart) < 1e-8, limit.name


def test_link_poses_are_those_of_pinocchio():
    for name in ("panda", "tree", "sliding"):
        robot = sample_arm(name)
        model = pinocchio_model(robot)
        data, motion = model.createData(), random_motion(robot, 5)
        poses = link_poses(robot, motion.q)
        for sample in range(5):
            pinocchio.forwardKinematics(model, data, motion.q[:, sample])
            for link in range(robot.n_v):
                assert np.allclose(poses.origin[link, sample], data.oMi[link + 1].translation)
                assert np.allclose(poses.rotation[link, sample], data.oMi[link + 1].rotation)


def test_torque_margins_are_those_of_inverse_dynamics_with_friction_against_the_joint():
    robot = load_robot("panda")
    motion = random_motion(robot)
    limit = TorqueLimit(robot=robot, largest=robot.effort_limit)
    torque = inverse_dynamics(robot, motion.q.T, motion.dq.T, motion.ddq.T).T
    own = np.array([(joint.rotor_inertia, joint.viscous, joint.coulomb) for joint in robot.joints])
    torque += own[:, :1] * motion.ddq + own[:, 1:2] * motion.dq
    expected = 1.0 - (np.abs(torque) + own[:, 2:]) / robot.effort_limit[:, None]
    assert np.allclose(limit.margins(motion), expected)


def test_tool_margins_are_those_of_forward_kinematics_and_its_differences():
    robot = load_robot("ur5e")
    frame, motion, step = tool_frame(robot), random_motion(robot), 1e-6
    place, ahead, behind = (
        forward_kinematics(robot, (motion.q + shift * motion.dq).T, frame=frame.name).translation
        for shift in (0.0, step, -step)
    )
    box = ToolBox(robot=robot, frame=frame, lower=np.full(3, -0.5), upper=np.full(3, 1.5))
    assert np.allclose(box.margins(motion)[:3], (place + 0.5).T)
    assert np.allclose(box.margins(motion)[3:], (1.5 - place).T)
    speed = np.linalg.norm(ahead - behind, axis=1) / (2 * step)
    assert np.allclose(ToolSpeed(robot=robot, frame=frame, largest=2.0).margins(motion)[0], 1.0 - speed / 2.0)


def test_a_tool_at_rest_has_all_its_speed_left_and_no_slope():
    robot = load_robot("ur5e")
    still = np.zeros((6, 3))
    limit = ToolSpeed(robot=robot, frame=tool_frame(robot), largest=1.0)
    assert np.array_equal(limit.margins(Motion(q=still, dq=still, ddq=still)), np.ones((1, 3)))
    assert not np.any(limit.pull(Motion(q=still, dq=still, ddq=still), np.ones((1, 3))).dq)


@pytest.mark.parametrize("seed", range(4))
def test_nearest_points_of_segments_are_those_of_a_dense_search(seed):
    robot = chain(np.random.default_rng(seed), "RRRR")
    body = link_capsules(robot, tool_frame(robot), radius=0.01)
    poses = link_poses(robot, random_motion(robot, 4, seed).q)
    pairs = np.array([(a, b) for a in range(4) for b in range(a)])
    first, second = nearest_points(body, poses, pairs)
    starts, ends = body.ends(poses)
    parts = np.linspace(0.0, 1.0, 301)[:, None, None, None]
    lines = starts + parts * (ends - starts)
    for row, (a, b) in enumerate(pairs):
        apart = np.linalg.norm(lines[:, None, a] - lines[None, :, b], axis=-1).min(axis=(0, 1))
        found = np.linalg.norm(first[row] - second[row], axis=-1)
        assert (found <= apart + 1e-12).all()
        assert np.allclose(found, apart, atol=5e-3)


def test_distances_to_a_box_are_those_of_a_clamped_point_and_end_at_one():
    robot = load_robot("two_link")
    tool = tool_frame(robot)
    place = np.array([0.45, 0.1, 0.35])
    half = np.array([0.1, 0.2, 0.15])
    box = box_obstacle("crate", size=2.0 * half, rotation=TURN, translation=place)
    ball = Capsule(link=1, start=np.array([0.05, 0.02, 0.0]), end=np.array([0.05, 0.02, 1e-9]), radius=0.04)
    body = link_capsules(robot, tool, given=(ball,))
    only = type(body)(robot=robot, capsules=(ball,))
    motion = random_motion(robot, 200)
    centre = link_poses(robot, motion.q).point(1, ball.start)
    inner = (centre - place) @ TURN
    expected = np.linalg.norm(inner - np.clip(inner, -half, half), axis=1) - 0.04 - 0.01
    outside = expected > -0.05
    found = ObstacleLimit(body=only, obstacle=box, clearance=0.01).margins(motion)[0]
    assert np.allclose(found[outside], np.minimum(expected / FAR, 1.0)[outside], atol=1e-5)
    assert found.max() == 1.0
    assert found.min() < 0.9


def test_heights_over_a_plane_are_those_of_its_normal():
    robot = load_robot("ur5e")
    body, motion = link_capsules(robot, tool_frame(robot), radius=0.05), random_motion(robot)
    floor = HalfSpace(body=body, label="floor", normal=np.array([0.0, 0.0, 3.0]), offset=-0.2, clearance=0.02)
    heights = forward_kinematics(robot, motion.q.T, frame="tool").translation[:, 2]
    assert np.allclose(floor.margins(motion)[-1] * FAR, heights + 0.2 - 0.05 - 0.02)


def test_parts_that_stand_still_are_not_held_against_a_floor():
    robot = load_robot("ur5e")
    body = link_capsules(robot, tool_frame(robot))
    floor = HalfSpace(body=body, label="floor", normal=np.array([0.0, 0.0, 1.0]), offset=0.0, clearance=0.0)
    assert "link of shoulder_pan_joint" not in floor.parts
    assert "link of elbow_joint" in floor.parts


def test_neighbours_and_links_that_always_touch_are_left_out_and_the_latter_told():
    robot = load_robot("panda")
    tool = tool_frame(robot)
    limit = SelfCollision(body=link_capsules(robot, tool), clearance=0.02)
    parents = dict(enumerate(robot.parents)) | {-1: None}
    for a, b in limit.pairs:
        links = [limit.body.capsules[k].link for k in (a, b)]
        assert links[0] != parents[links[1]]
        assert links[1] != parents[links[0]]
    assert len(limit.parts) > 3
    with pytest.warns(TauhatWarning, match="touch in nearly every pose"):
        SelfCollision(body=link_capsules(robot, tool, radius=0.4), clearance=0.02)


def test_capsules_run_from_joint_to_joint_and_given_ones_replace_them():
    robot = load_robot("ur5e")
    tool = tool_frame(robot)
    body = link_capsules(robot, tool, radius={"base": 0.1, "elbow_joint": 0.08})
    lengths = {capsule.link: capsule.length for capsule in body.capsules}
    assert lengths[1] == pytest.approx(0.425)
    assert [capsule.radius for capsule in body.capsules if capsule.link == 2] == [0.08]
    given = Capsule(link=1, start=np.zeros(3), end=np.ones(3), radius=0.01)
    replaced = link_capsules(robot, tool, given=(given,))
    assert [capsule for capsule in replaced.capsules if capsule.link == 1] == [given]
    with pytest.raises(ExcitationError, match="unknown joint"):
        link_capsules(robot, tool, radius={"elbow": 0.1})


def test_a_mesh_stands_for_its_convex_hull(tmp_path):
    path = tmp_path / "solid.obj"
    path.write_text(TETRAHEDRON)
    solid = mesh_obstacle("solid", path=path, scale=2.0, rotation=np.eye(3), translation=np.zeros(3))
    result = coal.DistanceResult()
    ball, place = coal.Sphere(0.1), coal.Transform3s(np.eye(3), np.array([3.0, 0.0, 0.0]))
    found = coal.distance(ball, place, solid.shape, coal.Transform3s(), coal.DistanceRequest(True), result)
    assert found == pytest.approx(0.9, abs=1e-6)


def test_jerk_of_a_space_is_that_of_its_accelerations_and_is_kept():
    robot = load_robot("two_link")
    jerk = np.array([3.0, 4.0])
    space = FourierSpace(limits=motion_limits(robot, jerk=jerk), period=4.0, harmonics=3)
    x = 0.2 * np.random.default_rng(0).normal(size=space.shape)
    grid = space.grid(20_000)
    slopes = np.gradient(grid.motion(x).ddq, 4.0 / 20_000, axis=1)[:, 1:-1]
    rows = np.einsum("jrk,jk->jr", grid.rows(), x)[:, 60_001:-1] * jerk[:, None]
    assert np.allclose(rows, slopes, atol=1e-4 * np.abs(slopes).max())
    kept = space.series(space.shrunk(50.0 * x)).largest_jerk()
    assert (kept <= jerk * (1 + 1e-9)).all()
    assert (kept > 0.5 * jerk).any()
    assert isinstance(space.series(x), FourierSeries)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda r, _: TorqueLimit(robot=r, largest=np.array([1.0, -1.0])), "a torque limit must be positive"),
        (lambda r, _: TorqueLimit(robot=r, largest=np.full(2, np.inf)), "no joint has a torque limit"),
        (lambda r, _: ToolSpeed(robot=r, frame=tool_frame(r), largest=0.0), "not a speed"),
        (lambda r, _: ToolBox(robot=r, frame=tool_frame(r), lower=np.ones(3), upper=np.zeros(3)), "lower above upper"),
        (lambda r, _: tool_frame(r, "hand"), "no such frame"),
        (lambda _, b: HalfSpace(body=b, label="floor", normal=np.zeros(3), offset=0.0, clearance=0.0), "no direction"),
        (lambda _, b: SelfCollision(body=b, clearance=-1.0), "not a clearance"),
        (lambda r, _: link_capsules(r, tool_frame(r), radius=0.0), "not a radius"),
        (
            lambda _, __: box_obstacle("b", size=np.array([1, 0, 1]), rotation=np.eye(3), translation=np.zeros(3)),
            "b: not a box",
        ),
        (lambda r, _: LimitSet(robot=r).check_robot(load_robot("panda")), "limits of another robot"),
    ],
)
def test_limits_that_mean_nothing_are_refused(build, message):
    robot = load_robot("two_link")
    with pytest.raises(ExcitationError, match=message):
        build(robot, link_capsules(robot, tool_frame(robot)))
