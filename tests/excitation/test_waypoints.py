"""Programs of moves: where the tool goes, when, what is slowed, what is refused, and how a motion is kept."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from sample_arms import WORKING_POSES, planar_arm
from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError, MissingExtraError
from tauhat.excitation import (
    AccelerationLimited,
    JerkLimited,
    JointMove,
    LineMove,
    ToolLimits,
    WaypointMotion,
    WaypointSettings,
    Zone,
    motion_limits,
    waypoint_motion,
)
from tauhat.excitation.motion_file import motion_for
from tauhat.recordings import write_recording
from tauhat.robots import Pose, Robot, forward_kinematics, load_robot

ROBOTS = {name: load_robot(name) for name in WORKING_POSES}
UR5E, HOME = ROBOTS["ur5e"], WORKING_POSES["ur5e"]
SLOW = WaypointSettings(tool=ToolLimits(speed=0.1, acceleration=0.5))


def smooth(robot: Robot, **other: object) -> WaypointSettings:
    pytest.importorskip("ruckig", reason="the extra `planner` is not installed")
    jerk = 30.0 * motion_limits(robot).acceleration
    return WaypointSettings(limits=motion_limits(robot, jerk=jerk), ramps=JerkLimited(), **other)


def shifted(x: float, y: float = 0.0, z: float = 0.0, turn: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Pose:
    """Return the UR5e's home pose moved in base axes and turned in its own."""
    pose = forward_kinematics(UR5E, HOME, frame="tool")
    rotation = pose.rotation @ Rotation.from_rotvec(turn).as_matrix()
    return Pose(rotation=rotation, translation=pose.translation + np.array([x, y, z]))


def tool_path(motion: WaypointMotion, t: FloatArray) -> Pose:
    frame = motion.settings.tool_frame(motion.robot)
    return forward_kinematics(motion.robot, motion.sample(t).q, frame=frame)


def tool_speed(motion: WaypointMotion, t: FloatArray, h: float = 1e-5) -> FloatArray:
    ahead, behind = (tool_path(motion, t + step).translation for step in (h, -h))
    return np.linalg.norm(ahead - behind, axis=1) / (2.0 * h)


@pytest.mark.parametrize("name", WORKING_POSES)
def test_a_line_move_takes_the_tool_along_the_line_and_turns_it_as_slerp_does(name: str):
    robot, start = ROBOTS[name], WORKING_POSES[name]
    frame = robot.frames[-1].name
    first = forward_kinematics(robot, start, frame=frame)
    turn = Rotation.from_rotvec([0.2, -0.3, 0.25])
    goal = Pose(
        rotation=first.rotation @ turn.as_matrix(), translation=first.translation + np.array([0.05, 0.08, -0.1])
    )
    motion = waypoint_motion(robot, start, [LineMove(target=goal)])
    found = tool_path(motion, np.linspace(0.0, motion.duration, 400))
    way = goal.translation - first.translation
    part = (found.translation - first.translation) @ way / (way @ way)
    assert np.abs(found.translation - first.translation - np.outer(part, way)).max() < 1e-12
    slerp = Slerp([0.0, 1.0], Rotation.from_matrix([first.rotation, goal.rotation]))
    assert np.abs(found.rotation - slerp(np.clip(part, 0.0, 1.0)).as_matrix()).max() < 1e-11
    assert (part[0], part[-1]) == pytest.approx((0.0, 1.0), abs=1e-12)
    assert (np.diff(part) >= -1e-12).all()


def test_a_seventh_joint_goes_straight_from_where_it_is_to_where_the_target_has_it():
    robot, start = ROBOTS["panda"], WORKING_POSES["panda"]
    motion = waypoint_motion(robot, start, [LineMove(target=start + np.array([0.1, 0.1, 0.1, 0.1, 0.05, -0.1, 0.1]))])
    q = motion.sample(np.linspace(0.0, motion.duration, 50)).q
    (spare,) = motion.pieces[0].curve.solver.spare
    way = tool_path(motion, np.linspace(0.0, motion.duration, 50)).translation
    part = np.linalg.norm(way - way[0], axis=1) / np.linalg.norm(way[-1] - way[0])
    assert np.abs(q[:, spare] - start[spare] - part * (q[-1, spare] - start[spare])).max() < 1e-10


