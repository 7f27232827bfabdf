"""The model in motion: a recording done again by the robot that the model describes.

Two ways, for the identified and for the description's own parameters beside each other:

- `followed`: the simulated robot under the recorded one's law and reference. Where these are not known, the reference
  is the measured motion and the law is tuned to the simulated robot, as `estimation.ClosedLoop` has it; every robot
  then follows, and it is the torque it asks for, not its position, that tells models apart;
- `driven`: the measured torque moves the simulated robot, and a weak law of `tether` Hz keeps it from drifting away,
  the same for all, tuned on every joint to the larger of both masses D. What the torque lacks for the model to move as
  the robot did is a deviation of the position, about `d tau / (D (2 pi tether)^2)`. No law needs to be known for that.

Without a model there is no robot to simulate.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.simulated_arm import Followed, Gains, Moved, follow
from tauhat.errors import ModelError, SimulationError
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import check_joints
from tauhat.estimation.simulated_runs import Run, SimulatedRuns, simulated_runs
from tauhat.plain_data import without_infinities
from tauhat.recordings.filters import filtered
from tauhat.recordings.recording import Recording

Way: TypeAlias = Literal["followed", "driven"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ForwardRun:
    """A recording done again by one model in one way.

    model : "identified" or "nominal"
    way : "followed" or "driven"
    rms, worst : (n_v,) deviation of the position from the measured one [rad or m]; nan where it could not be simulated
    torque_rms : (n_v,) of the law's torque from the measured one, through the filter of the estimate; driven: what the
        tether added [Nm or N]
    q : (n, n_v) simulated position [rad or m]
    failure : why there is no such motion; empty otherwise
    """

    model: str
    way: Way
    rms: FloatArray
    worst: FloatArray
    torque_rms: FloatArray
    q: FloatArray
    failure: str = ""

    def __post_init__(self) -> None:
        for array in (self.rms, self.worst, self.torque_rms, self.q):
            read_only(array)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, without the series, as plain data."""
        figures = {name: without_infinities(getattr(self, name).tolist()) for name in ("rms", "worst", "torque_rms")}
        return {"model": self.model, "way": self.way, **figures, "failure": self.failure}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ForwardMotion:
    """A recording beside what simulated robots make of it.

    log : name of the recording
    known : whether law and reference were those of the robot
    tether : bandwidth of the law that holds a driven robot [Hz]
    names, units : of the joints and of their positions
    t : (n,) [s]; q : (n, n_v) measured [rad or m]
    span : (n_v,) largest less smallest measured position
    """

    log: str
    known: bool
    tether: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    runs: tuple[ForwardRun, ...]

    def __post_init__(self) -> None:
        for array in (self.t, self.q):
            read_only(array)

    @property
    def span(self) -> FloatArray:
        """Largest less smallest measured position of each joint, (n_v,) [rad or m]."""
        return np.asarray(np.ptp(self.q, axis=0))

    def run(self, model: str, way: Way) -> ForwardRun:
        """Return the run of a model.

        Raises
        ------
        ModelError
            when there is none.
        """
        for run in self.runs:
            if (run.model, run.way) == (model, way):
                return run
        raise ModelError("no such run", got=f"{model}, {way}")

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, without the series, as plain data."""
        return {
            "log": self.log,
            "law_known": self.known,
            "tether": self.tether,
            "joints": list(self.names),
            "span": self.span.tolist(),
            "runs": [run.to_dict() for run in self.runs],
        }


@single_threaded
def forward_motion(
    estimate: Estimate, recording: Recording, *, loop: ClosedLoop | None = None, tether: float = 1.0
) -> ForwardMotion:
    """Return a recording beside its simulations with identified and nominal parameters.

    Parameters
    ----------
    recording : best one that was not fitted
    loop : law and reference of the recorded robot; by default both unknown
    tether : bandwidth of the weak law that holds the robot which the measured torque drives [Hz]

    Raises
    ------
    ModelError
        when a term of the model cannot be simulated.
    RecordingError
        when the recording does not fit the robot or lacks torque.
    """
    check_joints(estimate.model, recording)
    loop = loop or ClosedLoop()
    free = replace(loop, law=None, references=(), bandwidth=tether, control_rate=None)
    problem = _problem(estimate, recording)
    following, driving = simulated_runs(problem, loop), simulated_runs(problem, free)
    models = {"identified": estimate.values}
    if estimate.robot.has_inertia:
        models["nominal"] = estimate.base.projection @ nominal_standard_parameters(estimate.model)
    run = following.runs[0]
    held = _tether(driving, models.values())
    shown = _trusted(run)
    joints = estimate.robot.joints
    return ForwardMotion(
        log=recording.name,
        known=loop.known,
        tether=tether,
        names=estimate.robot.joint_names,
        units=tuple("rad" if joint.kind == "revolute" else "m" for joint in joints),
        t=run.t[shown],
        q=np.ascontiguousarray(run.q[:, shown].T),
        runs=(
            *(_followed(following, name, values) for name, values in models.items()),
            *(_driven(driving, name, values, gains=held) for name, values in models.items()),
        ),
    )


def _problem(estimate: Estimate, recording: Recording) -> Problem:
    parts = (estimate.model, estimate.base, (recording,), estimate.processing)
    model, base, recordings, processing = parts
    evidence = collect_all(model, base, recordings, processing)
    return Problem(model=model, base=base, recordings=recordings, processing=processing, evidence=evidence)


def _tether(driving: SimulatedRuns, models: Iterable[FloatArray]) -> Gains:
    """Return the weak law, tuned on every joint to the largest of the models' masses: some have none at all."""
    robot, run = driving.arm.model.robot, driving.runs[0]
    masses = (driving.arm.masses(driving.standard(values)) for values in models)
    laws = [driving.loop.law_for(robot, mass, run.q_ref) for mass in masses]
    kp, kd = (np.max([getattr(law, name) for law in laws], axis=0) for name in ("kp", "kd"))
    return Gains(kp, kd, np.zeros_like(kp), laws[0].torque_limit)


