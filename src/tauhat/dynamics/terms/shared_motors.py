"""Motors that turn with two joints: the wrists of many arms, whose last motor is carried along by the joint before.

Motor b moves by `q_m = q_b + r q_a` in joint units. Its inertia and friction act at q_m, and so on joint b and, times
r, on joint a. What acts on b through b's own motion (and on a through a's) is in the joints' own parameters already;
the rest couples the two:
    tau_b += Iam r ddq_a + Fvm r dq_a + Fsm s(dq_m),    tau_a += r (Iam ddq_b + Fvm dq_b + Fsm s(dq_m))

Source: Gautier, Janot, Vandanjon, "A new closed-loop output error method for parameter identification of robot
dynamics", 2013 (Staubli TX40, there with r = 1).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms.friction import per_speed
from tauhat.dynamics.terms.presliding import LENGTHS, SCALES, dahl_states
from tauhat.dynamics.terms.shaped import Shaped
from tauhat.dynamics.terms.term import Facts, Parameter, Term
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot
from tauhat.robots.shared_motor import SharedMotor

_WIDTH = 1e-2  # of the smooth sign, in parts of the motor's top speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling(Term):
    """Inertia, viscous and Coulomb friction of motors that turn with two joints; see the head of this file.

    motors : own joint, other joint, ratio; empty: those that the log's map tells
    widths : of the smooth sign of each motor [rad/s]; empty: the plain sign
    """

    key: ClassVar[str] = "coupling"
    dissipates: ClassVar[bool] = True
    frictions: ClassVar[tuple[str, ...]] = ("Fsm",)
    motors: tuple[SharedMotor, ...] = ()
    widths: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        motors = tuple(SharedMotor(int(own), int(other), float(ratio)) for own, other, ratio in self.motors)
        object.__setattr__(self, "motors", motors)
        object.__setattr__(self, "widths", tuple(float(width) for width in self.widths))
        if any(motor.own == motor.other or not 0.0 < abs(motor.ratio) < np.inf for motor in motors):
            raise ModelError(f"term {self.key}: a motor turns with two different joints, at a ratio that is not zero")
        if any(not 0.0 < width < np.inf for width in self.widths):
            raise ModelError(f"term {self.key}: the widths must be positive", got=self.widths)

    def candidates(self, facts: Facts) -> tuple[Term, ...]:
        """Return the one form there is: that with the motors that the map tells, and widths for them."""
        return (self.informed(facts),)

    def informed(self, facts: Facts) -> Self:
        """Return the term with the motors that the map tells, and widths for them.

        Raises
        ------
        ModelError
            when neither the term nor the map tells a motor.
        """
        term = self if self.motors else replace(self, motors=facts.shared_motors)
        if not term.motors:
            raise ModelError(
                f"term {self.key}: no motor turns with two joints",
                remedy="give the map's [coupling] section, or leave the term out",
            )
        if term.widths:
            return term
        tops = [facts.top_speeds[m.own] + abs(m.ratio) * facts.top_speeds[m.other] for m in term.motors]
        return replace(term, widths=tuple(_WIDTH * (top or 1.0) for top in tops))

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return inertia, viscous friction and dry friction of each shared motor."""
        known = []
        for motor in self.motors:
            if not (0 <= motor.own < robot.n_v and 0 <= motor.other < robot.n_v):
                raise ModelError(f"term {self.key}: no such joint", expected=f"0 to {robot.n_v - 1}", got=motor)
            joint = robot.joints[motor.own]
            inertia = "kg m^2" if joint.kind == "revolute" else "kg"
            units = (inertia, f"{joint.effort_unit} {per_speed(joint)}", *(joint.effort_unit,) * len(self.frictions))
            symbols = ("Iam", "Fvm", *self.frictions)
            known += [
                Parameter(symbol=symbol, joint=motor.own, unit=unit, lower=0.0)
                for symbol, unit in zip(symbols, units, strict=True)
            ]
        return tuple(known)

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for both joints of a motor its parameters."""
        count = 2 + len(self.frictions)
        return tuple(
            np.array(
                [count * k + i for k, m in enumerate(self.motors) if joint in m[:2] for i in range(count)],
                dtype=np.intp,
            )
            for joint in range(robot.n_v)
        )

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the columns of both joints of every motor."""
        dry, after = self._dry(motion, state)
        rows: list[list[FloatArray]] = [[] for _ in range(robot.n_v)]
        for motor, friction in zip(self.motors, dry, strict=True):
            own, other, ratio = motor
            rows[own] += [ratio * motion.ddq[other], ratio * motion.dq[other], *friction]
            rows[other] += [ratio * motion.ddq[own], ratio * motion.dq[own], *(ratio * friction)]
        empty = np.zeros((0, motion.n_t))
        return tuple(np.array(row) if row else empty for row in rows), after

    def _dry(self, motion: Motion, state: FloatArray | None) -> tuple[FloatArray, FloatArray | None]:
        """Return the states of dry friction of each motor, (n_motors, n_frictions, n_t)."""
        speeds = self._along(motion.dq)
        if not self.widths:
            return np.sign(speeds)[:, None], state
        if len(self.widths) != len(self.motors):
            raise ModelError(f"term {self.key}: widths", expected=f"{len(self.motors)} values", got=len(self.widths))
        return np.tanh(speeds / np.array(self.widths)[:, None])[:, None], state

    def _along(self, joints: FloatArray) -> FloatArray:
        """Return a joint quantity as the motors have it, (n_motors, n_t)."""
        turned = [joints[m.own] + m.ratio * joints[m.other] for m in self.motors]
        return np.array(turned).reshape(len(self.motors), joints.shape[1])


@dataclass(frozen=True, slots=True, kw_only=True)
class CouplingDahl(Coupling, Shaped):
    """The same with pre-sliding friction of two lengths in the place of the sign.

    scales : of the two lengths, per motor; empty until chosen, and then one
    """

    key: ClassVar[str] = "coupling-dahl"
    stateful: ClassVar[bool] = True
    stands_for: ClassVar[tuple[str, ...]] = ("coupling",)
    frictions: ClassVar[tuple[str, ...]] = ("Fdm", "Fem")
    shape_field: ClassVar[str] = "scales"
    grid: ClassVar[tuple[float, ...]] = SCALES
    scales: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super(CouplingDahl, self).__post_init__()
        object.__setattr__(self, "scales", tuple(float(scale) for scale in self.scales))
        if any(not 0.0 < scale < np.inf for scale in self.scales):
            raise ModelError(f"term {self.key}: the scales must be positive", got=self.scales)

    def candidates(self, facts: Facts) -> tuple[Term, ...]:
        """Return the term with the motors that the map tells and each scale of the grid; given scales stay."""
        term = self.informed(facts)
        if term.scales:
            return (term,)
        return tuple(term.with_shape([scale] * len(term.motors)) for scale in self.grid)

    def shaping(self, robot: Robot) -> IntArray:
        """Return each parameter's motor, -1 for those whose columns no scale shapes."""
        count = 2 + len(self.frictions)
        places = np.repeat(np.arange(len(self.motors)), count)
        return np.where(np.arange(places.size) % count < 2, -1, places)

    def _dry(self, motion: Motion, state: FloatArray | None) -> tuple[FloatArray, FloatArray | None]:
        scales = np.array(self.scales) if self.scales else np.ones(len(self.motors))
        if scales.size != len(self.motors):
            raise ModelError(f"term {self.key}: scales", expected=f"{len(self.motors)} values", got=scales.size)
        return dahl_states(self._along(motion.q), np.outer(scales, LENGTHS), state)