def test_a_joint_move_is_straight_in_joint_space_and_as_fast_as_its_slowest_joint():
    way = np.array([0.4, -0.2, 0.3, 1.5, 0.1, -0.7])
    motion = waypoint_motion(UR5E, HOME, [JointMove(target=HOME + way)])
    limits = motion_limits(UR5E)
    speed, acceleration = (limits.velocity / abs(way)).min(), (limits.acceleration / abs(way)).min()
    assert motion.duration == pytest.approx(1.0 / speed + speed / acceleration, rel=1e-12)
    q = motion.sample(np.linspace(0.0, motion.duration, 50)).q - HOME
    assert np.abs(q - np.outer(q @ way / (way @ way), way)).max() < 1e-14
    assert motion.slowed == ()


def test_overrides_scale_speed_and_acceleration():
    target = HOME + np.array([2.0, 0, 0, 0, 0, 0])
    motion = waypoint_motion(UR5E, HOME, [JointMove(target=target, speed=0.5, acceleration=0.25)])
    samples, limits = motion.sample(np.linspace(0.0, motion.duration, 2001)), motion_limits(UR5E)
    assert np.abs(samples.dq).max() == pytest.approx(0.5 * limits.velocity[0], rel=1e-12)
    assert np.abs(samples.ddq).max() == pytest.approx(0.25 * limits.acceleration[0], rel=1e-12)
    line = waypoint_motion(UR5E, HOME, [LineMove(target=shifted(0.2), speed=0.4)], settings=SLOW)
    middle = np.array([0.5 * line.duration])
    assert tool_speed(line, middle) == pytest.approx(0.04, rel=1e-6)


PROGRAM = (
    LineMove(target=shifted(0.1), zone=Zone(radius=0.02)),
    LineMove(target=shifted(0.1, 0.15, 0.0, (0.1, 0.2, 0.0)), zone=Zone(part=0.3)),
    JointMove(target=HOME + 0.3, zone=Zone(part=0.4)),
    JointMove(target=HOME - 0.2, zone=Zone(radius=0.05)),
    LineMove(target=shifted(-0.1, 0.1, 0.05), dwell=0.25),
    JointMove(target=HOME + 0.2, speed=0.5),
)


@pytest.mark.parametrize("bounded", ["acceleration", "jerk"])
def test_velocity_and_acceleration_are_derivatives_of_the_position(bounded: str):
    settings = smooth(UR5E) if bounded == "jerk" else WaypointSettings()
    motion, h = waypoint_motion(UR5E, HOME, PROGRAM, settings=settings), 1e-5
    bounds = np.concatenate([b + piece.law.begin for b, piece in zip(motion.begins, motion.pieces, strict=True)])
    t = np.linspace(0.0, motion.duration, 1500)[1:-1]
    t = t[np.abs(np.subtract.outer(t, bounds)).min(axis=1) > 2.0 * h]
    behind, here, ahead = (motion.sample(t + step) for step in (-h, 0.0, h))
    assert np.abs((ahead.q - behind.q) / (2 * h) - here.dq).max() < 1e-7
    assert np.abs((ahead.dq - behind.dq) / (2 * h) - here.ddq).max() < 1e-5


def test_every_target_is_passed_within_its_zone_and_without_a_stop():
    motion = waypoint_motion(UR5E, HOME, PROGRAM, settings=smooth(UR5E))
    corners = [piece for piece in motion.pieces if piece.place == "corner"]
    assert [piece.move for piece in corners] == [0, 1, 2, 3]
    for begin, piece in zip(motion.begins, motion.pieces, strict=True):
        t = begin + np.linspace(0.0, 1.0, 101) * piece.law.duration
        if piece.place != "corner":
            continue
        assert np.linalg.norm(motion.sample(t).dq, axis=1).min() > 0.02
        assert motion.passing_times[piece.move] == pytest.approx(t[50], abs=1e-9)
    for move, radius in ((0, 0.02), (3, 0.05)):
        target = PROGRAM[move].target
        place = target if isinstance(target, Pose) else forward_kinematics(UR5E, target, frame="tool")
        at = tool_path(motion, motion.passing_times[[move]]).translation[0]
        assert 0.0 < np.linalg.norm(at - place.translation) < radius
    stop = tool_path(motion, motion.passing_times[[4]])
    assert np.abs(stop.translation[0] - shifted(-0.1, 0.1, 0.05).translation).max() < 1e-11


