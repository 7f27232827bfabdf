"""One sample period of a cell: steps of the plant, the force of the contact, heat, and the joints' controller.

    q_ref(u) : cubic through positions and speeds at both ends of the period, u from 0 to 1
    dq_ref(u), feedforward(u) : straight lines
    tau(k) = clip(feedforward + kp (q_ref - q) + kd (dq_ref - dq))(k - delay)

The controller acts at the end of every control period; its last torque is the one that starts with the next sample.
"""

from __future__ import annotations

from numba import njit

from tauhat.simulation import rows as r
from tauhat.simulation.loop_kernel import FINE, observe
from tauhat.simulation.step_kernel import pass_step
from tauhat.simulation.touch_kernel import FORCE, FOUND, force_on_tool

# What is added up over a sample period: force on the tool in base axes, normal force, steps; whether the last touched.
FORCE_SUM, NORMAL_SUM, STEPS, TOUCHES, FELT_SIZE = 0, 3, 4, 5, 6
# Rows of a guide, (n, n_v): references and feedforward at both ends of a sample period.
FROM_Q, FROM_DQ, FROM_TORQUE, TO_Q, TO_DQ, TO_TORQUE, GUIDE_ROWS = range(7)
# Rows of work, (n, n_v): what viscous friction, dry friction and the laws turned to heat [J], and time times warmth.
VISCOUS_WORK, DRY_WORK, LAW_WORK, WARM_TIME, WORK_ROWS = range(5)


@njit(cache=True, nogil=True, error_model="numpy")
def pass_sample(machine, x, memory, steering, guide, tally):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Pass one sample period under the torque x[TAU]; return the control period that ran away, or FINE."""
    engine, drives = machine.engine, machine.drives
    for k in range(FELT_SIZE):
        tally.felt[k] = 0.0
    for period in range(steering.periods):
        for _ in range(steering.substeps):
            pass_step(machine, x, memory)
            _feel(tally.touch, tally.felt)
            _warm(x, drives.timestep, tally.work)
        if _ran_away(engine, steering.fastest):
            return period
        observe(engine, x, steering, steering.ticks[0] + 1)
        _command(x, steering, guide, (period + 1) / steering.periods)
        for j in range(x.shape[1]):
            tally.heard[period, 0, j] = engine.qpos[engine.dof[j]]
            tally.heard[period, 1, j] = x[r.SHAFT, j]
            tally.heard[period, 2, j] = x[r.GEAR, j] if steering.gear_torque else x[r.TAU, j]
    return FINE


@njit(cache=True, nogil=True, error_model="numpy")
def _feel(touch, felt):  # type: ignore[no-untyped-def]
    """Add up the force of a step."""
    felt[STEPS] += 1.0
    felt[TOUCHES] = 1.0 if touch[FOUND] > 0.0 else 0.0
    if felt[TOUCHES] == 0.0:
        return
    felt[NORMAL_SUM] += touch[FORCE]
    force = force_on_tool(touch)
    for i in range(3):
        felt[FORCE_SUM + i] += force[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _warm(x, timestep, work):  # type: ignore[no-untyped-def]
    """Add up what the parts of friction turned to heat; a part that drives takes away from the others' heat."""
    for j in range(x.shape[1]):
        viscous = x[r.VISCOUS, j] * x[r.MOTOR_DQ, j]
        moved = x[r.MOVED, j]
        if (viscous + x[r.DRY, j] + x[r.FRICTION, j]) * moved < 0.0:
            moved = -moved
        work[VISCOUS_WORK, j] += viscous * moved
        work[DRY_WORK, j] += x[r.DRY, j] * moved
        work[LAW_WORK, j] += x[r.FRICTION, j] * moved
        work[WARM_TIME, j] += x[r.TEMPERATURE, j] * timestep


@njit(cache=True, nogil=True, error_model="numpy")
def _ran_away(engine, fastest):  # type: ignore[no-untyped-def]
    """Return whether a joint or the tip is too fast to be true, or no number."""
    total = 0.0
    for i in range(engine.qvel.size):
        total += engine.qvel[i] ** 2
    return not total < fastest**2


@njit(cache=True, nogil=True, error_model="numpy")
def _command(x, steering, guide, u):  # type: ignore[no-untyped-def]
    """Find the controller's torque at the part u of the sample period, and give the plant the one whose time is."""
    c, n = steering.rows, steering.queue.shape[0]
    place = steering.ticks[0] % n if n > 0 else 0
    steering.ticks[0] += 1
    away = 1.0 - u
    for j in range(x.shape[1]):
        # The cubic of Hermite; speeds are by time, hence the sample period.
        tangents = (away * guide[FROM_DQ, j] - u * guide[TO_DQ, j]) * u * away * steering.sample_period
        places = guide[FROM_Q, j] * (1.0 + 2.0 * u) * away**2 + guide[TO_Q, j] * u * u * (3.0 - 2.0 * u)
        speed = away * guide[FROM_DQ, j] + u * guide[TO_DQ, j]
        wanted = away * guide[FROM_TORQUE, j] + u * guide[TO_TORQUE, j]
        wanted += c[r.KP, j] * (places + tangents - c[r.READ, j]) + c[r.KD, j] * (speed - c[r.READ_DQ, j])
        command = max(min(wanted, c[r.LIMIT, j]), -c[r.LIMIT, j])
        x[r.TAU, j] = command
        if n > 0:
            x[r.TAU, j] = steering.queue[place, j]
            steering.queue[place, j] = command
