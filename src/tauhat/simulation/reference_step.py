"""The step of `step_kernel` in plain NumPy, law by law as objects.

It is the kernel's reference, and its stand-in where MuJoCo's library cannot be called by address. The formulas are at
the head of the kernel, and x are the rows of the state here as there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.simulation import rows as r
from tauhat.simulation.laws import PassiveLaw
from tauhat.simulation.laws.law import JointState
from tauhat.simulation.machine import Drives, Machine, Warming

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


def reference_step(simulator: Simulator, machine: Machine, x: FloatArray, laws: Laws) -> None:
    """Pass one step under the motor torque x[TAU]; x then has what the step found at its begin."""
    engine, drives = machine.engine, machine.drives
    rigid = drives.stiffness == 0.0
    x[r.Q], x[r.DQ] = engine.qpos[engine.dof], engine.qvel[engine.dof]
    x[r.MOTOR] = np.where(rigid, x[r.Q], x[r.SHAFT])
    x[r.MOTOR_DQ] = np.where(rigid, x[r.DQ], x[r.SHAFT_DQ])
    x[r.TEMPERATURE], x[r.EXTERNAL] = x[r.WARMTH], x[r.PUSHED]
    x[r.SPRING] = 0.0
    links = JointState(x[r.Q], x[r.DQ], x[r.LOAD], x[r.SPRING], np.zeros_like(x[r.TAU]))
    for law, memory in laws:
        if law.side == "link":
            law.add(links, memory)
    impedance = _transmissions(drives, x, rigid)
    found = _friction(machine, x, laws)._replace(impedance=impedance)
    engine.damping[engine.dof] = np.where(rigid, found.viscous + x[r.SLOPE], 0.0)
    engine.dryness[engine.dof] = np.where(rigid, found.coulomb, 0.0)
    driven = x[r.TAU] - drives.offset - x[r.FRICTION] - x[r.SPRING]
    moving = driven + x[r.EXTERNAL] + x[r.SLOPE] * x[r.DQ]
    engine.applied[engine.dof] = np.where(rigid, moving, x[r.GEAR] - x[r.SPRING] + x[r.EXTERNAL])
    speed = _pass(simulator, machine, x, found)
    _react(machine, x, found, np.where(rigid, _dry_friction(simulator)[engine.dof], x[r.DRY]))
    _remember(machine, x, found, speed, laws)


def _transmissions(drives: Drives, x: FloatArray, rigid: NDArray[np.bool_]) -> FloatArray:
    """Find the torque of elastic gears; return how much they resist a change of speed, (n_v,)."""
    bent, rate = x[r.MOTOR] - x[r.Q], x[r.MOTOR_DQ] - x[r.DQ]
    beyond = np.where(drives.half_gap > 0.0, np.copysign(np.maximum(0.0, np.abs(bent) - drives.half_gap), bent), bent)
    torque = drives.stiffness * beyond + drives.spring_damping * rate
    loose = (drives.half_gap > 0.0) & (torque * beyond <= 0.0)
    torque = np.where(loose, 0.0, torque)
    impedance = 0.5 * drives.spring_damping + 0.25 * drives.stiffness * drives.timestep
    x[r.GEAR] = np.where(rigid, x[r.GEAR], torque)
    x[r.LOAD] = np.where(rigid, x[r.LOAD], np.abs(torque - x[r.SPRING]))
    return np.where(loose, 0.0, impedance)


def _friction(machine: Machine, x: FloatArray, laws: Laws) -> _Found:
    """Add up the laws of the motors, each at its temperature."""
    warming, drives = machine.warming, machine.drives
    factors = _factors(warming, x[r.WARMTH])
    x[r.FRICTION], x[r.SLOPE] = 0.0, 0.0
    for (law, memory), factor in zip(laws, factors[2:], strict=True):
        if law.side == "motor":
            part, slope = np.zeros_like(x[r.Q]), np.zeros_like(x[r.Q])
            law.add(JointState(x[r.MOTOR], x[r.MOTOR_DQ], x[r.LOAD], part, slope), memory)
            x[r.FRICTION] += part * factor
            x[r.SLOPE] += slope * factor
    viscous, coulomb = drives.viscous * factors[0], drives.coulomb * factors[1]
    return _Found(viscous, coulomb, viscous + x[r.SLOPE], np.zeros_like(viscous))


def _factors(warming: Warming, temperature: FloatArray) -> FloatArray:
    return np.maximum(0.0, 1.0 + warming.rows[r.SLOPES :] * (temperature - warming.reference))


def _pass(simulator: Simulator, machine: Machine, x: FloatArray, found: _Found) -> FloatArray:
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
    rest = (x[r.TAU] - drives.offset - x[r.FRICTION] - found.viscous * x[r.MOTOR_DQ] - x[r.GEAR])[e]
    whole = b + h * c + h * s
    stopping = x[r.MOTOR_DQ][e] * whole / h + rest + s * h * engine.qacc[dof]
    stands = np.abs(stopping) <= limit
    dry = np.minimum(np.maximum(stopping, -limit), limit)
    x[r.DRY][e], x[r.MOTOR_DDQ][e] = dry, (rest - dry) / b
    push = h * (rest - dry) / whole
    engine.damping[dof] = np.where(stands, s, s * (b + h * c) / whole)
    engine.smooth[dof] += np.where(stands, 0.0, s * push)
    mujoco.mj_implicit(model, data)
    speed = x[r.MOTOR_DQ][e] + push + h * s * (engine.qvel[dof] - x[r.DQ][e]) / whole
    moving = np.where(stands | (speed * dry < 0.0), 0.0, speed)
    speeds = np.array(engine.qvel[engine.dof])
    speeds[e] = moving
    return speeds


def _dry_friction(simulator: Simulator) -> FloatArray:
    """Return the torque of dry friction on MuJoCo's joints, (model.nv,): that of its own rows among the constraints."""
    mujoco, model, data = simulator
    rows = np.flatnonzero(data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF))
    dry = np.zeros(model.nv)
    dry[data.efc_id[rows]] = -data.efc_force[rows]
    return dry


