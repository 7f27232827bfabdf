"""Numbers as programs print them: no exponents, enough digits for positions of joints within 1e-8 rad.

Degrees have 8 decimals and millimetres 6, more than a controller with single precision keeps.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError

RADIANS = METRES = 10
DEGREES = 8
MILLIMETRES = 6
RATE = 12
"""Decimals of speeds, accelerations and times."""
NUMBER = r"(-?\d{1,9}(?:\.\d{0,15})?)"
"""Pattern of a number in a program."""
_WHOLE = 1e-7  # of a step: what counts as a whole number
_SAME_PART = 9  # decimals to which a part of a limit is read: speeds are printed with more


def decimal(value: float, decimals: int) -> str:
    """Return a number without exponent, without trailing zeros, with one decimal at least and no negative zero."""
    whole, _, fraction = f"{value:.{decimals}f}".partition(".")
    text = f"{whole}.{fraction.rstrip('0') or '0'}"
    return "0.0" if text == "-0.0" else text


def decimals(values: Iterable[float], digits: int) -> str:
    """Return numbers with commas between."""
    return ",".join(decimal(value, digits) for value in values)


def values_of(text: str) -> FloatArray:
    """Return the numbers of a list with commas between."""
    return np.array([float(part) for part in text.split(",")])


def whole_steps(value: float, step: float, name: str, where: str) -> int:
    """Return how many steps a value is.

    Raises
    ------
    ExportError
        when it is no whole number of them: the language has no word for it.
    """
    steps = value / step
    count = round(steps)
    if abs(steps - count) > _WHOLE or (count < 1 and value > 0.0):
        expected, near = f"whole steps of {step:g}", f"{max(count, 1) * step:g} can be said"
        raise ExportError(
            f"the language has no word for this {name}", where=where, expected=expected, got=f"{value:g}", remedy=near
        )
    return count


def part(value: float, limit: float, name: str) -> float:
    """Return which part of a limit a printed value is.

    Raises
    ------
    ExportError
        when it is not above zero, or above the limit.
    """
    found = round(value / limit, _SAME_PART)
    if not 0.0 < found <= 1.0:
        raise ExportError(
            f"{name} is beyond what the motion is planned for",
            expected=f"above 0, at most {limit:.6g}",
            got=f"{value:.6g}",
        )
    return found
