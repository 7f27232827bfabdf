"""What the kernel of a cell needs beside the plant: the controller's numbers, and the tally of a sample period."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.simulation import rows as r
from tauhat.simulation.contact import contact_kernel as c
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.running import RunningPlant

_RUNAWAY = 1e3  # [rad/s or m/s] nothing in a cell moves this fast: the simulation has diverged


class Steering(NamedTuple):
    """The joints' controller; the rows it reads, its ticks and its queue change.

    rows : (STEERING_ROWS, n_v) gains and readings: see `simulation.rows`
    queue : (delay, n_v) torques that are on their way
    ticks : (1,) control periods so far
    gear_torque : whether the torque that is remembered is that of the gear, and not of the motor
    """

    rows: FloatArray
    on_motor: bool
    differenced: bool
    period: float
    sample_period: float
    periods: int
    substeps: int
    queue: FloatArray
    ticks: IntArray
    gear_torque: bool
    fastest: float


class Tally(NamedTuple):
    """What a sample period leaves behind.

    touch : (TOUCH_SIZE,) the contact sensor
    felt : (FELT_SIZE,) sums of this sample period
    work : (WORK_ROWS, n_v) sums since the stretch of work began
    heard : (periods, 3, n_v) positions of links and motors, and torque, at the end of each control period
    """

    touch: FloatArray
    felt: FloatArray
    work: FloatArray
    heard: FloatArray


def steering_of(cell: Cell, running: RunningPlant, torque: FloatArray) -> Steering:
    """Return the controller of an arm at rest, with this torque (n_v,) on its way."""
    on_motor = cell.encoder.side == "motor"
    q, _ = running.motor_state if on_motor else running.state
    n_v, law = cell.robot.n_v, cell.control.gains(cell.known_robot, running.state[0])
    rows = np.zeros((r.STEERING_ROWS, n_v))
    rows[r.KP], rows[r.KD], rows[r.LIMIT] = law.kp, law.kd, law.torque_limit
    rows[r.ENCODER_STEP], rows[r.READ] = cell.encoder.steps(n_v), q
    return Steering(
        rows=rows,
        on_motor=on_motor,
        differenced=cell.encoder.velocity == "differenced",
        period=1.0 / cell.control.rate,
        sample_period=1.0 / cell.sample_rate,
        periods=cell.periods,
        substeps=cell.substeps,
        queue=np.tile(torque, (cell.control.delay, 1)),
        ticks=np.zeros(1, dtype=np.intp),
        gear_torque=cell.sensors.torque_side == "link",
        fastest=_RUNAWAY,
    )


def tally_of(cell: Cell, touch: FloatArray) -> Tally:
    """Return an empty tally."""
    n_v = cell.robot.n_v
    return Tally(touch, np.zeros(c.FELT_SIZE), np.zeros((c.WORK_ROWS, n_v)), np.zeros((cell.periods, 3, n_v)))
