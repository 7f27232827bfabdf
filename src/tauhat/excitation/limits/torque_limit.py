"""The joint torque that the nominal model needs stays below what the drives give."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray, IntArray, frozen, read_only
from tauhat.dynamics.model import Layout, TorqueModel, torque_model
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.motion_limit import MotionLimit, Pull
from tauhat.robots.robot import Robot

_TERMS = ("inertia", "rotor", "viscous")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueLimit(MotionLimit):
    """`|tau_j| + Fc_j <= largest_j` with the nominal model: links, gravity, rotors, viscous friction.

    Coulomb friction counts against the joint whichever way it moves, at rest too: the bound holds through every
    reversal, and the margin has a slope wherever the torque is not zero.

    robot : with nominal inertias
    largest : (n_v,) [Nm or N]; infinite where a joint is not limited
    """

    robot: Robot
    largest: FloatArray
    joints: IntArray = field(init=False)
    model: TorqueModel = field(init=False)
    layout: Layout = field(init=False)
    values: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        largest = np.array(self.largest, dtype=np.float64)
        joints = np.flatnonzero(np.isfinite(largest))
        checked = frozen("largest torque", largest[joints], (None,), where="torque limit")
        if not joints.size:
            raise ExcitationError("no joint has a torque limit", where="torque limit", remedy="state them in Nm or N")
        if not (checked > 0.0).all():
            raise ExcitationError("a torque limit must be positive", where="torque limit", got=checked.tolist())
        if not self.robot.has_inertia:
            raise ExcitationError("the robot states no masses", where="torque limit", remedy="leave the torque out")
        model = torque_model(self.robot, _TERMS)
        layout = model.layout()
        object.__setattr__(self, "largest", read_only(largest))
        object.__setattr__(self, "joints", read_only(joints))
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "layout", layout)
        object.__setattr__(self, "values", read_only(nominal_standard_parameters(model)[layout.parameters]))

    @property
    def name(self) -> str:
        """The word torque."""
        return "torque"

    @property
    def parts(self) -> tuple[str, ...]:
        """The limited joints."""
        return tuple(f"joint {self.robot.joint_names[joint]}" for joint in self.joints)

    def torque(self, motion: Motion) -> FloatArray:
        """Return the torque without Coulomb friction, (n_v, n_t)."""
        rows, _ = self.model.columns(motion, self.layout)
        parts = [self.layout.of_joint(joint) for joint in range(self.robot.n_v)]
        return np.array([self.values[part] @ rows[part] for part in parts])

    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return `1 - (|tau| + Fc) / largest` of each limited joint, and the pullback: the regressor's adjoint."""
        tau = self.torque(motion)[self.joints]
        size = self.largest[self.joints][:, None]
        friction = np.array([self.robot.joints[joint].coulomb for joint in self.joints])[:, None]

        def pull(bars: FloatArray) -> MotionGradient:
            whole = np.zeros((self.robot.n_v, motion.n_t))
            whole[self.joints] = -bars * np.sign(tau) / size
            counts = np.diff(self.layout.bounds)
            return self.model.pull(motion, self.layout, np.repeat(whole, counts, axis=0) * self.values[:, None])

        return 1.0 - (np.abs(tau) + friction) / size, pull

    def at_rest(self) -> str:
        """Return what needs torque at rest."""
        return "gravity and friction alone need that in the best pose"

    def missing(self, row: int, margin: float) -> str:
        """Return the torque needed and given."""
        joint = int(self.joints[row])
        unit = self.robot.joints[joint].effort_unit
        return f"{(1.0 - margin) * self.largest[joint]:.3g} of {self.largest[joint]:.3g} {unit} with friction"
