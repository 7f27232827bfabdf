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

x are the rows of the state, d those of the drives: see `rows`.
"""

from __future__ import annotations

import math

from numba import njit

from tauhat.simulation import rows as r
from tauhat.simulation.laws.program_kernel import add_law, advance_law, on_the_link
from tauhat.simulation.native_kernel import call_native
from tauhat.simulation.touch_kernel import force_on_tool, push_on_joint


@njit(cache=True, nogil=True, error_model="numpy")
def pass_step(machine, x, memory):  # type: ignore[no-untyped-def]
    """Pass one step under the motor torque x[TAU]; x then has what the step found at its begin."""
    engine, drives, d = machine.engine, machine.drives, machine.drives.rows
    for j in range(x.shape[1]):
        i, rigid = engine.dof[j], d[r.STIFFNESS, j] == 0.0
        x[r.Q, j], x[r.DQ, j] = engine.qpos[i], engine.qvel[i]
        x[r.MOTOR, j] = x[r.Q, j] if rigid else x[r.SHAFT, j]
        x[r.MOTOR_DQ, j] = x[r.DQ, j] if rigid else x[r.SHAFT_DQ, j]
        x[r.TEMPERATURE, j], x[r.EXTERNAL, j] = x[r.WARMTH, j], x[r.PUSHED, j]
    _springs(machine.program, x, memory)
    if drives.elastic:
        _transmissions(drives, x)
    _friction(machine.program, machine.warming, d, x, memory)
    _apply(engine, d, x)
    if drives.elastic:
        call_native(engine.forward, engine.model, engine.data)
        _load_links(engine, drives, x)
        call_native(engine.implicit, engine.model, engine.data)
        _move_motors(engine, drives, x)
    else:
        call_native(engine.step, engine.model, engine.data)
    _react(engine, d, x)
    _remember(machine, x, memory)


@njit(cache=True, nogil=True, error_model="numpy")
def _springs(program, x, memory):  # type: ignore[no-untyped-def]
    """Add up the laws that act on the links."""
    for j in range(x.shape[1]):
        x[r.SEEN, j], x[r.SEEN_DQ, j], x[r.SEEN_LOAD, j] = x[r.Q, j], x[r.DQ, j], x[r.LOAD, j]
        x[r.PART, j], x[r.PART_SLOPE, j] = 0.0, 0.0
    for i in range(program.kinds.size):
        if on_the_link(program.kinds[i]):
            add_law(program, i, memory, x)
    for j in range(x.shape[1]):
        x[r.SPRING, j] = x[r.PART, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _friction(program, warming, d, x, memory):  # type: ignore[no-untyped-def]
    """Add up the laws that act on the motors, each at its temperature, and the plant's own friction at it."""
    for j in range(x.shape[1]):
        x[r.SEEN, j], x[r.SEEN_DQ, j], x[r.SEEN_LOAD, j] = x[r.MOTOR, j], x[r.MOTOR_DQ, j], x[r.LOAD, j]
        x[r.FRICTION, j], x[r.SLOPE, j] = 0.0, 0.0
        x[r.VISCOUS, j] = d[r.OWN_VISCOUS, j] * _factor(warming, 0, x, j)
        x[r.COULOMB, j] = d[r.OWN_COULOMB, j] * _factor(warming, 1, x, j)
    for i in range(program.kinds.size):
        if on_the_link(program.kinds[i]):
            continue
        for j in range(x.shape[1]):
            x[r.PART, j], x[r.PART_SLOPE, j] = 0.0, 0.0
        add_law(program, i, memory, x)
        for j in range(x.shape[1]):
            factor = _factor(warming, 2 + i, x, j)
            x[r.FRICTION, j] += x[r.PART, j] * factor
            x[r.SLOPE, j] += x[r.PART_SLOPE, j] * factor


@njit(cache=True, nogil=True, error_model="numpy")
def _factor(warming, which, x, j):  # type: ignore[no-untyped-def]
    """Return how much of a friction is left at the joint's temperature."""
    return max(0.0, 1.0 + warming.rows[r.SLOPES + which, j] * (x[r.WARMTH, j] - warming.reference))


@njit(cache=True, nogil=True, error_model="numpy")
def _transmissions(drives, x):  # type: ignore[no-untyped-def]
    """Find the torque of the springs in the gears and how much it resists a change of speed."""
    d = drives.rows
    for j in range(x.shape[1]):
        k, gap = d[r.STIFFNESS, j], d[r.HALF_GAP, j]
        if k == 0.0:
            continue
        bent, rate = x[r.MOTOR, j] - x[r.Q, j], x[r.MOTOR_DQ, j] - x[r.DQ, j]
        beyond = math.copysign(max(0.0, abs(bent) - gap), bent) if gap > 0.0 else bent
        torque = k * beyond + d[r.SPRING_DAMPING, j] * rate
        x[r.IMPEDANCE, j] = 0.5 * d[r.SPRING_DAMPING, j] + 0.25 * k * drives.timestep
        if gap > 0.0 and torque * beyond <= 0.0:  # inside the gap, or the teeth would have to pull
            torque, x[r.IMPEDANCE, j] = 0.0, 0.0
        x[r.GEAR, j] = torque
        x[r.LOAD, j] = abs(torque - x[r.SPRING, j])


