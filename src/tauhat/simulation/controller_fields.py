"""A tracking law in a TOML table: `[controller]` of an experiment's file, and the file of a robot's own controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tauhat.control.laws import PD, PID, PDFeedforward, PDGravity, TrackingLaw
from tauhat.errors import SimulationError
from tauhat.robots.robot import Robot
from tauhat.robots.toml_fields import TomlFields
from tauhat.simulation.experiment_fields import joint_row, optional_row

TUNED = "tuned"
CONTROLLER_KEYS = ("kind", "bandwidth", "rate", "delay", "kp", "kd", "ki", "torque_limit")
LAWS: Mapping[str, type[TrackingLaw]] = {law.key: law for law in (PD, PDGravity, PDFeedforward, PID)}
"""Every law that a file can name."""


def tracking_law(fields: TomlFields, robot: Robot) -> TrackingLaw | None:
    """Return the law that a table names, None for a tuned one; without limits of its own it has the robot's.

    Raises
    ------
    RobotError, SimulationError
        an unknown law, a gain that it does not have or that is missing, or another number of them than joints.
    """
    kind = fields.choice("kind", (TUNED, *LAWS), TUNED)
    gains = ("kp", "kd", "ki") if kind == PID.key else () if kind == TUNED else ("kp", "kd")
    strange = [key for key in ("kp", "kd", "ki", "torque_limit") if key in fields.table and key not in gains]
    strange = [key for key in strange if kind == TUNED or key != "torque_limit"]
    if strange:
        raise SimulationError(f"a {kind} controller has no {strange[0]}", where=fields.where)
    if kind == TUNED:
        return None
    limit = optional_row(fields, "torque_limit", robot)
    make: Callable[..., TrackingLaw] = LAWS[kind]
    values = {key: joint_row(fields, key, robot) for key in gains}
    return make(**values, torque_limit=robot.effort_limit if limit is None else limit)
