"""Values of an experiment's file that are one for all joints, one a joint, or by the name of a joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot
from tauhat.robots.toml_fields import TomlFields


def joint_of(robot: Robot, name: str, where: str) -> int:
    """Return the index of a joint.

    Raises
    ------
    SimulationError
        when the robot has none of this name.
    """
    if name not in robot.joint_names:
        remedy = advice_on_name(name, robot.joint_names)
        raise SimulationError("unknown joint", where=where, got=name[:60], remedy=remedy)
    return robot.joint_names.index(name)


def joint_row(fields: TomlFields, key: str, robot: Robot, default: float | None = None) -> FloatArray:
    """Return a value of every joint, (n_v,): from one number, a list, or a table by joint name over the default.

    Raises
    ------
    RobotError, SimulationError
        when it is missing, not a number, of a joint that is not there, or a list of another length.
    """
    value = fields.table.get(key)
    if isinstance(value, Mapping):
        table = TomlFields(value, f"{fields.where}, {key}")
        row = np.full(robot.n_v, np.nan if default is None else default)
        for name in value:
            row[joint_of(robot, name, table.where)] = table.number(name)
        if np.isnan(row).any():
            missing = robot.joint_names[int(np.argmax(np.isnan(row)))]
            raise SimulationError(f"{key} needs a value for every joint", where=table.where, expected=missing)
        return row
    if isinstance(value, list):
        if len(value) != robot.n_v:
            wanted = f"1, or {robot.n_v} ({', '.join(robot.joint_names)})"
            raise SimulationError(f"wrong number of {key}", where=fields.where, expected=wanted, got=len(value))
        return np.array(fields.row(key, robot.n_v))
    return np.full(robot.n_v, fields.number(key, default))


def optional_row(fields: TomlFields, key: str, robot: Robot) -> FloatArray | None:
    """Return the same, or None where the key is missing."""
    return joint_row(fields, key, robot) if key in fields.table else None


def whole_number(fields: TomlFields, key: str, default: int) -> int:
    """Return a whole number that is not negative.

    Raises
    ------
    SimulationError
        when it is another.
    """
    value = fields.table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise SimulationError(f"{key} is not a whole number >= 0", where=fields.where, got=repr(value)[:60])
    return value
