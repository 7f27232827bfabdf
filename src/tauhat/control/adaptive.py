"""Adaptive tracking control of Slotine and Li: the controller learns the model's parameters while it tracks.

With e = q - q_ref, the reference velocity v = dq_ref - L e, its derivative dv = ddq_ref - L de, and s = dq - v:

    tau = Y(q, dq, v, dv) x - K s          dx/dt = -G Y' s

The robot, `M dv + C v + g + friction = Y x*` plus `M ds + C s`, then obeys `M ds + (C + K) s = Y (x - x*)`, less what
friction damps, and since `dM/dt - 2 C` is skew-symmetric

    V = s'M s / 2 + (x - x*)' G^-1 (x - x*) / 2         dV/dt <= -s'K s

for every constant positive definite G: s goes to zero, and with it e. The parameters need not go to the true ones; they
do where the motion excites them all. Gains of a PD are found again as kd = K, kp = K L.

Noise and what the model lacks keep s from zero, and the parameters drift on it. Against that there is a dead zone: only
the part of s beyond it teaches (V counts that part alone); and bounds, to which the parameters are put back: with a
diagonal G and x* within the bounds that only lowers V. Nothing is learnt before the motion starts, and none while a
torque is at its limit: s then says nothing about the parameters.

Source: Slotine, Li, "On the adaptive control of robot manipulators", 1987; dead zone: Peterson, Narendra, "Bounded
error adaptive control", 1982.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.control.controller import ControlSample
from tauhat.control.laws import Feedforward, joint_limits
from tauhat.control.tracking_regressor import TrackingRegressor
from tauhat.errors import ArrayError, ModelError

_SYMMETRY = 1e-9  # of the largest entry of G
_DAMPED = 1e-6  # part of its diagonal added to the mean of Y'K^-1 Y before it is inverted


class Learnt(NamedTuple):
    """What the controller remembers.

    values : (n_b,) parameters
    bent : (n_elements,) states of bristles
    q_ref : (n_v,) reference of the step before
    """

    values: FloatArray
    bent: FloatArray
    q_ref: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AdaptiveTracking:
    """Slotine and Li's adaptive tracking; see the head of this file.

    regressor : of the model's base parameters
    values : (n_b,) parameters to begin with
    gain : (n_v,) K [Nm s/rad or N s/m]
    stiffness : (n_v,) L [1/s]
    learning : (n_b, n_b) G, symmetric and positive semi-definite; zeros: nothing is learnt
    dead_zone : (n_v,) of s, zero by default [rad/s or m/s]
    lower, upper : (n_b,) bounds of the parameters, infinite by default; others need a diagonal G
    torque_limit : (n_v,) largest torque [Nm or N], infinite by default
    """

    feedforward: ClassVar[Feedforward] = "nothing"
    regressor: TrackingRegressor
    values: FloatArray
    gain: FloatArray
    stiffness: FloatArray
    learning: FloatArray
    dead_zone: FloatArray = field(default_factory=lambda: np.array(0.0))
    lower: FloatArray = field(default_factory=lambda: np.array(-np.inf))
    upper: FloatArray = field(default_factory=lambda: np.array(np.inf))
    torque_limit: FloatArray = field(default_factory=lambda: np.array(np.inf))

    def __post_init__(self) -> None:
        n_v, n_b, where = self.regressor.robot.n_v, self.regressor.n_b, "adaptive tracking"
        object.__setattr__(self, "dead_zone", np.broadcast_to(self.dead_zone, (n_v,)))
        for name in ("gain", "stiffness", "dead_zone"):
            array = frozen(name, getattr(self, name), (n_v,), where=where)
            if array.min() < 0.0:
                raise ArrayError(f"{name} is negative", where=where, got=f"{array.min():g}")
            object.__setattr__(self, name, array)
        object.__setattr__(self, "values", frozen("values", self.values, (n_b,), where=where))
        object.__setattr__(self, "learning", frozen("learning", self.learning, (n_b, n_b), where=where))
        for name in ("lower", "upper"):
            bounds = np.array(np.broadcast_to(np.asarray(getattr(self, name), dtype=np.float64), (n_b,)))
            object.__setattr__(self, name, read_only(bounds))
        object.__setattr__(self, "torque_limit", joint_limits(self.torque_limit, n_v, where))
        self._check_learning(where)

    def _check_learning(self, where: str) -> None:
        learning = self.learning
        size = float(np.abs(learning).max())
        skew = float(np.abs(learning - learning.T).max())
        if skew > _SYMMETRY * size or np.linalg.eigvalsh(learning).min() < -_SYMMETRY * size:
            raise ModelError("learning is not symmetric and positive semi-definite", where=where)
        if not ((self.lower <= self.values) & (self.values <= self.upper)).all():
            raise ModelError("a parameter begins outside its bounds", where=where)
        bounded = bool(np.isfinite(self.lower).any() or np.isfinite(self.upper).any())
        if bounded and np.count_nonzero(learning - np.diag(np.diag(learning))):
            raise ModelError(
                "bounds need a diagonal matrix of learning",
                where=where,
                remedy="keep its diagonal, or leave out bounds",
            )

    def start(self, sample: ControlSample) -> Learnt:
        """Return the parameters to begin with, and friction that nothing has bent."""
        return Learnt(self.values, np.zeros(self.regressor.elements.size), sample.q_ref)

    def step(self, memory: Learnt, sample: ControlSample) -> tuple[Learnt, FloatArray]:
        """Return what is known behind this step, and the motor torque (n_v,) [Nm or N]."""
        t, period, q, dq, q_ref, dq_ref, ddq_ref, _, _ = sample
        error, error_rate = q - q_ref, dq - dq_ref
        v = dq_ref - self.stiffness * error
        dv = ddq_ref - self.stiffness * error_rate
        s = dq - v
        bent = self.regressor.bent(memory.bent, q_ref - memory.q_ref)
        columns = self.regressor.columns((q, dq), v, dv, bent=bent)
        wanted = columns @ memory.values - self.gain * s
        torque = np.maximum(np.minimum(wanted, self.torque_limit), -self.torque_limit)
        values = memory.values
        if t >= 0.0 and (torque == wanted).all():
            beyond = s - np.maximum(np.minimum(s, self.dead_zone), -self.dead_zone)
            moved = values - period * (self.learning @ (columns.T @ beyond))
            values = np.maximum(np.minimum(moved, self.upper), self.lower)
        return Learnt(values, bent, q_ref), torque


def learning_along(
    regressor: TrackingRegressor,
    motion: tuple[FloatArray, FloatArray, FloatArray],
    *,
    gain: FloatArray,
    time: float,
    most: int = 500,
) -> FloatArray:
    """Return G with which all parameters are learnt alike, within about the time, on such a motion, (n_b, n_b).

    `G = (mean of Y' K^-1 Y)^-1 / time` along the reference: fast motion of e apart, `dx/dt = -G Y'K^-1 Y (x - x*)`.

    Parameters
    ----------
    motion : q, dq, ddq of the reference, (n_t, n_v) each
    gain : (n_v,) K
    time : [s]
    most : samples of the motion that are looked at

    Raises
    ------
    ModelError
        when the time is not positive, or a joint has no gain.
    """
    if not 0.0 < time < np.inf:
        raise ModelError("time of learning", expected="a positive number", got=time)
    if not np.min(gain) > 0.0:
        raise ModelError("gain of adaptive tracking", expected="positive on every joint", got=np.min(gain))
    stride = max(1, len(motion[0]) // most)
    mean = np.zeros((regressor.n_b, regressor.n_b))
    bent = np.zeros(regressor.elements.size)
    before = motion[0][0]
    rows = [signal[::stride] for signal in motion]
    for q, dq, ddq in zip(*rows, strict=True):
        bent, before = regressor.bent(bent, q - before), q
        columns = regressor.columns((q, dq), dq, ddq, bent=bent)
        mean += columns.T @ (columns / gain[:, None])
    mean /= len(rows[0])
    diagonal = np.diag(mean)
    if not diagonal.min() > 0.0:
        raise ModelError("the motion does not move every parameter", where=f"parameter {int(np.argmin(diagonal)) + 1}")
    return even_learning(mean, time=time)


def even_learning(mean: FloatArray, *, time: float) -> FloatArray:
    """Return G with which all directions are learnt alike, `mean^-1 / time`, (n_b, n_b).

    Parameters
    ----------
    mean : (n_b, n_b) of Y' K^-1 Y, with a diagonal above zero; that is damped a little before it is inverted
    time : [s]
    """
    damped = mean + _DAMPED * np.diag(np.diag(mean))
    scale = np.sqrt(np.diag(damped))
    root = np.linalg.cholesky(damped / np.outer(scale, scale))
    half = np.linalg.solve(root, np.diag(1.0 / scale))
    return np.asarray(half.T @ half / time)
