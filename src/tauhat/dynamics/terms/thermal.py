"""Friction that changes as its gear warms up: `theta (Hd z + Hv dq)` beside dry and viscous friction.

The warmth theta is a state that the power of friction heats and the surroundings cool (`thermal_kernel`); or, where the
log has temperatures, what they are above a reference. Without a thermometer the gain of heating, the capacity and the
slopes are known as products alone: theta is therefore measured in parts of what a typical speed would bring, zero where
the recording began. Hd and Hv, the change of friction by one such unit, are linear; the time constant is a shape.

z is the Dahl state over the shorter length: the sign of the motion that remembers its direction at rest.

Source: Bittencourt, Gunnarsson, "Static friction in a robot joint: modeling and identification of load and temperature
effects", 2012, measure friction against load and temperature; the state that takes the thermometer's place is ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms.friction import per_speed
from tauhat.dynamics.terms.joint_term import JointTerm, ShapedTerm
from tauhat.dynamics.terms.presliding import LENGTHS, dahl_states
from tauhat.dynamics.terms.term import Facts, Term
from tauhat.dynamics.thermal_kernel import warmth_kernel
from tauhat.errors import ModelError
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot

TIMES = (60.0, 120.0, 300.0, 600.0, 1200.0, 2400.0, 3600.0)  # [s]
TYPICAL_TIME = 600.0  # [s] before any is chosen
ROOM = 20.0  # [deg C]
TYPICAL_PART = 0.5  # of the top speed: the typical one
_SYMBOLS = ("Hd", "Hv")  # by dry and by viscous friction


@dataclass(frozen=True, slots=True, kw_only=True)
class Thermal(ShapedTerm):
    """Dry and viscous friction that change with the warmth that friction makes: `theta (Hd z + Hv dq)`; stateful.

    times : constant of cooling per joint [s]; empty until chosen, and then 600 s are taken
    speeds : at which theta settles at one [rad/s or m/s]; empty until recordings tell the top speed, and then 1
    friction : per joint what heats, of the pass before: dry and viscous friction at theta = 0, and the change of both
        by theta; empty: dry friction alone
    initial : theta at the first sample, per joint; empty: zero, where the fitted recording began
    """

    key: ClassVar[str] = "thermal"
    stateful: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = _SYMBOLS
    shape_field: ClassVar[str] = "times"
    grid: ClassVar[tuple[float, ...]] = TIMES
    times: tuple[float, ...] = ()
    speeds: tuple[float, ...] = ()
    friction: tuple[tuple[float, float, float, float], ...] = ()
    initial: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super(Thermal, self).__post_init__()
        for name in ("speeds", "initial"):
            object.__setattr__(self, name, tuple(float(value) for value in getattr(self, name)))
        if any(not 0.0 < speed < np.inf for speed in self.speeds):
            raise ModelError(f"term {self.key}: typical speeds must be positive", got=self.speeds)
        if not np.isfinite(self.initial).all():
            raise ModelError(f"term {self.key}: the initial warmth must be finite", got=self.initial)
        rows = tuple(tuple(float(value) for value in row) for row in self.friction)
        if any(len(row) != 4 or not np.isfinite(row).all() for row in rows):
            raise ModelError(f"term {self.key}: friction", expected="four numbers a joint", got=self.friction)
        object.__setattr__(self, "friction", rows)

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque, and torque over speed: theta has no unit."""
        return joint.effort_unit, f"{joint.effort_unit} {per_speed(joint)}"

    def informed(self, facts: Facts) -> Term:
        """Return the term with the typical speed of each joint; given ones stay."""
        tops = np.where(facts.top_speeds > 0.0, facts.top_speeds, 1.0)
        return self if self.speeds else replace(self, speeds=tuple((TYPICAL_PART * tops).tolist()))

    def candidates(self, facts: Facts) -> tuple[Term, ...]:
        """Return the term alone: minutes of warming show on whole recordings, not on the sample shapes are chosen on.

        The time constants are chosen on these (`estimation.warming`).
        """
        return (self.informed(facts),)

    def forms(self, n_v: int) -> tuple[Self, ...]:
        """Return the term with each time constant of the grid; a given one stays."""
        return (self,) if self.times else tuple(self.with_shape([time] * n_v) for time in self.grid)

    def numbers(self, n_v: int, step: float) -> FloatArray:
        """Return what `thermal_kernel` reads for samples `step` seconds apart, (n_v, 5).

        Raises
        ------
        ModelError
            when settings are not one a joint.
        """
        speeds = np.array(self._each("speeds", n_v) or (1.0,) * n_v)
        heat = np.array(self._each("friction", n_v) or ((1.0, 0.0, 0.0, 0.0),) * n_v)
        typical = (heat[:, 0] + heat[:, 1] * speeds) * speeds
        kept = np.exp(-step / self.chosen(n_v, TYPICAL_TIME))
        return np.column_stack([kept, heat / np.where(typical > 0.0, typical, 1.0)[:, None]])

    def start(self, n_v: int) -> FloatArray:
        """Return the warmth at the first sample, (n_v,)."""
        return np.array(self._each("initial", n_v) or (0.0,) * n_v)

    def _each(self, name: str, n_v: int) -> tuple[float, ...]:
        values: tuple[float, ...] = getattr(self, name)
        if values and len(values) != n_v:
            raise ModelError(f"term {self.key}: one of the {name} a joint is needed", expected=n_v, got=len(values))
        return values

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return theta times the Dahl state, and theta times dq; stateful: last position, z and theta, (n_v, 3)."""
        lengths, n_v = np.full((robot.n_v, 1), LENGTHS[0]), robot.n_v
        bent, after = dahl_states(motion.q, lengths, None if state is None else state[:, :2])
        warmth = self.start(n_v) if state is None else state[:, 2].copy()
        theta = np.empty(motion.q.shape)
        warmth_kernel(self.numbers(n_v, motion.step), np.ascontiguousarray(motion.dq), warmth, theta)
        return np.stack([theta * bent[:, 0], theta * motion.dq], axis=1), np.column_stack([after, warmth])


@dataclass(frozen=True, slots=True, kw_only=True)
class ThermalMeasured(JointTerm):
    """Dry and viscous friction that change with the logged temperature: `(temperature - reference) (Hd z + Hv dq)`.

    references : per joint [deg C]; empty until recordings tell their mean, and then 20
    """

    key: ClassVar[str] = "thermal-measured"
    stateful: ClassVar[bool] = True
    stands_for: ClassVar[tuple[str, ...]] = ("thermal",)
    needs: ClassVar[tuple[str, ...]] = ("temperature",)
    symbols: ClassVar[tuple[str, ...]] = _SYMBOLS
    references: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super(ThermalMeasured, self).__post_init__()
        object.__setattr__(self, "references", tuple(float(value) for value in self.references))
        if not np.isfinite(self.references).all():
            raise ModelError(f"term {self.key}: references must be finite", got=self.references)

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over temperature, and that over speed."""
        return f"{joint.effort_unit}/K", f"{joint.effort_unit} {per_speed(joint)}/K"

    def informed(self, facts: Facts) -> Term:
        """Return the term with the mean temperatures as references; given ones stay."""
        if self.references or facts.temperatures is None:
            return self
        return replace(self, references=tuple(facts.temperatures.tolist()))

    def candidates(self, facts: Facts) -> tuple[Term, ...]:
        """Return the term alone: it has no shape."""
        return (self.informed(facts),)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the columns; where a motion has no temperature, it is the reference's. Stateful."""
        if self.references and len(self.references) != robot.n_v:
            raise ModelError(
                f"term {self.key}: one of the references a joint is needed", expected=robot.n_v,
                got=len(self.references),
            )  # fmt: skip
        bent, after = dahl_states(motion.q, np.full((robot.n_v, 1), LENGTHS[0]), state)
        reference = np.array(self.references or (ROOM,) * robot.n_v)[:, None]
        above = np.zeros(motion.q.shape) if motion.temperature is None else motion.temperature - reference
        return np.stack([above * bent[:, 0], above * motion.dq], axis=1), after
