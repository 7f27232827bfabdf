"""Advice on names that are not there."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_MOST_LISTED = 12
_LONGEST = 60


def advice_on_name(name: str, known: Iterable[str]) -> str:
    """Return the nearest of the `known` names as a question, or a list of them all when none is near."""
    names = [known_name[:_LONGEST] for known_name in known]
    near = difflib.get_close_matches(name[:80].lower(), names, n=3, cutoff=0.5)
    if near:
        return f"did you mean {' or '.join(near)}?"
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return f"known names: {', '.join(names[:_MOST_LISTED])}{more}"
