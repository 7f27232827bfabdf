"""How a controller speeds up and slows down: with bounded acceleration, or with bounded jerk as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError, MissingExtraError
from tauhat.excitation.point_to_point import Course
from tauhat.excitation.waypoints.time_law import RateLimits, TimeLaw, law_of_phases

_HALVINGS = 60
_SAFE = 1e-6  # part of a distance kept in reserve when speeds are changed over it with bounded jerk
_NOTHING = 1e-12  # part of a way that takes no time


class Ramps(Protocol):
    """The course of speed along a way, and the shape of the corner between two ways.

    key : name in files
    corner_acceleration, corner_jerk : largest second and third derivative of `corner` by the part of the time
    """

    @property
    def key(self) -> str: ...  # noqa: D102

    @property
    def corner_acceleration(self) -> float: ...  # noqa: D102

    @property
    def corner_jerk(self) -> float: ...  # noqa: D102

    def corner(self, part: FloatArray) -> Course:
        """Return how the next way begins in a corner, from 0 at rest to 1 at speed 2, by the part of the time.

        The way before ends as the same shape backwards; the two speeds add up to a constant.
        """
        ...

    def reachable(self, rate: float, distance: float, limits: RateLimits) -> float:
        """Return the highest speed that can follow a speed after a distance [1/s]."""
        ...

    def law(self, ends: tuple[float, float], rates: tuple[float, float], limits: RateLimits) -> TimeLaw:
        """Return the fastest law from one fraction to another, with given speeds there and no acceleration beyond."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerationLimited:
    """Trapezoidal speed: constant acceleration, constant speed, constant deceleration. Corners are parabolas."""

    key: ClassVar[str] = "trapezoidal"
    corner_acceleration: ClassVar[float] = 2.0
    corner_jerk: ClassVar[float] = 0.0

    def corner(self, part: FloatArray) -> Course:
        """Return the parabola `u^2`."""
        return Course(part**2, 2.0 * part, np.full_like(part, 2.0))

    def reachable(self, rate: float, distance: float, limits: RateLimits) -> float:
        """Return `sqrt(rate^2 + 2 acceleration distance)`, at most the speed limit."""
        if distance < _NOTHING:
            return rate
        return float(min(limits.speed, np.sqrt(rate**2 + 2.0 * limits.acceleration * distance)))

    def law(self, ends: tuple[float, float], rates: tuple[float, float], limits: RateLimits) -> TimeLaw:
        """Return three phases: up to the highest speed that fits, along, and down."""
        (first, last), distance, a = rates, ends[1] - ends[0], limits.acceleration
        fits = float(np.sqrt(a * distance + 0.5 * (first**2 + last**2)))
        top = max(min(limits.speed, fits), first, last)
        ramps = (2.0 * top**2 - first**2 - last**2) / (2.0 * a)
        cruise = max(distance - ramps, 0.0) / top
        return law_of_phases(
            ends[0], first, [((top - first) / a, a, 0.0), (cruise, 0.0, 0.0), ((top - last) / a, -a, 0.0)]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class JerkLimited:
    """Speed with bounded jerk, as Ruckig plans it; accelerations are continuous everywhere. Needs the extra `planner`.

    Source: Berscheid and Kröger, "Jerk-limited real-time trajectory generation with arbitrary target states", 2021.
    """

    key: ClassVar[str] = "jerk-limited"
    corner_acceleration: ClassVar[float] = 3.0
    corner_jerk: ClassVar[float] = 12.0

    def corner(self, part: FloatArray) -> Course:
        """Return `2 u^3 - u^4`, whose acceleration begins and ends at zero."""
        return Course(part**3 * (2.0 - part), part**2 * (6.0 - 4.0 * part), 12.0 * part * (1.0 - part))

    def reachable(self, rate: float, distance: float, limits: RateLimits) -> float:
        """Return the highest speed that can follow a speed after a distance, from no acceleration to none."""
        if distance < _NOTHING:
            return rate
        room = (1.0 - _SAFE) * distance
        low, high = rate, max(limits.speed, rate)
        if _distance_of_change(rate, high, limits) <= room:
            return high
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            fits = _distance_of_change(rate, middle, limits) <= room
            low, high = (middle, high) if fits else (low, middle)
        return low

    def law(self, ends: tuple[float, float], rates: tuple[float, float], limits: RateLimits) -> TimeLaw:
        """Return the fastest law with these speeds and no acceleration at its ends.

        Raises
        ------
        MissingExtraError
            when Ruckig is not installed.
        ExcitationError
            when there is none.
        """
        try:
            import ruckig
        except ImportError as error:
            raise MissingExtraError("ruckig", "planner") from error
        unit = limits.speed  # so that Ruckig's numbers are of the order of one, however short the way
        wanted = ruckig.InputParameter(1)
        wanted.current_position, wanted.target_position = [0.0], [(ends[1] - ends[0]) / unit]
        wanted.current_velocity, wanted.target_velocity = ([min(rate / unit, 1.0)] for rate in rates)
        wanted.max_velocity, wanted.max_acceleration = [1.0], [limits.acceleration / unit]
        wanted.max_jerk = [limits.jerk / unit]
        found = ruckig.Trajectory(1)
        result = ruckig.Ruckig(1).calculate(wanted, found)
        if result not in {ruckig.Result.Working, ruckig.Result.Finished}:
            raise ExcitationError("Ruckig found no course of speed", got=result.name)
        profile = found.profiles[0][0]
        phases = [
            (time, unit * acceleration, unit * jerk)
            for time, acceleration, jerk in zip(profile.t, profile.a[:7], profile.j, strict=True)
        ]
        return law_of_phases(ends[0], rates[0], phases)


RAMPS: tuple[Ramps, ...] = (AccelerationLimited(), JerkLimited())


def ramps_named(name: str) -> Ramps:
    """Return the ramps of a name in a file.

    Raises
    ------
    ExcitationError
        when there are none of that name.
    """
    for ramps in RAMPS:
        if ramps.key == name:
            return ramps
    raise ExcitationError("unknown ramps", expected=", ".join(ramps.key for ramps in RAMPS), got=name)


def _distance_of_change(first: float, last: float, limits: RateLimits) -> float:
    """Return the shortest distance over which a speed changes, from no acceleration to none."""
    change = abs(last - first)
    if change * limits.jerk <= limits.acceleration**2:
        time = 2.0 * np.sqrt(change / limits.jerk)
    else:
        time = change / limits.acceleration + limits.acceleration / limits.jerk
    return float(0.5 * (first + last) * time)
