"""`controller.toml`: how a recorded robot was driven, for the estimators that simulate it.

kind = "pd"                             # tuned, pd, pd-gravity, pd-feedforward or pid, as in an experiment's file
kp = [3000.0, 1000.0]                   # one number, one a joint, or by joint name [Nm/rad or N/m]
kd = [300.0, 100.0]                     # [Nm s/rad or N s/m]; ki of pid
torque_limit = [150.0, 60.0]            # [Nm or N]; the robot's own by default
rate = 1000.0                           # [Hz] at which it computes a torque and holds it; all the time by default
delay = 0.001                           # [s] from a position to the torque that answers it, whole periods of `rate`

[reference]                             # or reference = "measured": the measured position, low-passed
position = { columns = "q_ref_{1..2}", unit = "deg" } # columns of each log, said as in a map
velocity = { columns = "dq_ref_{1..2}", unit = "deg/s" } # its slope by default; "none" where the law takes none
acceleration = { columns = "ddq_ref_{1..2}", unit = "deg/s^2" } # likewise; only a pd-feedforward takes it

Instead of columns, `file = "motion.parquet"` is a motion file beside this one, or a list of them, one a log; `start` is
the time of the log at which it begins [s], 0 by default. A tuned law has its `bandwidth` [Hz] instead of gains.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.laws import TrackingLaw
from tauhat.errors import ModelError, TauhatError
from tauhat.estimation.closed_loop import ClosedLoop, LoopFile, Positions, Reference, SampledReference
from tauhat.excitation.motion_file import motion_for
from tauhat.files import read_text, sha256_of
from tauhat.recordings.log_source import LogSource
from tauhat.recordings.logmap import SignalMap
from tauhat.recordings.mapfile import signal_from_table
from tauhat.recordings.processing import unwrapped
from tauhat.recordings.reading import map_of
from tauhat.robots.robot import Robot
from tauhat.robots.toml_fields import TomlFields
from tauhat.simulation.controller_fields import CONTROLLER_KEYS, LAWS, TUNED, tracking_law

_LARGEST_FILE = 2**20  # [bytes]
_OF_MODELS = ("computed-torque", "model-feedforward", "adaptive")  # laws of the control room that no table can hold
_WHOLE = 1e-6  # by which a number of periods may differ from a whole one
_MOST_PERIODS = 1000  # of delay: no controller is that late
_MEASURED, _NONE = "measured", "none"


def load_closed_loop(path: str | Path, robot: Robot, logs: Sequence[LogSource]) -> ClosedLoop:
    """Return the loop that a TOML file describes, with a reference for each log unless it is the measured motion.

    Parameters
    ----------
    robot : with the joints of the logs
    logs : where the reference's columns are

    Raises
    ------
    ModelError
        missing file, not TOML, unknown law or key, another number of gains than joints, a law that needs a model, or a
        reference that is missing or cannot be read.
    """
    text, where = read_text(path, error=ModelError, largest=_LARGEST_FILE), str(path)
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ModelError("not valid TOML", where=where, got=error) from error
    try:
        return _loop(TomlFields(data, where), Path(path), robot, logs)
    except TauhatError as error:
        place = error.where if error.where.startswith(where) else f"{where}, {error.where}".rstrip(", ")
        raise ModelError(
            error.what, where=place, expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def _loop(fields: TomlFields, path: Path, robot: Robot, logs: Sequence[LogSource]) -> ClosedLoop:
    fields.refuse_unknown((*CONTROLLER_KEYS, "reference"))
    law = _law(fields, robot)
    rate = _positive(fields, "rate") if "rate" in fields.table else None
    usual = ClosedLoop()
    return ClosedLoop(
        law=law,
        bandwidth=_positive(fields, "bandwidth", usual.bandwidth),
        control_rate=rate,
        delay=_periods(fields, rate),
        references=_references(fields, path.parent, robot, logs),
        file=LoopFile(name=path.name, sha256=sha256_of([path])),
    )


def _law(fields: TomlFields, robot: Robot) -> TrackingLaw | None:
    kind = fields.text("kind")
    if kind in _OF_MODELS:
        raise ModelError(
            f"{kind} needs a model of its own, which this file cannot hold",
            expected=" | ".join((TUNED, *LAWS)), got=kind,
            remedy="pd-feedforward adds the torque of the robot's description along the reference",
        )  # fmt: skip
    law = tracking_law(fields, robot)
    if law is not None and "bandwidth" in fields.table:
        raise ModelError(f"a {kind} controller has no bandwidth", where=fields.where)
    if law is not None and law.feedforward != "nothing" and not robot.has_inertia:
        raise ModelError(
            f"{kind} adds torque of the robot's description, which has no masses", where=fields.where, got=robot.name,
            remedy="give a description with inertias, or take pd",
        )  # fmt: skip
    return law


def _positive(fields: TomlFields, key: str, default: float | None = None) -> float:
    value = fields.number(key, default)
    if value <= 0.0:
        raise ModelError(f"{key} of the controller", where=fields.where, expected="> 0", got=value)
    return value


def _periods(fields: TomlFields, rate: float | None) -> int:
    """Return the delay in periods of the controller."""
    delay = fields.number("delay", 0.0)
    if delay == 0.0:
        return 0
    if rate is None:
        raise ModelError("a delay needs the rate of the controller", where=fields.where, expected="rate [Hz]")
    periods = delay * rate
    if not 0.0 < periods <= _MOST_PERIODS or abs(periods - round(periods)) > _WHOLE * max(periods, 1.0):
        expected = f"a whole number, at most {_MOST_PERIODS}"
        raise ModelError("control periods in the delay", where=fields.where, expected=expected, got=f"{periods:g}")
    return round(periods)


def _references(fields: TomlFields, folder: Path, robot: Robot, logs: Sequence[LogSource]) -> tuple[Reference, ...]:
    given = fields.table.get("reference")
    if given == _MEASURED:
        return ()
    if not isinstance(given, dict):
        raise ModelError(
            "the reference is missing" if given is None else "unknown reference", where=fields.where,
            expected=f'[reference] with position or file, or reference = "{_MEASURED}"',
            got="" if given is None else repr(given)[:60],
        )  # fmt: skip
    reference = fields.subtable("reference")
    reference.refuse_unknown(("position", "velocity", "acceleration", "file", "start"))
    if ("position" in given) == ("file" in given):
        raise ModelError("not one source of the reference", where=reference.where, expected="either position or file")
    stray = [
        key for key in ("velocity", "acceleration", "start") if key in given and (key == "start") != ("file" in given)
    ]
    if stray:
        raise ModelError(f"{stray[0]} does not go with this source", where=reference.where, got=", ".join(given))
    if "file" in given:
        return _motions(reference, folder, robot, len(logs))
    return tuple(_logged(reference, robot, log) for log in logs)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _BegunMotion:
    """A motion that begins at a time of the log, `start` [s]."""

    motion: Reference
    start: float

    def sample(self, t: FloatArray) -> Positions:
        """Return the motion at the times t of the log, (n_t,) [s]."""
        return self.motion.sample(t - self.start)


def _motions(fields: TomlFields, folder: Path, robot: Robot, count: int) -> tuple[Reference, ...]:
    named = fields.table["file"]
    names = named if isinstance(named, list) else [named]
    if not names or not all(isinstance(name, str) and name for name in names):
        raise ModelError("file is not a name, or a list of names", where=fields.where, got=repr(named)[:60])
    if len(names) not in {1, count}:
        raise ModelError("wrong number of motion files", where=fields.where, expected=f"1 or {count}", got=len(names))
    start = fields.number("start", 0.0)
    motions = [_BegunMotion(motion=motion_for(robot, folder / name), start=start) for name in names]
    return tuple(motions * count if len(motions) == 1 else motions)


def _logged(fields: TomlFields, robot: Robot, log: LogSource) -> SampledReference:
    """Return the reference that columns of a log hold: read as another log, whose positions it is."""
    signals: dict[str, Any] = {key: _signal(fields, key) for key in ("position", "velocity", "acceleration")}
    measured: dict[str, Any] = dict.fromkeys(("torque", "temperature", "wrench"))
    reference = replace(map_of(log.path, log.map), **signals, **measured, source=fields.where)
    recording = replace(log, map=reference).read()
    if recording.n_v != robot.n_v:
        raise ModelError(
            "the reference does not fit the robot", where=fields.where, expected=f"{robot.n_v} columns",
            got=recording.n_v,
        )  # fmt: skip
    t, q = recording.t, unwrapped(recording.q)
    dq = _slope(q, t) if recording.dq is None else recording.dq
    dq = np.zeros_like(q) if fields.table.get("velocity") == _NONE else dq
    return SampledReference(t=t, q=q, dq=dq, ddq=_slope(dq, t) if recording.ddq is None else recording.ddq)


def _signal(fields: TomlFields, key: str) -> SignalMap | None:
    table = fields.table.get(key)
    if table is None or (key == "velocity" and table == _NONE):
        return None
    if not isinstance(table, dict):
        legal = '{ columns = .., unit = .. }, or "none"' if key == "velocity" else "{ columns = .., unit = .. }"
        raise ModelError(f"{key} is not a table", where=fields.where, expected=legal, got=repr(table)[:60])
    return signal_from_table(key, table)


def _slope(signal: FloatArray, t: FloatArray) -> FloatArray:
    return np.asarray(np.gradient(signal, t, axis=0, edge_order=2))
