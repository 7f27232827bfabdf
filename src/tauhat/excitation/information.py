"""What a motion tells about a model: the information matrix, and the gradient of a criterion through the regressor."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, IntArray, frozen, read_only
from tauhat.dynamics.base import base_parameters, independent_among, random_motion
from tauhat.dynamics.model import Layout, TorqueModel
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Coulomb
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import Criterion
from tauhat.excitation.limits.joint_limits import MotionLimits

_SEED = 20240229
_STATES = 2000
_SMOOTH_SIGN = 0.02  # width of the smooth sign while a motion is designed, in parts of the speed limit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Information:
    """Which columns count, and by what constants they are scaled.

    model : robot and terms, shapes settled
    columns : (n,) indices of the base parameters that count
    scales : (n,) RMS of each column over the equations of random states in the limits; a motion cannot change them
    weights : (n_v,) of the joints, one over the torque noise
    prior : (n, n) scaled information that other motions already gave, added to every motion's own; zeros for none
    """

    model: TorqueModel
    columns: IntArray
    scales: FloatArray
    weights: FloatArray
    layout: Layout
    prior: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "prior", frozen("prior information", self.prior, (self.n, self.n)))

    @property
    def n(self) -> int:
        """Number of columns."""
        return int(self.columns.size)

    def matrix(self, motion: Motion) -> FloatArray:
        """Return `M = (1/N) sum_j w_j^2 A_j'A_j + prior` with scaled columns, (n, n)."""
        return self._matrix(self._rows(motion), motion.n_t)

    def matrices(self, motion: Motion, count: int) -> FloatArray:
        """Return M of each of `count` equally long motions that stand one after the other, (count, n, n)."""
        rows = self._rows(motion).reshape(-1, count, motion.n_t // count)
        matrices = np.zeros((count, self.n, self.n))
        for joint, place in enumerate(self._places()):
            part = rows[self.layout.of_joint(joint)].transpose(1, 0, 2)
            matrices[:, place[:, None], place] += part @ part.transpose(0, 2, 1)
        return np.asarray(matrices / (motion.n_t // count) + self.prior)

    def evaluate(self, motion: Motion, criterion: Criterion) -> tuple[float, MotionGradient]:
        """Return a criterion of the motion and its gradient with respect to q, dq, ddq, (n_v, n_t) each."""
        rows = self._rows(motion)
        value, slope = criterion.evaluate(self._matrix(rows, motion.n_t))
        bars = np.empty_like(rows)
        for joint, place in enumerate(self._places()):
            part = self.layout.of_joint(joint)
            bars[part] = (2.0 / motion.n_t) * slope[np.ix_(place, place)] @ rows[part]
        return value, self.model.pull(motion, self.layout, bars * self._factors()[:, None])

    def _rows(self, motion: Motion) -> FloatArray:
        rows, _ = self.model.columns(motion, self.layout)
        rows *= self._factors()[:, None]
        return rows

    def _matrix(self, rows: FloatArray, n_t: int) -> FloatArray:
        matrix = np.zeros((self.n, self.n))
        for joint, place in enumerate(self._places()):
            part = rows[self.layout.of_joint(joint)]
            matrix[np.ix_(place, place)] += part @ part.T
        return np.asarray(matrix / n_t + self.prior)

    def _places(self) -> list[IntArray]:
        position = np.full(self.model.n_p, -1)
        position[self.columns] = np.arange(self.n)
        rows = [self.layout.of_joint(joint) for joint in range(self.model.robot.n_v)]
        return [position[self.layout.parameters[part]] for part in rows]

    def _factors(self) -> FloatArray:
        position = np.full(self.model.n_p, -1)
        position[self.columns] = np.arange(self.n)
        joints = np.repeat(np.arange(self.model.robot.n_v), np.diff(self.layout.bounds))
        return np.asarray(self.weights[joints] / self.scales[position[self.layout.parameters]])


def information(
    model: TorqueModel, *, terms: Iterable[str] = (), torque_noise: FloatArray | None = None
) -> Information:
    """Return what counts when motions for this model are compared.

    Parameters
    ----------
    terms : keys of the terms whose columns count; all by default
    torque_noise : (n_v,) deviation of each joint's torque noise [Nm or N]; all alike by default

    Raises
    ------
    ExcitationError
        when no column is left, or a noise is not positive.
    """
    return _information(model, _columns(model, set(terms)), torque_noise)


def payload_information(model: TorqueModel, *, torque_noise: FloatArray | None = None) -> Information:
    """Return what counts for a payload: the inertial columns of the last link that can be told from each other.

    Raises
    ------
    ExcitationError
        when the model has no such column, or a noise is not positive.
    """
    return _information(model, _payload_columns(model), torque_noise)


def _information(model: TorqueModel, columns: IntArray, torque_noise: FloatArray | None) -> Information:
    n_v = model.robot.n_v
    noise = frozen("torque_noise", np.ones(n_v) if torque_noise is None else torque_noise, (n_v,))
    if not (noise > 0).all():
        raise ExcitationError("torque noise must be positive", got=noise.tolist())
    layout = model.layout(columns)
    return Information(
        model=model,
        columns=read_only(columns),
        scales=read_only(_scales(model, layout, columns)),
        weights=read_only(1.0 / noise),
        layout=layout,
        prior=np.zeros((columns.size, columns.size)),
    )


def with_exact_sign(model: TorqueModel) -> TorqueModel:
    """Return the model with the exact sign of the speed in its Coulomb columns, where it has some."""
    if all(term.key != Coulomb.key for term in model.terms):
        return model
    return model.with_term(Coulomb())


def with_smooth_sign(model: TorqueModel, limits: MotionLimits) -> TorqueModel:
    """Return the model with the sign of the speed smoothed for a search, where its Coulomb columns have one."""
    if all(term.key != Coulomb.key for term in model.terms):
        return model
    return model.with_term(Coulomb(widths=tuple((_SMOOTH_SIGN * limits.velocity).tolist())))


def after_motions(facts: Information, motions: Iterable[Motion]) -> Information:
    """Return the same columns with what equally long motions already told about them."""
    prior = sum((facts.matrix(motion) - facts.prior for motion in motions), start=facts.prior)
    return replace(facts, prior=prior)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Knowledge:
    """What an estimate already knows, for the motion that comes after it.

    names : (n,) of the parameters that the covariance is of
    covariance : (n, n) `estimate.covariance`
    torque_noise : (n_v,) `estimate.joint_rms` [Nm or N]
    rows_per_second : independent rows that a second of motion gives, twice the low-pass of the estimate [1/s]
    """

    names: tuple[str, ...]
    covariance: FloatArray
    torque_noise: FloatArray
    rows_per_second: float

    def __post_init__(self) -> None:
        n = len(self.names)
        object.__setattr__(self, "covariance", frozen("covariance", self.covariance, (n, n)))
        object.__setattr__(self, "torque_noise", frozen("torque_noise", self.torque_noise, (None,)))
        if not ((self.torque_noise > 0).all() and self.rows_per_second > 0):
            raise ExcitationError("torque noise and rows must be positive", got=self.torque_noise.tolist())


def after_evidence(facts: Information, known: Knowledge, *, seconds: float) -> Information:
    """Return the same columns with what is already known about them, and joints weighted by the estimate's residuals.

    The estimate may be of a model with other friction: what both models have counts as known, the rest as unknown.

    Parameters
    ----------
    seconds : length of the motion to design

    Raises
    ------
    ExcitationError
        when the estimate knows none of the columns.
    """
    parameters = facts.model.parameters
    wanted = [parameters[index].name for index in facts.columns]
    place = {name: index for index, name in enumerate(known.names)}
    here = np.array([index for index, name in enumerate(wanted) if name in place], dtype=np.intp)
    there = np.array([place[wanted[index]] for index in here], dtype=np.intp)
    if not here.size:
        raise ExcitationError("the estimate knows no parameter of this model", where=facts.model.robot.name)
    scales = facts.scales[here]
    told = np.linalg.pinv(known.covariance[np.ix_(there, there)] * np.outer(scales, scales), hermitian=True)
    prior = np.zeros((facts.n, facts.n))
    prior[np.ix_(here, here)] = 0.5 * (told + told.T) / (seconds * known.rows_per_second)
    return replace(facts, weights=read_only(1.0 / known.torque_noise), prior=prior)


def _columns(model: TorqueModel, wanted: set[str]) -> IntArray:
    owner = [term.key for term in model.terms for _ in term.parameters(model.robot)]
    kept = wanted or set(owner)
    columns = np.array([index for index in base_parameters(model).independent if owner[index] in kept], dtype=np.intp)
    if not columns.size:
        raise ExcitationError("no column of the model is among the terms asked for", got=", ".join(sorted(kept)))
    return columns


def _payload_columns(model: TorqueModel) -> IntArray:
    last = model.robot.n_v - 1
    wanted = [
        index
        for index, parameter in enumerate(model.parameters)
        if parameter.joint == last and parameter.symbol in INERTIAL_SYMBOLS
    ]
    columns = independent_among(model, np.array(wanted, dtype=np.intp))
    if not columns.size:
        raise ExcitationError("the model has no inertia of a last link to carry a payload", where=model.robot.name)
    return columns


def _scales(model: TorqueModel, layout: Layout, columns: IntArray) -> FloatArray:
    states = random_motion(model.robot, _STATES, np.random.default_rng(_SEED))
    rows, _ = model.columns(states, layout)
    squares = np.zeros(model.n_p)
    np.add.at(squares, layout.parameters, np.mean(rows**2, axis=1))
    return np.asarray(np.sqrt(squares[columns] / model.robot.n_v))
