"""Motors that turn with two joints, as the last motor of many wrists does."""

from __future__ import annotations

from typing import NamedTuple


class SharedMotor(NamedTuple):
    """A motor that turns with two joints: in joint units it moves by `q[own] + ratio q[other]`; joints from zero."""

    own: int
    other: int
    ratio: float
