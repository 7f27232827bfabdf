"""Control laws as pure steps: references and state in, torque out; no plant, no clock."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import ArrayError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PDGravity:
    """Proportional-derivative control of each joint on top of a gravity feedforward, within torque limits.

    kp, kd : (n_v,) gains [Nm/rad, Nm s/rad] or [N/m, N s/m]
    torque_limit : (n_v,) largest torque [Nm or N], infinite by default
    """

    kp: FloatArray
    kd: FloatArray
    torque_limit: FloatArray = field(default_factory=lambda: np.array(np.inf))

    def __post_init__(self) -> None:
        kp = frozen("kp", self.kp, (None,), where="PDGravity")
        kd = frozen("kd", self.kd, kp.shape, where="PDGravity")
        if min(kp.min(), kd.min()) < 0.0:
            raise ArrayError("a gain is negative", where="PDGravity", got=f"kp {kp.min():g}, kd {kd.min():g}")
        object.__setattr__(self, "kp", kp)
        object.__setattr__(self, "kd", kd)
        object.__setattr__(self, "torque_limit", _limit(self.torque_limit, kp.size))

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
        wanted = gravity_torque + self.kp * (q_ref - q) + self.kd * (dq_ref - dq)
        # np.clip costs three times as much on the short arrays of a control step.
        return np.asarray(np.maximum(np.minimum(wanted, self.torque_limit), -self.torque_limit))


def _limit(value: FloatArray, n_v: int) -> FloatArray:
    given = np.asarray(value, dtype=np.float64)
    if given.shape not in {(), (n_v,)}:
        raise ArrayError("torque_limit has the wrong shape", where="PDGravity", expected=(n_v,), got=given.shape)
    limit = np.array(np.broadcast_to(given, (n_v,)))
    if not (limit > 0.0).all():
        joint = int(np.argmin(limit > 0.0)) + 1
        raise ArrayError("a torque limit is not positive", where=f"PDGravity, joint {joint}", got=limit[joint - 1])
    return np.asarray(read_only(limit))
