"""One step of the plant in time: passive laws, elastic transmissions, MuJoCo's step, heat.

Rigid joints. The laws' torque f at the begin of the step is applied; its slope c by dq is given to MuJoCo as damping
and `c dq` added back: the acceleration is that of the laws exactly, the step implicit in what is steep (Rosenbrock).

Elastic joints, motor speed w, rotor B, step h. With `T = k d + b dd` at the begin, the gear's torque over the step is
`T + S (dw - ddq)`, `S = b/2 + k h/4`: the trapezoidal rule on speeds that live between the positions, of second
order, which neither damps an oscillation nor can be made unstable by a stiff spring. The motor's change of speed
    (B + h c + h S) dw = h (tau - f - dry - T) + h S ddq                                with B' = B + h c + h S
put into the link's equation leaves a damping `S (B + h c) / B'` and a push `S h (tau - f - dry - T) / B'` on MuJoCo's
link, both added after `mj_forward`: its acceleration is that under T. Dry friction `dry` is the torque that stops the
motor within the step, if that is within the Coulomb limit; a motor that stands is a wall, with damping S on the link.
"""

from __future__ import annotations

import math

from numba import njit

from tauhat.simulation.laws.law import JointState
from tauhat.simulation.laws.program_kernel import add_law, advance_law, on_the_link
from tauhat.simulation.native_kernel import call_native

# Rows of the scratch.
VISCOUS, COULOMB, PART, PART_SLOPE, IMPEDANCE, PUSH, STANDS, MOVED = 0, 1, 2, 3, 4, 5, 6, 7
SPEED = PUSH  # which nobody reads any more when the motors have moved


@njit(cache=True, nogil=True, error_model="numpy")
def pass_step(machine, state, tau):  # type: ignore[no-untyped-def]
    """Pass one step under the motor torque tau (n_v,); the state then has what the step found at its begin."""
    engine, drives = machine.engine, machine.drives
    for j in range(tau.size):
        i = engine.dof[j]
        state.q[j], state.dq[j] = engine.qpos[i], engine.qvel[i]
        rigid = drives.stiffness[j] == 0.0
        state.motor[j] = state.q[j] if rigid else state.shaft[j]
        state.motor_dq[j] = state.dq[j] if rigid else state.shaft_dq[j]
    _springs(machine, state)
    if drives.elastic:
        _transmissions(drives, state)
    _friction(machine, state)
    _apply(engine, drives, state, tau)
    if drives.elastic:
        call_native(engine.forward, engine.model, engine.data)
        _load_links(engine, drives, state, tau)
        call_native(engine.implicit, engine.model, engine.data)
        _move_motors(engine, drives, state, tau)
    else:
        call_native(engine.step, engine.model, engine.data)
    _react(engine, drives, state, tau)
    _remember(machine, state)


@njit(cache=True, nogil=True, error_model="numpy")
def _springs(machine, state):  # type: ignore[no-untyped-def]
    """Add up the laws that act on the links."""
    program, work = machine.program, state.work
    for j in range(state.q.size):
        state.spring[j] = 0.0
    joints = JointState(state.q, state.dq, state.load, state.spring, work[PART_SLOPE])
    for i in range(program.kinds.size):
        if on_the_link(program.kinds[i]):
            add_law(program, i, state.memory, joints, state.single)


