"""Pre-sliding friction: what turns the sharp sign into a spring of a few arc minutes, and remembers the direction.

Before a gear slides it bends. Driven by displacement, not by speed, the friction state of Dahl's model has no noise at
standstill, keeps its last value there, and is right in the moment after a reversal:
    dz/dq = (sgn(dq) - z) / x0   (in units of the Coulomb torque)
Over one step of the clock the direction is constant and the solution exact: `z+ = s + (z - s) exp(-|dq dt| / x0)`.

Source: Dahl, "A solid friction model", 1968.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms.joint_term import ShapedTerm
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot

LENGTHS = (1e-4, 3e-3)  # [rad or m] two springs in a row: the teeth, and the flexible gear as a whole
SCALES = (0.1, 0.3, 1.0, 3.0)  # of the lengths


@njit(cache=True, nogil=True, error_model="numpy")
def dahl_kernel(q, lengths, states, out):  # type: ignore[no-untyped-def]
    """Fill `out` with the states along q (n_v, n_t); lengths (n_v, k); states (n_v, k + 1): last position, last z."""
    for j in range(q.shape[0]):
        for i in range(lengths.shape[1]):
            states[j, i + 1] = _stepped(q[j], states[j, 0], states[j, i + 1], lengths[j, i], out[j, i])
        states[j, 0] = q[j, q.shape[1] - 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _stepped(q, last, z, length, out):  # type: ignore[no-untyped-def]
    """Step `z+ = s + (z - s) exp(-|q+ - q| / x0)` along q (n_t,) and return the last z."""
    for k in range(q.size):
        moved = q[k] - last
        last = q[k]
        if moved != 0.0:
            sign = 1.0 if moved > 0.0 else -1.0
            z = sign + (z - sign) * np.exp(-abs(moved) / length)
        out[k] = z
    return z


def dahl_states(q: FloatArray, lengths: FloatArray, state: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    """Return the Dahl states along positions (n_v, n_t), (n_v, n_lengths, n_t) in -1 to 1, and where they end.

    Parameters
    ----------
    lengths : (n_v, n_lengths) [rad or m] over which friction turns round after a reversal
    state : (n_v, n_lengths + 1) last position and states; None at the start of a recording: unbent
    """
    if state is None:
        state = np.column_stack([q[:, 0], np.zeros_like(lengths)])
    after, out = state.copy(), np.empty((*lengths.shape, q.shape[1]))
    dahl_kernel(np.ascontiguousarray(q), lengths, after, out)
    return out, after


@dataclass(frozen=True, slots=True, kw_only=True)
class Dahl(ShapedTerm):
    """Coulomb friction that builds up over a displacement: `sum_i Fd_i z_i`, one Dahl state for each length.

    Two lengths are in the ratio of `LENGTHS`; the shape is their common scale. Takes the place of `coulomb`.

    scales : of the two lengths, per joint; empty until chosen, and then one
    """

    key: ClassVar[str] = "dahl"
    dissipates: ClassVar[bool] = True
    stateful: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fd", "Fe")
    shape_field: ClassVar[str] = "scales"
    grid: ClassVar[tuple[float, ...]] = SCALES
    grid_of_speed: ClassVar[bool] = False
    scales: tuple[float, ...] = ()

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return the unit of the joint's torque for each length."""
        return (joint.effort_unit,) * len(LENGTHS)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the states; stateful."""
        return dahl_states(motion.q, self.chosen(robot.n_v, 1.0) * LENGTHS, state)
