"""What a robot program holds beside its language: moves and repeats, and how the controller counts joints and poses."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExportError
from tauhat.excitation.waypoints.moves import Move
from tauhat.files import write_text
from tauhat.robots.kinematics import Pose

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,23}")
_ROUNDING = 1e-9
MOST_REPEATS = 100_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Program:
    """The motion that a text describes; `waypoint_motion(robot, start, moves)` plans it.

    start : (n_v,) where it begins at rest [rad or m]
    repeats : how often the moves run, one after the other
    """

    start: FloatArray
    moves: tuple[Move, ...]
    repeats: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen("start", self.start, (None,), where="program"))
        object.__setattr__(self, "moves", tuple(self.moves))
        if not self.moves:
            raise ExportError("a program without moves")
        if not 1 <= self.repeats <= MOST_REPEATS:
            raise ExportError("repeats of a program", expected=f"1 to {MOST_REPEATS}", got=self.repeats)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControllerJoints:
    """How a controller counts joints: `shown = matrix q + offset`, since vendors' zero poses and signs differ.

    matrix : (n_v, n_v), mostly diagonal with 1 and -1; FANUC counts J3 from the horizontal, so its row has J2 in it
    offset : (n_v,) what the controller shows at q = 0 [rad or m]
    """

    matrix: FloatArray
    offset: FloatArray

    def __post_init__(self) -> None:
        offset = frozen("offset", self.offset, (None,), where="controller joints")
        matrix = frozen("matrix", self.matrix, (offset.size, offset.size), where="controller joints")
        if np.linalg.svd(matrix, compute_uv=False)[-1] < _ROUNDING:
            raise ExportError("the matrix of controller joints cannot be turned round", got=matrix.tolist())
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "offset", offset)

    def shown(self, q: FloatArray) -> FloatArray:
        """Return what the controller shows at joint positions q, (n_v,) [rad or m]."""
        return np.asarray(self.matrix @ q + self.offset)

    def meant(self, shown: FloatArray) -> FloatArray:
        """Return the joint positions at which the controller shows this, (n_v,) [rad or m]."""
        return np.asarray(np.linalg.solve(self.matrix, shown - self.offset))


def signed_joints(sign: FloatArray, offset: FloatArray) -> ControllerJoints:
    """Return `shown = sign q + offset`, joint by joint.

    Parameters
    ----------
    sign : (n_v,) of 1 and -1
    offset : (n_v,) what the controller shows at q = 0 [rad or m]

    Raises
    ------
    ExportError
        when a sign is another number.
    """
    signs = frozen("sign", sign, (None,), where="controller joints")
    if not (np.abs(signs) == 1.0).all():
        raise ExportError("signs of controller joints", expected="1 or -1 each", got=signs.tolist())
    return ControllerJoints(matrix=np.diag(signs), offset=offset)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramSettings:
    """How a program is written for a controller, and so how it has to be read.

    name : of the program, letters, digits and _, at most 24
    repeats : how often the moves run
    approach : part of the speed and acceleration at which the start is approached, a whole percentage
    joints : how the controller counts joints; as the robot does where not stated
    base : the controller's base frame, a pose in the robot's; the same where not stated
    tool : number of the controller's tool data, which must be the frame that lines are planned for
    configuration : FANUC's word for the arm's branch at poses
    """

    name: str = "waypoints"
    repeats: int = 1
    approach: float = 0.1
    joints: ControllerJoints | None = None
    base: Pose | None = None
    tool: int = 1
    configuration: str = "N U T, 0, 0, 0"

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ExportError(
                "name of a program", expected="a letter, then at most 23 letters, digits, _", got=self.name[:60]
            )
        if not 1 <= self.repeats <= MOST_REPEATS:
            raise ExportError("repeats of a program", expected=f"1 to {MOST_REPEATS}", got=self.repeats)
        percent = 100.0 * self.approach
        if not (1.0 - _ROUNDING <= percent <= 100.0 and abs(percent - round(percent)) < _ROUNDING):
            raise ExportError(
                "speed of the approach", expected="a part of whole per cent, 0.01 to 1", got=self.approach
            )
        if not 0 <= self.tool <= 99:
            raise ExportError("number of the tool data", expected="0 to 99", got=self.tool)
        if not re.fullmatch(r"[NF] [UD] [TB], -?\d, -?\d, -?\d", self.configuration):
            raise ExportError(
                "configuration", expected="letters and turns as in N U T, 0, 0, 0", got=self.configuration[:60]
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramText:
    """A program in a controller's language.

    text : the whole file
    unsaid : what the language leaves to the controller, one sentence each; its head comment says the same
    """

    text: str
    unsaid: tuple[str, ...]

    def save(self, path: str | Path) -> Path:
        """Write the file whole or not at all, and return its path.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        write_text(path, self.text)
        return Path(path)
