"""Terms with values that enter non-linearly: widths, speeds, lengths."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

from tauhat.arrays import IntArray
from tauhat.dynamics.terms.term import Term
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaped(Term):
    """A term whose columns depend non-linearly on positive values: its shape, each value of a few parameters alone.

    Which values are right is told by the residual on the recordings that are fitted: the linear parameters are solved
    inside (variable projection, Golub and Pereyra 1973), only the shape is searched, first on `grid`, then around the
    best value of it.
    """

    shape_field: ClassVar[str]
    grid: ClassVar[tuple[float, ...]]

    @property
    def shape(self) -> tuple[float, ...]:
        """The values; empty until chosen."""
        values: tuple[float, ...] = getattr(self, self.shape_field)
        return values

    def with_shape(self, values: Sequence[float]) -> Self:
        """Return the term with these values."""
        changes: dict[str, Any] = {self.shape_field: tuple(float(value) for value in values)}
        return replace(self, **changes)

    @abstractmethod
    def shaping(self, robot: Robot) -> IntArray:
        """Return for each of the term's parameters which of the values shapes its columns, (n,)."""

    def mixed(self, forms: Sequence[Shaped], picks: Sequence[int]) -> Self:
        """Return the term whose value k is that of `forms[picks[k]]`."""
        shapes = [form.shape for form in forms]
        return self.with_shape([shapes[pick][place] for place, pick in enumerate(picks)])

    def shaped_joints(self, robot: Robot) -> dict[int, int]:
        """Return the values that shape any parameter -> the joint that these are named after; in order."""
        pairs = zip(self.shaping(robot), self.parameters(robot), strict=True)
        return dict(sorted({int(place): parameter.joint for place, parameter in pairs if place >= 0}.items()))
