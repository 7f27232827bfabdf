"""The plant in motion: its state, the memory of its passive laws, and one step of time.

Every step the laws see the state at its begin. Their torque is applied; its derivative by dq goes to MuJoCo as damping,
with the same torque `damping dq` added back, so that the acceleration is that of the laws exactly, while the integrator
treats the steep part of friction near zero speed implicitly (a Rosenbrock step). Bristles are stepped like any spring:
position after velocity, which keeps energy and is stable for `step sqrt(stiffness / inertia) < 2`.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation.laws import JointState, SharedDrive
from tauhat.simulation.laws.law import resting_state
from tauhat.simulation.plant import Plant, load_mujoco

_LONGEST_STEP = 1.0  # of a bristle's or spring's own time sqrt(inertia / stiffness): half the limit of stability


class Reaction(NamedTuple):
    """What the plant did at the begin of a step, (n_v,) each.

    ddq : [rad/s^2 or m/s^2]
    coulomb_torque, law_torque : taken by ideal dry friction and by the passive laws [Nm or N]
    """

    ddq: FloatArray
    coulomb_torque: FloatArray
    law_torque: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunningPlant:
    """A plant with its state; made by `started`, changed by `advance`.

    model, data : own copies of the MuJoCo model and its state
    joints : what the passive laws see and add up
    memories : of the laws, one each
    shared_inertia : (n_v, n_v) of the motors that turn with two joints
    """

    plant: Plant
    mujoco: Any
    model: Any
    data: Any
    joints: JointState
    memories: tuple[FloatArray, ...]
    shared_inertia: FloatArray

    @property
    def state(self) -> tuple[FloatArray, FloatArray]:
        """Position and velocity, (n_v,) each."""
        return self.data.qpos[self.plant.dof], self.data.qvel[self.plant.dof]

    def place(self, q: FloatArray, dq: FloatArray) -> None:
        """Put the plant into a state, its bristles as they are."""
        self.data.qpos[self.plant.dof], self.data.qvel[self.plant.dof] = q, dq

    def advance(self, tau: FloatArray, steps: int = 1) -> Reaction:
        """Pass `steps` steps of time under the motor torque (n_v,), and return the reaction at the first."""
        if self.plant.parameters.laws:
            reaction = self._step_with_laws(tau)
            for _ in range(steps - 1):
                self._step_with_laws(tau)
            return reaction
        data, dof = self.data, self.plant.dof
        data.qfrc_applied[dof] = tau - self.plant.parameters.offset
        # mj_step first computes the acceleration at the present state and leaves it in qacc, then integrates:
        # what is read after a single step belongs to the state read before it.
        self.mujoco.mj_step(self.model, data)
        reaction = Reaction(data.qacc[dof], -data.qfrc_constraint[dof], np.zeros(dof.size))
        if steps > 1:
            self.mujoco.mj_step(self.model, data, steps - 1)
        return reaction

    def _step_with_laws(self, tau: FloatArray) -> Reaction:
        data, dof, joints, truth = self.data, self.plant.dof, self.joints, self.plant.parameters
        joints.q[:], joints.dq[:] = data.qpos[dof], data.qvel[dof]
        joints.torque[:], joints.damping[:] = 0.0, 0.0
        for law, memory in zip(truth.laws, self.memories, strict=True):
            law.add(joints, memory)
        driven = tau - truth.offset - joints.torque
        self.model.dof_damping[dof] = truth.viscous + joints.damping
        data.qfrc_applied[dof] = driven + joints.damping * joints.dq
        self.mujoco.mj_step(self.model, data)
        ddq, coulomb_torque = data.qacc[dof], -data.qfrc_constraint[dof]
        shared = self.shared_inertia @ ddq
        # The load that friction sees in the next step is what this one's equation of motion leaves for the links.
        rigid = driven - coulomb_torque - truth.viscous * joints.dq - truth.rotor * ddq - shared
        np.abs(rigid, out=joints.load)
        moved = data.qpos[dof] - joints.q
        for law, memory in zip(truth.laws, self.memories, strict=True):
            law.advance(moved, memory)
        return Reaction(ddq, coulomb_torque, joints.torque + shared)


def started(plant: Plant, q: FloatArray) -> RunningPlant:
    """Return the plant at rest in the pose q (n_v,), bristles unbent.

    Raises
    ------
    SimulationError
        when a spring or bristle is too stiff for the plant's timestep.
    """
    mujoco = load_mujoco()
    laws, n_v = plant.parameters.laws, plant.robot.n_v
    model = copy.copy(plant.model) if laws else plant.model
    data = mujoco.MjData(model)
    data.qpos[plant.dof] = q
    drives = [law.inertia_matrix(n_v) for law in laws if isinstance(law, SharedDrive)]
    running = RunningPlant(
        plant=plant,
        mujoco=mujoco,
        model=model,
        data=data,
        joints=resting_state(n_v),
        memories=tuple(law.memory() for law in laws),
        shared_inertia=np.sum(drives, axis=0) if drives else np.zeros((n_v, n_v)),
    )
    if laws:
        mujoco.mj_forward(model, data)
        running.joints.load[:] = np.abs(data.qfrc_bias[plant.dof])
        _refuse_stiff_laws(running)
    return running


def _refuse_stiff_laws(running: RunningPlant) -> None:
    """Refuse a timestep at which a bristle would ring: judged by the inertia of each joint with the others free."""
    plant, n_v = running.plant, running.plant.robot.n_v
    inverse = np.empty((n_v, n_v))
    running.mujoco.mj_solveM(running.model, running.data, inverse, np.eye(n_v))
    mobility = np.diag(inverse)[plant.dof]
    stiffness = np.sum([law.stiffness(running.joints.load) for law in plant.parameters.laws], axis=0)
    longest = _LONGEST_STEP / np.sqrt(np.maximum(stiffness * mobility, np.finfo(float).tiny))
    worst = int(np.argmin(longest))
    if longest[worst] < plant.timestep:
        raise SimulationError(
            "the passive laws are too stiff for the timestep",
            where=f"{plant.robot.name}, joint {plant.robot.joint_names[worst]}",
            expected=f"a timestep below {longest[worst]:.2g} s",
            got=f"{plant.timestep:.2g} s",
            remedy="shorten the timestep, or lengthen the bristles",
        )
