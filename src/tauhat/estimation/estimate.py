"""The estimate: values, covariance, base set and provenance in one JSON file that everything downstream reads."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import tauhat
from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.motion import motion_from_rows
from tauhat.errors import EstimateError, TauhatError
from tauhat.estimation.confidence import student_quantile
from tauhat.estimation.friction import SteadyFriction, steady_friction
from tauhat.estimation.structure import Structure
from tauhat.files import read_text, replace_file
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.library import builtin_names
from tauhat.robots.robot import Robot

SCHEMA = "tauhat/estimate"
SCHEMA_VERSION = 1
_LARGEST_FILE = 200_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class InputLog:
    """A recording that went into an estimate: name, hash of its file, rows taken, samples and seconds."""

    name: str
    sha256: str
    rows: tuple[int, int]
    samples: int
    seconds: float

    def overlaps(self, other: InputLog) -> bool:
        """Return whether the two share rows of the same file; without hashes, whether they have the same name."""
        if not (self.sha256 and other.sha256):
            return self.name == other.name
        shared = min(self.rows[1], other.rows[1]) > max(self.rows[0], other.rows[0])
        return self.sha256 == other.sha256 and shared


def input_log(recording: Recording) -> InputLog:
    """Return what an estimate or a verification notes of a recording."""
    source = recording.source
    return InputLog(
        name=recording.name,
        sha256=source.sha256 if source else "",
        rows=source.rows if source else (0, recording.n_t),
        samples=recording.n_t,
        seconds=recording.duration,
    )


class ParameterRow(NamedTuple):
    """One line of the summary: base parameter, formula, value and standard error in `unit`, relative error."""

    name: str
    formula: str
    value: float
    standard_error: float
    relative: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimate:
    """An identified torque model with its error bars and where it came from.

    model : robot and terms
    base : which parameters are independent and how the rest regroup
    values : (n_b,) base parameters, SI, joint side
    covariance : (n_b, n_b)
    degrees : degrees of freedom of the standard errors
    processing : filters the model was fitted through
    estimator : name and settings of the method
    joint_rms, torque_rms : (n_v,) residual and torque of the fit [Nm or N]
    rank, condition : of the scaled regressor
    inputs : the recordings it was fitted on
    structure : how the terms were chosen, when they were
    top_speeds : (n_v,) of the joints in these recordings [rad/s or m/s]; friction at higher speeds is extrapolated
    standard : (n_p,) all standard parameters, where they were identified under physical constraints
    physical : what these constraints were, what they cost and what proves the solution
    passes : how often the problem was solved
    cause, advice : why the method stopped, and what to do about it, in words
    version : of the library that wrote it
    """

    model: TorqueModel
    base: BaseParameters
    values: FloatArray
    covariance: FloatArray
    degrees: int
    processing: Processing
    estimator: Mapping[str, Any]
    joint_rms: FloatArray
    torque_rms: FloatArray
    rank: int
    condition: float
    inputs: tuple[InputLog, ...]
    structure: Structure | None = None
    top_speeds: FloatArray | None = None
    standard: FloatArray | None = None
    physical: Mapping[str, Any] | None = None
    passes: int = 1
    cause: str = "solved"
    advice: str = ""
    version: str = tauhat.__version__

    def __post_init__(self) -> None:
        n_b, n_v = self.base.n_b, self.robot.n_v
        shapes: dict[str, tuple[int, ...]] = {
            "values": (n_b,),
            "covariance": (n_b, n_b),
            "joint_rms": (n_v,),
            "torque_rms": (n_v,),
        }
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="estimate"))
        if self.top_speeds is not None:
            object.__setattr__(self, "top_speeds", frozen("top_speeds", self.top_speeds, (n_v,), where="estimate"))
        if self.standard is not None:
            standard = frozen("standard", self.standard, (len(self.base.names),), where="estimate")
            object.__setattr__(self, "standard", standard)
        if (np.diag(self.covariance) < 0.0).any():
            raise EstimateError("a variance is negative", where="estimate")

    @property
    def robot(self) -> Robot:
        """The robot the model belongs to."""
        return self.model.robot

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the base parameters, (n_b,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def n_fitted(self) -> int:
        """Number of base parameters that were fitted; fewer than all where the essential ones alone were kept."""
        return int(np.count_nonzero(np.diag(self.covariance)))

    def friction(self, speeds: FloatArray) -> SteadyFriction:
        """Return the friction torque of each joint in steady motion at these speeds, (n_v,), with standard errors.

        Parameters
        ----------
        speeds : (n_v,) positive [rad/s or m/s]
        """
        wanted = frozen("speeds", speeds, (self.robot.n_v,))
        return steady_friction(self.model, self.base, self.values, self.covariance, wanted)

    def half_intervals(self, *, confidence: float = 0.95) -> FloatArray:
        """Return half of each base parameter's confidence interval, (n_b,), by Student's t."""
        return np.asarray(student_quantile(self.degrees, confidence=confidence) * self.standard_errors)

    @property
    def relative_rms(self) -> float:
        """Residual over torque of the fit, all joints stacked."""
        return float(np.linalg.norm(self.joint_rms) / np.linalg.norm(self.torque_rms))

    def check_robot(self, robot: Robot) -> None:
        """Refuse a robot that is not the one the model was identified for.

        Raises
        ------
        EstimateError
            when joints, axes, placements or gravity differ.
        """
        if robot.joint_names != self.robot.joint_names:
            raise EstimateError(
                "the estimate is of another robot",
                expected=", ".join(self.robot.joint_names),
                got=", ".join(robot.joint_names),
            )
        if robot.fingerprint != self.robot.fingerprint:
            raise EstimateError(
                f"the estimate is not of this {robot.name}: same joint names, other axes, placements or gravity",
                remedy="identify again with this robot",
            )

    def predict(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the torque along consecutive samples of a motion, (n_t, n_v) [Nm or N].

        Parameters
        ----------
        q, dq, ddq : (n_t, n_v); consecutive, since friction remembers its direction
        """
        shape = (None, self.robot.n_v)
        arrays = [frozen(name, value, shape) for name, value in (("q", q), ("dq", dq), ("ddq", ddq))]
        layout = self.model.layout(self.base.independent)
        columns, _ = self.model.columns(motion_from_rows(*arrays), layout)
        place = np.empty(len(self.base.names))
        place[self.base.independent] = self.values
        weights = place[layout.parameters]
        torque = [weights[layout.of_joint(j)] @ columns[layout.of_joint(j)] for j in range(self.robot.n_v)]
        return np.ascontiguousarray(np.array(torque).T)

    def summary(self) -> tuple[ParameterRow, ...]:
        """Return one line per base parameter, with its formula, value, standard error and relative error."""
        parameters = self.model.parameters
        rows = zip(self.base.independent, self.base.formulas(), self.values, self.standard_errors, strict=True)
        return tuple(
            ParameterRow(
                name=parameters[index].name,
                formula=formula,
                value=float(value),
                standard_error=float(error),
                relative=float(error / abs(value)) if value else np.inf,
                unit=parameters[index].unit,
            )
            for index, formula, value, error in rows
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data in the form of the estimate file."""
        parameters = [row._asdict() for row in self.summary()]
        for row in parameters:
            row["relative"] = row["relative"] if np.isfinite(row["relative"]) else None
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "tauhat_version": self.version,
            "fingerprint": self.robot.fingerprint,
            "parameters": parameters,
            "fit": {
                "estimator": dict(self.estimator),
                "relative_rms": self.relative_rms,
                "joint_rms": self.joint_rms.tolist(),
                "torque_rms": self.torque_rms.tolist(),
                "rank": self.rank,
                "condition": self.condition if np.isfinite(self.condition) else None,
                "degrees": self.degrees,
                "passes": self.passes,
                "cause": self.cause,
                "advice": self.advice,
            },
            "structure": None if self.structure is None else self.structure.to_dict(),
            "processing": self.processing.to_dict(),
            "inputs": [asdict(log) for log in self.inputs],
            "model": self.model.to_dict(),
            "base": {
                "independent": self.base.independent.tolist(),
                "dependent": self.base.dependent.tolist(),
                "unidentifiable": self.base.unidentifiable.tolist(),
                "regrouping": self.base.regrouping.tolist(),
            },
            "top_speeds": None if self.top_speeds is None else self.top_speeds.tolist(),
            "values": self.values.tolist(),
            "covariance": self.covariance.tolist(),
            "standard": None if self.standard is None else self.standard.tolist(),
            "physical": None if self.physical is None else dict(self.physical),
        }

    def save(self, path: str | Path) -> None:
        """Write the estimate as JSON; the file appears whole or not at all.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        text = json.dumps(self.to_dict(), indent=1, allow_nan=False)
        replace_file(Path(path), lambda beside: beside.write_text(text, encoding="utf-8"))


def load_estimate(path: str | Path) -> Estimate:
    """Return the estimate in a file, exactly as it was saved.

    Raises
    ------
    EstimateError
        when the file is missing, cut off, not an estimate, damaged or of a newer schema.
    """
    if str(path) in builtin_names() and not Path(path).exists():
        raise EstimateError("a robot, not an estimate", where=path, remedy="identify it first: tauhat identify")
    text = read_text(Path(path), error=EstimateError, largest=_LARGEST_FILE)
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise EstimateError(
            "not a readable estimate",
            where=path,
            got=str(error),
            remedy="the file is damaged or cut off: identify again",
        ) from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise EstimateError("not an estimate file", where=path, expected=f'"schema": "{SCHEMA}"')
    written = data.get("schema_version")
    if isinstance(written, bool) or not isinstance(written, int) or written < 1:
        raise EstimateError("the estimate is damaged", where=path, expected="schema_version, 1 or more", got=written)
    if written > SCHEMA_VERSION:
        raise EstimateError(
            "written by a newer version",
            where=path,
            expected=f"schema_version <= {SCHEMA_VERSION}",
            got=written,
            remedy="update tauhat",
        )
    try:
        return estimate_from_dict(data)
    except TauhatError as error:
        raise EstimateError("the estimate is damaged", where=path, got=error) from error
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        raise EstimateError("the estimate is damaged", where=path, got=f"{type(error).__name__} {error}") from error


def estimate_from_dict(data: Mapping[str, Any]) -> Estimate:
    """Return the estimate that `Estimate.to_dict` described."""
    model = TorqueModel.from_dict(data["model"])
    if model.robot.fingerprint != data["fingerprint"]:
        raise EstimateError("the robot inside does not match its fingerprint")
    names = tuple(parameter.name for parameter in model.parameters)
    fit = data["fit"]
    return Estimate(
        model=model,
        base=_base_from_dict(data["base"], names),
        values=data["values"],
        covariance=data["covariance"],
        degrees=int(fit["degrees"]),
        processing=Processing(**data["processing"]),
        estimator=dict(fit["estimator"]),
        joint_rms=fit["joint_rms"],
        torque_rms=fit["torque_rms"],
        rank=int(fit["rank"]),
        condition=np.inf if fit["condition"] is None else float(fit["condition"]),
        structure=Structure.from_dict(data["structure"]) if data.get("structure") else None,
        top_speeds=data.get("top_speeds"),
        standard=data.get("standard"),
        physical=data.get("physical"),
        passes=int(fit.get("passes", 1)),
        cause=str(fit.get("cause", "solved")),
        advice=str(fit.get("advice", "")),
        inputs=tuple(InputLog(**{**log, "rows": tuple(log["rows"])}) for log in data["inputs"]),
        version=str(data["tauhat_version"]),
    )


def _base_from_dict(data: Mapping[str, Any], names: tuple[str, ...]) -> BaseParameters:
    indices = {key: np.array(data[key], dtype=np.intp) for key in ("independent", "dependent", "unidentifiable")}
    everyone = np.sort(np.concatenate(list(indices.values())))
    if not np.array_equal(everyone, np.arange(len(names))):
        raise EstimateError("the base set does not fit the model's parameters")
    shape = (indices["independent"].size, indices["dependent"].size)
    regrouping = np.array(data["regrouping"], dtype=np.float64).reshape(shape)
    return BaseParameters(
        names=names,
        independent=read_only(indices["independent"]),
        dependent=read_only(indices["dependent"]),
        unidentifiable=read_only(indices["unidentifiable"]),
        regrouping=frozen("regrouping", regrouping, shape),
    )
