"""Plain data for JSON, which has no word for numbers that are not finite."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any


def without_infinities(value: Any) -> Any:
    """Return plain data with None for every number that is not finite, tuples as lists, NumPy's floats as floats."""
    if isinstance(value, Mapping):
        return {key: without_infinities(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_infinities(item) for item in value]
    if isinstance(value, Real) and not isinstance(value, Integral):
        return float(value) if math.isfinite(value) else None
    return value
