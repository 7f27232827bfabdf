"""A plant as flat arrays: what the step kernel reads and writes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.simulation.laws import SharedDrive
from tauhat.simulation.laws.law import JointState, resting_state
from tauhat.simulation.laws.program import Program, compiled, initial_memory
from tauhat.simulation.native import NativeFunctions
from tauhat.simulation.parameters import TrueParameters


class Engine(NamedTuple):
    """MuJoCo as a kernel sees it: addresses, and views of the model's and the data's own memory.

    step, forward, implicit : addresses of the functions; zero without native ones
    model, data : addresses of what they take
    dof : (n_v,) index of each joint of the robot among MuJoCo's
    """

    step: int
    forward: int
    implicit: int
    model: int
    data: int
    dof: IntArray
    qpos: FloatArray
    qvel: FloatArray
    qacc: FloatArray
    applied: FloatArray
    smooth: FloatArray
    constraint: FloatArray
    damping: FloatArray
    dryness: FloatArray


class Drives(NamedTuple):
    """Constants of the drives, (n_v,) each.

    timestep : [s]
    elastic : whether any joint is
    offset, viscous, coulomb, rotor : as in `TrueParameters`
    stiffness, spring_damping, half_gap : of elastic transmissions; a stiffness of zero marks a rigid joint
    shared : (n_v, n_v) inertia of motors that turn with two joints
    """

    timestep: float
    elastic: bool
    offset: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    rotor: FloatArray
    stiffness: FloatArray
    spring_damping: FloatArray
    half_gap: FloatArray
    shared: FloatArray


class Warming(NamedTuple):
    """Constants of the thermal states.

    active : whether friction depends on temperature at all
    ambient, reference : [deg C]
    decay : (n_v,) what is left of a difference of temperature after a step
    rise : (n_v,) [K/J]
    slopes : (2 + n_laws, n_v) relative change of viscous, Coulomb and the laws' friction [1/K]
    """

    active: bool
    ambient: float
    reference: float
    decay: FloatArray
    rise: FloatArray
    slopes: FloatArray


class Machine(NamedTuple):
    """Everything that does not change while a plant runs."""

    engine: Engine
    drives: Drives
    warming: Warming
    program: Program


class MachineState(NamedTuple):
    """What changes, (n_v,) each; from `q` on it is what the last step found at its begin.

    shaft, shaft_dq : where the motors are now, on the joint side; the joints' own position where they are rigid
    memory : (n_rows, n_v) of the laws
    load : size of the rigid-body torque through the gear
    temperature : [deg C]
    external : torque that the environment adds, held until it is set again
    q, dq, ddq, motor, motor_dq, motor_ddq : motion of the links and of the motors
    dry, law, gear : torque of ideal dry friction, of everything passive beside it, and through the gear
    friction, slope, spring : of friction laws with its derivative by speed, and of springs
    single : one joint, scratch
    work : (8, n_v) scratch
    """

    shaft: FloatArray
    shaft_dq: FloatArray
    memory: FloatArray
    load: FloatArray
    temperature: FloatArray
    external: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    motor: FloatArray
    motor_dq: FloatArray
    motor_ddq: FloatArray
    dry: FloatArray
    law: FloatArray
    gear: FloatArray
    friction: FloatArray
    slope: FloatArray
    spring: FloatArray
    single: JointState
    work: FloatArray


def drives_of(truth: TrueParameters, timestep: float) -> Drives:
    """Return the constants of the drives."""
    n_v, elastic = truth.n_v, truth.elasticity
    inertias = [law.inertia_matrix(n_v) for law in truth.laws if isinstance(law, SharedDrive)]
    rigid = np.zeros(n_v)
    return Drives(
        timestep=timestep,
        elastic=elastic is not None,
        offset=truth.offset,
        viscous=truth.viscous,
        coulomb=truth.coulomb,
        rotor=truth.rotor,
        stiffness=rigid if elastic is None else elastic.spread(elastic.stiffness, n_v),
        spring_damping=rigid if elastic is None else elastic.spread(elastic.damping, n_v),
        half_gap=rigid if elastic is None else elastic.spread(0.5 * elastic.gap, n_v),
        shared=np.sum(inertias, axis=0) if inertias else np.zeros((n_v, n_v)),
    )


def warming_of(truth: TrueParameters, timestep: float) -> Warming:
    """Return the constants of the thermal states, which stay put and change nothing where the truth has none."""
    n_v, heat = truth.n_v, truth.heat
    slopes = np.zeros((2 + len(truth.laws), n_v))
    if heat is None:
        return Warming(False, 0.0, 0.0, np.ones(n_v), np.zeros(n_v), slopes)
    slopes[0], slopes[1] = heat.viscous, heat.coulomb
    slopes[2 : 2 + len(heat.laws)] = heat.laws
    decay = np.exp(-timestep / heat.time_constant)
    # A step's heat arrives evenly over the step and cools while it does.
    rise = heat.heating * (1.0 - decay) * heat.time_constant / timestep
    return Warming(True, heat.ambient, heat.reference, decay, rise, slopes)


def engine_of(model: Any, data: Any, dof: IntArray, native: NativeFunctions | None) -> Engine:
    """Return MuJoCo's memory as views; without native functions all addresses are zero."""
    step, forward, implicit = native or (0, 0, 0)
    return Engine(
        step=step,
        forward=forward,
        implicit=implicit,
        model=model._address if native else 0,  # noqa: SLF001 (the only way to the C struct)
        data=data._address if native else 0,  # noqa: SLF001
        dof=dof,
        qpos=data.qpos,
        qvel=data.qvel,
        qacc=data.qacc,
        applied=data.qfrc_applied,
        smooth=data.qfrc_smooth,
        constraint=data.qfrc_constraint,
        damping=model.dof_damping,
        dryness=model.dof_frictionloss,
    )


def machine_of(truth: TrueParameters, engine: Engine, timestep: float) -> Machine:
    """Return what the kernel needs of a plant."""
    return Machine(engine, drives_of(truth, timestep), warming_of(truth, timestep), compiled(truth.laws, truth.n_v))


def machine_state(truth: TrueParameters) -> MachineState:
    """Return a state of rest at position zero."""
    n_v = truth.n_v
    rows = {name: np.zeros(n_v) for name in MachineState._fields if name not in {"memory", "single", "work"}}
    if truth.heat is not None:
        rows["temperature"][:] = truth.heat.initial
    return MachineState(
        **rows, memory=initial_memory(truth.laws, n_v), single=resting_state(1), work=np.zeros((8, n_v))
    )
