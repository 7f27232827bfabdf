"""The robot's own position controller: PD with feedforward of the robot as its description has it, at its own rate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.laws import Feedforward, TrackingLaw
from tauhat.control.model_torque import JointState, ModelTorque
from tauhat.errors import SimulationError
from tauhat.robots.robot import Robot
from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.gains import tracking_gains

_CHOICES = ("nothing", "gravity", "dynamics")


@dataclass(frozen=True, slots=True, kw_only=True)
class JointControl:
    """`clip(feedforward + kp (q_ref - q) + kd (dq_ref - dq))`, some periods late.

    rate : [Hz]; its period is a whole number of timesteps, the sample period a whole number of its own
    bandwidth : of the gains, tuned on the described robot [Hz]
    delay : periods from the encoders to the torque that answers them
    feedforward : `nothing`, `gravity`, or `dynamics`: links, rotors and friction of the description
    friction_width : speed over which the sign in that friction is smoothed [rad/s or m/s]
    """

    rate: float = 1000.0
    bandwidth: float = 10.0
    delay: int = 1
    feedforward: Feedforward = "dynamics"
    friction_width: float = 0.02

    def __post_init__(self) -> None:
        for name in ("rate", "bandwidth", "friction_width"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise SimulationError(f"joint control, {name}", expected="a positive number", got=value)
        if self.delay != int(self.delay) or self.delay < 0:
            raise SimulationError("joint control, delay", expected="whole periods, >= 0", got=self.delay)
        if self.feedforward not in _CHOICES:
            raise SimulationError("joint control, feedforward", expected=", ".join(_CHOICES), got=self.feedforward)

    def gains(self, robot: Robot, q: FloatArray) -> TrackingLaw:
        """Return the gains for the robot about a pose q (n_v,)."""
        return tracking_gains(robot, q[None], bandwidth=self.bandwidth, control_rate=self.rate)


class FeedforwardTorque:
    """The torque that the controller adds ahead, reference by reference.

    robot : as the controller knows it, with the loads it carries
    """

    __slots__ = ("_control", "_coulomb", "_model", "_viscous", "_zero")

    def __init__(self, control: JointControl, robot: Robot) -> None:
        rotor = np.array([joint.rotor_inertia for joint in robot.joints])
        self._control = control
        self._model = ModelTorque(robot=robot, inertia=robot.inertia, rotor=rotor)
        self._viscous = np.array([joint.viscous for joint in robot.joints])
        self._coulomb = np.array([joint.coulomb for joint in robot.joints])
        self._zero = np.zeros(robot.n_v)

    def at(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the torque at a reference, (n_v,) each [Nm or N]."""
        kind = self._control.feedforward
        if kind == "nothing":
            return self._zero
        still = kind == "gravity"
        state = JointState(q, self._zero, self._zero) if still else JointState(q, dq, ddq)
        _, torque = self._model.step(self._model.start(q), state)
        if still:
            return torque
        smooth = np.tanh(dq / self._control.friction_width)
        return np.asarray(torque + self._viscous * dq + self._coulomb * smooth)


def loaded_robot(robot: Robot, bodies: Iterable[AttachedBody]) -> Robot:
    """Return the robot whose description knows what it carries, as an operator enters the load of a tool."""
    joints = list(robot.joints)
    for body in bodies:
        joint = joints[body.joint]
        joints[body.joint] = replace(joint, inertia=joint.inertia + body.parameters)
    return replace(robot, joints=tuple(joints))