def _followed(runs: SimulatedRuns, model: str, values: FloatArray) -> ForwardRun:
    run = runs.runs[0]
    try:
        moved = runs.moved(run, values)
    except (ModelError, SimulationError) as error:
        return _failed(run, model, "followed", error)
    return _judged(runs, model, "followed", moved)


def _driven(runs: SimulatedRuns, model: str, values: FloatArray, *, gains: Gains) -> ForwardRun:
    run = runs.runs[0]
    ahead = Followed(run.q_ref, run.dq_ref, np.ascontiguousarray(run.tau.T))
    stepping, standard = runs.loop.stepping(run.step), runs.standard(values)
    try:
        moved = follow(runs.arm, standard, ahead, gains=gains, start=run.start, stepping=stepping)
    except (ModelError, SimulationError) as error:
        return _failed(run, model, "driven", error)
    return _judged(runs, model, "driven", moved)


def _judged(runs: SimulatedRuns, model: str, way: Way, moved: Moved) -> ForwardRun:
    run = runs.runs[0]
    shown = _trusted(run)
    off = moved.q[:, shown] - run.q[:, shown]
    low_pass = runs.problem.processing.parallel_filter(1.0 / run.step)
    torque = filtered(moved.tau - run.tau, low_pass)[:, _trusted(run, stride=low_pass.decimation)]
    return ForwardRun(
        model=model,
        way=way,
        rms=np.sqrt(np.mean(off**2, axis=1)),
        worst=np.abs(off).max(axis=1),
        torque_rms=np.sqrt(np.mean(torque**2, axis=1)),
        q=np.ascontiguousarray(moved.q[:, shown].T),
    )


def _failed(run: Run, model: str, way: Way, error: Exception) -> ForwardRun:
    n_v = run.q.shape[0]
    nothing = [np.full(n_v, np.nan) for _ in range(3)]
    q = np.full((int(_trusted(run).sum()), n_v), np.nan)
    return ForwardRun(
        model=model, way=way, rms=nothing[0], worst=nothing[1], torque_rms=nothing[2], q=q, failure=str(error)
    )


def _trusted(run: Run, *, stride: int = 1) -> Any:
    """Return which of every so many samples lie in the rows that are trusted."""
    t = run.t[::stride]
    return (t >= run.begin) & (t <= run.end)
