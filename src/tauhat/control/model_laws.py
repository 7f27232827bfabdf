"""Controllers that know a model: PD with its torque along the reference, and computed torque.

Friction in both is that of the reference, not of the measured speed. Near rest the sign of a measured speed is noise,
and a controller that adds `Fc sign(noise)` makes the robot rattle; the reference is exact, and where the robot follows
it, friction is the same. Pre-sliding friction (Dahl terms) is driven by the displacement of the reference for the same
reason: the controller remembers how far the bristles are bent, from unbent on in the pose in which it starts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.control.controller import ControlSample
from tauhat.control.laws import Feedforward, PDFeedforward, joint_limits
from tauhat.control.model_torque import FrictionMemory, JointState, ModelTorque
from tauhat.errors import ArrayError, ModelError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelFeedforward:
    """PD on top of a model's torque along the reference: `tau(q_ref, dq_ref, ddq_ref) + kp e + kd de`, clipped.

    Unlike a `PDFeedforward` handed to a simulation, which gets the torque of the robot's description, it brings a model
    of its own, as an identified one.

    torque : of the model
    law : gains and limits
    """

    feedforward: ClassVar[Feedforward] = "nothing"
    torque: ModelTorque
    law: PDFeedforward

    def __post_init__(self) -> None:
        if self.law.n_v != self.torque.n_v:
            raise ModelError("the law does not fit the model", expected=f"{self.torque.n_v} joints", got=self.law.n_v)

    @property
    def torque_limit(self) -> FloatArray:
        """The law's."""
        return self.law.torque_limit

    def start(self, sample: ControlSample) -> FrictionMemory:
        """Return friction that nothing has bent."""
        return self.torque.start(sample.q_ref)

    def step(self, memory: FrictionMemory, sample: ControlSample) -> tuple[FrictionMemory, FloatArray]:
        """Return friction's memory behind this step, and the motor torque (n_v,) [Nm or N]."""
        _, _, q, dq, q_ref, dq_ref, ddq_ref, _, _ = sample
        memory, ahead = self.torque.step(memory, JointState(q_ref, dq_ref, ddq_ref))
        return memory, self.law.torque(q, dq, q_ref=q_ref, dq_ref=dq_ref, model_torque=ahead)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComputedTorque:
    """Computed torque: `M(q) (ddq_ref + kd de + kp e) + b(q, dq) + friction(reference)`, clipped.

    With the true model the error obeys `dde + kd de + kp e = 0` on every joint, whatever the others do.

    torque : of the model
    kp, kd : (n_v,) gains [1/s^2, 1/s]
    torque_limit : (n_v,) largest torque [Nm or N], infinite by default

    Source: Luh, Walker, Paul, "Resolved-acceleration control of mechanical manipulators", 1980.
    """

    feedforward: ClassVar[Feedforward] = "nothing"
    torque: ModelTorque
    kp: FloatArray
    kd: FloatArray
    torque_limit: FloatArray = field(default_factory=lambda: np.array(np.inf))

    def __post_init__(self) -> None:
        n_v, where = self.torque.n_v, "computed torque"
        for name in ("kp", "kd"):
            gain = frozen(name, getattr(self, name), (n_v,), where=where)
            if gain.min() < 0.0:
                raise ArrayError(f"{name} is negative", where=where, got=f"{gain.min():g}")
            object.__setattr__(self, name, gain)
        object.__setattr__(self, "torque_limit", joint_limits(self.torque_limit, n_v, where))

    def start(self, sample: ControlSample) -> FrictionMemory:
        """Return friction that nothing has bent."""
        return self.torque.start(sample.q_ref)

    def step(self, memory: FrictionMemory, sample: ControlSample) -> tuple[FrictionMemory, FloatArray]:
        """Return friction's memory behind this step, and the motor torque (n_v,) [Nm or N]."""
        _, _, q, dq, q_ref, dq_ref, ddq_ref, _, _ = sample
        wanted = ddq_ref + self.kd * (dq_ref - dq) + self.kp * (q_ref - q)
        asked = JointState(q, dq, wanted)
        memory, torque = self.torque.step(memory, asked, passing=JointState(q_ref, dq_ref, ddq_ref))
        return memory, np.maximum(np.minimum(torque, self.torque_limit), -self.torque_limit)


def computed_torque(
    torque: ModelTorque, *, bandwidth: float, torque_limit: FloatArray | float = np.inf
) -> ComputedTorque:
    """Return computed torque whose error is critically damped: `kp = w^2, kd = 2 w` with `w = 2 pi bandwidth`.

    Parameters
    ----------
    bandwidth : [Hz]
    torque_limit : (n_v,) or one for all joints [Nm or N]

    Raises
    ------
    ModelError
        when the bandwidth is not positive.
    """
    if not 0.0 < bandwidth < np.inf:
        raise ModelError("bandwidth of computed torque", expected="a positive number", got=bandwidth)
    w = np.full(torque.n_v, 2.0 * np.pi * bandwidth)
    return ComputedTorque(torque=torque, kp=w**2, kd=2.0 * w, torque_limit=np.asarray(torque_limit))
