"""`experiment.toml`: a whole simulated experiment at one place, with every key checked.

robot = "ur5e"                          # a built-in name, or a file beside this one
seed = 1                                # of motion and noise
robot_seed = 7                          # of the truth

[locked]                                # joints frozen at a position, optional [rad or m]

[truth]                                 # what the robot really is; all optional
spread = 0.1                            # how far it is from its description, relative
friction = "stribeck"                   # plain, coulomb, dahl, ...: a kind of typical_plant

[truth.elasticity]
joints = ["shoulder_pan_joint"]         # all by default
stiffness = 2e4                         # one number, or one for each of these joints [Nm/rad]
damping = 20.0                          # [Nm s/rad]
gap = 1e-4                              # backlash [rad], none by default

[truth.heat]
heating = 1e-3                          # [K/J]
time_constant = 3600.0                  # [s]
viscous = -0.01                         # change of friction by a kelvin [1/K]
coulomb = -0.005
initial = 25.0                          # ambient, reference likewise [deg C]

[[truth.attached]]                      # a tool or payload
name = "gripper"
mass = 1.2                              # [kg]
centre = [0, 0, 0.08]                   # from the joint's frame [m]
inertia = [0.002, 0.002, 0.001]         # about it, along the frame's axes [kg m^2]; a point by default
joint = "wrist_3_joint"                 # the last by default

[motion]
kind = "designed"                       # or "random"; `file` instead of all these
seconds = 20.0
harmonics = 5
starts = 2                              # of the design
limits = "limits.toml"                  # of a designed motion

[controller]
kind = "tuned"                          # or pd, pd-gravity, pd-feedforward, pid with kp, kd, ki, torque_limit
bandwidth = 15.0                        # of the tuned one [Hz]
rate = 2000.0                           # [Hz]
delay = 0.0                             # [s]

[encoder]                               # what the controller sees
side = "motor"                          # of elastic joints; the log's position too
step = 1e-6                             # [rad or m]
velocity = "differenced"                # or "true"

[sensors]                               # what the log shows
preset = "cobot"                        # industrial-arm, low-cost
scale = 1.0                             # how many times as bad
torque_noise = 0.2                      # any error of SensorErrors, over the preset's

[[sensors.ripples]]
amplitude = 0.3
order = 2
turns = "motor"
gear_ratio = 100

[log]
file = "run.parquet"
rate = 500.0                            # [Hz]
settle = 1.0                            # [s] in the start pose before it begins
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import fields as fields_of
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError, TauhatError
from tauhat.excitation.limits import load_limits
from tauhat.excitation.motion_file import motion_for
from tauhat.files import read_text
from tauhat.robots.library import builtin_names, load_robot
from tauhat.robots.robot import Robot
from tauhat.robots.toml_fields import TomlFields
from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.closed_loop import Encoder
from tauhat.simulation.controller_fields import CONTROLLER_KEYS, tracking_law
from tauhat.simulation.elasticity import ElasticJoints
from tauhat.simulation.experiment import ExperimentSettings
from tauhat.simulation.experiment_fields import joint_of, joint_row, optional_row, whole_number
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.simulation.sensors import Ripple, SensorErrors, sensor_preset

_LARGEST_FILE = 2**20  # [bytes]
_SLOWEST_CONTROL = 2000.0  # [Hz]
_SECTIONS = ("robot", "seed", "robot_seed", "locked", "truth", "motion", "controller", "encoder", "sensors", "log")
_SENSORS = tuple(item.name for item in fields_of(SensorErrors))
_SPRING: Mapping[str, float | None] = {"stiffness": None, "damping": 0.0, "gap": 0.0}
_WORDS = ("velocity", "torque_side", "stamps")
_OF_THE_CLOCK = ("torque_delay", "sampling_jitter", "stamp_jitter", "lost_samples", "lost_run")


def is_experiment(path: str | Path) -> bool:
    """Return whether a name is that of an experiment's file: TOML that names a robot instead of listing joints."""
    file = Path(path)
    if file.suffix.lower() != ".toml" or not file.is_file() or file.stat().st_size > _LARGEST_FILE:
        return False
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return "robot" in data and "joints" not in data