def test_a_right_corner_is_a_parabola_of_the_zone_passed_at_constant_pace():
    moves = [LineMove(target=shifted(0.1), zone=Zone(radius=0.02)), LineMove(target=shifted(0.1, 0.1))]
    motion = waypoint_motion(UR5E, HOME, moves, settings=WaypointSettings(tool=ToolLimits(speed=0.1, acceleration=1.0)))
    (begin,) = (b for b, piece in zip(motion.begins, motion.pieces, strict=True) if piece.place == "corner")
    length = motion.pieces[1].law.duration
    assert length == pytest.approx(2.0 * 0.02 / 0.1, rel=1e-12)  # both legs of the zone, at the mean of its speeds
    u = np.linspace(0.0, 1.0, 21)
    found = tool_path(motion, begin + u * length).translation - shifted(0.1).translation
    assert np.abs(found - 0.02 * np.outer(-((1 - u) ** 2), [1, 0, 0]) - 0.02 * np.outer(u**2, [0, 1, 0])).max() < 1e-12
    speeds = tool_speed(motion, begin + np.array([0.001, 0.5, 0.999]) * length)
    assert speeds == pytest.approx([0.1, 0.1 / np.sqrt(2.0), 0.1], rel=2e-3)


@pytest.mark.parametrize("radius", [0.002, 0.02])
def test_a_zone_between_two_lines_of_one_direction_does_not_change_the_speed(radius: float):
    moves = [LineMove(target=shifted(0.1), zone=Zone(radius=radius)), LineMove(target=shifted(0.2))]
    motion = waypoint_motion(UR5E, HOME, moves, settings=SLOW)
    whole = waypoint_motion(UR5E, HOME, [LineMove(target=shifted(0.2))], settings=SLOW)
    assert motion.duration == pytest.approx(whole.duration, rel=1e-9)
    t = np.linspace(0.0, motion.duration, 60)
    assert np.abs(motion.sample(t).q - whole.sample(t).q).max() < 1e-9


def test_zones_save_time_and_larger_ones_more():
    durations = []
    for zone in (None, Zone(part=0.1), Zone(part=0.3)):
        moves = [replace(move, zone=zone, dwell=0.0) for move in PROGRAM]
        durations.append(waypoint_motion(UR5E, HOME, moves).duration)
    assert durations[0] > durations[1] > durations[2]


def test_speeds_look_ahead_over_many_short_lines():
    angles = np.linspace(0.0, np.pi, 41)[1:]
    moves = [LineMove(target=shifted(0.08 * np.sin(a), 0.08 * (1 - np.cos(a))), zone=Zone(part=0.4)) for a in angles]
    motion = waypoint_motion(UR5E, HOME, moves, settings=SLOW)
    t = np.linspace(0.6, motion.duration - 0.6, 100)
    assert tool_speed(motion, t).min() > 0.099
    one = waypoint_motion(UR5E, HOME, [replace(moves[0], zone=None)], settings=SLOW)
    assert tool_speed(one, np.linspace(0.1, 0.9, 20) * one.duration).max() < 0.06  # 6 mm are too short for 0.1 m/s
    assert motion.duration < 0.08 * np.pi / 0.1 + 0.4  # the way at full speed, and getting there


def test_a_dwell_stands_at_the_target():
    motion = waypoint_motion(UR5E, HOME, [JointMove(target=HOME + 0.2, dwell=0.5), JointMove(target=HOME)])
    arrival = motion.passing_times[0]
    held = motion.sample(arrival + np.linspace(0.01, 0.49, 20))
    assert np.abs(held.q - (HOME + 0.2)).max() == 0.0
    assert not held.dq.any()
    assert not held.ddq.any()
    assert np.abs(motion.sample(np.array([arrival + 0.52])).dq).max() > 0.0


def test_a_line_too_fast_for_a_joint_is_slowed_no_more_than_needed_and_reported():
    quick = WaypointSettings(tool=ToolLimits(speed=3.0, acceleration=100.0, turn_speed=50.0, turn_acceleration=900.0))
    motion = waypoint_motion(UR5E, HOME, [LineMove(target=shifted(0.2, 0.2))], settings=quick)
    (slowed,) = motion.slowed
    assert (slowed.move, slowed.place) == (1, "way")
    assert slowed.factor < 0.6
    quantity, _, joint = slowed.limit.partition(" of ")
    assert quantity in {"speed", "acceleration"}
    limits, samples = motion_limits(UR5E), motion.sample(np.linspace(0.0, motion.duration, 20_001))
    used = {
        "speed": np.abs(samples.dq).max(axis=0) / limits.velocity,
        "acceleration": np.abs(samples.ddq).max(axis=0) / limits.acceleration,
    }
    assert 0.999 < used[quantity][UR5E.joint_names.index(joint)] <= 1.0
    assert max(part.max() for part in used.values()) <= 1.0
    assert str(slowed) == f"move 1: way slowed to {slowed.factor:.1%}, {slowed.limit}"
    assert waypoint_motion(UR5E, HOME, [LineMove(target=shifted(0.2, 0.2))], settings=SLOW).slowed == ()


