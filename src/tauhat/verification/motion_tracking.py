"""The model as feedforward: how closely a plant of known truth follows a motion with it, with the description, without.

Every controller has the same feedback, `kp = w^2 D, kd = 2 w D`, in its own form: added to a torque, inside the mass
matrix (`kp = w^2, kd = 2 w`), or as K = kd, L = kp / kd of adaptive tracking. What differs is what it knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.control.adaptive import AdaptiveTracking, learning_along
from tauhat.control.controller import Controller
from tauhat.control.laws import PD, PDFeedforward, TrackingLaw
from tauhat.control.model_laws import ModelFeedforward, computed_torque
from tauhat.control.model_torque import nominal_torque
from tauhat.control.tracking_regressor import tracking_regressor
from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import torque_model
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.terms import Coulomb
from tauhat.errors import ModelError, SimulationError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identified_torque import identified_torque
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.plain_data import without_infinities
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import ExperimentSettings, simulate
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.parameters import TrueParameters

Knowledge: TypeAlias = Literal["none", "nominal", "identified", "learnt"]
_LOOKED_AT = 400  # samples of the motion from which gains are made
_ADAPTED_TERMS = "inertia,rotor,viscous,coulomb"
_SIGN_WIDTH = 1e-2  # of the adaptive model's sign, in parts of the motion's top speed
_LEARNING_TIME = 2.0  # [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contender:
    """A controller by name, and whose model it has."""

    name: str
    knows: Knowledge
    controller: TrackingLaw | Controller


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingRun:
    """How a controller followed the motion.

    rms, worst : (n_v,) of the position error [rad or m]; nan where the robot went unstable
    effort : (n_v,) root mean square of the motor torque [Nm or N]
    error : (n_t, n_v) reference less position [rad or m]
    failure : why there is no such motion; empty otherwise
    """

    name: str
    knows: Knowledge
    rms: FloatArray
    worst: FloatArray
    effort: FloatArray
    error: FloatArray
    failure: str = ""

    def __post_init__(self) -> None:
        for array in (self.rms, self.worst, self.effort, self.error):
            read_only(array)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, without the series, as plain data."""
        figures = {name: without_infinities(getattr(self, name).tolist()) for name in ("rms", "worst", "effort")}
        return {"controller": self.name, "model": self.knows, **figures, "failure": self.failure}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingComparison:
    """Controllers beside each other on one motion of one plant.

    robot : its name
    bandwidth : of the feedback that all share [Hz]
    names, units : of the joints and of their positions
    t : (n_t,) [s]; reference : (n_t, n_v) [rad or m]
    """

    robot: str
    bandwidth: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    t: FloatArray
    reference: FloatArray
    runs: tuple[TrackingRun, ...]

    def __post_init__(self) -> None:
        for array in (self.t, self.reference):
            read_only(array)

    def run(self, name: str) -> TrackingRun:
        """Return the run of a controller.

        Raises
        ------
        ModelError
            when there is none of that name.
        """
        for run in self.runs:
            if run.name == name:
                return run
        raise ModelError("no such controller", expected=", ".join(run.name for run in self.runs), got=name)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, without the series, as plain data."""
        return {
            "robot": self.robot,
            "bandwidth": self.bandwidth,
            "seconds": float(self.t[-1]),
            "joints": list(self.names),
            "units": list(self.units),
            "controllers": [run.to_dict() for run in self.runs],
        }


@single_threaded
def compare_tracking(
    estimate: Estimate,
    motion: Trajectory,
    *,
    truth: TrueParameters,
    settings: ExperimentSettings | None = None,
    contenders: Sequence[Contender] = (),
) -> TrackingComparison:
    """Return how closely controllers with and without a model make a plant follow a motion.

    Parameters
    ----------
    motion : best one that was not fitted
    truth : parameters of the plant, which no controller knows
    settings : rates, delay, encoders, and the bandwidth of the feedback; its controller is not looked at
    contenders : those of `tracking_contenders` by default

    Raises
    ------
    ModelError
        when the description has no masses, or a term of the estimate has no value at a single state.
    """
    settings = settings or ExperimentSettings()
    robot = estimate.robot
    known = tuple(contenders) or tracking_contenders(estimate, motion, settings=settings)
    clock = np.arange(int(motion.duration * settings.sample_rate + 1e-6) + 1) / settings.sample_rate
    reference = motion.sample(clock)
    return TrackingComparison(
        robot=robot.name,
        bandwidth=settings.bandwidth,
        names=robot.joint_names,
        units=tuple("rad" if joint.kind == "revolute" else "m" for joint in robot.joints),
        t=clock,
        reference=np.array(reference.q),
        runs=tuple(_run(robot, motion, contender, truth=truth, settings=settings) for contender in known),
    )


def tracking_contenders(
    estimate: Estimate, motion: Trajectory, *, settings: ExperimentSettings
) -> tuple[Contender, ...]:
    """Return PD, PD with gravity, feedforward and computed torque of both models, and adaptive tracking.

    Parameters
    ----------
    motion : which poses the gains are made for, and what adaptive tracking will learn from
    settings : control rate and bandwidth

    Raises
    ------
    ModelError
        when the description has no masses, or a term of the estimate has no value at a single state.
    """
    robot = estimate.robot
    if not robot.has_inertia:
        raise ModelError(
            "the description has no masses to compare with",
            where=robot.name,
            remedy="use a URDF with inertial elements",
        )
    samples = motion.sample(np.linspace(0.0, motion.duration, _LOOKED_AT))
    gravity = tracking_gains(
        robot, samples.q, bandwidth=settings.bandwidth, control_rate=settings.control_rate
    )  # fmt: skip
    gains = {"kp": gravity.kp, "kd": gravity.kd, "torque_limit": gravity.torque_limit}
    law, limit = PDFeedforward(**gains), gravity.torque_limit
    nominal, found = nominal_torque(robot), identified_torque(estimate)
    bandwidth = float(np.median(gravity.kp / gravity.kd) / np.pi)  # lowered where coupling asked for it
    return (
        Contender(name="PD", knows="none", controller=PD(**gains)),
        Contender(name="PD + gravity", knows="nominal", controller=gravity),
        Contender(name="feedforward, nominal", knows="nominal", controller=ModelFeedforward(torque=nominal, law=law)),
        Contender(
            name="feedforward, identified", knows="identified", controller=ModelFeedforward(torque=found, law=law)
        ),
        Contender(
            name="computed torque, nominal",
            knows="nominal",
            controller=computed_torque(nominal, bandwidth=bandwidth, torque_limit=limit),
        ),
        Contender(
            name="computed torque, identified",
            knows="identified",
            controller=computed_torque(found, bandwidth=bandwidth, torque_limit=limit),
        ),
        Contender(name="adaptive", knows="learnt", controller=_adaptive(robot, samples, law)),
    )


def _adaptive(robot: Robot, samples: MotionSamples, law: TrackingLaw) -> AdaptiveTracking:
    """Return adaptive tracking that begins with the description's parameters."""
    tops = np.maximum(np.abs(samples.dq).max(axis=0), np.finfo(float).tiny)
    sign = Coulomb(widths=tuple((_SIGN_WIDTH * tops).tolist()))
    model = torque_model(robot, _ADAPTED_TERMS).with_term(sign)
    base = base_parameters(model)
    regressor = tracking_regressor(model, base)
    moving = (np.array(samples.q), np.array(samples.dq), np.array(samples.ddq))
    return AdaptiveTracking(
        regressor=regressor,
        values=base.projection @ nominal_standard_parameters(model),
        gain=law.kd,
        stiffness=law.kp / law.kd,
        learning=learning_along(regressor, moving, gain=law.kd, time=_LEARNING_TIME),
        torque_limit=law.torque_limit,
    )


def _run(
    robot: Robot, motion: Trajectory, contender: Contender, *, truth: TrueParameters, settings: ExperimentSettings
) -> TrackingRun:
    steered = replace(settings, controller=contender.controller)
    unread = np.random.default_rng(0)  # of the sensors of the log; what counts here is the true motion
    try:
        done = simulate(robot, motion, rng=unread, parameters=truth, settings=steered).truth
    except SimulationError as failure:
        nothing = np.full(robot.n_v, np.nan)
        return TrackingRun(
            name=contender.name,
            knows=contender.knows,
            rms=nothing,
            worst=nothing,
            effort=nothing,
            error=np.zeros((0, robot.n_v)),
            failure=str(failure),
        )
    error = done.reference.q - done.q
    return TrackingRun(
        name=contender.name,
        knows=contender.knows,
        rms=np.sqrt(np.mean(error**2, axis=0)),
        worst=np.abs(error).max(axis=0),
        effort=np.sqrt(np.mean(done.tau**2, axis=0)),
        error=np.array(error),
    )
