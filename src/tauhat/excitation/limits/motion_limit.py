"""What a limit of a motion is: margins along the motion, and how they pull on it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, TypeAlias

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion, MotionGradient

Pull: TypeAlias = Callable[[FloatArray], MotionGradient]


class MotionLimit(ABC):
    """A limit that depends on several joints at once: rows of margins, zero on the limit, positive inside.

    A margin of one is far away from the limit. Relative limits count the margin in parts of the limit; the others
    count lengths and carry their own clearance.

    name : how messages and reports call it
    parts : what each row of margins belongs to
    """

    __slots__ = ()
    relative: ClassVar[bool] = True

    @property
    @abstractmethod
    def name(self) -> str:
        """How messages and reports call the limit."""

    @property
    @abstractmethod
    def parts(self) -> tuple[str, ...]:
        """What each row of margins belongs to, (n_c,)."""

    @abstractmethod
    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return the margins, (n_c, n_t), and the pullback of their sensitivities to the motion."""

    @abstractmethod
    def missing(self, row: int, margin: float) -> str:
        """Return in words by how much a negative margin of this row exceeds the limit."""

    def at_rest(self) -> str:
        """Return in words why a pose at rest can miss the limit, where that needs saying."""
        return ""

    def margins(self, motion: Motion) -> FloatArray:
        """Return the margins, (n_c, n_t): >= 0 is allowed, 1 is far away."""
        return self.evaluate(motion)[0]

    def pull(self, motion: Motion, bars: FloatArray) -> MotionGradient:
        """Return the gradient with respect to the motion from sensitivities `bars` of the margins, (n_c, n_t)."""
        return self.evaluate(motion)[1](bars)