def _react(machine: Machine, x: FloatArray, found: _Found, dry: FloatArray) -> None:
    """Note the accelerations and torques at the begin of the step."""
    engine, drives = machine.engine, machine.drives
    rigid = drives.stiffness == 0.0
    x[r.DDQ] = engine.qacc[engine.dof]
    own = found.viscous * x[r.MOTOR_DQ]
    coupled = (drives.shared * x[r.DDQ]).sum(axis=1)  # row by row, as the kernel adds
    x[r.LAW] = x[r.FRICTION] + x[r.SPRING] + coupled + (own - drives.viscous * x[r.MOTOR_DQ])
    x[r.MOTOR_DDQ] = np.where(rigid, x[r.DDQ], x[r.MOTOR_DDQ])
    x[r.DRY] = dry
    taken = x[r.FRICTION] + x[r.DRY] + own + drives.rotor * x[r.DDQ] + coupled
    x[r.GEAR] = np.where(rigid, x[r.TAU] - drives.offset - taken, x[r.GEAR])
    x[r.LOAD] = np.where(rigid, np.abs(x[r.GEAR] - x[r.SPRING]), x[r.LOAD])


def _remember(machine: Machine, x: FloatArray, found: _Found, speed: FloatArray, laws: Laws) -> None:
    """Carry motors, bristles and temperatures along."""
    engine, drives, warming = machine.engine, machine.drives, machine.warming
    rigid = drives.stiffness == 0.0
    moved = np.where(rigid, engine.qpos[engine.dof] - x[r.Q], drives.timestep * speed)
    x[r.SHAFT], x[r.SHAFT_DQ] = x[r.MOTOR] + moved, speed
    for law, memory in laws:
        law.advance(moved, memory)
    if warming.active:
        friction = x[r.FRICTION] + x[r.DRY] + found.viscous * x[r.MOTOR_DQ]
        cooled = warming.ambient + (x[r.WARMTH] - warming.ambient) * warming.rows[r.DECAY]
        x[r.WARMTH] = cooled + warming.rows[r.RISE] * np.abs(friction * moved)
