"""Rigid links with fewer parameters: without products of inertia and, if wanted, without others that are named."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.terms.inertia import Inertia
from tauhat.dynamics.terms.term import Parameter, Term
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

PRODUCTS = ("Ixy", "Ixz", "Iyz")


@dataclass(frozen=True, slots=True, kw_only=True)
class InertiaWithoutProducts(Term):
    """Rigid links with gravity whose products of inertia about the joint frames are zero: seven parameters a link.

    Exact for links whose mass lies symmetrically to the planes of their joint frame, a simplification for all others:
    which parameters are left out depends on how the description turns and places those frames.

    dropped : names of further parameters that are taken as zero, e.g. `("mz_3", "Ixx_6")`
    """

    key: ClassVar[str] = "inertia-simple"
    stands_for: ClassVar[tuple[str, ...]] = ("inertia",)
    dropped: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "dropped", tuple(str(name) for name in self.dropped))

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return `m, mx, my, mz, Ixx, Iyy, Izz` of every link, less the dropped ones."""
        every = Inertia().parameters(robot)
        return tuple(every[index] for index in self._kept(robot))

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the parameters of the links that move with it."""
        rank = np.full(10 * robot.n_v, -1)
        kept = self._kept(robot)
        rank[kept] = np.arange(kept.size)
        return tuple(rank[support[rank[support] >= 0]] for support in Inertia().support(robot))

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the kept rows of the rigid-body regressor joint by joint; pointwise."""
        whole, _ = Inertia().columns(robot, motion, None)
        return tuple(rows[picked] for rows, picked in zip(whole, self._picked(robot), strict=True)), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add the adjoint of the regressor, in which the columns left out count nothing."""
        supports = Inertia().support(robot)
        whole = tuple(np.zeros((support.size, motion.n_t)) for support in supports)
        for rows, picked, bar in zip(whole, self._picked(robot), bars, strict=True):
            rows[picked] = bar
        Inertia().pull(robot, motion, whole, gradient)

    def _kept(self, robot: Robot) -> IntArray:
        """Return the indices of the kept among the ten standard parameters a link."""
        every = Inertia().parameters(robot)
        unknown = sorted(set(self.dropped) - {parameter.name for parameter in every})
        if unknown:
            raise ModelError("a dropped parameter is not one of the links'", where=robot.name, got=", ".join(unknown))
        kept = [k for k, item in enumerate(every) if item.symbol not in PRODUCTS and item.name not in self.dropped]
        return np.array(kept, dtype=np.intp)

    def _picked(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint which of the rows of its whole support are kept."""
        kept = self._kept(robot)
        return tuple(np.flatnonzero(np.isin(support, kept)) for support in Inertia().support(robot))
