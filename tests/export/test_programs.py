"""Programs for controllers: what is written, read back and planned again is the same motion; the rest is refused."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from program_samples import TOOL, controller, programs
from scipy.spatial.transform import Rotation

from sample_arms import WORKING_POSES
from tauhat.errors import ExportError
from tauhat.excitation import JointMove, LineMove, WaypointMotion, WaypointSettings, Zone, waypoint_motion
from tauhat.export.programs import DIALECTS, ControllerJoints, ProgramSettings, program_named, signed_joints
from tauhat.robots import Pose, forward_kinematics, load_robot

KEYS = tuple(dialect.key for dialect in DIALECTS)
SIX = ("urscript", "krl", "rapid", "fanuc")
HOME = WORKING_POSES["ur5e"]


def again(key: str, motion: WaypointMotion, settings: ProgramSettings) -> tuple[WaypointMotion, int]:
    """Return the motion planned from the text of its program, and how often that runs it."""
    dialect = program_named(key)
    text = dialect.write(motion, settings=settings).text
    program = dialect.read(text, motion.robot, planned=motion.settings, settings=settings)
    planned = waypoint_motion(motion.robot, program.start, program.moves, settings=motion.settings)
    return planned, program.repeats


@pytest.fixture(scope="module")
def ur5e():
    return load_robot("ur5e")


def planned(robot, *moves, ending="stay"):
    return waypoint_motion(robot, HOME, moves, settings=WaypointSettings(tool=TOOL, ending=ending))


def below(robot, depth=0.1):
    pose = forward_kinematics(robot, HOME, frame="tool")
    return Pose(rotation=pose.rotation, translation=pose.translation - np.array([0.0, 0.0, depth]))


@pytest.mark.parametrize("key", KEYS)
def test_random_programs_written_read_and_planned_again_are_the_same_motion(key: str):
    kinds = set()
    for seed, motion in programs(key, 10):
        settings = controller(seed)
        found, repeats = again(key, motion, settings)
        assert repeats == settings.repeats
        assert found.duration == pytest.approx(motion.duration, abs=1e-6)
        t = np.linspace(0.0, motion.duration, 151)
        assert np.abs(found.sample(t).q - motion.sample(t).q).max() < 1e-6, f"seed {seed}"
        kinds |= {(type(move), move.zone is None, move.dwell > 0.0) for move in motion.moves}
    assert len(kinds) == 6  # both moves: stopping, passing by, dwelling


@pytest.mark.parametrize("key", ["csv", "toml"])
def test_tables_hold_robots_with_seven_joints_and_lines_to_joint_positions(key: str):
    robot = load_robot("panda")
    start = np.array([0.0, -0.4, 0.2, -1.9, 0.1, 1.7, 0.7])
    target = waypoint_motion(robot, start, [LineMove(target=_lower(robot, start))]).pieces[-1].curve.end
    motion = waypoint_motion(robot, start, [LineMove(target=target), JointMove(target=start + 0.1)])
    found, _ = again(key, motion, ProgramSettings())
    t = np.linspace(0.0, motion.duration, 50)
    assert np.array_equal(found.sample(t).q, motion.sample(t).q)


def _lower(robot, start):
    pose = forward_kinematics(robot, start, frame=WaypointSettings().tool_frame(robot))
    return Pose(rotation=pose.rotation, translation=pose.translation - np.array([0.0, 0.0, 0.05]))


@pytest.mark.parametrize("key", SIX)
def test_lines_to_joint_positions_are_the_same_motion(key: str, ur5e):
    end = planned(ur5e, LineMove(target=below(ur5e))).pieces[-1].curve.end
    motion = planned(ur5e, LineMove(target=end, speed=0.5), JointMove(target=HOME + 0.2))
    found, _ = again(key, motion, ProgramSettings())
    t = np.linspace(0.0, motion.duration, 50)
    assert np.abs(found.sample(t).q - motion.sample(t).q).max() < 1e-6


def test_joints_that_a_controller_couples_come_back(ur5e):
    matrix = np.eye(6)
    matrix[2, 1] = 1.0  # J3 from the horizontal
    joints = ControllerJoints(matrix=matrix, offset=np.array([0.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0]))
    motion = planned(ur5e, JointMove(target=HOME + 0.2, speed=0.5))
    settings = ProgramSettings(joints=joints)
    text = program_named("fanuc").write(motion, settings=settings).text
    shown = np.rad2deg([0.2, -1.1 + np.pi / 2, 1.8 - 1.1])
    assert f"J1= {shown[0]:.6f}"[:12] in text
    assert f"J2= {shown[1]:.6f}"[:12] in text
    assert f"J3= {shown[2]:.6f}"[:12] in text
    found, _ = again("fanuc", motion, settings)
    assert np.abs(found.moves[0].target - motion.moves[0].target).max() < 1e-9


def lines_of(key, motion, **settings):
    text = program_named(key).write(motion, settings=ProgramSettings(**settings)).text
    return [line.strip() for line in text.splitlines()]


def test_every_program_says_that_it_is_to_be_run_slowly_first(ur5e):
    motion = planned(ur5e, JointMove(target=HOME + 0.2))
    for key in KEYS:
        text = " ".join(program_named(key).write(motion).text.replace("!", " ").split())
        assert "RUN IT SLOWLY FIRST" in text


def test_urscript_says_the_leading_axis_metres_and_blend_radii(ur5e):
    # All joints of a UR5e have one speed limit, so the joint with the longest way runs at 0.5 of it.
    target = HOME + np.array([0.1, 0.2, 0.0, -0.4, 0.0, 0.0])
    dwelling = JointMove(target=target, speed=0.5, acceleration=0.25, dwell=0.25)
    radius = LineMove(target=below(ur5e), speed=0.5, acceleration=0.5, zone=Zone(radius=0.02))
    motion = planned(
        ur5e, JointMove(target=HOME + 0.1), dwelling, JointMove(target=HOME), radius, JointMove(target=HOME)
    )
    limits = motion.settings.joint_limits(ur5e)
    text = lines_of("urscript", motion)
    speed = f"v={0.5 * limits.velocity[3]:.6f}"
    (found,) = [line for line in text if line.startswith("movej([0.1,-1.1,1.6,-2.2,-1.4,0.0]")]
    assert speed in found
    assert "sleep(0.25)" in text
    (line,) = [line for line in text if line.startswith("movel(p[")]
    assert line.endswith("a=2.0, v=0.25, r=0.02)")


def test_krl_says_per_cent_of_axes_and_zones_as_parts_of_half_a_way(ur5e):
    moves = [JointMove(target=np.deg2rad([10.0, -80.0, 95.5, -100.0, -80.0, 5.0]), speed=0.4, zone=Zone(part=0.3))]
    motion = planned(ur5e, *moves, JointMove(target=HOME, dwell=0.5), LineMove(target=below(ur5e), speed=0.4))
    text = lines_of("krl", motion, repeats=1)
    assert "PTP {A1 10.0, A2 -80.0, A3 95.5, A4 -100.0, A5 -80.0, A6 5.0} C_PTP" in text
    assert text[text.index("$APO.CPTP = 60") - 2] == "BAS(#VEL_PTP, 40)"
    assert "WAIT SEC 0.5" in text
    assert {"$VEL.CP = 0.2", "$ACC.CP = 4.0", f"$VEL.ORI1 = {np.rad2deg(0.8):.12f}"} <= set(text)


def test_rapid_says_speed_data_in_millimetres_and_degrees_and_known_zones(ur5e):
    base = Pose(rotation=below(ur5e).rotation, translation=below(ur5e).translation - np.array([0.5, 0.25, 0.125]))
    first = LineMove(target=below(ur5e), speed=0.4, zone=Zone(radius=0.02))
    motion = planned(ur5e, first, LineMove(target=below(ur5e, 0.2)), JointMove(target=HOME))
    settings = ProgramSettings(base=Pose(rotation=np.eye(3), translation=base.translation), tool=2)
    text = program_named("rapid").write(motion, settings=settings).text
    assert "MoveL [[500.0,250.0,125.0],[" in text
    turn = np.rad2deg(0.8)
    data = f"[200.0,{turn:.12f},200.0,{turn:.12f}]"
    assert rf"],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], {data}, z20, tool2 \WObj:=wobj0;" in text
    assert r"PathAccLim TRUE \AccMax:=4.0, TRUE \DecelMax:=4.0;" in text


def test_fanuc_says_cnt_and_waits_in_hundredths(ur5e):
    first = JointMove(target=np.deg2rad([10.0, -80.0, 95.5, -100.0, -80.0, 5.0]), speed=0.5, zone=Zone(part=0.2))
    motion = planned(ur5e, first, JointMove(target=HOME, dwell=0.2), LineMove(target=below(ur5e), speed=0.5))
    text = lines_of("fanuc", motion)
    assert any(line.endswith(":J P[2] 50% CNT50 ACC100 ;") for line in text)
    assert any(line.endswith("WAIT 0.20(sec) ;") for line in text)
    assert any(line.endswith(":L P[4] 250mm/sec FINE ACC100 ;") for line in text)
    assert "J1= 10.0 deg, J2= -80.0 deg, J3= 95.5 deg," in text


def test_repeats_are_a_loop_around_the_moves_and_not_the_approach(ur5e):
    motion = planned(ur5e, JointMove(target=HOME + 0.2, speed=0.5), ending="return")
    loops = {"urscript": "while done < 7:", "krl": "FOR i = 1 TO 7", "rapid": "FOR i FROM 1 TO 7 DO"}
    for key, loop in loops.items():
        text = lines_of(key, motion, repeats=7)
        moves = [number for number, line in enumerate(text) if line.startswith(("movej", "PTP", "MoveAbsJ"))]
        assert moves[0] < text.index(loop) < moves[1]
        assert len(moves) == 3
    assert any(line.endswith("FOR R[1]=1 TO 7 ;") for line in lines_of("fanuc", motion, repeats=7))


def refused(key, motion, **settings):
    with pytest.raises(ExportError) as caught:
        program_named(key).write(motion, settings=ProgramSettings(**settings))
    return str(caught.value)


def test_what_a_language_has_no_word_for_is_refused_by_the_move(ur5e):
    odd = planned(ur5e, JointMove(target=HOME + 0.2), JointMove(target=HOME, speed=0.123))
    for key in ("krl", "fanuc"):
        assert refused(key, odd).startswith("move 2: the language has no word for this percentage of speed")
    by_part = planned(ur5e, JointMove(target=HOME + 0.2, zone=Zone(part=0.2)), JointMove(target=HOME))
    for key in ("urscript", "rapid"):
        assert refused(key, by_part).startswith("move 1")
    by_radius = planned(ur5e, JointMove(target=HOME + 0.2, zone=Zone(radius=0.01)), JointMove(target=HOME))
    assert "Zone(part=...)" in refused("fanuc", by_radius)
    assert "Zone(part=...) between joint moves" in refused("krl", by_radius)
    mixed = planned(ur5e, JointMove(target=HOME + 0.2, zone=Zone(part=0.2)), LineMove(target=below(ur5e)))
    assert "sizes a zone between a joint move and a line twice" in refused("krl", mixed)
    slow = planned(ur5e, JointMove(target=HOME + 0.2, acceleration=0.1))
    assert "RAPID knows no acceleration this low" in refused("rapid", slow)
    slow_line = planned(ur5e, LineMove(target=below(ur5e), acceleration=0.02))
    assert "at least 0.1 m/s^2" in refused("rapid", slow_line)
    waiting = planned(ur5e, JointMove(target=HOME + 0.2, dwell=0.123))
    assert "dwell" in refused("fanuc", waiting)
    wide = [LineMove(target=below(ur5e, depth), zone=Zone(radius=0.06)) for depth in (0.1, 0.2)]
    assert refused("urscript", planned(ur5e, *wide, JointMove(target=HOME))).startswith("move 2: blend radii overlap")


def test_a_turn_on_the_spot_has_no_speed_in_fanuc(ur5e):
    here = forward_kinematics(ur5e, HOME, frame="tool")
    turned = here.rotation @ np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    motion = planned(ur5e, LineMove(target=Pose(rotation=turned, translation=here.translation)))
    assert "turn on the spot" in refused("fanuc", motion)


def test_motions_that_do_not_come_back_and_robots_of_other_joints_are_refused(ur5e):
    away = planned(ur5e, JointMove(target=HOME + 0.2))
    assert "does not come back" in refused("krl", away, repeats=2)
    assert refused("csv", away, joints=signed_joints(np.ones(5), np.zeros(5))).startswith("ur5e: controller joints")
    panda = load_robot("panda")
    start = np.array([0.0, -0.4, 0.2, -1.9, 0.1, 1.7, 0.7])
    motion = waypoint_motion(panda, start, [JointMove(target=start + 0.1)])
    assert "6 revolute joints, got 7 revolute" in refused("rapid", motion)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"name": "1st"}, "name of a program"),
        ({"name": "x\nend"}, "name of a program"),
        ({"repeats": 0}, "repeats"),
        ({"approach": 0.125}, "approach"),
        ({"tool": -1}, "tool data"),
        ({"configuration": "N U T', 0"}, "configuration"),
    ],
)
def test_settings_that_cannot_be_written_are_refused(fields, message):
    with pytest.raises(ExportError, match=message):
        ProgramSettings(**fields)


def test_joints_that_cannot_be_turned_back_and_unknown_names_are_refused():
    with pytest.raises(ExportError, match="cannot be turned round"):
        ControllerJoints(matrix=np.zeros((2, 2)), offset=np.zeros(2))
    with pytest.raises(ExportError, match="1 or -1"):
        signed_joints(np.array([1.0, 0.5]), np.zeros(2))
    with pytest.raises(ExportError, match="did you mean rapid"):
        program_named("rapit")


def read(key, text, robot, **fields):
    return program_named(key).read(text, robot, planned=WaypointSettings(tool=TOOL), settings=ProgramSettings(**fields))


STRANGE = {
    "urscript": "  set_digital_out(1, True)",
    "krl": "$OUT[1] = TRUE",
    "rapid": "    SetDO do1, 1;",
    "fanuc": "   9:  DO[1]=ON ;",
}


LAST = {"urscript": "  movej([0.2", "krl": "END", "rapid": "ENDPROC", "fanuc": ":J P[2]"}


@pytest.mark.parametrize("key", SIX)
def test_an_unknown_statement_is_named_with_its_line(key: str, ur5e):
    motion = planned(ur5e, JointMove(target=HOME + 0.2), JointMove(target=HOME))
    lines = program_named(key).write(motion).text.splitlines()
    place = next(number for number, line in enumerate(lines) if LAST[key] in line)
    lines.insert(place, STRANGE[key])
    with pytest.raises(ExportError, match=f"line {place + 1}: unknown statement; got"):
        read(key, "\n".join([*lines, ""]), ur5e)


@pytest.mark.parametrize("key", SIX)
def test_a_program_that_is_cut_off_anywhere_is_refused(key: str, ur5e):
    motion = planned(ur5e, JointMove(target=HOME + 0.2), LineMove(target=below(ur5e)), ending="return")
    lines = program_named(key).write(motion, settings=ProgramSettings(repeats=2)).text.splitlines()
    for count in range(len(lines)):
        with pytest.raises(ExportError):
            read(key, "\n".join([*lines[:count], ""]), ur5e)


@pytest.mark.parametrize(
    ("key", "old", "new", "message"),
    [
        ("urscript", "v=0.5", "v=0.75", "the speed is beyond"),
        ("urscript", "sleep(0.1)", "sleep(0.1)\n  sleep(0.1)", "two dwells"),
        ("krl", "$VEL.CP = 0.5", "$VEL.CP = 0.51", "the speed is beyond"),
        ("krl", "$VEL.ORI1 = 114", "$VEL.ORI1 = 90", "another part of its limit"),
        ("krl", "BAS(#TOOL, 1)", "BAS(#TOOL, 2)", "unknown statement"),
        ("rapid", "VelSet 100,", "VelSet 50,", "a line under VelSet"),
        ("rapid", "DecelMax:=4.0", "DecelMax:=3.0", "two values"),
        ("rapid", "[500.0,114", "[500.0,90", "turns are another part"),
        ("rapid", "fine, tool1", "z7, tool1", "unknown zone data"),
        ("fanuc", "UT : 1", "UT : 3", "unknown statement"),
        ("fanuc", "L P[2]", "L P[9]", "P\\[9\\] is not among"),
        ("fanuc", "L P[2] 500mm", "J P[2] 50%", "unknown statement|joint move to a pose"),
        ("csv", "line,", "circle,", "line 13: a move|a move"),
        ("toml", "dwell", "pause", "unknown field of a move; got pause"),
    ],
)
def test_what_cannot_be_is_refused(key, old, new, message, ur5e):
    motion = planned(ur5e, LineMove(target=below(ur5e), dwell=0.1), JointMove(target=HOME))
    text = program_named(key).write(motion).text
    assert old in text
    with pytest.raises(ExportError, match=message):
        read(key, text.replace(old, new), ur5e)


PTP = "PTP {A1 10.0, A2 -80.0, A3 95.5, A4 -100.0, A5 -80.0, A6 5.0}"
LIN = "LIN {X 1.0, Y 2.0, Z 3.0, A 4.0, B 5.0, C 6.0}"
SET = "BAS(#VEL_PTP, 50)\nBAS(#ACC_PTP, 50)"
RATES = "$VEL.CP = 0.5\n$ACC.CP = 4.0"
TURNS = "$VEL.ORI1 = {0}\n$VEL.ORI2 = {0}\n$ACC.ORI1 = {1}\n$ACC.ORI2 = {1}".format(*np.rad2deg([2.0, 16.0]))


@pytest.mark.parametrize(
    ("statements", "message"),
    [
        ([PTP, PTP], "line 2: a move before VEL_PTP is set"),
        ([RATES, TURNS, LIN], "a line before the first joint move"),
        ([PTP, SET, PTP, "FOR i = 1 TO 2"], "a loop that does not hold the whole motion"),
        ([PTP, "FOR i = 1 TO 2", SET, PTP, "ENDFOR", PTP], "line 7: a move behind the end"),
        ([PTP, "FOR i = 1 TO 2", SET, PTP, "ENDFOR", "ENDFOR"], "line 7: an end without a loop"),
        ([PTP, SET, PTP, "FOR i = 1 TO 2", "END"], "a loop that"),
        ([PTP, "FOR i = 1 TO 0", SET, PTP, "ENDFOR", "END"], "repeats of a program"),
        ([PTP, "WAIT SEC 1.0"], "a dwell outside the motion"),
        ([PTP, SET, "$APO.CPTP = 40", PTP + " C_PTP", "WAIT SEC 1.0"], "cannot pass it by"),
        ([PTP, "END"], "no moves"),
        ([PTP, SET, PTP], "the end is missing"),
        (["; " + 9_000_000 * "x"], "too long a program"),
    ],
)
def test_programs_of_another_shape_are_refused(statements, message, ur5e):
    with pytest.raises(ExportError, match=message):
        read("krl", "\n".join(statements), ur5e)


def test_a_program_written_by_hand_is_read(ur5e):
    found = read("krl", "\n".join([PTP, SET, "$APO.CPTP = 40", PTP + " C_PTP", RATES, TURNS, LIN, "END"]), ur5e)
    joint, line = found.moves
    assert np.rad2deg(found.start) == pytest.approx([10.0, -80.0, 95.5, -100.0, -80.0, 5.0])
    assert (joint.speed, joint.acceleration, joint.zone.part) == (0.5, 0.5, 0.2)
    assert line.target.translation == pytest.approx([0.001, 0.002, 0.003])
    assert line.target.rotation == pytest.approx(Rotation.from_euler("ZYX", [4.0, 5.0, 6.0], degrees=True).as_matrix())
    assert (line.speed, line.acceleration) == (1.0, 1.0)


@pytest.mark.parametrize("key", KEYS)
def test_a_wrong_letter_anywhere_is_read_or_refused_and_nothing_else(key: str, ur5e):
    motion = planned(ur5e, LineMove(target=below(ur5e), dwell=0.1), JointMove(target=HOME, speed=0.5), ending="return")
    text, rng = program_named(key).write(motion).text, np.random.default_rng(3)
    refusals = []
    for _ in range(60):
        place, letter = int(rng.integers(len(text))), chr(int(rng.integers(32, 127)))
        with suppress(ExportError):  # any other error fails
            refusals.append(place)
            read(key, text[:place] + letter + text[place + 1 :], ur5e)
            refusals.pop()
    assert len(refusals) >= 5


def test_a_saved_program_is_its_text(tmp_path, ur5e):
    program = program_named("krl").write(planned(ur5e, JointMove(target=HOME + 0.2)))
    assert program.save(tmp_path / "run.src").read_text(encoding="utf-8") == program.text
    assert all(f"; {sentence}" in program.text for sentence in program.unsaid)


def test_a_plan_that_is_slowed_says_so(ur5e):
    fast = replace(TOOL, speed=5.0, acceleration=80.0)
    moves = [LineMove(target=below(ur5e, 0.3))]
    motion = waypoint_motion(ur5e, HOME, moves, settings=WaypointSettings(tool=fast))
    assert motion.slowed
    assert any("The plan slows 1 " in sentence for sentence in program_named("krl").write(motion).unsaid)
