"""What a model says along a recording, row by row: torque, its error bar, the load, and further columns beside them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.model import Layout, TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Parameter, Term
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.rows import filtered_rows
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot

_FLAT = ("t", "tau", "predicted", "std", "load", "dq")


class PredictedRows(NamedTuple):
    """Consecutive filtered, decimated rows and what the model says about them; joints first, (n_v, n) each.

    t : (n,) [s]
    tau, predicted, std, load : measured torque, predicted torque, its standard error from the parameters alone, and the
        part of it that the links take [Nm or N]
    dq : [rad/s or m/s]
    own : for each joint the model's columns, (n_columns, n)
    probes : for each joint the further columns, (n_probes, n)
    """

    t: FloatArray
    tau: FloatArray
    predicted: FloatArray
    std: FloatArray
    load: FloatArray
    dq: FloatArray
    own: tuple[FloatArray, ...]
    probes: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeTerm(Term):
    """Columns that are looked at beside a model's own, equally many on every joint; nothing to fit."""

    @property
    @abstractmethod
    def width(self) -> int:
        """Columns of each joint."""

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return one parameter a column."""
        return tuple(
            Parameter(symbol=f"probe {column}", joint=joint, unit="")
            for joint in range(robot.n_v)
            for column in range(self.width)
        )

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return each joint's own columns."""
        return tuple(np.arange(self.width) + self.width * joint for joint in range(robot.n_v))


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinematics(ProbeTerm):
    """Position and acceleration as columns, so that they pass the filter that the torque passes."""

    key: ClassVar[str] = "kinematics"

    @property
    def width(self) -> int:
        """Position and acceleration."""
        return 2

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return q and ddq; pointwise."""
        pairs = [(motion.q[joint], motion.ddq[joint]) for joint in range(robot.n_v)]
        return tuple(np.stack(pair) for pair in pairs), state


def predicted_rows(
    estimate: Estimate, recording: Recording, *, processing: Processing, probes: Term
) -> Iterator[PredictedRows]:
    """Yield the rows of a recording with what the model says about them, through the parallel filter.

    The error bar of row k of joint j is `sqrt(y' C y)` with its columns y and the covariance C of their parameters.

    Parameters
    ----------
    probes : columns that are filtered beside the model's own

    Raises
    ------
    RecordingError
        when the recording does not fit the robot or cannot be processed.
    """
    model = TorqueModel(robot=estimate.robot, terms=(*estimate.model.terms, probes))
    n_p = estimate.model.n_p
    kept = np.concatenate([estimate.base.independent, np.arange(n_p, model.n_p)])
    layout = model.layout(kept)
    facts = [_JointFacts.of(estimate, layout, joint) for joint in range(model.robot.n_v)]
    for rows in filtered_rows(model, layout, recording, processing):
        own = tuple(rows.columns[fact.own] for fact in facts)
        pairs = list(zip(facts, own, strict=True))
        yield PredictedRows(
            t=rows.t,
            tau=rows.tau,
            predicted=np.array([fact.weights @ columns for fact, columns in pairs]),
            std=np.array([np.linalg.norm(fact.root.T @ columns, axis=0) for fact, columns in pairs]),
            load=np.array([np.where(fact.carried, fact.weights, 0.0) @ columns for fact, columns in pairs]),
            dq=rows.dq,
            own=own,
            probes=tuple(rows.columns[fact.probes] for fact in facts),
        )


class _JointFacts(NamedTuple):
    """Where a joint's columns are, their parameters' values, a root of their covariance, and which carry a load."""

    own: slice
    probes: slice
    weights: FloatArray
    root: FloatArray
    carried: NDArray[np.bool_]

    @classmethod
    def of(cls, estimate: Estimate, layout: Layout, joint: int) -> _JointFacts:
        whole = layout.of_joint(joint)
        indices = layout.parameters[whole]
        n_own = int((indices < estimate.model.n_p).sum())
        place = base_places(estimate, indices[:n_own])
        parameters = estimate.model.parameters
        return cls(
            own=slice(whole.start, whole.start + n_own),
            probes=slice(whole.start + n_own, whole.stop),
            weights=estimate.values[place],
            root=covariance_root(estimate.covariance[np.ix_(place, place)]),
            carried=np.array([parameters[index].symbol in INERTIAL_SYMBOLS for index in indices[:n_own]], dtype=bool),
        )


def base_places(estimate: Estimate, indices: IntArray) -> IntArray:
    """Return where these standard parameters are among the base parameters."""
    place = np.full(len(estimate.base.names), -1)
    place[estimate.base.independent] = np.arange(estimate.base.n_b)
    return np.asarray(place[indices], dtype=np.intp)


def covariance_root(covariance: FloatArray) -> FloatArray:
    """Return R with `R R' = covariance`, (n, n), also where it is singular."""
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0.0, scale, 1.0)
    sizes, axes = np.linalg.eigh(covariance / np.outer(safe, safe))
    return np.asarray(safe[:, None] * axes * np.sqrt(np.maximum(sizes, 0.0)))


def joined(pieces: list[PredictedRows], recording: Recording) -> PredictedRows:
    """Return consecutive pieces as one.

    Raises
    ------
    ModelError
        when there is none.
    """
    if not pieces:
        raise ModelError("no row of the recording is left to verify on", where=recording.name)
    flat = {name: np.concatenate([getattr(piece, name) for piece in pieces], axis=-1) for name in _FLAT}
    own, probes = (
        tuple(np.concatenate(parts, axis=1) for parts in zip(*several, strict=True))
        for several in ([piece.own for piece in pieces], [piece.probes for piece in pieces])
    )
    return pieces[0]._replace(**flat, own=own, probes=probes)


def temperature_at(recording: Recording, t: FloatArray) -> FloatArray | None:
    """Return the logged temperature of each joint at the times t, (n, n_v) [deg C]; None where it was not logged."""
    if recording.temperature is None:
        return None
    return np.column_stack([np.interp(t, recording.t, column) for column in recording.temperature.T])
