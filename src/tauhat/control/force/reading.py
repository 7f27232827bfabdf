"""What a polisher knows of the force: a reading as it comes, and whether it may be used."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, TypeAlias

Reason: TypeAlias = Literal[
    "",
    "contact_lost",
    "surface_misplaced",
    "force_limit",
    "reading_missing",
    "reading_invalid",
    "reading_frozen",
    "untrusted",
]
"""Why a job was given up; empty while it runs and when it is done."""


class ForceReading(NamedTuple):
    """Force along the outward normal; positive where the surface pushes the tool out.

    force : [N]
    std : standard deviation of its error [N]
    """

    force: float
    std: float

    @property
    def valid(self) -> bool:
        """Whether both are finite and the deviation is not negative."""
        return math.isfinite(self.force) and math.isfinite(self.std) and self.std >= 0.0


class Sight(NamedTuple):
    """A reading that has been looked at.

    reading : valid, though perhaps not to be used; None where there is no valid one
    trouble : why it is not to be used now; empty where it may be
    fault : why readings have been of no use for too long; empty while they have not
    """

    reading: ForceReading | None
    trouble: Reason
    fault: Reason
