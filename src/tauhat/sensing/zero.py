"""Zeroing: what is taken off the external torque before anyone calls it contact.

Two ways, for two kinds of error. Standing, friction holds any torque up to its breakaway, so what is sensed when an arm
comes to rest is taken as nothing: `StandingZero`. In motion the model's error belongs to the place on the path, so the
same motion in air tells it: `AirPass`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SensingError
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.wrench import WrenchSolver

_FEWEST = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class StandingZero:
    """The external torque over the first moments of standing is a joint's zero.

    A push that begins in them, or slower than `follow`, goes into the zero; one that is held into standstill does not,
    if it was found before.

    seconds : over which the mean is taken; 0 for no zero at all
    fade : way of the fastest joint over which the zero loses all but 37 % of itself [rad or m]
    follow : later, the zero follows with this time constant while nothing touches the arm [s]; inf for one that stays
    """

    seconds: float = 0.5
    fade: float = 0.02
    follow: float = 5.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.seconds < np.inf and self.fade > 0.0 and self.follow > 0.0):
            raise SensingError(
                "zero of a standing arm", expected="seconds of at least 0, fade and follow above 0",
                got=f"{self.seconds}, {self.fade}, {self.follow}",
            )  # fmt: skip


NO_ZERO = StandingZero(seconds=0.0)
"""What is sensed is taken as it is."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AirPass:
    """External torque and wrench that a motion shows without contact, by progress along it.

    progress : (n,) increasing; time since the motion began, or length of path
    torque : (n, n_v) [Nm or N]
    wrench : (n, 6) [N, Nm]
    """

    progress: FloatArray
    torque: FloatArray
    wrench: FloatArray

    def __post_init__(self) -> None:
        progress = frozen("progress", self.progress, (None,), where="pass in air")
        object.__setattr__(self, "progress", progress)
        for name, columns in (("torque", None), ("wrench", 6)):
            value = frozen(name, getattr(self, name), (progress.size, columns), where="pass in air")
            object.__setattr__(self, name, value)
        if progress.size < _FEWEST or (np.diff(progress) <= 0.0).any():
            raise SensingError("progress of a pass in air", expected=f"{_FEWEST} or more, increasing")

    def torque_at(self, progress: FloatArray) -> FloatArray:
        """Return the torque to take off at these places of the motion, (n, n_v); beyond its ends that of the end."""
        return _at(self.progress, self.torque, progress)

    def wrench_at(self, progress: FloatArray) -> FloatArray:
        """Return the wrench to take off at these places of the motion, (n, 6)."""
        return _at(self.progress, self.wrench, progress)


def air_pass(sensed: SensedLog, *, progress: FloatArray | None = None) -> AirPass:
    """Return what a log of a motion in air tells of the same motion in contact.

    Parameters
    ----------
    progress : (n_t,) of the samples along the motion, increasing; time since the first by default

    Raises
    ------
    ArrayError, SensingError
        progress of another length, or that does not increase.
    """
    along = sensed.t - sensed.t[0] if progress is None else frozen("progress", progress, (sensed.n_t,))
    kept = sensed.settled
    return AirPass(progress=along[kept], torque=sensed.tau[kept], wrench=sensed.wrench[kept])


def zeroed(sensed: SensedLog, zero: FloatArray, *, solver: WrenchSolver) -> SensedLog:
    """Return what was sensed less a zero of the joints; the wrench is solved again.

    Parameters
    ----------
    zero : (n_t, n_v) of a `ContactDetector` or of an `AirPass` [Nm or N]
    solver : frame and directions of the wrench

    Raises
    ------
    ArrayError
        when the zero has another shape.
    """
    tau = sensed.tau - frozen("zero", zero, sensed.tau.shape, where=sensed.name)
    found = solver.along(sensed.q, tau, np.square(sensed.tau_std) + np.square(sensed.lag))
    return replace(sensed, tau=tau, wrench=found.wrench, wrench_std=found.standard_errors, frame=str(solver.frame))


def _at(progress: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    places = frozen("progress", wanted, (None,), where="pass in air")
    return np.stack([np.interp(places, progress, column) for column in values.T], axis=1)