@njit(cache=True, nogil=True, error_model="numpy")
def _friction(machine, state):  # type: ignore[no-untyped-def]
    """Add up the laws that act on the motors, each at its temperature, and the plant's own friction at it."""
    program, warming, work = machine.program, machine.warming, state.work
    _at_temperature(warming, 0, state, machine.drives.viscous, work[VISCOUS])
    _at_temperature(warming, 1, state, machine.drives.coulomb, work[COULOMB])
    part, part_slope = work[PART], work[PART_SLOPE]
    joints = JointState(state.motor, state.motor_dq, state.load, part, part_slope)
    for j in range(part.size):
        state.friction[j], state.slope[j] = 0.0, 0.0
    for i in range(program.kinds.size):
        if on_the_link(program.kinds[i]):
            continue
        for j in range(part.size):
            part[j], part_slope[j] = 0.0, 0.0
        add_law(program, i, state.memory, joints, state.single)
        if warming.active:
            _at_temperature(warming, 2 + i, state, part, part)
            _at_temperature(warming, 2 + i, state, part_slope, part_slope)
        for j in range(part.size):
            state.friction[j] += part[j]
            state.slope[j] += part_slope[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _at_temperature(warming, row, state, values, out):  # type: ignore[no-untyped-def]
    for j in range(values.size):
        factor = 1.0 + warming.slopes[row, j] * (state.temperature[j] - warming.reference)
        out[j] = values[j] * max(0.0, factor)


@njit(cache=True, nogil=True, error_model="numpy")
def _transmissions(drives, state):  # type: ignore[no-untyped-def]
    """Find the torque of the springs in the gears and how much it resists a change of speed."""
    h, impedance = drives.timestep, state.work[IMPEDANCE]
    for j in range(state.q.size):
        k, gap = drives.stiffness[j], drives.half_gap[j]
        if k == 0.0:
            continue
        bent, rate = state.motor[j] - state.q[j], state.motor_dq[j] - state.dq[j]
        beyond = math.copysign(max(0.0, abs(bent) - gap), bent) if gap > 0.0 else bent
        torque = k * beyond + drives.spring_damping[j] * rate
        if gap > 0.0 and torque * beyond <= 0.0:  # inside the gap, or the teeth would have to pull
            torque, impedance[j] = 0.0, 0.0
        else:
            impedance[j] = 0.5 * drives.spring_damping[j] + 0.25 * k * h
        state.gear[j] = torque
        state.load[j] = abs(torque - state.spring[j])


@njit(cache=True, nogil=True, error_model="numpy")
def _apply(engine, drives, state, tau):  # type: ignore[no-untyped-def]
    """Give MuJoCo the torques on its links and the damping of its step."""
    viscous, coulomb = state.work[VISCOUS], state.work[COULOMB]
    for j in range(tau.size):
        i = engine.dof[j]
        if drives.stiffness[j] != 0.0:
            engine.damping[i], engine.dryness[i] = 0.0, 0.0
            engine.applied[i] = state.gear[j] - state.spring[j] + state.external[j]
            continue
        engine.damping[i], engine.dryness[i] = viscous[j] + state.slope[j], coulomb[j]
        driven = tau[j] - drives.offset[j] - state.friction[j] - state.spring[j]
        engine.applied[i] = driven + state.external[j] + state.slope[j] * state.dq[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _load_links(engine, drives, state, tau):  # type: ignore[no-untyped-def]
    """Decide what dry friction does to the motors, and add to the links what their motors' step does to them."""
    h, work = drives.timestep, state.work
    for j in range(tau.size):
        if drives.stiffness[j] == 0.0:
            continue
        i, b, s = engine.dof[j], drives.rotor[j], work[IMPEDANCE, j]
        c = work[VISCOUS, j] + state.slope[j]
        rest = tau[j] - drives.offset[j] - state.friction[j] - work[VISCOUS, j] * state.motor_dq[j] - state.gear[j]
        whole = b + h * c + h * s
        stopping = state.motor_dq[j] * whole / h + rest + s * h * engine.qacc[i]
        limit = work[COULOMB, j]
        state.dry[j] = min(max(stopping, -limit), limit)
        state.motor_ddq[j] = (rest - state.dry[j]) / b
        if abs(stopping) <= limit:
            work[STANDS, j] = 1.0
            engine.damping[i] = s
            continue
        work[STANDS, j] = 0.0
        work[PUSH, j] = h * (rest - state.dry[j]) / whole
        engine.damping[i] = s * (b + h * c) / whole
        engine.smooth[i] += s * work[PUSH, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _move_motors(engine, drives, state, tau):  # type: ignore[no-untyped-def]
    h, work = drives.timestep, state.work
    for j in range(tau.size):
        if drives.stiffness[j] == 0.0:
            continue
        i, s = engine.dof[j], work[IMPEDANCE, j]
        speed = 0.0
        if work[STANDS, j] == 0.0:
            whole = drives.rotor[j] + h * (work[VISCOUS, j] + state.slope[j]) + h * s
            speed = state.motor_dq[j] + work[PUSH, j] + h * s * (engine.qvel[i] - state.dq[j]) / whole
            if speed * state.dry[j] < 0.0:  # friction stops a motor, it does not turn it round
                speed = 0.0
        work[MOVED, j] = h * speed
        work[SPEED, j] = speed


@njit(cache=True, nogil=True, error_model="numpy")
def _react(engine, drives, state, tau):  # type: ignore[no-untyped-def]
    """Note what the step found at its begin: accelerations, and the torques that balance there."""
    viscous = state.work[VISCOUS]
    for j in range(tau.size):
        i = engine.dof[j]
        state.ddq[j] = engine.qacc[i]
    for j in range(tau.size):
        i = engine.dof[j]
        own = viscous[j] * state.motor_dq[j]
        coupled = 0.0
        for m in range(tau.size):
            coupled += drives.shared[j, m] * state.ddq[m]
        warm = own - drives.viscous[j] * state.motor_dq[j]
        state.law[j] = state.friction[j] + state.spring[j] + coupled + warm
        if drives.stiffness[j] == 0.0:
            state.motor_ddq[j] = state.ddq[j]
            state.dry[j] = -engine.constraint[i]
            taken = state.friction[j] + state.dry[j] + own + drives.rotor[j] * state.ddq[j] + coupled
            state.gear[j] = tau[j] - drives.offset[j] - taken
            # The load that friction sees in the next step is what this one's equation of motion leaves for the links.
            state.load[j] = abs(state.gear[j] - state.spring[j])


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(machine, state):  # type: ignore[no-untyped-def]
    """Carry bristles and temperatures along what the motors moved, and the elastic motors themselves."""
    engine, drives, program, warming, work = (
        machine.engine,
        machine.drives,
        machine.program,
        machine.warming,
        state.work,
    )
    moved = work[MOVED]
    for j in range(moved.size):
        if drives.stiffness[j] == 0.0:
            moved[j] = engine.qpos[engine.dof[j]] - state.q[j]
            work[SPEED, j] = engine.qvel[engine.dof[j]]
        state.shaft[j], state.shaft_dq[j] = state.motor[j] + moved[j], work[SPEED, j]
    for i in range(program.kinds.size):
        advance_law(program, i, state.memory, moved, state.single)
    if warming.active:
        for j in range(moved.size):
            friction = state.friction[j] + state.dry[j] + work[VISCOUS, j] * state.motor_dq[j]
            heat = warming.rise[j] * abs(friction * moved[j])
            cooled = warming.ambient + (state.temperature[j] - warming.ambient) * warming.decay[j]
            state.temperature[j] = cooled + heat
