"""The plant in motion: its state, the memory of its passive laws, and one step of time.

A step is that of `step_kernel`, which calls MuJoCo by the address of its functions; where those are not to be had, the
same step is passed by `reference_step` in Python.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation import rows as r
from tauhat.simulation.laws.law import resting_state
from tauhat.simulation.laws.program import parts_of_memory
from tauhat.simulation.loop_kernel import pass_period
from tauhat.simulation.machine import Machine, MachineState, engine_of, machine_of, machine_state
from tauhat.simulation.native import native_functions
from tauhat.simulation.plant import Plant, load_mujoco
from tauhat.simulation.reference_step import Laws, Simulator, reference_step

_LONGEST_STEP = 1.0  # of a bristle's or spring's own time sqrt(inertia / stiffness): half the limit of stability


class Reaction(NamedTuple):
    """What the plant did at the begin of a step, (n_v,) each; the fields are the channels of a log.

    q, dq, ddq : of the links [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    tau : of the motors [Nm or N]
    coulomb_torque, law_torque : taken by ideal dry friction, and by everything passive beside the plant's own friction
    motor_q, motor_dq, motor_ddq : of the motors, on the joint side; those of the links where joints are rigid
    gear_torque : what the gear passes on to the link [Nm or N]
    temperature : [deg C]; zero where the plant has none
    external_torque : what the environment adds [Nm or N]
    """

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    coulomb_torque: FloatArray
    law_torque: FloatArray
    motor_q: FloatArray
    motor_dq: FloatArray
    motor_ddq: FloatArray
    gear_torque: FloatArray
    temperature: FloatArray
    external_torque: FloatArray


CHANNELS = Reaction._fields


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunningPlant:
    """A plant with its state; made by `started`, changed by `advance`.

    simulator : MuJoCo with copies of the plant's model and its data, of this run alone
    machine, memory : the same as arrays, with all else that moves
    laws : the passive laws, each with its part of the memory
    """

    plant: Plant
    simulator: Simulator
    machine: Machine
    memory: MachineState
    laws: Laws

    @property
    def native(self) -> bool:
        """Whether the kernel steps the plant, and not Python."""
        return self.machine.engine.step != 0

    @property
    def state(self) -> tuple[FloatArray, FloatArray]:
        """Position and velocity of the links, (n_v,) each."""
        engine = self.machine.engine
        return engine.qpos[engine.dof], engine.qvel[engine.dof]

    @property
    def motor_state(self) -> tuple[FloatArray, FloatArray]:
        """Position and velocity of the motors on the joint side, (n_v,) each."""
        return self.memory.shaft.copy(), self.memory.shaft_dq.copy()

    @property
    def shared_inertia(self) -> FloatArray:
        """Inertia of the motors that turn with two joints, (n_v, n_v)."""
        return self.machine.drives.shared

    @property
    def temperature(self) -> FloatArray:
        """Temperatures of the joints, (n_v,) [deg C]; zero where the plant has none."""
        return self.memory.temperature.copy()

    def place(self, q: FloatArray, dq: FloatArray) -> None:
        """Put links and motors into a state; bristles and the springs of the gears stay bent as they are."""
        engine = self.machine.engine
        self.memory.shaft[:] += q - engine.qpos[engine.dof]
        self.memory.shaft_dq[:] = dq
        engine.qpos[engine.dof], engine.qvel[engine.dof] = q, dq

    def push(self, torque: FloatArray) -> None:
        """Let the environment add a torque (n_v,) to the links, until it is set again [Nm or N]."""
        self.memory.pushed[:] = torque

    def advance(self, tau: FloatArray, steps: int = 1) -> Reaction:
        """Pass `steps` steps of time under the motor torque (n_v,), and return the reaction at the first."""
        x = self.memory.rows
        record = np.empty((len(CHANNELS), x.shape[1]))
        x[r.TAU] = tau
        if self.native:
            pass_period(self.machine, x, self.memory.memory, steps, record)
        else:
            self._advance_in_python(steps, record)
        return Reaction(*record)

    def _advance_in_python(self, steps: int, record: FloatArray) -> None:
        x = self.memory.rows
        for step in range(steps):
            reference_step(self.simulator, self.machine, x, self.laws)
            if step == 0:
                record[:] = x[: len(CHANNELS)]

    def in_python(self) -> RunningPlant:
        """Return the same plant, stepped from Python."""
        engine = self.machine.engine._replace(step=0, forward=0, implicit=0)
        return replace(self, machine=self.machine._replace(engine=engine))


def started(plant: Plant, q: FloatArray) -> RunningPlant:
    """Return the plant at rest in the pose q (n_v,), bristles unbent, elastic gears bent by gravity and springs.

    Raises
    ------
    SimulationError
        when a spring or bristle is too stiff for the plant's timestep.
    """
    mujoco, truth = load_mujoco(), plant.parameters
    model = copy.copy(plant.model)
    data = mujoco.MjData(model)
    data.qpos[plant.dof] = q
    engine = engine_of(model, data, plant.dof, native_functions(mujoco))
    memory = machine_state(truth)
    pairs = zip(truth.laws, parts_of_memory(truth.laws, memory.memory), strict=True)
    running = RunningPlant(
        plant=plant,
        simulator=Simulator(mujoco, model, data),
        machine=machine_of(truth, engine, plant.timestep),
        memory=memory,
        laws=tuple(pairs),
    )
    mujoco.mj_forward(model, data)
    gravity = data.qfrc_bias[plant.dof]
    memory.load[:] = np.abs(gravity)
    memory.shaft[:] = q + _bending(running, gravity)
    _refuse_stiff_laws(running)
    return running


def _bending(running: RunningPlant, gravity: FloatArray) -> FloatArray:
    """Return by how much the motors must be ahead of their links to hold them, (n_v,)."""
    drives, joints = running.machine.drives, resting_state(gravity.size)
    joints.q[:], _ = running.state
    for law, part in running.laws:
        if law.side == "link":
            law.add(joints, part)
    torque = gravity + joints.torque
    stiffness = np.where(drives.stiffness > 0.0, drives.stiffness, np.inf)
    return np.asarray(torque / stiffness + np.sign(torque) * drives.half_gap)


def _refuse_stiff_laws(running: RunningPlant) -> None:
    """Refuse a timestep at which a bristle, or the teeth of a gear with a gap, would ring.

    Judged by the inertia of each joint with the others free. An elastic gear without a gap may be as stiff as it likes.
    """
    plant, n_v, drives = running.plant, running.plant.robot.n_v, running.machine.drives
    mujoco, model, data = running.simulator
    inverse = np.empty((model.nv, model.nv))
    mujoco.mj_solveM(model, data, inverse, np.eye(model.nv))
    link = np.diag(inverse)[plant.dof]
    elastic = drives.stiffness > 0.0
    motor = 1.0 / np.where(elastic, drives.rotor, np.inf)
    rings = np.zeros(n_v)
    for law, _ in running.laws:
        mobility = link if law.side == "link" else np.where(elastic, motor, link)
        rings += mobility * law.stiffness(running.memory.load)
    teeth = np.where(drives.half_gap > 0.0, drives.stiffness * (motor + link), 0.0)
    longest = _LONGEST_STEP / np.sqrt(np.maximum(np.maximum(rings, teeth), np.finfo(float).tiny))
    worst = int(np.argmin(longest))
    if longest[worst] < plant.timestep:
        gap = teeth[worst] > rings[worst]
        raise SimulationError(
            "the gap's teeth are too stiff for the timestep"
            if gap
            else "the passive laws are too stiff for the timestep",
            where=f"{plant.robot.name}, joint {plant.robot.joint_names[worst]}",
            expected=f"a timestep below {longest[worst]:.2g} s",
            got=f"{plant.timestep:.2g} s",
            remedy="shorten the timestep, or soften the spring"
            if gap
            else "shorten the timestep, or lengthen the bristles",
        )
