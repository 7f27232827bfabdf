"""Numbers out of URDF attributes: finite, of a believable size, or an error that names the attribute."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from xml.etree.ElementTree import Element

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RobotError, TauhatWarning

_LARGEST_OFFSET = 50.0  # [m] no link of a robot is that long; a millimetre file is over it at once
_LONGEST_EXTRACT = 60  # characters of a bad value that a message repeats
_DEGREES_FROM, _DEGREES_TO = 45.0, 1000.0  # a revolute limit in this range is in degrees


def required_child(element: Element, tag: str, where: str) -> Element:
    """Return the child element of that tag.

    Raises
    ------
    RobotError
        when there is none.
    """
    child = element.find(tag)
    if child is None:
        raise RobotError(f"<{element.tag}> has no <{tag}>", where=where)
    return child


def number(element: Element | None, key: str, *, where: str, default: float | None = None) -> float:
    """Return one finite number; `default` where element or attribute is missing (None: it must be there)."""
    value = limit_number(element, key, where=where, default=default)
    if not np.isfinite(value):
        raise RobotError(f"{key} is not finite", where=where, got=value)
    return value


def limit_number(element: Element | None, key: str, *, where: str, default: float | None = None) -> float:
    """Return one number that may be infinite, as joint limits may.

    Raises
    ------
    RobotError
        the attribute is missing without a default, or is not a number.
    """
    text = None if element is None else element.get(key)
    if text is None and default is not None:
        return default
    if text is None:
        tag = "attribute" if element is None else f"<{element.tag}>"
        raise RobotError(f"{tag} has no {key}", where=where)
    return _parsed(text, key, where)


def numbers(element: Element | None, key: str, default: Sequence[float], *, where: str) -> FloatArray:
    """Return a row of finite numbers, as many as `default` has, which stands in for a missing attribute."""
    text = None if element is None else element.get(key)
    if text is None:
        return np.array(default, dtype=np.float64)
    words = text.split(maxsplit=len(default))
    if len(words) != len(default):
        got = repr(text[:_LONGEST_EXTRACT])
        raise RobotError(f"{key} has the wrong length", where=where, expected=f"{len(default)} numbers", got=got)
    row = np.array([_parsed(word, key, where) for word in words])
    if not np.isfinite(row).all():
        raise RobotError(f"{key} is not finite", where=where, got=row.tolist())
    return row


def length_triple(origin: Element | None, where: str) -> FloatArray:
    """Return an `<origin>`'s translation (3,) [m].

    Raises
    ------
    RobotError
        farther than any robot's link is long.
    """
    xyz = numbers(origin, "xyz", (0.0, 0.0, 0.0), where=where)
    longest = float(np.abs(xyz).max())
    if longest > _LARGEST_OFFSET:
        remedy = "lengths are metres: is the URDF in millimetres?"
        expected = f"at most {_LARGEST_OFFSET:g} m"
        raise RobotError("absurd size", where=where, expected=expected, got=f"{longest:g} m", remedy=remedy)
    return xyz


def range_of(limit: Element | None, joint: Element, where: str) -> tuple[float, float]:
    """Return lower and upper position limit [rad or m]; infinite where the file gives none or an empty range."""
    lower = limit_number(limit, "lower", where=where, default=-np.inf)
    upper = limit_number(limit, "upper", where=where, default=np.inf)
    if lower > upper:
        raise RobotError("lower limit above upper limit", where=where, got=f"[{lower:g}, {upper:g}]")
    if lower == upper:
        message = f"{where}: lower and upper limit are both {lower:g}; taken as not given"
        warnings.warn(message, TauhatWarning, stacklevel=2)
        return -np.inf, np.inf
    largest = max((abs(bound) for bound in (lower, upper) if np.isfinite(bound)), default=0.0)
    if joint.get("type") == "revolute" and _DEGREES_FROM < largest <= _DEGREES_TO:
        message = f"{where}: position limit {largest:g} rad; limits are radians, are these degrees?"
        warnings.warn(message, TauhatWarning, stacklevel=2)
    return lower, upper


def _parsed(text: str, key: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        remedy = "expand the file with xacro first" if "$" in text else ""
        got = repr(text[:_LONGEST_EXTRACT])
        raise RobotError(f"{key} is not a number", where=where, got=got, remedy=remedy) from error
    if np.isnan(value):
        raise RobotError(f"{key} is not finite", where=where, got=text.strip())
    return value
