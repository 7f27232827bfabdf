"""A whole identification experiment, simulated: a controlled robot follows a motion and its sensors are logged."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.control.controller import Controller
from tauhat.control.laws import TrackingLaw
from tauhat.errors import SimulationError, TauhatWarning
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot
from tauhat.robots.shared_motor import SharedMotor
from tauhat.simulation.closed_loop import Course, Encoder, Environment, Pilot, follow
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.laws import SharedDrive
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.plant import build_plant
from tauhat.simulation.running import CHANNELS, started
from tauhat.simulation.sensors import SensorErrors, Signals, measure

_WHOLE = 1e-6  # how far a ratio of rates may be from a whole number


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentSettings:
    """How an experiment is run.

    timestep : of the integrator [s]
    control_rate : [Hz]; its period is a whole number of timesteps
    sample_rate : of the log [Hz]; its period is a whole number of control periods
    settle : time the robot holds the start pose before the log begins [s]
    bandwidth : of the controller that is tuned when none is given [Hz]
    controller : a tracking law, or any other controller; tuned on the nominal robot by default
    control_delay : from the encoders to the torque that answers them, whole control periods [s]
    encoder : on which side of elastic joints it sits, and what the controller sees of it
    sensors : what the log shows of the truth
    """

    timestep: float = 5e-4
    control_rate: float = 2000.0
    sample_rate: float = 1000.0
    settle: float = 1.0
    bandwidth: float = 15.0
    controller: TrackingLaw | Controller | None = None
    control_delay: float = 0.0
    encoder: Encoder = field(default_factory=Encoder)
    sensors: SensorErrors = field(default_factory=SensorErrors)

    def __post_init__(self) -> None:
        for name in ("timestep", "control_rate", "sample_rate", "bandwidth"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise SimulationError(f"setting {name}", expected="a positive number", got=value)
        for name in ("settle", "control_delay"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise SimulationError(f"setting {name}", expected="a time >= 0", got=getattr(self, name))
        _whole("timesteps in a control period", 1.0 / (self.control_rate * self.timestep))
        _whole("control periods in a sample period", self.control_rate / self.sample_rate)
        if self.control_delay > 0.0:
            _whole("control periods in the delay", self.control_delay * self.control_rate)

    @property
    def substeps(self) -> int:
        """Timesteps in a control period."""
        return round(1.0 / (self.control_rate * self.timestep))

    @property
    def stride(self) -> int:
        """Control periods in a sample period."""
        return round(self.control_rate / self.sample_rate)

    @property
    def delayed(self) -> int:
        """Control periods of delay."""
        return round(self.control_delay * self.control_rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """What the sensors cannot show, at the ticks of the log's clock; (n_t, n_v) arrays.

    At every sample, to rounding,

        tau = inverse dynamics(q, dq, ddq) + rotor motor_ddq + viscous motor_dq + coulomb_torque + law_torque + offset
              - external_torque

    ddq and motor_ddq are the accelerations at that state under the motor torque tau. Where joints are rigid, the motor
    moves as the joint does. Where they are elastic, the equation is the sum of the motor's and the link's, which meet
    in `gear_torque = stiffness d + damping dd`, d = motor_q - q (less the gap): links and springs take gear_torque +
    external_torque, all the rest is the motor's.

    parameters : of the plant; an offset of the torque sensor is not among them
    q, dq, ddq : of the links [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    tau : motor torque, after the control's delay [Nm or N]
    coulomb_torque : the part of tau that dry friction takes, `coulomb sign(motor_dq)` while the joint moves, at its
        temperature [Nm or N]
    law_torque : the part that passive laws, shared motors and the heat's change of viscous friction take [Nm or N]
    motor_q, motor_dq, motor_ddq : of the motors, on the joint side
    gear_torque : what the gear passes on to the link, as a torque sensor behind it shows [Nm or N]
    temperature : of the joints [deg C]; zero where the plant has no heat
    external_torque : what the environment adds [Nm or N]
    reference : the motion that was asked for
    """

    parameters: TrueParameters
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    coulomb_torque: FloatArray
    law_torque: FloatArray
    motor_q: FloatArray
    motor_dq: FloatArray
    motor_ddq: FloatArray
    gear_torque: FloatArray
    temperature: FloatArray
    external_torque: FloatArray
    reference: MotionSamples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulation:
    """A recording as a robot would log it, with its truth.

    rows : (n,) sample of the truth that each row of the recording was taken at: all, unless samples were lost
    """

    recording: Recording
    truth: Truth
    rows: IntArray


def simulate(
    robot: Robot,
    motion: Trajectory,
    *,
    rng: np.random.Generator,
    parameters: TrueParameters | None = None,
    settings: ExperimentSettings | None = None,
    environment: Environment | None = None,
) -> Simulation:
    """Return what a log of the robot following the motion would hold, and the truth behind it.

    By default a PD controller with the nominal robot's gravity at the reference as feedforward acts on the true state.
    Recording and truth share one clock that starts with the motion: sample k is the state at t_k and the torque the
    motor starts to deliver at t_k; sensors may read it late, stamp it wrongly or lose it. The recording's position is
    that of the encoder: with `encoder.side = "motor"` and elastic joints, the motor's.

    Parameters
    ----------
    motion : of the same number of joints; run once, from t = 0 to its duration
    rng : of the sensor noise
    parameters : true inertia and friction; nominal by default
    environment : pushes on the links; nothing by default

    Raises
    ------
    SimulationError
        when a link is not physical, the motion does not fit the robot, or the robot goes unstable.
    """
    settings = settings or ExperimentSettings()
    if motion.n_v != robot.n_v:
        raise SimulationError("the motion is of another robot", where=robot.name, expected=robot.n_v, got=motion.n_v)
    plant = build_plant(robot, parameters=parameters, timestep=settings.timestep)
    course = _course(robot, motion, settings)
    pilot = _pilot(robot, course, settings)
    running = started(plant, course.reference.q[0])
    rows = follow(running, pilot, course, environment=environment)
    log = {name: np.ascontiguousarray(rows[:, index]) for index, name in enumerate(CHANNELS)}
    _warn_of_saturation(robot, pilot.controller.torque_limit, log["tau"])
    t = np.arange(len(rows)) / settings.sample_rate
    truth = Truth(
        parameters=plant.parameters, reference=motion.sample(t), **{name: read_only(log[name]) for name in log}
    )
    return logged(robot, truth, settings=settings, rng=rng)


def logged(robot: Robot, truth: Truth, *, settings: ExperimentSettings, rng: np.random.Generator) -> Simulation:
    """Return the log that the sensors of these settings make of a run: another one of the same run, where it has one.

    Parameters
    ----------
    settings : their sensors, and the side of their encoder
    rng : of the sensor noise
    """
    on_motor = settings.encoder.side == "motor"
    signals = Signals(
        t=truth.reference.t,
        q=truth.motor_q if on_motor else truth.q,
        dq=truth.motor_dq if on_motor else truth.dq,
        tau=truth.gear_torque if settings.sensors.torque_side == "link" else truth.tau,
        link=truth.q,
        motor=truth.motor_q,
    )
    shown = measure(settings.sensors, signals, rng=rng)
    recording = Recording(
        t=shown.t,
        q=shown.q,
        dq=shown.dq,
        tau=shown.tau,
        temperature=None if truth.parameters.heat is None else truth.temperature[shown.rows],
        joint_names=robot.joint_names,
        name=f"{robot.name} simulated",
        shared_motors=_shared_motors(truth.parameters),
    )
    return Simulation(recording=recording, truth=truth, rows=shown.rows)


def _course(robot: Robot, motion: Trajectory, settings: ExperimentSettings) -> Course:
    """Return the reference at every control step, with the nominal robot's torque along it."""
    return Course(
        reference=motion.sample(_control_clock(motion, settings)),
        nominal=build_plant(robot, timestep=settings.timestep),
        settle=round(settings.settle * settings.control_rate),
        stride=settings.stride,
        period=1.0 / settings.control_rate,
        substeps=settings.substeps,
    )


def _pilot(robot: Robot, course: Course, settings: ExperimentSettings) -> Pilot:
    law = settings.controller or tracking_gains(
        robot, course.reference.q, bandwidth=settings.bandwidth, control_rate=settings.control_rate
    )
    return Pilot(controller=law, encoder=settings.encoder, delayed=settings.delayed)


def _shared_motors(parameters: TrueParameters) -> tuple[SharedMotor, ...]:
    drives = [law for law in parameters.laws if isinstance(law, SharedDrive)]
    return tuple(SharedMotor(drive.own, drive.other, drive.ratio) for drive in drives)


def _control_clock(motion: Trajectory, settings: ExperimentSettings) -> FloatArray:
    """Return the times of the control steps from the start of the motion, (n,) [s]; the last is a sample."""
    samples = int(np.floor(motion.duration * settings.sample_rate + _WHOLE))
    return np.arange(samples * settings.stride + 1) / settings.control_rate


def _warn_of_saturation(robot: Robot, limit: FloatArray, tau: FloatArray) -> None:
    saturated = np.abs(tau) >= limit
    if saturated.any():
        worst = int(saturated.mean(axis=0).argmax())
        share = 100.0 * saturated[:, worst].mean()
        message = f"{robot.name}, joint {robot.joint_names[worst]}: torque at its limit in {share:.1f} % of the samples"
        warnings.warn(TauhatWarning(message), stacklevel=3)


def _whole(what: str, ratio: float) -> None:
    if round(ratio) < 1 or abs(ratio - round(ratio)) > _WHOLE * ratio:
        raise SimulationError(what, expected="a whole number", got=f"{ratio:g}")
