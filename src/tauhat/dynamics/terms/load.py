"""Friction that grows with the load: `Fl |tau_load| s`, the rigid-body torque through the gear times a friction state.

The load is computed from rigid-body parameters that the term carries: the robot's nominal ones at first, then those
that the pass before found (`Term.after`). Two passes are enough, since the load enters a small term. What a rotor takes
never passes through the gear, also where links and rotor are one number: that number less the rotor is the load.

Source: Hamon, Gautier, Garrec, "Dynamic identification of robots with a dry friction model depending on load and
velocity", 2010.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.rigid_body import rigid_torque
from tauhat.dynamics.terms.friction import WIDTHS
from tauhat.dynamics.terms.joint_term import JointTerm, ShapedTerm
from tauhat.dynamics.terms.presliding import LENGTHS, dahl_states
from tauhat.dynamics.terms.term import Term
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot


def load_on_joints(robot: Robot, motion: Motion, inertia: tuple[float, ...]) -> FloatArray:
    """Return the size of the rigid-body torque on each joint, (n_v, n_t) [Nm or N].

    Parameters
    ----------
    inertia : rigid-body parameters link by link, (10 n_v,); empty: the robot's nominal ones
    """
    if inertia and len(inertia) != 10 * robot.n_v:
        raise ModelError("load friction: inertia", expected=f"{10 * robot.n_v} values", got=len(inertia))
    parameters = np.array(inertia).reshape(-1, 10) if inertia else robot.inertia
    return np.abs(rigid_torque(kernel_tree(robot), motion, parameters))


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCoulomb(ShapedTerm):
    """Coulomb friction in proportion to the load: `Fl |tau_load| tanh(dq / width)`, beside `coulomb`.

    widths : per joint [rad/s or m/s]; empty until chosen, and then the plain sign is taken
    inertia : rigid-body parameters of the pass before, (10 n_v,); empty: the robot's nominal ones
    rotors : taken off these, (n_v,) [kg m^2 or kg], where the fit has links and rotor in one number; empty: nothing
    """

    key: ClassVar[str] = "load-coulomb"
    dissipates: ClassVar[bool] = True
    iterated: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fl",)
    smallest: ClassVar[float] = 0.0
    shape_field: ClassVar[str] = "widths"
    grid: ClassVar[tuple[float, ...]] = WIDTHS
    widths: tuple[float, ...] = ()
    inertia: tuple[float, ...] = ()
    rotors: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super(LoadCoulomb, self).__post_init__()
        object.__setattr__(self, "inertia", tuple(float(value) for value in self.inertia))
        object.__setattr__(self, "rotors", tuple(float(value) for value in self.rotors))

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return one: torque over torque."""
        return ("1",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the load times the smooth sign; iterated."""
        sign = np.tanh(motion.dq / self.chosen(robot.n_v, 0.0)) if self.widths else np.sign(motion.dq)
        return (load_on_joints(robot, motion, self.inertia) * sign)[:, None], state

    def after(self, inertia: FloatArray, rotors: FloatArray | None = None) -> Term:
        """Return the term with the load of these parameters."""
        taken_off = () if rotors is None or not rotors.any() else tuple(rotors.tolist())
        return replace(self, inertia=tuple(inertia.ravel().tolist()), rotors=taken_off)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadDahl(JointTerm):
    """Pre-sliding friction in proportion to the load, beside `dahl`: `Fl |tau_load| z` with the shorter length.

    inertia : rigid-body parameters of the pass before, (10 n_v,); empty: the robot's nominal ones
    rotors : taken off these, (n_v,) [kg m^2 or kg], where the fit has links and rotor in one number; empty: nothing
    """

    key: ClassVar[str] = "load-dahl"
    dissipates: ClassVar[bool] = True
    stateful: ClassVar[bool] = True
    iterated: ClassVar[bool] = True
    stands_for: ClassVar[tuple[str, ...]] = ("load-coulomb",)
    symbols: ClassVar[tuple[str, ...]] = ("Fl",)
    smallest: ClassVar[float] = 0.0
    inertia: tuple[float, ...] = ()
    rotors: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super(LoadDahl, self).__post_init__()
        object.__setattr__(self, "inertia", tuple(float(value) for value in self.inertia))
        object.__setattr__(self, "rotors", tuple(float(value) for value in self.rotors))

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return one: torque over torque."""
        return ("1",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the load times the Dahl state; stateful and iterated."""
        bent, after = dahl_states(motion.q, np.full((robot.n_v, 1), LENGTHS[0]), state)
        return load_on_joints(robot, motion, self.inertia)[:, None] * bent, after

    def after(self, inertia: FloatArray, rotors: FloatArray | None = None) -> Term:
        """Return the term with the load of these parameters."""
        taken_off = () if rotors is None or not rotors.any() else tuple(rotors.tolist())
        return replace(self, inertia=tuple(inertia.ravel().tolist()), rotors=taken_off)
