"""Rigid links: the ten inertial parameters of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.adjoint_kernel import adjoint_kernel
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.rigid_body import inertial_columns
from tauhat.dynamics.terms.term import Parameter, Term
from tauhat.dynamics.tree import kernel_tree
from tauhat.robots.robot import Robot

INERTIAL_SYMBOLS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
INERTIAL_UNITS = ("kg", *("kg m",) * 3, *("kg m^2",) * 6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertia(Term):
    """Rigid links with gravity: ten standard parameters a link.

    Source: Atkeson, An, Hollerbach 1986.
    """

    key: ClassVar[str] = "inertia"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return `m, mx, ..., Izz` of every link."""
        symbols = tuple(zip(INERTIAL_SYMBOLS, INERTIAL_UNITS, strict=True))
        return tuple(
            Parameter(
                symbol=symbol, joint=link, unit=unit, lower=0.0 if symbol in {"m", "Ixx", "Iyy", "Izz"} else -np.inf
            )
            for link in range(robot.n_v)
            for symbol, unit in symbols
        )

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the parameters of the links that move with it."""
        return tuple(
            np.concatenate([np.arange(10 * link, 10 * link + 10) for link in robot.subtree(joint)])
            for joint in range(robot.n_v)
        )

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the regressor's rows joint by joint; pointwise."""
        whole = inertial_columns(kernel_tree(robot), motion)
        support = self.support(robot)
        return tuple(_rows(whole[:, joint], support[joint]) for joint in range(robot.n_v)), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add the adjoint of the regressor."""
        whole = np.zeros((10 * robot.n_v, robot.n_v, motion.n_t))
        for joint, (rows, bar) in enumerate(zip(self.support(robot), bars, strict=True)):
            whole[rows, joint] = bar
        adjoint_kernel(kernel_tree(robot).links, motion.q, motion.dq, motion.ddq, whole, tuple(gradient))


def _rows(columns: FloatArray, rows: IntArray) -> FloatArray:
    """Return the rows as a view where they are contiguous, which they are on a serial arm."""
    if rows.size == rows[-1] - rows[0] + 1:
        return columns[rows[0] : rows[-1] + 1]
    return columns[rows]
