"""How contact is told from free motion: hysteresis, settling, zero, and the blocks of time that thresholds count."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SensingError
from tauhat.sensing.zero import StandingZero


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactRules:
    """How contact is told from free motion; learning and detecting share them.

    release : part of the threshold below which a contact ends
    settle : standing for less, the arm settles: friction and controller creep for a while [s]
    quiet : at the start of a log nothing is told for so long [s]
    zero : what is taken off
    block : length of the blocks whose maxima count [s]; longer than a residual remembers
    margin : on the largest residual, where free motion is too short for the rate
    least : no threshold is below so many standard errors of the sensor as fitted; short pauses look too quiet
    """

    release: float = 0.7
    settle: float = 1.5
    quiet: float = 0.5
    zero: StandingZero = field(default_factory=StandingZero)
    block: float = 2.0
    margin: float = 1.1
    least: float = 2.0

    def __post_init__(self) -> None:
        if not 0.0 < self.release <= 1.0:
            raise SensingError("release of a contact", expected="above 0, at most 1", got=self.release)
        if not (min(self.settle, self.quiet, self.least) >= 0.0 and self.block > 0.0 and self.margin >= 1.0):
            raise SensingError(
                "rules of contact", expected="settle, quiet, least of at least 0, block above 0, margin of at least 1",
                got=f"{self.settle}, {self.quiet}, {self.least}, {self.block}, {self.margin}",
            )  # fmt: skip

    def way(self, step: float) -> FloatArray:
        """Return the numbers that the kernel reads, (7,), for samples `step` seconds apart."""
        zero = self.zero
        return np.array([self.release, step, self.settle, zero.seconds, zero.fade, zero.follow, self.quiet])
