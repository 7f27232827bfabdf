"""The sample period of `contact_kernel` in plain NumPy: the kernel's reference, and its stand-in without native MuJoCo.

The formulas are at the head of the kernel.
"""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.simulation import rows as r
from tauhat.simulation import touch_kernel as t
from tauhat.simulation.contact import contact_kernel as c
from tauhat.simulation.contact.steering import Steering, Tally
from tauhat.simulation.loop_kernel import FINE
from tauhat.simulation.running import RunningPlant


def reference_sample(running: RunningPlant, steering: Steering, guide: FloatArray, tally: Tally) -> int:
    """Pass one sample period; return the control period that ran away, or FINE."""
    x, data = running.memory.rows, running.simulator.data
    engine = running.machine.engine
    tally.felt[:] = 0.0
    for period in range(steering.periods):
        for _ in range(steering.substeps):
            running.advance(x[r.TAU].copy())
            _feel(tally)
            _warm(x, running.plant.timestep, tally.work)
        if not data.qvel @ data.qvel < steering.fastest**2:
            return period
        _observe(running, steering)
        _command(x, steering, guide, (period + 1) / steering.periods)
        tally.heard[period, 0] = engine.qpos[engine.dof]
        tally.heard[period, 1] = x[r.SHAFT]
        tally.heard[period, 2] = x[r.GEAR] if steering.gear_torque else x[r.TAU]
    return FINE


def _feel(tally: Tally) -> None:
    touch, felt = tally.touch, tally.felt
    felt[c.STEPS] += 1.0
    felt[c.TOUCHES] = float(touch[t.FOUND] > 0.0)
    if felt[c.TOUCHES]:
        normal, tangent = touch[t.NORMAL : t.NORMAL + 3], touch[t.TANGENT : t.TANGENT + 3]
        axes = np.array([normal, tangent, np.cross(normal, tangent)])
        felt[c.NORMAL_SUM] += touch[t.FORCE]
        felt[c.FORCE_SUM : c.FORCE_SUM + 3] -= touch[t.FORCE : t.FORCE + 3] @ axes


def _warm(x: FloatArray, timestep: float, work: FloatArray) -> None:
    parts = np.array([x[r.VISCOUS] * x[r.MOTOR_DQ], x[r.DRY], x[r.FRICTION]])
    turned = np.where(parts.sum(axis=0) * x[r.MOVED] < 0.0, -1.0, 1.0) * x[r.MOVED]
    work[[c.VISCOUS_WORK, c.DRY_WORK, c.LAW_WORK]] += parts * turned
    work[c.WARM_TIME] += x[r.TEMPERATURE] * timestep


def _observe(running: RunningPlant, steering: Steering) -> None:
    rows, (q, dq) = steering.rows, running.motor_state if steering.on_motor else running.state
    step = rows[r.ENCODER_STEP]
    coarse = step > 0.0
    q = np.where(coarse, step * np.rint(q / np.where(coarse, step, 1.0)), q)
    rows[r.READ_DQ] = (q - rows[r.READ]) / steering.period if steering.differenced else dq
    rows[r.READ] = q


def _command(x: FloatArray, steering: Steering, guide: FloatArray, u: float) -> None:
    rows, n, away = steering.rows, len(steering.queue), 1.0 - u
    tangents = (away * guide[c.FROM_DQ] - u * guide[c.TO_DQ]) * u * away * steering.sample_period
    places = guide[c.FROM_Q] * (1.0 + 2.0 * u) * away**2 + guide[c.TO_Q] * u * u * (3.0 - 2.0 * u)
    speed = away * guide[c.FROM_DQ] + u * guide[c.TO_DQ]
    wanted = away * guide[c.FROM_TORQUE] + u * guide[c.TO_TORQUE]
    wanted += rows[r.KP] * (places + tangents - rows[r.READ]) + rows[r.KD] * (speed - rows[r.READ_DQ])
    command = np.clip(wanted, -rows[r.LIMIT], rows[r.LIMIT])
    x[r.TAU] = command
    if n:
        place = int(steering.ticks[0]) % n
        x[r.TAU] = steering.queue[place]
        steering.queue[place] = command
    steering.ticks[0] += 1
