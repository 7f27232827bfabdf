"""The file of a new project, every key explained."""

from __future__ import annotations

import os
from pathlib import Path

from tauhat.errors import OutputError
from tauhat.files import write_text
from tauhat.project.project_file import NAME
from tauhat.robots.library import builtin_names, load_robot

_TEXT = """\
# One robot's whole way. `tauhat run` in this folder makes what is not up to date; everything it makes is in here.
# Change a value, run again: only what hangs on it is made anew.

[robot]
source = {source}        # a built-in name, or a .urdf or .toml file, from this folder
# locked = {{ finger_joint = 0.0 }}   # joints frozen at a position [rad or m]

[motion]                       # designed, inside the joint limits at all times; or: file = "motion.parquet"
seconds = 10.0                 # of one period [s]
periods = 2                    # how often it runs
harmonics = 5
starts = 3                     # random starts of the search: its budget
seed = 0
# limits = "limits.toml"       # torque, tool, collisions and obstacles

[record]
kind = "simulate"              # a simulated robot whose truth is known
spread = 0.1                   # how far it is from its description, relative
rate = 500.0                   # [Hz]
seed = 0                       # of the noise
robot_seed = 0                 # of the truth
# sensors = "cobot"            # named sensors instead of 2 % torque noise
# experiment = "experiment.toml"   # a whole experiment instead of all these

# The real robot instead; a run stops where logs are missing and says what to record:
# [record]
# kind = "logs"
# logs = ["recordings/run_1.csv"]
# map = "recordings/map.toml"  # by default the one beside each log

[identify]
model = "robust"               # robust, plain, auto, terms, or a .toml file
estimator = "wls"
constraints = "physical"       # none, physical, or a .toml file
# cutoff = 10.0                # [Hz]; chosen from the data by default

[verify]                       # a random motion of the simulated robot; of a real one: logs = ["recordings/run_2.csv"]
seconds = 20.0
seed = 1

[report]
# title = "My arm"

[export]                       # needs constraints
formats = ["urdf", "mjcf", "c"]
"""


def write_new_project(path: str | Path, robot: str) -> Path:
    """Write the file of a new project, and return its path; a folder is made where there is none.

    Parameters
    ----------
    path : the file, or the folder that shall hold `project.toml`
    robot : a built-in name or a robot's file

    Raises
    ------
    OutputError
        when there is such a file, or none can be written.
    RobotError
        when there is no such robot.
    """
    load_robot(robot)
    place = Path(path) if Path(path).suffix.lower() == ".toml" else Path(path) / NAME
    if place.exists():
        raise OutputError("there is a project already", where=place, remedy="choose another folder")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError("the folder cannot be made", where=place.parent, got=error.strerror) from error
    source = robot if robot in builtin_names() else Path(os.path.relpath(robot, place.parent)).as_posix()
    write_text(place, _TEXT.format(source=_quoted(source)))
    return place


def _quoted(text: str) -> str:
    """Return the text as a TOML string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
