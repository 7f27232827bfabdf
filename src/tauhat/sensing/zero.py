"""Zeroing: what is taken off the external torque before anyone calls it contact.

Two ways, for two kinds of error. Standing, friction holds any torque up to its breakaway, so what is sensed when an arm
comes to rest is taken as nothing: `StandingZero`. In motion the model's error belongs to the place on the path, so the
same motion in air tells it: `AirPass`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SensingError
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.wrench import WrenchSolver

Zero: TypeAlias = Literal["as sensed", "standing"]
"""Whether what is told holds what friction held when the arm came to rest, or less it."""

_FEWEST = 2
_SAME_PLACE = 0.05  # [rad or m] to which two passes of a motion agree
_ELSEWHERE = 0.05  # share of the samples that may be further apart
_APART = 5.0  # [s] that the logs of two passes may begin apart
_COARSE, _FINE = 0.02, 41  # step of the search for that time [s], and places within it
_COMPARED = 2000  # samples by which it is found
_CHUNK = 2**16  # samples


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
    q : (n, n_v) where the arm was, to tell other motions [rad or m]; None: nobody checks
    """

    progress: FloatArray
    torque: FloatArray
    wrench: FloatArray
    q: FloatArray | None = None

    def __post_init__(self) -> None:
        progress = frozen("progress", self.progress, (None,), where="pass in air")
        object.__setattr__(self, "progress", progress)
        for name, columns in (("torque", None), ("wrench", 6)):
            value = frozen(name, getattr(self, name), (progress.size, columns), where="pass in air")
            object.__setattr__(self, name, value)
        if self.q is not None:
            object.__setattr__(self, "q", frozen("q", self.q, self.torque.shape, where="pass in air"))
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
    return AirPass(progress=along[kept], torque=sensed.tau[kept], wrench=sensed.wrench[kept], q=sensed.q[kept])


def without_air(sensed: SensedLog, air: AirPass, *, solver: WrenchSolver) -> SensedLog:
    """Return what was sensed less a pass in air of the same motion, by the time at which the positions fit.

    The two logs may begin up to five seconds apart, and one may be longer. Samples where the arm is elsewhere than in
    the pass, or than it ended, are no longer `settled`: nothing is known of them.

    Parameters
    ----------
    air : by time, with its positions

    Raises
    ------
    SensingError
        when the motions differ: more than a twentieth of the samples within the pass more than 0.05 rad or m apart.
    """
    since = sensed.t - sensed.t[0]
    progress = since + _shift(since, sensed, air)
    apart = np.abs(sensed.q - _at(air.progress, _positions(air), progress)).max(axis=1)
    elsewhere = sensed.settled & (apart > _SAME_PLACE)
    during = sensed.settled & (progress >= air.progress[0]) & (progress <= air.progress[-1])
    share = float((elsewhere & during).sum() / during.sum()) if during.any() else 1.0
    if share > _ELSEWHERE:
        raise SensingError(
            "not the motion of the pass in air", where=sensed.name,
            expected=f"positions within {_SAME_PLACE:g} rad or m, logs that begin within {_APART:g} s of each other",
            got=f"{100.0 * share:.0f} % of the samples within the pass elsewhere" if during.any() else "none within it",
            remedy="log the same motion in air",
        )  # fmt: skip
    found = zeroed(sensed, air.torque_at(progress), solver=solver)
    return replace(found, settled=sensed.settled & ~elsewhere)


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
    less = replace(sensed, tau=sensed.tau - frozen("zero", zero, sensed.tau.shape, where=sensed.name))
    wrench, errors, shared = (np.empty((sensed.n_t, n)) for n in (6, 6, 3))
    for first in range(0, sensed.n_t, _CHUNK):  # covariances take 36 numbers a sample
        window = slice(first, first + _CHUNK)
        found = less.solved_by(solver, window)
        wrench[window], errors[window] = found.wrench, found.standard_errors
        shared[window] = found.covariance[:, [0, 0, 1], [1, 2, 2]]
    return replace(less, wrench=wrench, wrench_std=errors, force_shared=shared, frame=str(solver.frame))


def _shift(since: FloatArray, sensed: SensedLog, air: AirPass) -> float:
    """Return how much later in the pass the positions of a log fit best [s]."""
    rows = np.unique(np.linspace(0, sensed.n_t - 1, _COMPARED).astype(np.intp))
    q, places = sensed.q[rows], _positions(air)

    def best(shifts: FloatArray) -> float:
        apart = [np.square(q - _at(air.progress, places, since[rows] + shift)).mean() for shift in shifts]
        return float(shifts[int(np.argmin(apart))])

    coarse = best(np.arange(-_APART, _APART + _COARSE, _COARSE))
    return best(np.linspace(coarse - _COARSE, coarse + _COARSE, _FINE))


def _positions(air: AirPass) -> FloatArray:
    if air.q is None:
        raise SensingError("a pass in air without positions", remedy="make it with air_pass")
    return air.q


def _at(progress: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    places = frozen("progress", wanted, (None,), where="pass in air")
    return np.stack([np.interp(places, progress, column) for column in values.T], axis=1)
