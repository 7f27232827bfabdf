"""Numbers as a reader wants them."""

from __future__ import annotations

import math

_NOTHING = "–"
_MOST_DECIMALS = 12
_LARGEST_WHOLE = 1e6


def percent(share: float) -> str:
    """Return a share as percent with three significant digits; a dash where there is none."""
    if not math.isfinite(share):
        return _NOTHING
    value = 100.0 * share
    return f"{value:.0f} %" if abs(value) >= 100 else f"{value:.3g} %"


def number(value: float) -> str:
    """Return a number with three significant digits, whole from a thousand on; a dash where it is not finite."""
    if not math.isfinite(value):
        return _NOTHING
    return f"{value:.0f}" if 1e3 <= abs(value) < _LARGEST_WHOLE else f"{value:.3g}"


def value_and_half(value: float, half: float) -> tuple[str, str]:
    """Return a value and its half interval with as many digits as the interval deserves: two of its own."""
    if not (math.isfinite(value) and math.isfinite(half)) or half <= 0:
        return number(value), number(half)
    decimals = 1 - math.floor(math.log10(half))
    if decimals > _MOST_DECIMALS or max(abs(value), half) >= _LARGEST_WHOLE:
        return f"{value:.6g}", f"{half:.2g}"
    shown = max(0, decimals)
    return f"{round(value, decimals):.{shown}f}", f"{round(half, decimals):.{shown}f}"


def unit(text: str) -> str:
    """Return a unit with raised exponents: kg m² for kg m^2."""
    return text.replace("^2", "²").replace("^3", "³")


def span(lower: float, upper: float) -> str:
    """Return a range of positions in words; unlimited ends are said."""
    if not (math.isfinite(lower) or math.isfinite(upper)):
        return "unlimited"
    return f"{number(lower)} … {number(upper)}"
