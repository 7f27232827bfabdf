"""`task.toml`: every key is read, every mistake is one line that says where."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tauhat.errors import ExcitationError
from tauhat.excitation import AOptimal, GeneticSettings, Mixed, ToolLimits
from tauhat.excitation.task_design import (
    BoxRegion,
    Freedom,
    PathRegion,
    PosesRegion,
    TaskStage,
    load_task,
    parse_task,
    task_file,
    two_stages,
)
from tauhat.robots import Pose, forward_kinematics, load_robot

UR5E = load_robot("ur5e")
EXAMPLE = Path(__file__).parents[2] / "examples" / "task.toml"
HOME = "home = [0.3, -1.3, 1.6, -1.8, -1.4, 0]\n"
Q = np.array([0.3, -1.3, 1.6, -1.8, -1.4, 0.0])
BOX = '[region]\nkind = "box"\nlower = [-0.6, -0.4, 0.2]\nupper = [-0.4, -0.2, 0.4]\n'
STAGE = '[[stages]]\nname = "one"\ncolumns = ["gravity"]\n'


def pose_at_home() -> Pose:
    return forward_kinematics(UR5E, Q, frame="tool")


def test_what_is_not_stated_is_as_the_settings_have_it():
    task = parse_task(HOME + BOX, UR5E)
    assert isinstance(task.region, BoxRegion)
    assert task.home.tolist() == Q.tolist()
    assert task.frame == "tool"
    assert task.stages == two_stages()
    assert task.tool == ToolLimits()
    assert (task.genetic, task.islands, task.margin) == (GeneticSettings(population=40, generations=40), 2, 0.05)
    assert isinstance(task.criterion, Mixed)
    assert task.limits is None
    assert task.region.freedom == Freedom()
    assert np.allclose(task.region.rotation, pose_at_home().rotation)


def test_a_box_has_its_corners_and_the_orientation_of_its_rpy():
    task = parse_task(HOME + BOX + "rpy = [0.1, 0.2, 0.3]\ntilt = 0.2\nspin = 0.5\n", UR5E)
    region = task.region
    assert isinstance(region, BoxRegion)
    assert (region.lower.tolist(), region.upper.tolist()) == ([-0.6, -0.4, 0.2], [-0.4, -0.2, 0.4])
    assert np.allclose(region.rotation, Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix())
    assert region.freedom == Freedom(tilt=0.2, spin=0.5)


def test_taught_positions_in_degrees_and_home_too_are_the_poses_of_the_arm():
    degrees = np.rad2deg(Q).tolist()
    text = f'[home]\nq = {degrees}\nunit = "deg"\n[region]\nkind = "poses"\nposes = [{degrees}]\nunit = "deg"\n'
    task = parse_task(text + "clearance = 0.03\n", UR5E)
    assert isinstance(task.region, PosesRegion)
    assert np.allclose(task.home, Q)
    (pose,) = task.region.poses
    assert np.allclose(pose.translation, pose_at_home().translation)
    assert np.allclose(pose.rotation, pose_at_home().rotation)
    assert task.region.clearance == 0.03


def test_poses_and_points_may_be_stated_as_poses():
    text = '[region]\nkind = "poses"\n[[region.poses]]\nxyz = [0.1, 0.2, 0.3]\nrpy = [0, 0, 0.5]\n'
    region = parse_task(HOME + text + "[[region.poses]]\nxyz = [0.2, 0.2, 0.3]\n", UR5E).region
    assert isinstance(region, PosesRegion)
    first, second = region.poses
    assert first.translation.tolist() == [0.1, 0.2, 0.3]
    assert np.allclose(first.rotation, Rotation.from_euler("z", 0.5).as_matrix())
    assert np.allclose(second.rotation, pose_at_home().rotation)
    text = '[region]\nkind = "path"\nrpy = [0, 0, 1]\n[[region.points]]\nxyz = [0, 0, 0]\nrpy = [0, 0, 0.5]\n'
    region = parse_task(HOME + text + "[[region.points]]\nxyz = [1, 0, 0]\n", UR5E).region
    assert isinstance(region, PathRegion)
    turns = [Rotation.from_matrix(pose.rotation).as_rotvec()[2] for pose in region.poses]
    assert turns == pytest.approx([0.5, 1.0])


def test_every_key_of_a_stage_of_lines_and_of_the_search_is_read():
    stage = (
        '[[stages]]\nname = "slow"\ncolumns = ["gravity", "friction"]\npoints = 7\nseconds = 12\nspeed = [0.1, 0.3]\n'
        'acceleration = [0.2, 0.4]\nzone = 0.2\nradius = 0.04\ndwell = 0.5\nmoves = "line"\nweight = 2\n'
    )
    rest = "[line]\nspeed = 0.4\nturn_jerk = 100\n[search]\npopulation = 9\nislands = 3\nmargin = 0.1\n"
    task = parse_task(HOME + BOX + stage + rest + 'criterion = "a"\n', UR5E)
    assert task.stages == (
        TaskStage(
            name="slow", counted=("gravity", "friction"), points=7, seconds=12.0, speed=(0.1, 0.3),
            acceleration=(0.2, 0.4), zone=0.2, radius=0.04, dwell=0.5, moves="line", weight=2.0,
        ),
    )  # fmt: skip
    assert task.tool == ToolLimits(speed=0.4, turn_jerk=100.0)
    assert task.genetic == GeneticSettings(population=9, generations=40)
    assert (task.islands, task.margin, type(task.criterion)) == (3, 0.1, AOptimal)


def test_the_example_and_the_text_that_explains_the_file_are_tasks():
    assert [stage.name for stage in load_task(EXAMPLE, UR5E).stages] == ["fast", "slow"]
    assert task_file.__doc__ is not None
    shown = parse_task(task_file.__doc__.partition("\n\n")[2], UR5E)
    keys = {*task_file._STAGE_KEYS, *task_file._SEARCH_KEYS, *task_file._SECTIONS}
    keys |= {key for known in task_file._REGION_KEYS.values() for key in known}
    assert {key for key in keys if not re.search(rf"\b{key}\b", task_file.__doc__)} == set()
    assert shown.islands == 2


MISTAKES = {
    "no TOML": ("home = [", "task: not valid TOML"),
    "unknown section": (HOME + BOX + "[regoin]", "task: unknown key; got regoin; did you mean region?"),
    "no home": (BOX, "task: a key is missing; expected home"),
    "short home": ("home = [1]\n" + BOX, "task: home has the wrong form; expected 6 numbers"),
    "unit of home": ('[home]\nq = [0,0,0,0,0,0]\nunit = "turns"\n' + BOX, r"\[home\]: unknown unit; expected rad"),
    "key of home": ("[home]\nq = [0,0,0,0,0,0]\np = 1\n" + BOX, r"\[home\]: unknown key; got p"),
    "frame": (HOME + 'frame = "tip"\n' + BOX, "tool: no such frame; got tip"),
    "no region": (HOME, "task: a region is missing"),
    "kind": (HOME + '[region]\nkind = "ball"', r"\[region\]: unknown kind; expected box \| poses \| path, got ball"),
    "key of another kind": (HOME + BOX + "clearance = 0.1", r"\[region\]: unknown key; got clearance"),
    "tilt": (HOME + BOX + "tilt = 4", "tilt of a region; expected 0 to pi"),
    "corners": (HOME + BOX.replace("0.2, 0.4]", "0.2, 0.1]"), "corners of a box region; expected lower <= upper"),
    "no list of poses": (HOME + '[region]\nkind = "poses"\nposes = 3', r"poses has the wrong form; expected a list"),
    "short pose": (HOME + '[region]\nkind = "poses"\nposes = [[1]]', r"\[region\], pose 1: pose has the wrong form"),
    "key of a pose": (
        HOME + '[region]\nkind = "poses"\nposes = [{xyz = [0,0,0], pry = [0,0,0]}]',
        r"\[region\], pose 1: unknown key; got pry; did you mean rpy",
    ),
    "clearance": (
        HOME + '[region]\nkind = "poses"\nclearance = -1\nposes = [[0,0,0,0,0,0]]', "clearance of a region",
    ),
    "one point": (HOME + '[region]\nkind = "path"\npoints = [[0,0,0]]', "a region along a path; expected two points"),
    "key of a stage": (HOME + BOX + STAGE + "zones = 1", "stage 1: unknown key; got zones; did you mean zone"),
    "no stage": ("stages = []\n" + HOME + BOX, "stages of a task; expected one or more"),
    "columns": (HOME + BOX + '[[stages]]\nname = "a"\ncolumns = "gravity"', "stage 1: columns has the wrong form"),
    "block": (HOME + BOX + '[[stages]]\nname = "a"\ncolumns = ["mass"]', "unknown block of columns; expected inertial"),
    "half a point": (HOME + BOX + STAGE + "points = 2.5", "points is no whole number; expected 1 to 100000, got 2.5"),
    "radius": (HOME + BOX + STAGE + "radius = 0", "stage one: radius of zones; expected a length of at least 0.001 m"),
    "speed": (HOME + BOX + STAGE + "speed = [0.001, 1]", "stage one: speed; expected parts, 0.01 <= least"),
    "line": (HOME + BOX + "[line]\nspeed = -1", "tool limits; expected finite numbers above zero"),
    "key of line": (HOME + BOX + "[line]\npace = 1", r"\[line\]: unknown key; got pace"),
    "search": (HOME + BOX + "[search]\npopulation = 2", "too small a genetic search"),
    "criterion": (HOME + BOX + '[search]\ncriterion = "best"', "unknown criterion; expected"),
    "margin": (HOME + BOX + "[search]\nmargin = 1.5", r"\[search\]: margin; expected a part, 0 <= margin < 1, got 1.5"),
    "islands": (HOME + BOX + "[search]\nislands = 0", "islands is no whole number"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_one_line_that_says_where(text: str, message: str):
    with pytest.raises(ExcitationError, match=message) as caught:
        parse_task(text, UR5E)
    assert str(caught.value).startswith("task")
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(ExcitationError, match=r"nowhere\.toml: no such file"):
        load_task(tmp_path / "nowhere.toml", UR5E)