def test_a_returning_motion_repeats_and_another_stands_where_it_ends():
    moves = [JointMove(target=HOME + 0.4, zone=Zone(part=0.2)), JointMove(target=HOME - 0.3)]
    back = waypoint_motion(UR5E, HOME, moves, settings=WaypointSettings(ending="return"))
    t = np.linspace(0.0, back.duration, 30)[1:-1]
    once, again = back.sample(t), back.sample(t + 3.0 * back.duration)
    assert np.abs(once.q - again.q).max() < 1e-9
    assert np.abs(back.sample(np.array([back.duration])).q - HOME).max() < 1e-12
    closed = waypoint_motion(UR5E, HOME, [*moves, JointMove(target=HOME)])
    assert closed.duration == pytest.approx(back.duration, rel=1e-12)
    stay = waypoint_motion(UR5E, HOME, moves)
    outside = stay.sample(np.array([-1.0, stay.duration, stay.duration + 5.0]))
    assert np.abs(outside.q - [HOME, HOME - 0.3, HOME - 0.3]).max() < 1e-12
    assert not outside.dq.any()
    assert not outside.ddq.any()
    assert stay.passing_times.shape == (2,)


def test_a_motion_survives_pickle_and_its_program_survives_json():
    motion = waypoint_motion(UR5E, HOME, PROGRAM, settings=smooth(UR5E, ending="return"))
    t = np.linspace(0.0, motion.duration, 300)
    expected = motion.sample(t)
    for copy in (
        pickle.loads(pickle.dumps(motion)),  # noqa: S301 - our own
        WaypointMotion.from_dict(json.loads(json.dumps(motion.to_dict()))),
    ):
        found = copy.sample(t)
        assert np.array_equal(found.q, expected.q)
        assert np.array_equal(found.ddq, expected.ddq)
        assert copy.duration == motion.duration
        assert copy.slowed == motion.slowed
    taught = waypoint_motion(UR5E, HOME, [LineMove(target=HOME + 0.1)])
    assert WaypointMotion.from_dict(taught.to_dict()).to_dict() == taught.to_dict()


def test_a_motion_file_gives_the_motion_back(tmp_path: Path):
    motion = waypoint_motion(UR5E, HOME, PROGRAM)
    write_recording(motion.recording(rate=250.0), tmp_path / "motion.parquet")
    read = motion_for(UR5E, tmp_path / "motion.parquet")
    assert motion.duration <= read.duration < motion.duration + 0.004
    samples = read.samples
    assert np.abs(samples.q[-1] - PROGRAM[-1].target).max() < 1e-12
    assert not samples.dq[[0, -1]].any()
    inside = samples.t[1:-1]
    assert np.array_equal(samples.q[1:-1], motion.sample(inside).q)
    assert np.array_equal(samples.ddq[1:-1], motion.sample(inside).ddq)


def refused(*moves: JointMove | LineMove, match: str, settings: WaypointSettings | None = None) -> None:
    with pytest.raises(ExcitationError, match=match):
        waypoint_motion(UR5E, HOME, moves, settings=settings)


def test_moves_that_cannot_be_run_are_refused_by_number():
    first = JointMove(target=HOME + 0.1)
    refused(
        first, LineMove(target=shifted(-0.8)), match=r"ur5e: move 2 (leaves the reach|passes a singularity) of the arm"
    )
    refused(first, JointMove(target=HOME + 9.0), match=r"the target of move 2 is outside the limits of joint 1")
    refused(first, JointMove(target=HOME + 0.1), match=r"move 2 goes nowhere; expected a target other than the last")
    refused(LineMove(target=shifted(0.0)), match="move 1 goes nowhere")
    refused(
        JointMove(target=HOME[:4]), match="the target of move 1: joint positions of another robot; expected 6, got 4"
    )
    refused(LineMove(target=HOME[:4]), match="move 1: joint positions of another robot; expected 6, got 4")
    refused(match="expected one move or more")


def test_a_line_through_a_singularity_is_refused_where_it_is_met():
    over = np.array([0.0, -1.3, 1.6, -1.8, 0.2, 0.0])
    pose = forward_kinematics(UR5E, over, frame="tool")
    mirrored = over.copy()
    mirrored[4] = -0.2
    with pytest.raises(
        ExcitationError, match=r"move 1 passes a singularity of the arm at \d+% of the way; expected smal"
    ):
        waypoint_motion(UR5E, over, [LineMove(target=forward_kinematics(UR5E, mirrored, frame="tool"))])
    near = Pose(rotation=pose.rotation, translation=pose.translation + np.array([0.0, 0.02, 0.0]))
    assert waypoint_motion(UR5E, over, [LineMove(target=near)]).duration > 0.0
    with pytest.raises(ExcitationError, match=r"singular.*>= 0.5"):
        waypoint_motion(UR5E, over, [LineMove(target=near)], settings=WaypointSettings(singular=0.5))