def load_experiment(path: str | Path) -> PlannedExperiment:
    """Return the experiment that a TOML file plans.

    Raises
    ------
    SimulationError
        missing file, not TOML, unknown keys or joints, bad values, or a robot, motion or limits that cannot be read.
    """
    text, where = read_text(path, error=SimulationError, largest=_LARGEST_FILE), str(path)
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise SimulationError("not valid TOML", where=where, got=error) from error
    try:
        return _experiment(TomlFields(data, where), Path(path).parent)
    except TauhatError as error:
        place = error.where if error.where.startswith(where) else f"{where}, {error.where}".rstrip(", ")
        raise SimulationError(
            error.what, where=place, expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def _experiment(top: TomlFields, folder: Path) -> PlannedExperiment:
    if isinstance(top.table.get("robot"), dict):
        raise SimulationError("a project, not an experiment", where=top.where, remedy="go its way with tauhat run")
    top.refuse_unknown(_SECTIONS)
    name = top.text("robot")
    described_by = name if name in builtin_names() else str(folder / name)
    robot = _robot(top, described_by)
    truth, log = top.subtable("truth"), top.subtable("log")
    truth.refuse_unknown(("spread", "friction", "elasticity", "heat", "attached"))
    log.refuse_unknown(("file", "rate", "settle"))
    sensors = top.subtable("sensors")
    return PlannedExperiment(
        robot=robot,
        described_by=described_by,
        spread=truth.number("spread", 0.1),
        friction=truth.text("friction", "plain"),
        elasticity=_elasticity(truth.subtable("elasticity"), robot) if "elasticity" in truth.table else None,
        heat=_heat(truth.subtable("heat"), robot) if "heat" in truth.table else None,
        attached=tuple(_attached(body, robot) for body in truth.subtables("attached")),
        motion=_motion(top.subtable("motion"), robot, folder),
        settings=_settings(top, robot, log),
        sensors=_named(sensors),
        seed=whole_number(top, "seed", 0),
        robot_seed=whole_number(top, "robot_seed", 0),
        log=folder / log.text("file") if "file" in log.table else None,
    )


def _robot(top: TomlFields, described_by: str) -> Robot:
    locked = top.subtable("locked")
    positions = {joint: locked.number(joint) for joint in locked.table}
    return load_robot(described_by, locked=positions or None)


def _elasticity(fields: TomlFields, robot: Robot) -> ElasticJoints:
    fields.refuse_unknown(("joints", "stiffness", "damping", "gap"))
    names = fields.table.get("joints", list(robot.joint_names))
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise SimulationError("joints is not a list of names", where=fields.where, got=repr(names)[:60])
    joints = tuple(joint_of(robot, name, fields.where) for name in names)
    values = {key: _of_some(fields, key, len(joints), default) for key, default in _SPRING.items()}
    return ElasticJoints(joints=joints, **values)


def _of_some(fields: TomlFields, key: str, count: int, default: float | None) -> FloatArray:
    if isinstance(fields.table.get(key), list):
        return np.array(fields.row(key, count))
    return np.full(count, fields.number(key, default))


def _heat(fields: TomlFields, robot: Robot) -> FrictionHeat:
    fields.refuse_unknown(("heating", "time_constant", "viscous", "coulomb", "initial", "ambient", "reference"))
    ambient = fields.number("ambient", 20.0)
    return FrictionHeat(
        heating=joint_row(fields, "heating", robot, 0.0),
        time_constant=joint_row(fields, "time_constant", robot, 3600.0),
        viscous=joint_row(fields, "viscous", robot, 0.0),
        coulomb=joint_row(fields, "coulomb", robot, 0.0),
        initial=joint_row(fields, "initial", robot, ambient),
        ambient=ambient,
        reference=fields.number("reference", 20.0),
    )


def _attached(fields: TomlFields, robot: Robot) -> AttachedBody:
    fields.refuse_unknown(("name", "mass", "centre", "inertia", "joint"))
    joint = joint_of(robot, fields.text("joint"), fields.where) if "joint" in fields.table else -1
    moments = fields.row("inertia", 3, (0.0, 0.0, 0.0))
    return AttachedBody(
        name=fields.text("name", "payload"),
        mass=fields.number("mass"),
        centre=np.array(fields.row("centre", 3)),
        inertia=np.diag(moments),
        joint=joint,
    )


def _motion(fields: TomlFields, robot: Robot, folder: Path) -> MotionPlan:
    fields.refuse_unknown(("file", "kind", "seconds", "harmonics", "starts", "limits"))
    if "file" in fields.table:
        if len(fields.table) > 1:
            raise SimulationError("a motion file has its own length and shape", where=fields.where, got=[*fields.table])
        return MotionPlan(given=motion_for(robot, folder / fields.text("file")))
    usual = MotionPlan()
    return MotionPlan(
        kind="random" if fields.choice("kind", ("designed", "random"), usual.kind) == "random" else "designed",
        seconds=fields.number("seconds", usual.seconds),
        harmonics=whole_number(fields, "harmonics", usual.harmonics),
        starts=whole_number(fields, "starts", usual.starts),
        limits=load_limits(folder / fields.text("limits"), robot) if "limits" in fields.table else None,
    )


def _settings(top: TomlFields, robot: Robot, log: TomlFields) -> ExperimentSettings:
    control, encoder = top.subtable("controller"), top.subtable("encoder")
    control.refuse_unknown(CONTROLLER_KEYS)
    encoder.refuse_unknown(("side", "step", "velocity"))
    rate = log.number("rate", 500.0)
    if rate <= 0.0:
        raise SimulationError("rate of the log", where=log.where, expected="a positive number", got=rate)
    control_rate = control.number("rate", rate * math.ceil(_SLOWEST_CONTROL / rate))
    if control_rate <= 0.0:
        raise SimulationError("rate of the controller", where=control.where, expected="> 0", got=control_rate)
    fine = math.ceil(_SLOWEST_CONTROL / control_rate)  # a slow controller does not make the plant's step long
    side: Any = encoder.choice("side", ("link", "motor"), "link")
    velocity: Any = encoder.choice("velocity", ("true", "differenced"), "true")
    return ExperimentSettings(
        timestep=1.0 / (control_rate * fine),
        control_rate=control_rate,
        sample_rate=rate,
        settle=log.number("settle", 1.0),
        bandwidth=control.number("bandwidth", 15.0),
        controller=tracking_law(control, robot),
        control_delay=control.number("delay", 0.0),
        encoder=Encoder(side=side, step=joint_row(encoder, "step", robot, 0.0), velocity=velocity),
        sensors=_sensors(top.subtable("sensors"), robot),
    )


def _sensors(fields: TomlFields, robot: Robot) -> SensorErrors:
    fields.refuse_unknown(("preset", "scale", *_SENSORS))
    start = sensor_preset(fields.text("preset"), robot) if "preset" in fields.table else SensorErrors()
    given = {key: _sensor_value(fields, key, robot) for key in fields.table if key in _SENSORS}
    return replace(start.scaled(fields.number("scale", 1.0)), **given)


def _sensor_value(fields: TomlFields, key: str, robot: Robot) -> Any:
    """Return the value of one sensor error."""
    if key in _WORDS:
        return fields.text(key)
    if key in _OF_THE_CLOCK:
        return fields.number(key)
    if key == "ripples":
        return tuple(_ripple(ripple, robot) for ripple in fields.subtables(key))
    return joint_row(fields, key, robot, 1.0 if key == "torque_factor" else 0.0)


def _ripple(fields: TomlFields, robot: Robot) -> Ripple:
    fields.refuse_unknown(("amplitude", "order", "turns", "gear_ratio", "phase"))
    turns: Any = fields.choice("turns", ("joint", "motor"), "joint")
    return Ripple(
        amplitude=joint_row(fields, "amplitude", robot, 0.0),
        order=joint_row(fields, "order", robot),
        turns=turns,
        gear_ratio=joint_row(fields, "gear_ratio", robot, 1.0),
        phase=optional_row(fields, "phase", robot),
    )


def _named(sensors: TomlFields) -> str:
    """Return what people call the sensors."""
    if "preset" not in sensors.table:
        return "own"
    scale, others = sensors.number("scale", 1.0), set(sensors.table) - {"preset", "scale"}
    name = sensors.text("preset") if scale == 1.0 else f"{sensors.text('preset')} x {scale:g}"
    return f"{name}, changed" if others else name
