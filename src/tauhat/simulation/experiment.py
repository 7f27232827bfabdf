"""A whole identification experiment, simulated: a controlled robot follows a motion and its sensors are logged."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.control.laws import PDGravity
from tauhat.errors import SimulationError, TauhatWarning
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot
from tauhat.robots.shared_motor import SharedMotor
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.laws import SharedDrive
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.plant import Plant, build_plant, load_mujoco, plant_gravity_torque
from tauhat.simulation.running import RunningPlant, started
from tauhat.simulation.sensors import SensorErrors, measure

_RUNAWAY = 1e3  # [rad/s or m/s] no robot moves this fast: the simulation has diverged
_LOGGED = ("q", "dq", "ddq", "tau", "coulomb_torque", "law_torque")
_WHOLE = 1e-6  # how far a ratio of rates may be from a whole number


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentSettings:
    """How an experiment is run.

    timestep : of the integrator [s]
    control_rate : [Hz]; its period is a whole number of timesteps
    sample_rate : of the log [Hz]; its period is a whole number of control periods
    settle : time the robot holds the start pose before the log begins [s]
    bandwidth : of the controller that is tuned when none is given [Hz]
    controller : gains and torque limits; tuned on the nominal robot by default
    sensors : what the log shows of the truth
    """

    timestep: float = 5e-4
    control_rate: float = 2000.0
    sample_rate: float = 1000.0
    settle: float = 1.0
    bandwidth: float = 15.0
    controller: PDGravity | None = None
    sensors: SensorErrors = field(default_factory=SensorErrors)

    def __post_init__(self) -> None:
        for name in ("timestep", "control_rate", "sample_rate", "bandwidth"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise SimulationError(f"setting {name}", expected="a positive number", got=value)
        if not (np.isfinite(self.settle) and self.settle >= 0.0):
            raise SimulationError("setting settle", expected="a time >= 0", got=self.settle)
        _whole("timesteps in a control period", 1.0 / (self.control_rate * self.timestep))
        _whole("control periods in a sample period", self.control_rate / self.sample_rate)

    @property
    def substeps(self) -> int:
        """Timesteps in a control period."""
        return round(1.0 / (self.control_rate * self.timestep))

    @property
    def stride(self) -> int:
        """Control periods in a sample period."""
        return round(self.control_rate / self.sample_rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """What the sensors cannot show, at the samples of the recording; (n_t, n_v) arrays.

    At every sample `tau = inverse dynamics(q, dq, ddq) + rotor ddq + viscous dq + coulomb_torque + law_torque + offset`
    exactly: ddq is the acceleration at the state (q, dq) under the motor torque tau.

    parameters : of the plant; an offset of the torque sensor is not among them
    q, dq, ddq : [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    tau : motor torque [Nm or N]
    coulomb_torque : the part of tau that dry friction takes, `coulomb sign(dq)` while the joint moves [Nm or N]
    law_torque : the part that the plant's passive laws and shared motors take [Nm or N]
    reference : the motion that was asked for
    """

    parameters: TrueParameters
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    coulomb_torque: FloatArray
    law_torque: FloatArray
    reference: MotionSamples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulation:
    """A recording as a robot would log it, with its truth."""

    recording: Recording
    truth: Truth


def simulate(
    robot: Robot,
    motion: Trajectory,
    *,
    rng: np.random.Generator,
    parameters: TrueParameters | None = None,
    settings: ExperimentSettings | None = None,
) -> Simulation:
    """Return what a log of the robot following the motion would hold, and the truth behind it.

    A PD controller with the nominal robot's gravity at the reference as feedforward acts on the true state. Recording
    and truth share one clock that starts with the motion: sample k is the state at t_k and the torque the motor starts
    to deliver at t_k.

    Parameters
    ----------
    motion : of the same number of joints; run once, from t = 0 to its duration
    rng : of the sensor noise
    parameters : true inertia and friction; nominal by default

    Raises
    ------
    SimulationError
        when a link is not physical, the motion does not fit the robot, or the robot goes unstable.
    MissingExtraError
        when MuJoCo is not installed.
    """
    settings = ExperimentSettings() if settings is None else settings
    if motion.n_v != robot.n_v:
        raise SimulationError("the motion is of another robot", where=robot.name, expected=robot.n_v, got=motion.n_v)
    plant = build_plant(robot, parameters=parameters, timestep=settings.timestep)
    reference = motion.sample(_control_clock(motion, settings))
    nominal = build_plant(robot, timestep=settings.timestep)
    feedforward = plant_gravity_torque(nominal, reference.q)
    law = settings.controller or tracking_gains(
        robot, reference.q, bandwidth=settings.bandwidth, control_rate=settings.control_rate
    )
    log = _run(plant, law, reference, feedforward=feedforward, settings=settings)
    _warn_of_saturation(robot, law, log["tau"])
    shown = measure(settings.sensors, log["q"], log["dq"], tau=log["tau"], rng=rng)
    t = np.arange(len(log["q"])) / settings.sample_rate
    truth = Truth(
        parameters=plant.parameters, reference=motion.sample(t), **{name: read_only(log[name]) for name in log}
    )
    recording = Recording(
        t=t,
        q=shown.q,
        dq=shown.dq,
        tau=shown.tau,
        joint_names=robot.joint_names,
        name=f"{robot.name} simulated",
        shared_motors=_shared_motors(plant.parameters),
    )
    return Simulation(recording=recording, truth=truth)


def _shared_motors(parameters: TrueParameters) -> tuple[SharedMotor, ...]:
    drives = [law for law in parameters.laws if isinstance(law, SharedDrive)]
    return tuple(SharedMotor(drive.own, drive.other, drive.ratio) for drive in drives)


def _control_clock(motion: Trajectory, settings: ExperimentSettings) -> FloatArray:
    """Return the times of the control steps from the start of the motion, (n,) [s]; the last is a sample."""
    samples = int(np.floor(motion.duration * settings.sample_rate + _WHOLE))
    return np.arange(samples * settings.stride + 1) / settings.control_rate


def _run(
    plant: Plant, law: PDGravity, reference: MotionSamples, *, feedforward: FloatArray, settings: ExperimentSettings
) -> dict[str, FloatArray]:
    """Return the truth at the samples of the log, after the robot has settled in the start pose."""
    mujoco = load_mujoco()
    running = started(plant, reference.q[0])
    stepper = _Stepper(running=running, law=law, substeps=settings.substeps)
    log = np.empty(((reference.n_t - 1) // settings.stride + 1, len(_LOGGED), plant.robot.n_v))
    hold = np.zeros(plant.robot.n_v)
    with _silent(mujoco):
        for step in range(round(settings.settle * settings.control_rate)):
            stepper.advance(reference.q[0], hold, feedforward[0], step / settings.control_rate - settings.settle)
        for step, t in enumerate(reference.t.tolist()):
            state = stepper.advance(reference.q[step], reference.dq[step], feedforward[step], t)
            if step % settings.stride == 0:
                log[step // settings.stride] = state
    return {name: np.ascontiguousarray(log[:, index]) for index, name in enumerate(_LOGGED)}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stepper:
    """One control period of a plant under a control law."""

    running: RunningPlant
    law: PDGravity
    substeps: int

    def advance(
        self, q_ref: FloatArray, dq_ref: FloatArray, gravity_torque: FloatArray, t: float
    ) -> tuple[FloatArray, ...]:
        """Return the log's channels at the begin of the period, and pass it."""
        q, dq = self.running.state
        if not dq @ dq < _RUNAWAY**2:
            self._report_runaway(dq, t)
        tau = self.law.torque(q, dq, q_ref=q_ref, dq_ref=dq_ref, gravity_torque=gravity_torque)
        ddq, coulomb_torque, law_torque = self.running.advance(tau, self.substeps)
        return q, dq, ddq, tau, coulomb_torque, law_torque

    def _report_runaway(self, dq: FloatArray, t: float) -> None:
        worst = int(np.argmax(np.where(np.isfinite(dq), np.abs(dq), np.inf)))
        robot = self.running.plant.robot
        joint = robot.joints[worst]
        raise SimulationError(
            "the simulated robot went unstable",
            where=f"{robot.name}, joint {joint.name}",
            got=f"{dq[worst]:.3g} {joint.unit}/s at t = {t:.4g} s",
            remedy="lower the controller's gains, raise the control rate or shorten the timestep",
        )


@contextmanager
def _silent(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT into the working directory; divergence is reported as an error."""
    previous = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(previous)


def _warn_of_saturation(robot: Robot, law: PDGravity, tau: FloatArray) -> None:
    saturated = np.abs(tau) >= law.torque_limit
    if saturated.any():
        worst = int(saturated.mean(axis=0).argmax())
        share = 100.0 * saturated[:, worst].mean()
        message = f"{robot.name}, joint {robot.joint_names[worst]}: torque at its limit in {share:.1f} % of the samples"
        warnings.warn(TauhatWarning(message), stacklevel=3)


def _whole(what: str, ratio: float) -> None:
    if round(ratio) < 1 or abs(ratio - round(ratio)) > _WHOLE * ratio:
        raise SimulationError(what, expected="a whole number", got=f"{ratio:g}")
