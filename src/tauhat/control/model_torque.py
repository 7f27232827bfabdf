"""A model's torque as a controller needs it: one state at a time, in a few microseconds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.control.model_torque_kernel import model_torque_kernel
from tauhat.dynamics.forward import rotor_matrix
from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.passive_kernel import ELEMENT
from tauhat.dynamics.simulated_arm import simulated_arm
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

_DESCRIBED_TERMS = "inertia,rotor,viscous,coulomb"


class JointState(NamedTuple):
    """Position, velocity and acceleration of the joints, (n_v,) each."""

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray


class FrictionMemory(NamedTuple):
    """What friction remembers: states of the bristles (n_elements,), and the position (n_v,) at which they had them."""

    bent: FloatArray
    q: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelTorque:
    """`M(q) ddq + b(q, dq) + Ia ddq + passive`: the torque a model predicts, step by step; b holds gravity.

    Pre-sliding friction (Dahl terms) needs a memory: the caller keeps it, so that one object serves many controllers.

    robot : geometry and gravity
    inertia : (n_v, 10) standard parameters; base parameters do as well, the regrouped ones zero
    rotor : (n_v, n_v) rotor inertia, joint side [kg m^2 or kg]; (n_v,) where each motor turns with one joint
    elements : (n_elements,) friction, springs and offsets, as `dynamics.passive_kernel` reads them
    """

    robot: Robot
    inertia: FloatArray
    rotor: FloatArray
    elements: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, dtype=ELEMENT))
    _links: NDArray[np.void] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        n_v = self.robot.n_v
        object.__setattr__(self, "inertia", frozen("inertia", self.inertia, (n_v, 10), where="model torque"))
        object.__setattr__(self, "rotor", rotor_matrix(self.rotor, n_v, where="model torque"))
        elements = np.array(self.elements)
        if elements.dtype != ELEMENT:
            raise ModelError("elements of a model torque", expected="those of simulated_arm", got=elements.dtype)
        object.__setattr__(self, "elements", read_only(elements))
        object.__setattr__(self, "_links", kernel_tree(self.robot).links)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.robot.n_v

    def start(self, q: FloatArray) -> FrictionMemory:
        """Return the memory of friction that nothing has bent yet, at the position q (n_v,)."""
        return FrictionMemory(np.zeros(self.elements.size), q)

    def step(
        self, memory: FrictionMemory, state: JointState, *, passing: JointState | None = None
    ) -> tuple[FrictionMemory, FloatArray]:
        """Return the memory behind this step and the torque, (n_v,) [Nm or N].

        Parameters
        ----------
        state : of links and rotors
        passing : motion that friction, springs and offsets meet; the same by default
        """
        met = state if passing is None else passing
        bent, torque = memory.bent.copy(), np.empty(self.robot.n_v)
        body = (self._links, self.inertia, self.rotor, self.elements)
        model_torque_kernel(body, tuple(state), (met.q, met.dq, met.q - memory.q), bent, torque)
        return FrictionMemory(bent, met.q), torque

    def along(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the torque along consecutive samples of a motion, (n_t, n_v) [Nm or N].

        Parameters
        ----------
        q, dq, ddq : (n_t, n_v)
        """
        shape = (None, self.n_v)
        rows = [frozen(name, value, shape) for name, value in (("q", q), ("dq", dq), ("ddq", ddq))]
        torque, memory = np.empty(rows[0].shape), self.start(rows[0][0])
        for k, state in enumerate(zip(*rows, strict=True)):
            memory, torque[k] = self.step(memory, JointState(*state))
        return torque


def model_torque(model: TorqueModel, standard: FloatArray) -> ModelTorque:
    """Return the torque of a model with these standard parameters (n_p,).

    Raises
    ------
    ModelError
        when a term has no value at a single state: friction that warms up.
    """
    arm = simulated_arm(model)
    values = frozen("standard", standard, (model.n_p,), where="model torque")
    inertia, rotor = arm.masses(values)
    return ModelTorque(robot=model.robot, inertia=inertia, rotor=rotor, elements=arm.passive(values))


def nominal_torque(robot: Robot) -> ModelTorque:
    """Return the torque of the robot's description: links, rotors, and what friction it states."""
    model = torque_model(robot, _DESCRIBED_TERMS)
    return model_torque(model, nominal_standard_parameters(model))
