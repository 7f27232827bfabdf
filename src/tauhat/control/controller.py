"""What a controller is to a simulated plant: a pure step from what its sensors show to a motor torque.

    class Hold:
        feedforward, torque_limit = "gravity", np.full(6, 150.0)

        def start(self, sample):
            return np.zeros(6)                                   # the memory: whatever the controller needs

        def step(self, memory, sample):
            memory = memory + sample.period * (sample.q_ref - sample.q)
            return memory, sample.feedforward + 50.0 * memory    # the new memory, and the torque

The controller keeps nothing between steps but the memory that it is handed, so one object may steer many plants.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.laws import Feedforward, TrackingLaw


class ControlSample(NamedTuple):
    """What a controller sees in one period, (n_v,) each.

    t : since the start of the motion, below zero while the robot settles in the start pose [s]
    period : between two steps [s]
    q, dq : as the encoders show them
    q_ref, dq_ref, ddq_ref : reference
    feedforward : torque of the nominal robot along the reference, of the kind that the controller asks for
    tau : motor torque of the period before, what the drives really had [Nm or N]
    """

    t: float
    period: float
    q: FloatArray
    dq: FloatArray
    q_ref: FloatArray
    dq_ref: FloatArray
    ddq_ref: FloatArray
    feedforward: FloatArray
    tau: FloatArray


class Controller(Protocol):
    """A controller of all joints.

    feedforward : which torque along the reference it wants in each sample: `nothing`, `gravity` or `dynamics`
    torque_limit : (n_v,) largest torque, to which it clips itself [Nm or N]
    """

    @property
    def feedforward(self) -> Feedforward:
        """Which torque of the nominal robot the samples bring."""

    @property
    def torque_limit(self) -> FloatArray:
        """Largest torque, (n_v,) [Nm or N]; infinite where there is none."""

    def start(self, sample: ControlSample) -> Any:
        """Return the memory before the first step."""

    def step(self, memory: Any, sample: ControlSample) -> tuple[Any, FloatArray]:
        """Return the memory behind this step, and the motor torque (n_v,) [Nm or N]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingController:
    """A tracking law as a controller; its memory is the integral of the position error, (n_v,)."""

    law: TrackingLaw

    @property
    def feedforward(self) -> Feedforward:
        """What the law adds its feedback to."""
        return self.law.feedforward

    @property
    def torque_limit(self) -> FloatArray:
        """The law's."""
        return self.law.torque_limit

    def start(self, sample: ControlSample) -> FloatArray:
        """Return an integral of nothing."""
        return np.zeros_like(sample.q)

    def step(self, memory: FloatArray, sample: ControlSample) -> tuple[FloatArray, FloatArray]:
        """Return the integral behind this step, and the law's torque."""
        _, period, q, dq, q_ref, dq_ref, _, feedforward, _ = sample
        return self.law.step(memory, q_ref - q, dq_ref - dq, period=period, feedforward=feedforward)
