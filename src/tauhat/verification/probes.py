"""Columns of effects that a model may lack, driven along a recording and filtered beside the model's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms.load import load_on_joints
from tauhat.dynamics.terms.presliding import dahl_states
from tauhat.robots.robot import Robot
from tauhat.verification.series import ProbeTerm

WIDTH = 0.01  # of the smooth sign, in parts of the top speed
STRIBECK_SPEEDS = (0.02, 0.06, 0.2)  # in parts of the top speed
LENGTHS = (1e-4, 1e-3, 1e-2)  # [rad or m] of the pre-sliding springs
ORDERS = tuple(range(2, 25))  # of the ripple, periods a revolution of the joint
SINGLE = (
    *("q", "ddq", "dq", "cube root", "sign", "speed"),
    *(f"stribeck {number}" for number in range(len(STRIBECK_SPEEDS))),
    *(f"dahl {number}" for number in range(len(LENGTHS))),
    *("load sign", "load dahl", "sine", "cosine"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Probes(ProbeTerm):
    """What effects of position, speed, direction, acceleration and load would add to each joint's torque.

    tops : (n_v,) top speed of each joint [rad/s or m/s]
    inertia : rigid-body parameters that tell the load, (10 n_v,); empty: no load is looked at
    orders : of the ripple for each joint, in periods a revolution of the joint; equally many each
    """

    key: ClassVar[str] = "probes"
    stateful: ClassVar[bool] = True
    tops: tuple[float, ...]
    inertia: tuple[float, ...]
    orders: tuple[tuple[float, ...], ...]

    @property
    def width(self) -> int:
        """Columns of each joint."""
        return len(SINGLE) + 2 * len(self.orders[0])

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the columns in the order of `SINGLE`, then sine and cosine of every order; stateful."""
        tops = np.array(self.tops)[:, None]
        sign = np.tanh(motion.dq / (WIDTH * tops))
        bumps = [np.exp(-np.minimum((motion.dq / (part * tops)) ** 2, 300.0)) * sign for part in STRIBECK_SPEEDS]
        bent, after = dahl_states(motion.q, np.tile(LENGTHS, (robot.n_v, 1)), state)
        load = load_on_joints(robot, motion, self.inertia) if self.inertia else np.zeros_like(motion.q)
        single = [motion.q, motion.ddq, motion.dq, np.cbrt(motion.dq), sign, np.abs(motion.dq), *bumps]
        single += [*bent.transpose(1, 0, 2), load * sign, load * bent[:, 0], np.sin(motion.q), np.cos(motion.q)]
        return tuple(
            np.concatenate([np.array([column[joint] for column in single]), self._ripple(motion.q[joint], joint)])
            for joint in range(robot.n_v)
        ), after

    def _ripple(self, q: FloatArray, joint: int) -> FloatArray:
        angles = np.multiply.outer(np.array(self.orders[joint]), q)
        return np.stack([np.sin(angles), np.cos(angles)], axis=1).reshape(-1, q.size)

    def place(self, name: str) -> int:
        """Return the row of a single column."""
        return SINGLE.index(name)

    def ripple_places(self, order: int) -> list[int]:
        """Return the rows of the ripple's order at this place of `orders`."""
        first = len(SINGLE) + 2 * order
        return [first, first + 1]
