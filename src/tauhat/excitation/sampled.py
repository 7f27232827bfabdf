"""A motion read from a file: samples joined by quintic polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import ExcitationError
from tauhat.excitation.trajectory import MotionSamples
from tauhat.recordings.recording import Recording

# Rows: what multiplies q, h dq, h^2 ddq at the left sample, then h^2 ddq, h dq, q at the right one; columns: powers of
# the part u of the step h that has passed.
_QUINTIC = (
    (1.0, 0.0, 0.0, -10.0, 15.0, -6.0),
    (0.0, 1.0, 0.0, -6.0, 8.0, -3.0),
    (0.0, 0.0, 0.5, -1.5, 1.5, -0.5),
    (0.0, 0.0, 0.0, 0.5, -1.0, 0.5),
    (0.0, 0.0, 0.0, -4.0, 7.0, -3.0),
    (0.0, 0.0, 0.0, 10.0, -15.0, 6.0),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledMotion:
    """A motion through given samples whose position, velocity and acceleration are theirs, and continuous between.

    Each step is the quintic Hermite polynomial of its two ends; its error is of sixth order in the step.

    samples : from t = 0 on, at increasing times
    """

    samples: MotionSamples

    def __post_init__(self) -> None:
        t = self.samples.t
        if t.size < 2 or t[0] != 0.0 or not (np.diff(t) > 0.0).all():
            raise ExcitationError("samples of a motion", expected="two or more, at increasing times from 0 on")

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.samples.n_v

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.samples.t[-1])

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]; before its start and after its end, the sample there."""
        given = self.samples
        inside = np.clip(t, 0.0, self.duration)
        left = np.clip(np.searchsorted(given.t, inside, side="right") - 1, 0, given.n_t - 2)
        step = (given.t[left + 1] - given.t[left])[:, None]
        part = (inside - given.t[left]) / step[:, 0]
        ends = np.stack([given.q[left], step * given.dq[left], step**2 * given.ddq[left]])
        others = np.stack([step**2 * given.ddq[left + 1], step * given.dq[left + 1], given.q[left + 1]])
        values = np.concatenate([ends, others])
        q, dq, ddq = (
            np.einsum("kt,ktj->tj", basis @ part ** np.arange(6)[:, None], values) / step**order
            for order, basis in enumerate(_derivatives())
        )
        return MotionSamples(t=t, q=q, dq=dq, ddq=ddq)


def sampled_motion(recording: Recording) -> SampledMotion:
    """Return the motion that a motion file holds.

    Raises
    ------
    ExcitationError
        when it lacks velocities or accelerations.
    """
    dq, ddq = recording.dq, recording.ddq
    if dq is None or ddq is None:
        raise ExcitationError(
            "a motion file has velocities and accelerations", where=recording.name,
            expected="columns t, q_1.., dq_1.., ddq_1..", got=", ".join(recording.channels()),
            remedy="write it with tauhat excite",
        )  # fmt: skip
    samples = MotionSamples(t=recording.t - recording.t[0], q=recording.q, dq=dq, ddq=ddq)
    return SampledMotion(samples=samples)


@cache
def _derivatives() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the polynomials and their first and second derivative in u, (6, 6) each."""
    position = np.array(_QUINTIC)
    slope = np.diag(np.arange(1.0, 6.0), k=-1)  # powers of u to the powers of its derivative
    velocity = position @ slope
    return read_only(position), read_only(velocity), read_only(velocity @ slope)