def test_a_line_to_joint_positions_of_another_configuration_is_refused():
    turned = HOME + np.array([0.05, 0.0, 0.0, 0.0, 0.0, -2.0 * np.pi])
    refused(LineMove(target=turned), match=r"move 1: the line ends in another configuration.*of wrist_3_joint, got")


def test_a_line_that_leaves_the_range_of_a_joint_is_refused():
    limits = motion_limits(UR5E)
    tight = replace(limits, lower=HOME - 0.05, upper=HOME + 0.05)
    refused(
        LineMove(target=shifted(0.1)), settings=WaypointSettings(limits=tight),
        match=r"the way of move 1 leaves the range of \w+; expected",
    )  # fmt: skip


def test_lines_need_six_joints():
    arm = planar_arm()
    pose = forward_kinematics(arm, [0.5, 0.5], frame=arm.joint_names[-1])
    with pytest.raises(ExcitationError, match="a line move needs six joints or more; got 2; use joint moves"):
        waypoint_motion(arm, np.zeros(2), [LineMove(target=pose)])
    assert waypoint_motion(arm, np.zeros(2), [JointMove(target=np.ones(2))]).n_v == 2


def test_settings_that_do_not_fit_are_refused():
    move = JointMove(target=HOME + 0.1)
    jerk = motion_limits(UR5E, jerk=np.full(6, 100.0))
    refused(
        move, settings=WaypointSettings(ramps=JerkLimited()), match="need limits of jerk; give limits=motion_limits"
    )
    refused(move, settings=WaypointSettings(limits=jerk), match="trapezoidal ramps cannot keep a limit of jerk")
    refused(move, settings=WaypointSettings(limits=motion_limits(ROBOTS["panda"])), match="limits of another robot")
    refused(move, settings=WaypointSettings(frame="tol"), match="no such frame")
    with pytest.raises(ExcitationError, match="expected stay or return, got loop"):
        WaypointSettings(ending="loop")  # type: ignore[arg-type]
    with pytest.raises(ExcitationError, match="above zero"):
        WaypointSettings(singular=0.0)
    with pytest.raises(ExcitationError, match="tool limits"):
        ToolLimits(speed=-1.0)


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ({"speed": 0.0}, "speed of a move; expected a part"),
        ({"acceleration": 1.5}, "acceleration of a move"),
        ({"dwell": -1.0}, "dwell of a move"),
        ({"dwell": 1.0, "zone": Zone(part=0.1)}, "cannot pass it by"),
    ],
)
def test_moves_with_impossible_values_are_refused(wrong: dict[str, object], match: str):
    for kind in (JointMove, LineMove):
        with pytest.raises(ExcitationError, match=match):
            kind(target=HOME, **wrong)


def test_zones_and_targets_are_checked():
    for wrong in ({}, {"radius": 0.1, "part": 0.1}, {"radius": 0.0}, {"part": 0.5}):
        with pytest.raises(ExcitationError, match="zone"):
            Zone(**wrong)
    with pytest.raises(ExcitationError, match="expected a rotation matrix"):
        LineMove(target=Pose(rotation=2.0 * np.eye(3), translation=np.zeros(3)))


def test_damaged_data_is_refused():
    good = waypoint_motion(UR5E, HOME, PROGRAM[:1]).to_dict()
    for wrong in (
        {**good, "schema": 9},
        {key: value for key, value in good.items() if key != "start"},
        {**good, "moves": [{"kind": "spiral", "target": [], "zone": None}]},
        {**good, "settings": {**good["settings"], "ramps": "sudden"}},
        {**good, "settings": {**good["settings"], "colour": 1}},
    ):
        with pytest.raises(ExcitationError, match=r"damaged|another version|unknown ramps"):
            WaypointMotion.from_dict(wrong)


def test_without_ruckig_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    settings = smooth(UR5E)
    monkeypatch.setitem(__import__("sys").modules, "ruckig", None)
    with pytest.raises(MissingExtraError, match=r"tauhat\[planner\]"):
        waypoint_motion(UR5E, HOME, [JointMove(target=HOME + 0.1)], settings=settings)
    assert waypoint_motion(UR5E, HOME, [JointMove(target=HOME + 0.1)]).settings.ramps == AccelerationLimited()
