"""The thresholds above which something touches the arm, per joint and condition, and their file."""

from __future__ import annotations

import json
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SensingError, TauhatError, TauhatWarning
from tauhat.files import read_text, write_text
from tauhat.plain_data import without_infinities
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.learnt_error import LearntError, learnt_error
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.zero import StandingZero

TakenOff: TypeAlias = Literal["nothing", "air"]
"""What was taken off the external torque before thresholds were learnt: nothing, or a pass in air."""

CONDITIONS = ("settling", "resting", "moving")
SCHEMA, SCHEMA_VERSION = "tauhat/contact-thresholds", 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContactThresholds:
    """Limits of the external torque in free motion, in standard errors that the sensor states.

    joint_names : of the columns
    edges : (n_steps, n_v) speeds at which steps end; the first tells standing, the last is the top speed of free motion
    limits : (2 + n_steps, n_v) settling, resting, then steps of speed
    rules : they were learnt with
    rate : false alarms an hour that were asked for
    promised : false alarms an hour that this much free motion can promise; above `rate` where it is too short
    seconds : (3,) of free motion settling, resting and moving
    spread : largest residual of one recording over that of the others; nan with a single one
    error : of the sensor, in whose standard errors the limits are; None: whatever the sensor has
    taken_off : what has to be taken off the torque before it is judged
    estimate : fingerprint of the estimate they were learnt with (`SensedModel.estimate`); empty: nobody knows
    """

    joint_names: tuple[str, ...]
    edges: FloatArray
    limits: FloatArray
    rules: ContactRules
    rate: float
    promised: float
    seconds: FloatArray
    spread: float
    error: LearntError | None = None
    taken_off: TakenOff = "nothing"
    estimate: str = ""

    def __post_init__(self) -> None:
        n_v, where = len(self.joint_names), "contact thresholds"
        edges = frozen("edges", self.edges, (None, n_v), where=where)
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        object.__setattr__(self, "edges", edges)
        object.__setattr__(self, "limits", frozen("limits", self.limits, (2 + len(edges), n_v), where=where))
        object.__setattr__(self, "seconds", frozen("seconds", self.seconds, (len(CONDITIONS),), where=where))
        if self.error is not None and self.error.rms.size != n_v:
            raise SensingError("error of contact thresholds", expected=f"{n_v} joints", got=self.error.rms.size)
        if self.taken_off not in {"nothing", "air"}:
            raise SensingError("what thresholds are behind", expected="nothing or air", got=str(self.taken_off)[:60])
        if not ((self.limits > 0.0).all() and (edges > 0.0).all() and (np.diff(edges, axis=0) >= 0.0).all()):
            raise SensingError("thresholds of contact", expected="above zero, speeds increasing")

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    def sensor_of(self, sensor: ForceSensor) -> ForceSensor:
        """Return the sensor with the error in which these thresholds count.

        Raises
        ------
        SensingError
            when the sensor has other joints or another estimate, or observes or filters otherwise.

        Warns
        -----
        TauhatWarning
            when the thresholds do not say of which estimate they are.
        """
        self.check_joints(sensor.model.robot.joint_names, where="sensor")
        self._check_estimate(sensor.model.estimate)
        return sensor if self.error is None else self.error.on(sensor)

    def _check_estimate(self, other: str) -> None:
        if other and not self.estimate:
            warnings.warn(
                "the thresholds do not say of which estimate they are: with another one they are wrong",
                TauhatWarning, stacklevel=3,
            )  # fmt: skip
        if other and self.estimate and other != self.estimate:
            raise SensingError(
                "thresholds of another estimate", where="sensor", expected=self.estimate, got=other,
                remedy="sense with the estimate that they were learnt with, or learn them again (--free)",
            )  # fmt: skip

    def check_joints(self, names: tuple[str, ...], *, where: str) -> None:
        """Pass where the thresholds are of these joints.

        Raises
        ------
        SensingError
            when they are of others.
        """
        if tuple(names) != self.joint_names:
            raise SensingError(
                "thresholds of another robot", where=where, expected=", ".join(self.joint_names), got=", ".join(names)
            )

    @property
    def keeps_rate(self) -> bool:
        """Whether the free motion was long enough for the rate that was asked for."""
        return self.promised <= self.rate

    def to_dict(self) -> dict[str, Any]:
        """Return plain data in the form of the file."""
        data = {
            "schema": SCHEMA, "schema_version": SCHEMA_VERSION, "joint_names": list(self.joint_names),
            "edges": self.edges.tolist(), "limits": self.limits.tolist(), "rules": asdict(self.rules),
            "rate": self.rate, "promised": self.promised, "keeps_rate": self.keeps_rate,
            "seconds": dict(zip(CONDITIONS, self.seconds.tolist(), strict=True)),
            "spread": self.spread, "error": None if self.error is None else self.error.to_dict(),
            "taken_off": self.taken_off, "estimate": self.estimate,
        }  # fmt: skip
        return dict(without_infinities(data))

    def save(self, path: str | Path) -> None:
        """Write the thresholds as JSON; the file appears whole or not at all.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False))


def load_contact_thresholds(path: str | Path) -> ContactThresholds:
    """Return the thresholds in a file, exactly as they were saved.

    Raises
    ------
    SensingError
        when the file is missing, damaged, of something else or of a newer version.
    """
    text = read_text(path, error=SensingError)
    try:
        data = json.loads(text)
        if data["schema"] != SCHEMA or data["schema_version"] > SCHEMA_VERSION:
            raise SensingError(
                "not contact thresholds of this version", where=path, expected=f"{SCHEMA}, {SCHEMA_VERSION} or less",
                got=f"{data['schema']}, {data['schema_version']}",
            )  # fmt: skip
        return _from_dict(data)
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise SensingError("contact thresholds are damaged", where=path, got=f"{error}") from error
    except TauhatError as error:
        raise SensingError("contact thresholds cannot be used", where=path, got=error) from error


def _from_dict(data: dict[str, Any]) -> ContactThresholds:
    rules = dict(data["rules"])
    zero = dict(rules.pop("zero"))
    zero["follow"] = _endless(zero["follow"])
    return ContactThresholds(
        joint_names=tuple(data["joint_names"]), edges=data["edges"], limits=data["limits"],
        rules=ContactRules(zero=StandingZero(**zero), **rules), rate=_endless(data["rate"]),
        promised=_endless(data["promised"]),
        seconds=np.array([data["seconds"][name] for name in CONDITIONS], dtype=np.float64),
        spread=np.nan if data["spread"] is None else float(data["spread"]),
        error=learnt_error(data["error"]) if data.get("error") else None,
        taken_off=data.get("taken_off", "nothing"), estimate=str(data.get("estimate", "")),
    )  # fmt: skip


def _endless(value: float | None) -> float:
    return np.inf if value is None else float(value)
