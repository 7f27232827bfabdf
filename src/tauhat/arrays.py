"""Checked, read-only arrays: what every data class of the library is made of."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import fields
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauhat.errors import ArrayError, TauhatError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.intp]


def frozen(name: str, value: object, shape: Sequence[int | None], *, where: str = "") -> FloatArray:
    """Return a read-only float64 copy of `value` after checking shape and finiteness.

    Parameters
    ----------
    name : how messages call the array
    shape : expected length of each axis, `None` for any
    where : the object or file the array belongs to

    Raises
    ------
    ArrayError
        not numeric, wrong shape, or not finite.
    """
    array = _numeric(name, value, where)
    fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
        raise ArrayError(f"{name} has the wrong shape", where=where, expected=wanted, got=array.shape)
    if not np.isfinite(array).all():
        first = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ArrayError(f"{name} is not finite", where=where, got=f"{array[first]} at index {first}")
    array.setflags(write=False)
    return array


def _numeric(name: str, value: object, where: str) -> FloatArray:
    try:
        return np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ArrayError(f"{name} is not an array of numbers", where=where, got=type(value).__name__) from error


def check_fields(
    settings: Any, *, error: type[TauhatError], name: str, or_zero: Collection[str] = (), signed: Collection[str] = ()
) -> None:
    """Pass where every field of a dataclass is a finite number above zero.

    Parameters
    ----------
    error : raised where one is not
    name : how messages call the settings
    or_zero, signed : fields that may also be zero, or any finite number

    Raises
    ------
    TauhatError
        the given one, for the first field that is not.
    """
    for field in fields(settings):
        value = getattr(settings, field.name)
        least, wanted = 0.0, "a finite number above zero"
        if field.name in signed:
            least, wanted = -np.inf, "a finite number"
        elif field.name in or_zero:
            wanted = "a finite number, not negative"
        if not (np.isfinite(value) and (value > least or (value == 0.0 and field.name in or_zero))):
            raise error(f"{name}, {field.name}", expected=wanted, got=value)


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` itself with writing switched off, for arrays that nobody else holds."""
    array.setflags(write=False)
    return array
