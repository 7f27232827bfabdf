"""Corrected gains of the torque channels: in numbers, and in the text of a map of which nothing else changes."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tauhat.errors import MapError
from tauhat.recordings.logmap import LogMap
from tauhat.recordings.mapfile import parse_map

_SECTION = re.compile(r"^[ \t]*\[[ \t]*torque[ \t]*\][^\n]*\n?", re.MULTILINE)
_ANY_SECTION = re.compile(r"^[ \t]*\[[ \t]*[a-z]+[ \t]*\]", re.MULTILINE)
_GAIN = re.compile(r"^([ \t]*gain[ \t]*=[ \t]*)(\[[^\]]*\]|[^\s#]+)", re.MULTILINE)
_DIGITS = 6


def corrected_gains(log_map: LogMap, factors: Sequence[float]) -> tuple[float, ...]:
    """Return the gains of a map times factors on the joints' torques, one a column.

    Raises
    ------
    MapError
        when the map has no torque, or couples torques of several motors: then a joint has no gain of its own.
    """
    if log_map.torque is None:
        raise MapError("no section [torque]", where=log_map.source)
    coupling = log_map.coupling.torque
    if coupling is not None and np.count_nonzero(coupling - np.diag(np.diag(coupling))):
        raise MapError(
            "the torques of several motors are coupled", where=f"{log_map.source}, [coupling] torque",
            remedy="multiply the rows of the matrix by the factors instead",
        )  # fmt: skip
    given = np.array(log_map.torque.scale or (1.0,))
    if given.size not in {1, len(factors)}:
        raise MapError("wrong number of gains", where=log_map.source, expected=len(factors), got=given.size)
    return tuple(float(f"{value:.{_DIGITS}g}") for value in given * np.array(factors))


def with_gains(text: str, gains: Sequence[float], *, where: str = "map") -> str:
    """Return the text of a map with these gains in its [torque] section, the rest as it was.

    Raises
    ------
    MapError
        when there is no such section, or its text is too unusual to be changed.
    """
    head = _SECTION.search(text)
    if head is None:
        raise MapError("no section [torque]", where=where)
    after = _ANY_SECTION.search(text, head.end())
    end = after.start() if after else len(text)
    body = text[head.end() : end]
    written = f"[{', '.join(f'{gain:.{_DIGITS}g}' for gain in gains)}]"
    if _GAIN.search(body):
        body = _GAIN.sub(lambda found: found.group(1) + written, body, count=1)
    else:
        body = f"gain = {written}\n{body}"
    start = text[: head.end()]
    changed = f"{start}{'' if start.endswith(chr(10)) else chr(10)}{body}{text[end:]}"
    if _gains_of(changed) != tuple(gains):
        raise MapError("the gains cannot be written into the map", where=where, remedy=f"set gain = {written} by hand")
    return changed


def _gains_of(text: str) -> tuple[float, ...] | None:
    try:
        torque = parse_map(text).torque
    except MapError:
        return None
    return torque.scale if torque else None
