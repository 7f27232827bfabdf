"""Control laws as pure steps: references and state in, torque out; no plant, no clock.

Every law tracks a reference joint by joint, `clip(feedforward + kp (q_ref - q) + kd (dq_ref - dq) + ki integral)`; they
differ in what the feedforward is and whether there is an integral.
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass, field
from typing import ClassVar, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import ArrayError

Feedforward: TypeAlias = Literal["nothing", "gravity", "dynamics"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingLaw(ABC):
    """What all tracking laws have: gains of every joint and the largest torque.

    kp, kd : (n_v,) gains [Nm/rad, Nm s/rad] or [N/m, N s/m]
    torque_limit : (n_v,) largest torque [Nm or N], infinite by default
    """

    key: ClassVar[str]
    feedforward: ClassVar[Feedforward]
    kp: FloatArray
    kd: FloatArray
    torque_limit: FloatArray = field(default_factory=lambda: np.array(np.inf))

    def __post_init__(self) -> None:
        where = type(self).__name__
        kp = frozen("kp", self.kp, (None,), where=where)
        if not kp.size:
            raise ArrayError("kp is empty", where=where, expected="a gain a joint")
        kd = frozen("kd", self.kd, kp.shape, where=where)
        if min(kp.min(), kd.min()) < 0.0:
            raise ArrayError("a gain is negative", where=where, got=f"kp {kp.min():g}, kd {kd.min():g}")
        object.__setattr__(self, "kp", kp)
        object.__setattr__(self, "kd", kd)
        object.__setattr__(self, "torque_limit", joint_limits(self.torque_limit, kp.size, where))

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.kp.size)

    @property
    def integral_gain(self) -> FloatArray:
        """Gain of the integral, (n_v,) [Nm/(rad s)] or [N/(m s)]; zero without one."""
        return np.zeros(self.n_v)

    def step(
        self,
        integral: FloatArray,
        error: FloatArray,
        error_rate: FloatArray,
        *,
        period: float,  # noqa: ARG002 (of laws with an integral)
        feedforward: FloatArray | float = 0.0,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the integral behind this step, which a law without one leaves alone, and the torque, (n_v,) each.

        `tau = clip(feedforward + kp e + kd de)`

        Parameters
        ----------
        integral : (n_v,) of the position error so far [rad s or m s]; zeros at the start
        error, error_rate : (n_v,) `q_ref - q` and `dq_ref - dq`
        period : between two steps [s]
        feedforward : (n_v,) of the kind that the law names [Nm or N]
        """
        return integral, self._clipped(feedforward + self.kp * error + self.kd * error_rate)

    def _clipped(self, wanted: FloatArray) -> FloatArray:
        # np.clip costs three times as much on the short arrays of a control step.
        return np.asarray(np.maximum(np.minimum(wanted, self.torque_limit), -self.torque_limit))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PD(TrackingLaw):
    """Proportional-derivative control of each joint, within torque limits."""

    key: ClassVar[str] = "pd"
    feedforward: ClassVar[Feedforward] = "nothing"

    def torque(self, q: FloatArray, dq: FloatArray, *, q_ref: FloatArray, dq_ref: FloatArray) -> FloatArray:
        """Return `kp (q_ref - q) + kd (dq_ref - dq)` clipped to the limits, (..., n_v) [Nm or N]."""
        return self._clipped(self.kp * (q_ref - q) + self.kd * (dq_ref - dq))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PDGravity(TrackingLaw):
    """Proportional-derivative control of each joint on top of a gravity feedforward, within torque limits.

    kp, kd : (n_v,) gains [Nm/rad, Nm s/rad] or [N/m, N s/m]
    torque_limit : (n_v,) largest torque [Nm or N], infinite by default
    """

    key: ClassVar[str] = "pd-gravity"
    feedforward: ClassVar[Feedforward] = "gravity"

    def torque(
        self, q: FloatArray, dq: FloatArray, *, q_ref: FloatArray, dq_ref: FloatArray, gravity_torque: FloatArray
    ) -> FloatArray:
        """Return `gravity + kp (q_ref - q) + kd (dq_ref - dq)` clipped to the limits, (..., n_v) [Nm or N].

        Parameters
        ----------
        q, dq : (..., n_v) state
        q_ref, dq_ref : (..., n_v) reference
        gravity_torque : (..., n_v) feedforward [Nm or N]
        """
        return self._clipped(gravity_torque + self.kp * (q_ref - q) + self.kd * (dq_ref - dq))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PDFeedforward(TrackingLaw):
    """Proportional-derivative control of each joint on top of the whole model's torque along the reference."""

    key: ClassVar[str] = "pd-feedforward"
    feedforward: ClassVar[Feedforward] = "dynamics"

    def torque(
        self, q: FloatArray, dq: FloatArray, *, q_ref: FloatArray, dq_ref: FloatArray, model_torque: FloatArray
    ) -> FloatArray:
        """Return `model_torque + kp (q_ref - q) + kd (dq_ref - dq)` clipped to the limits, (..., n_v) [Nm or N].

        Parameters
        ----------
        q, dq : (..., n_v) state
        q_ref, dq_ref : (..., n_v) reference
        model_torque : (..., n_v) inverse dynamics of the reference, friction included [Nm or N]
        """
        return self._clipped(model_torque + self.kp * (q_ref - q) + self.kd * (dq_ref - dq))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PID(TrackingLaw):
    """Proportional-integral-derivative control of each joint, within torque limits.

    ki : (n_v,) gain of the integral [Nm/(rad s)] or [N/(m s)]
    """

    key: ClassVar[str] = "pid"
    feedforward: ClassVar[Feedforward] = "nothing"
    ki: FloatArray

    def __post_init__(self) -> None:
        super(PID, self).__post_init__()
        ki = frozen("ki", self.ki, self.kp.shape, where="PID")
        if ki.min() < 0.0:
            raise ArrayError("a gain is negative", where="PID", got=f"ki {ki.min():g}")
        object.__setattr__(self, "ki", ki)

    @property
    def integral_gain(self) -> FloatArray:
        """Gain of the integral, (n_v,)."""
        return self.ki

    def step(
        self,
        integral: FloatArray,
        error: FloatArray,
        error_rate: FloatArray,
        *,
        period: float,
        feedforward: FloatArray | float = 0.0,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the integral behind this step of the controller, and its torque, (n_v,) each.

        `tau = clip(feedforward + kp e + kd de + ki integral)`; then `integral + period e`, except on joints whose
        torque is at its limit and whose error would drive it further. Parameters as those of every law.
        """
        wanted = feedforward + self.kp * error + self.kd * error_rate + self.ki * integral
        torque = self._clipped(wanted)
        winding = (np.abs(wanted) >= self.torque_limit) & (torque * error >= 0.0)
        return integral + np.where(winding, 0.0, period * error), torque


def joint_limits(value: FloatArray, n_v: int, where: str) -> FloatArray:
    """Return a torque limit a joint, (n_v,) read-only; one value counts for all.

    Raises
    ------
    ArrayError
        when there is not one a joint, or one is not positive.
    """
    given = np.asarray(value, dtype=np.float64)
    if given.shape not in {(), (n_v,)}:
        raise ArrayError("torque_limit has the wrong shape", where=where, expected=(n_v,), got=given.shape)
    limit = np.array(np.broadcast_to(given, (n_v,)))
    if not (limit > 0.0).all():
        joint = int(np.argmin(limit > 0.0)) + 1
        raise ArrayError("a torque limit is not positive", where=f"{where}, joint {joint}", got=limit[joint - 1])
    return np.asarray(read_only(limit))
