"""Motion in kernel layout: joints first, samples last, so that the compiler vectorises across samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """A stretch of motion, `(n_v, n_t)` each, uniform in time.

    q, dq, ddq : position, velocity, acceleration [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    step : time between samples [s]
    temperature : of the joints [deg C], where it is known
    """

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    step: float = 0.0
    temperature: FloatArray | None = None

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.q.shape[0])

    @property
    def n_t(self) -> int:
        """Number of samples."""
        return int(self.q.shape[1])

    def samples(self, start: int, stop: int) -> Motion:
        """Return samples `start` to `stop`, end excluded."""
        parts = (self.q[:, start:stop], self.dq[:, start:stop], self.ddq[:, start:stop])
        temperature = None if self.temperature is None else self.temperature[:, start:stop]
        return Motion(q=parts[0], dq=parts[1], ddq=parts[2], step=self.step, temperature=temperature)


class MotionGradient(NamedTuple):
    """Gradient of a scalar with respect to a motion, (n_v, n_t) each."""

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray


def no_gradient(motion: Motion) -> MotionGradient:
    """Return a gradient of zeros, to add to."""
    return MotionGradient(*(np.zeros_like(motion.q) for _ in range(3)))


def motion_from_rows(q: FloatArray, dq: FloatArray, ddq: FloatArray) -> Motion:
    """Return a motion from time-first arrays `(n_t, n_v)`."""
    return Motion(q=_joint_first(q), dq=_joint_first(dq), ddq=_joint_first(ddq))


def _joint_first(rows: FloatArray) -> FloatArray:
    return np.ascontiguousarray(np.asarray(rows, dtype=np.float64).T)
