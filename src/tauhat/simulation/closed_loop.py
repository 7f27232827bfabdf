"""The plant under control: encoders, controller, delay, plant, log.

A tracking law runs inside the kernel, together with everything else. Another controller, or an environment that pushes,
is asked from Python once a control period, while the kernel passes the steps of the plant in between.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.controller import Controller, ControlSample, TrackingController
from tauhat.control.laws import TrackingLaw
from tauhat.errors import SimulationError
from tauhat.excitation.trajectory import MotionSamples
from tauhat.simulation import rows as r
from tauhat.simulation.laws.law import Side
from tauhat.simulation.loop_kernel import FINE, run_loop
from tauhat.simulation.plant import Plant, plant_gravity_torque, plant_torque
from tauhat.simulation.running import CHANNELS, RunningPlant

Velocity: TypeAlias = Literal["true", "differenced"]
_RUNAWAY = 1e3  # [rad/s or m/s] no robot moves this fast: the simulation has diverged


class Environment(Protocol):
    """What pushes on the links: a person, a table, a spring."""

    def torque(self, t: float, q: FloatArray, dq: FloatArray) -> FloatArray:
        """Return the joint torque (n_v,) that it adds at this state of the links, held for a control period."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Encoder:
    """The encoders, and what the controller sees of them.

    side : of an elastic joint; the log's position is of the same side
    step : of the position that the controller sees, one for all joints or (n_v,) [rad or m]; zero is exact
    velocity : the true speed of that side, or the difference of two positions that the controller saw over its period
    """

    side: Side = "link"
    step: float | FloatArray = 0.0
    velocity: Velocity = "true"

    def __post_init__(self) -> None:
        for name, known in (("side", ("link", "motor")), ("velocity", ("true", "differenced"))):
            if getattr(self, name) not in known:
                raise SimulationError(f"encoder, {name}", expected=" or ".join(known), got=getattr(self, name))
        step = np.array(self.step, dtype=np.float64)
        if step.ndim > 1 or not np.isfinite(step).all() or step.min() < 0.0:
            raise SimulationError("encoder, step", expected="one number >= 0, or one a joint", got=self.step)
        step.setflags(write=False)
        object.__setattr__(self, "step", step)

    def steps(self, n_v: int) -> FloatArray:
        """Return the step of each joint, (n_v,).

        Raises
        ------
        SimulationError
            when there is not one a joint.
        """
        step = np.asarray(self.step)
        if step.shape not in {(), (n_v,)}:
            raise SimulationError("encoder, step", expected=f"1 or {n_v} values", got=step.size)
        return np.array(np.broadcast_to(step, (n_v,)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pilot:
    """Who steers: a controller, through which encoders, and how many control periods late."""

    controller: TrackingLaw | Controller
    encoder: Encoder = field(default_factory=Encoder)
    delayed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """What the robot shall do.

    reference : at every control step
    nominal : plant of the robot that the controller knows, for its feedforward
    settle : control periods in the start pose, before the log begins
    stride, substeps : control periods in a sample period, timesteps in a control period
    period : of control [s]
    """

    reference: MotionSamples
    nominal: Plant
    settle: int
    stride: int
    substeps: int
    period: float

    @property
    def samples(self) -> int:
        """Rows of the log."""
        return (self.reference.n_t - 1) // self.stride + 1

    def feedforward(self, controller: TrackingLaw | Controller) -> FloatArray:
        """Return the nominal torque along the reference of the kind that the controller asks for, (n, n_v)."""
        motion, kind = self.reference, controller.feedforward
        if kind == "nothing":
            return np.zeros(motion.q.shape)
        if kind == "gravity":
            return plant_gravity_torque(self.nominal, motion.q)
        known = self.nominal.parameters
        friction = known.viscous * motion.dq + known.coulomb * np.sign(motion.dq)
        return plant_torque(self.nominal, motion.q, motion.dq, motion.ddq) + friction


class _Steering(NamedTuple):
    """A tracking law in the kernel; `queue` and some of the rows change."""

    rows: FloatArray
    on_motor: bool
    differenced: bool
    period: float
    substeps: int
    queue: FloatArray
    unlogged: FloatArray


class _Reference(NamedTuple):
    """A course in the kernel."""

    q: FloatArray
    dq: FloatArray
    feedforward: FloatArray
    settle: int
    stride: int
    fastest: float


def follow(
    running: RunningPlant, pilot: Pilot, course: Course, *, environment: Environment | None = None
) -> FloatArray:
    """Return the log of the plant on its course, (n_samples, n_channels, n_v), in the order of `CHANNELS`.

    Raises
    ------
    SimulationError
        when the robot runs away.
    """
    feedforward = np.ascontiguousarray(course.feedforward(pilot.controller))
    log = np.empty((course.samples, len(CHANNELS), running.plant.robot.n_v))
    with silent(running.simulator.mujoco):
        if isinstance(pilot.controller, TrackingLaw) and environment is None and running.native:
            _follow_in_kernel(running, pilot, course, feedforward=feedforward, law=pilot.controller, log=log)
        else:
            _follow_in_python(running, pilot, course, feedforward=feedforward, environment=environment, log=log)
    return log


def _follow_in_kernel(
    running: RunningPlant,
    pilot: Pilot,
    course: Course,
    *,
    feedforward: FloatArray,
    law: TrackingLaw,
    log: FloatArray,
) -> None:
    n_v = running.plant.robot.n_v
    rows = np.zeros((r.STEERING_ROWS, n_v))
    rows[r.KP], rows[r.KD], rows[r.KI], rows[r.LIMIT] = law.kp, law.kd, law.integral_gain, law.torque_limit
    rows[r.ENCODER_STEP] = pilot.encoder.steps(n_v)
    steering = _Steering(
        rows=rows,
        on_motor=pilot.encoder.side == "motor",
        differenced=pilot.encoder.velocity == "differenced",
        period=course.period,
        substeps=course.substeps,
        queue=np.tile(_clipped(feedforward[0], law.torque_limit), (pilot.delayed, 1)),
        unlogged=np.empty(log.shape[1:]),
    )
    motion = course.reference
    reference = _Reference(motion.q, motion.dq, feedforward, course.settle, course.stride, _RUNAWAY)
    failed = run_loop(running.machine, running.memory.rows, running.memory.memory, steering, reference, log)
    if failed != FINE:
        raise _runaway(running, (failed - course.settle) * course.period)


def _follow_in_python(
    running: RunningPlant,
    pilot: Pilot,
    course: Course,
    *,
    feedforward: FloatArray,
    environment: Environment | None,
    log: FloatArray,
) -> None:
    steers = pilot.controller
    controller: Controller = TrackingController(law=steers) if isinstance(steers, TrackingLaw) else steers
    first = _clipped(feedforward[0], controller.torque_limit)
    queue = deque([first] * pilot.delayed)
    eyes, memory, tau = _Eyes(running, pilot.encoder, course.period), None, first
    for step in range(course.settle + course.reference.n_t):
        row = step - course.settle
        _refuse_runaway(running, row * course.period)
        sample = _sample(course, row, eyes.see(), feedforward=feedforward, tau=tau)
        memory = controller.start(sample) if step == 0 else memory
        memory, command = controller.step(memory, sample)
        queue.append(np.asarray(command, dtype=np.float64))
        tau = queue.popleft()
        if environment is not None:
            running.push(environment.torque(row * course.period, *running.state))
        reaction = running.advance(tau, course.substeps)
        if row >= 0 and row % course.stride == 0:
            log[row // course.stride] = reaction


class _Eyes:
    """The encoders of a running plant, as its controller reads them."""

    def __init__(self, running: RunningPlant, encoder: Encoder, period: float) -> None:
        self._running, self._encoder, self._period = running, encoder, period
        self._steps = encoder.steps(running.plant.robot.n_v)
        self._before: FloatArray | None = None

    def see(self) -> tuple[FloatArray, FloatArray]:
        """Return position and velocity, (n_v,) each."""
        running, coarse = self._running, self._steps > 0.0
        q, dq = running.motor_state if self._encoder.side == "motor" else running.state
        if coarse.any():
            counts = np.rint(q / np.where(coarse, self._steps, 1.0))
            q = np.where(coarse, self._steps * counts, q)
        if self._encoder.velocity == "differenced":
            dq = np.zeros_like(q) if self._before is None else (q - self._before) / self._period
        self._before = q
        return q, dq


def _sample(
    course: Course, row: int, seen: tuple[FloatArray, FloatArray], *, feedforward: FloatArray, tau: FloatArray
) -> ControlSample:
    motion, at = course.reference, max(row, 0)
    still = np.zeros_like(tau)
    return ControlSample(
        t=row * course.period,
        period=course.period,
        q=seen[0],
        dq=seen[1],
        q_ref=motion.q[at],
        dq_ref=motion.dq[at] if row >= 0 else still,
        ddq_ref=motion.ddq[at] if row >= 0 else still,
        feedforward=feedforward[at],
        tau=tau,
    )


def _clipped(torque: FloatArray, limit: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.minimum(torque, limit), -limit))


def _refuse_runaway(running: RunningPlant, t: float) -> None:
    dq = running.state[1]
    if not dq @ dq < _RUNAWAY**2:
        raise _runaway(running, t)


def _runaway(running: RunningPlant, t: float) -> SimulationError:
    dq = running.state[1]
    worst = int(np.argmax(np.where(np.isfinite(dq), np.abs(dq), np.inf)))
    robot = running.plant.robot
    joint = robot.joints[worst]
    return SimulationError(
        "the simulated robot went unstable",
        where=f"{robot.name}, joint {joint.name}",
        got=f"{dq[worst]:.3g} {joint.unit}/s at t = {t:.4g} s",
        remedy="lower the controller's gains, raise the control rate or shorten the timestep",
    )


@contextmanager
def silent(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT into the working directory; divergence is reported as an error."""
    previous = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(previous)
