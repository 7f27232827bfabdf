"""Robots from Denavit-Hartenberg tables, standard and modified."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.robots.dh_table import DhRow, DhTable, read_dh_table
from tauhat.robots.inertia_checks import warn_of_massless_links
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Frame, Robot
from tauhat.robots.source import DescriptionSource, source_from_file, source_from_text
from tauhat.robots.transforms import moved_inertia, shift, turn_x, turn_z

_MOST_BYTES = 100_000


def robot_from_dh(source: str | Path) -> Robot:
    r"""Return the robot that a DH table in TOML describes.

    A joint is one row: `a`, `d` in metres, `alpha`, `theta` in radians (`angle_unit = "deg"` for degrees), `theta`
    the offset of a revolute joint's variable and `d` that of a prismatic one's. With `T` a link's pose in the last:

    - standard: `T_i = RotZ(theta_i + q_i) TransZ(d_i) TransX(a_i) RotX(alpha_i)`
    - modified: `T_i = RotX(alpha_{i-1}) TransX(a_{i-1}) RotZ(theta_i + q_i) TransZ(d_i)`

    Frames: `base`, `dh_1` to `dh_n` (the frames of the convention) and `tool`. Without masses the robot is kinematic
    only, which is enough to identify one.

    Parameters
    ----------
    source : path of a file, or the table itself (text of more than one line)

    Raises
    ------
    RobotError
        not TOML, an unknown key, or numbers that cannot be right.

    Examples
    --------
    >>> slide = robot_from_dh('convention = "modified"\n[[joints]]\nname = "x"\nkind = "prismatic"')
    >>> slide.joints[0].unit, slide.has_inertia
    ('m', False)
    """
    content = _read(source)
    table = read_dh_table(content)
    robot = _standard(table, content) if table.convention == "standard" else _modified(table, content)
    warn_of_massless_links(robot)
    return robot


def _read(source: str | Path) -> DescriptionSource:
    if isinstance(source, str) and "\n" in source:
        return source_from_text(source, most_bytes=_MOST_BYTES)
    return source_from_file(source, most_bytes=_MOST_BYTES)


def _standard(table: DhTable, source: DescriptionSource) -> Robot:
    """Joint frame i is DH frame i-1 moved by q_i, so that z is the joint's axis; DH frame i is fixed in it."""
    placement, joints, frames = table.base, [], []
    for index, row in enumerate(table.rows):
        link = turn_z(row.theta) @ shift(row.a, 0.0, row.d) @ turn_x(row.alpha)
        joints.append(_joint(row, index, placement, moved_inertia(row.inertia, link)))
        frames.append(_frame(f"dh_{index + 1}", index, link))
        placement = link
    return _robot(table, joints, [*frames, _frame("tool", len(joints) - 1, placement @ table.tool)], source)


def _modified(table: DhTable, source: DescriptionSource) -> Robot:
    """Joint frame i is DH frame i itself: its axis z is the joint's."""
    joints, frames = [], []
    for index, row in enumerate(table.rows):
        before = table.base if index == 0 else np.eye(4)
        placement = before @ turn_x(row.alpha) @ shift(row.a, 0.0, 0.0) @ turn_z(row.theta) @ shift(0.0, 0.0, row.d)
        joints.append(_joint(row, index, placement, row.inertia))
        frames.append(_frame(f"dh_{index + 1}", index, np.eye(4)))
    return _robot(table, joints, [*frames, _frame("tool", len(joints) - 1, table.tool)], source)


def _robot(table: DhTable, joints: list[Joint], frames: list[Frame], source: DescriptionSource) -> Robot:
    return Robot(
        name=table.name,
        joints=tuple(joints),
        gravity=np.array(table.gravity),
        frames=(_frame("base", -1, np.eye(4)), *frames),
        source=Path(source.where).name,
    )


def _joint(row: DhRow, index: int, placement: FloatArray, inertia: FloatArray) -> Joint:
    return Joint(
        name=row.name,
        kind=row.kind,
        parent=index - 1,
        rotation=placement[:3, :3],
        translation=placement[:3, 3],
        axis=np.array([0.0, 0.0, 1.0]),
        inertia=inertia,
        limits=row.limits,
        rotor_inertia=row.rotor_inertia,
        viscous=row.viscous,
        coulomb=row.coulomb,
    )


def _frame(name: str, joint: int, pose: FloatArray) -> Frame:
    return Frame(name=name, joint=joint, rotation=pose[:3, :3], translation=pose[:3, 3])