@njit(cache=True, nogil=True, error_model="numpy")
def _apply(engine, d, x):  # type: ignore[no-untyped-def]
    """Give MuJoCo the torques on its links and the damping of its step."""
    for j in range(x.shape[1]):
        i = engine.dof[j]
        if d[r.STIFFNESS, j] != 0.0:
            engine.damping[i], engine.dryness[i] = 0.0, 0.0
            engine.applied[i] = x[r.GEAR, j] - x[r.SPRING, j] + x[r.EXTERNAL, j]
            continue
        engine.damping[i], engine.dryness[i] = x[r.VISCOUS, j] + x[r.SLOPE, j], x[r.COULOMB, j]
        driven = x[r.TAU, j] - d[r.OFFSET, j] - x[r.FRICTION, j] - x[r.SPRING, j]
        engine.applied[i] = driven + x[r.EXTERNAL, j] + x[r.SLOPE, j] * x[r.DQ, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _load_links(engine, drives, x):  # type: ignore[no-untyped-def]
    """Decide what dry friction does to the motors, and add to the links what their motors' step does to them."""
    h, d = drives.timestep, drives.rows
    for j in range(x.shape[1]):
        if d[r.STIFFNESS, j] == 0.0:
            continue
        i, b, s = engine.dof[j], d[r.ROTOR, j], x[r.IMPEDANCE, j]
        c, own = x[r.VISCOUS, j] + x[r.SLOPE, j], x[r.VISCOUS, j] * x[r.MOTOR_DQ, j]
        rest = x[r.TAU, j] - d[r.OFFSET, j] - x[r.FRICTION, j] - own - x[r.GEAR, j]
        whole = b + h * c + h * s
        stopping = x[r.MOTOR_DQ, j] * whole / h + rest + s * h * engine.qacc[i]
        limit = x[r.COULOMB, j]
        x[r.DRY, j] = min(max(stopping, -limit), limit)
        x[r.MOTOR_DDQ, j] = (rest - x[r.DRY, j]) / b
        x[r.STANDS, j] = 1.0 if abs(stopping) <= limit else 0.0
        if x[r.STANDS, j] == 1.0:
            engine.damping[i] = s
            continue
        x[r.PUSH, j] = h * (rest - x[r.DRY, j]) / whole
        engine.damping[i] = s * (b + h * c) / whole
        engine.smooth[i] += s * x[r.PUSH, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _move_motors(engine, drives, x):  # type: ignore[no-untyped-def]
    """Find the new speeds of the elastic joints' motors, and what they move in the step."""
    h, d = drives.timestep, drives.rows
    for j in range(x.shape[1]):
        if d[r.STIFFNESS, j] == 0.0:
            continue
        s, speed = x[r.IMPEDANCE, j], 0.0
        if x[r.STANDS, j] == 0.0:
            whole = d[r.ROTOR, j] + h * (x[r.VISCOUS, j] + x[r.SLOPE, j]) + h * s
            gained = h * s * (engine.qvel[engine.dof[j]] - x[r.DQ, j]) / whole
            speed = x[r.MOTOR_DQ, j] + x[r.PUSH, j] + gained
            if speed * x[r.DRY, j] < 0.0:  # friction stops a motor, it does not turn it round
                speed = 0.0
        x[r.MOVED, j], x[r.SPEED, j] = h * speed, speed


@njit(cache=True, nogil=True, error_model="numpy")
def _react(engine, d, x):  # type: ignore[no-untyped-def]
    """Note what the step found at its begin: accelerations, and the torques that balance there."""
    for j in range(x.shape[1]):
        x[r.DDQ, j] = engine.qacc[engine.dof[j]]
    force = force_on_tool(engine.touch)
    for j in range(x.shape[1]):
        own, coupled = x[r.VISCOUS, j] * x[r.MOTOR_DQ, j], 0.0
        for m in range(x.shape[1]):
            coupled += d[r.SHARED + j, m] * x[r.DDQ, m]
        warm = own - d[r.OWN_VISCOUS, j] * x[r.MOTOR_DQ, j]
        x[r.LAW, j] = x[r.FRICTION, j] + x[r.SPRING, j] + coupled + warm
        if d[r.STIFFNESS, j] == 0.0:
            x[r.MOTOR_DDQ, j] = x[r.DDQ, j]
            x[r.DRY, j] = push_on_joint(engine, force, j) - engine.constraint[engine.dof[j]]
            taken = x[r.FRICTION, j] + x[r.DRY, j] + own + d[r.ROTOR, j] * x[r.DDQ, j] + coupled
            x[r.GEAR, j] = x[r.TAU, j] - d[r.OFFSET, j] - taken
            # The load that friction sees in the next step is what this one's equation of motion leaves for the links.
            x[r.LOAD, j] = abs(x[r.GEAR, j] - x[r.SPRING, j])


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(machine, x, memory):  # type: ignore[no-untyped-def]
    """Carry motors, bristles and temperatures along what the motors moved."""
    engine, d, program, warming = machine.engine, machine.drives.rows, machine.program, machine.warming
    for j in range(x.shape[1]):
        if d[r.STIFFNESS, j] == 0.0:
            x[r.MOVED, j] = engine.qpos[engine.dof[j]] - x[r.Q, j]
            x[r.SPEED, j] = engine.qvel[engine.dof[j]]
        x[r.SHAFT, j], x[r.SHAFT_DQ, j] = x[r.MOTOR, j] + x[r.MOVED, j], x[r.SPEED, j]
    for i in range(program.kinds.size):
        advance_law(program, i, memory, x)
    if not warming.active:
        return
    for j in range(x.shape[1]):
        friction = x[r.FRICTION, j] + x[r.DRY, j] + x[r.VISCOUS, j] * x[r.MOTOR_DQ, j]
        cooled = warming.ambient + (x[r.WARMTH, j] - warming.ambient) * warming.rows[r.DECAY, j]
        x[r.WARMTH, j] = cooled + warming.rows[r.RISE, j] * abs(friction * x[r.MOVED, j])
