"""The step of `step_kernel` in plain NumPy, law by law as objects.

It is the kernel's reference, and its stand-in where MuJoCo's library cannot be called by address. The formulas are at
the head of the kernel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.simulation.laws import PassiveLaw
from tauhat.simulation.laws.law import JointState
from tauhat.simulation.machine import Drives, Machine, MachineState, Warming

Laws: TypeAlias = Sequence[tuple[PassiveLaw, FloatArray]]  # each with its memory


class Simulator(NamedTuple):
    """MuJoCo from Python: the module, the model and its data."""

    mujoco: Any
    model: Any
    data: Any


class _Found(NamedTuple):
    """What a step finds on the motors at its begin, (n_v,) each: own friction, slopes, and the gears' impedance."""

    viscous: FloatArray
    coulomb: FloatArray
    damping: FloatArray
    impedance: FloatArray


def reference_step(simulator: Simulator, machine: Machine, state: MachineState, *, laws: Laws, tau: FloatArray) -> None:
    """Pass one step under the motor torque tau (n_v,); the state then has what the step found at its begin."""
    engine, drives = machine.engine, machine.drives
    rigid = drives.stiffness == 0.0
    state.q[:], state.dq[:] = engine.qpos[engine.dof], engine.qvel[engine.dof]
    state.motor[:] = np.where(rigid, state.q, state.shaft)
    state.motor_dq[:] = np.where(rigid, state.dq, state.shaft_dq)
    state.spring[:] = 0.0
    links = JointState(state.q, state.dq, state.load, state.spring, np.zeros_like(tau))
    for law, memory in laws:
        if law.side == "link":
            law.add(links, memory)
    impedance = _transmissions(drives, state, rigid)
    found = _friction(machine, state, laws)._replace(impedance=impedance)
    engine.damping[engine.dof] = np.where(rigid, found.viscous + state.slope, 0.0)
    engine.dryness[engine.dof] = np.where(rigid, found.coulomb, 0.0)
    driven = tau - drives.offset - state.friction - state.spring
    moving = driven + state.external + state.slope * state.dq
    engine.applied[engine.dof] = np.where(rigid, moving, state.gear - state.spring + state.external)
    speed = _pass(simulator, machine, state, found, tau)
    _react(machine, state, found, tau, rigid)
    _remember(machine, state, found, speed, laws)


def _transmissions(drives: Drives, state: MachineState, rigid: NDArray[np.bool_]) -> FloatArray:
    """Find the torque of elastic gears; return how much they resist a change of speed, (n_v,)."""
    bent, rate = state.motor - state.q, state.motor_dq - state.dq
    beyond = np.where(drives.half_gap > 0.0, np.copysign(np.maximum(0.0, np.abs(bent) - drives.half_gap), bent), bent)
    torque = drives.stiffness * beyond + drives.spring_damping * rate
    loose = (drives.half_gap > 0.0) & (torque * beyond <= 0.0)
    torque = np.where(loose, 0.0, torque)
    impedance = 0.5 * drives.spring_damping + 0.25 * drives.stiffness * drives.timestep
    state.gear[:] = np.where(rigid, state.gear, torque)
    state.load[:] = np.where(rigid, state.load, np.abs(torque - state.spring))
    return np.where(loose, 0.0, impedance)


def _friction(machine: Machine, state: MachineState, laws: Laws) -> _Found:
    """Add up the laws of the motors, each at its temperature."""
    warming, drives = machine.warming, machine.drives
    factors = _factors(warming, state.temperature)
    state.friction[:], state.slope[:] = 0.0, 0.0
    for (law, memory), factor in zip(laws, factors[2:], strict=True):
        if law.side == "motor":
            part, slope = np.zeros_like(state.q), np.zeros_like(state.q)
            law.add(JointState(state.motor, state.motor_dq, state.load, part, slope), memory)
            state.friction[:] += part * factor
            state.slope[:] += slope * factor
    viscous, coulomb = drives.viscous * factors[0], drives.coulomb * factors[1]
    return _Found(viscous, coulomb, viscous + state.slope, np.zeros_like(viscous))


def _factors(warming: Warming, temperature: FloatArray) -> FloatArray:
    return np.maximum(0.0, 1.0 + warming.slopes * (temperature - warming.reference))


def _pass(simulator: Simulator, machine: Machine, state: MachineState, found: _Found, tau: FloatArray) -> FloatArray:
    """Let MuJoCo pass the step; return the new speed of the motors, (n_v,)."""
    mujoco, model, data = simulator
    engine, drives = machine.engine, machine.drives
    if not drives.elastic:
        mujoco.mj_step(model, data)
        return np.asarray(engine.qvel[engine.dof])
    mujoco.mj_forward(model, data)
    e = np.flatnonzero(drives.stiffness)
    dof, h, b = engine.dof[e], drives.timestep, drives.rotor[e]
    s, c, limit = found.impedance[e], found.damping[e], found.coulomb[e]
    rest = (tau - drives.offset - state.friction - found.viscous * state.motor_dq - state.gear)[e]
    whole = b + h * c + h * s
    stopping = state.motor_dq[e] * whole / h + rest + s * h * engine.qacc[dof]
    stands = np.abs(stopping) <= limit
    dry = np.minimum(np.maximum(stopping, -limit), limit)
    state.dry[e], state.motor_ddq[e] = dry, (rest - dry) / b
    push = h * (rest - dry) / whole
    engine.damping[dof] = np.where(stands, s, s * (b + h * c) / whole)
    engine.smooth[dof] += np.where(stands, 0.0, s * push)
    mujoco.mj_implicit(model, data)
    speed = state.motor_dq[e] + push + h * s * (engine.qvel[dof] - state.dq[e]) / whole
    moving = np.where(stands | (speed * dry < 0.0), 0.0, speed)
    speeds = np.array(engine.qvel[engine.dof])
    speeds[e] = moving
    return speeds


def _react(machine: Machine, state: MachineState, found: _Found, tau: FloatArray, rigid: NDArray[np.bool_]) -> None:
    """Note the accelerations and torques at the begin of the step."""
    engine, drives = machine.engine, machine.drives
    state.ddq[:] = engine.qacc[engine.dof]
    own = found.viscous * state.motor_dq
    coupled = (drives.shared * state.ddq).sum(axis=1)  # row by row, as the kernel adds
    state.law[:] = state.friction + state.spring + coupled + (own - drives.viscous * state.motor_dq)
    state.motor_ddq[:] = np.where(rigid, state.ddq, state.motor_ddq)
    state.dry[:] = np.where(rigid, -engine.constraint[engine.dof], state.dry)
    taken = state.friction + state.dry + own + drives.rotor * state.ddq + coupled
    state.gear[:] = np.where(rigid, tau - drives.offset - taken, state.gear)
    state.load[:] = np.where(rigid, np.abs(state.gear - state.spring), state.load)


def _remember(machine: Machine, state: MachineState, found: _Found, speed: FloatArray, laws: Laws) -> None:
    """Carry motors, bristles and temperatures along."""
    engine, drives, warming = machine.engine, machine.drives, machine.warming
    rigid = drives.stiffness == 0.0
    moved = np.where(rigid, engine.qpos[engine.dof] - state.q, drives.timestep * speed)
    state.shaft[:], state.shaft_dq[:] = state.motor + moved, speed
    for law, memory in laws:
        law.advance(moved, memory)
    if warming.active:
        friction = state.friction + state.dry + found.viscous * state.motor_dq
        cooled = warming.ambient + (state.temperature - warming.ambient) * warming.decay
        state.temperature[:] = cooled + warming.rise * np.abs(friction * moved)
