"""Recordings repeated by simulation: the same robot, law and reference, with parameters that are tried."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.control.laws import Feedforward
from tauhat.dynamics.forward import Masses, nominal_masses
from tauhat.dynamics.model import Layout
from tauhat.dynamics.motion import motion_from_rows
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.rigid_body import gravity_torque
from tauhat.dynamics.simulated_arm import Followed, Gains, Moved, SimulatedArm, follow, simulated_arm
from tauhat.errors import ModelError, SimulationError
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.problem import Problem
from tauhat.estimation.rotor_load import standard_with_rotors
from tauhat.estimation.rows import Rows, rows_of_stretches
from tauhat.recordings.processing import (
    CHUNK,
    Stretch,
    bridged,
    clock_step,
    interpolated,
    stretches,
    uniform_clock,
    unwrapped,
)
from tauhat.recordings.recording import Recording

_LOST = 0.5  # distance between simulated and measured positions, in parts of the motion: no longer the same motion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """One recording on its uniform clock, and what the law followed; (n_v, n_t) each, references (n_t, n_v).

    q, tau : measured, without any filter [rad or m], [Nm or N]; the position at the times of the reference: those of
        the log where the reference is given, later by the delay of the processing where it is the measured motion
    start : (2, n_v) position, through the filter of the processing, and reference of the speed at the first sample; the
        measured speed where the controller takes no reference of it
    q_ref, dq_ref, ddq_ref : the reference
    begin, end : first and last time of the rows that are trusted [s]
    """

    name: str
    t: FloatArray
    q: FloatArray
    tau: FloatArray
    start: FloatArray
    q_ref: FloatArray
    dq_ref: FloatArray
    ddq_ref: FloatArray
    step: float
    begin: float
    end: float

    def __post_init__(self) -> None:
        for array in (self.t, self.q, self.tau, self.start, self.q_ref, self.dq_ref, self.ddq_ref):
            read_only(array)


class Controller(NamedTuple):
    """Law and reference of a run as numbers."""

    gains: Gains
    followed: Followed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatedRuns:
    """All recordings of a problem, ready to be simulated.

    problem : model, base parameters, filters
    loop : law and references
    arm : the model as something that moves
    runs : one a recording
    measured : filtered rows of every recording
    layout : which regressor entries rows hold
    """

    problem: Problem
    loop: ClosedLoop
    arm: SimulatedArm
    runs: tuple[Run, ...]
    measured: tuple[Rows, ...]
    layout: Layout

    def standard(self, values: FloatArray) -> FloatArray:
        """Return standard parameters (n_p,) that move, and load the gears, as the base parameters and model do."""
        return standard_with_rotors(self.problem.model, self.problem.base, values)

    def controller(self, run: Run, values: FloatArray) -> Controller:
        """Return law and reference of a run as numbers; what of them is not known is made from these parameters."""
        robot, standard = self.arm.model.robot, self.standard(values)
        masses = self.arm.masses(standard)
        law = self.loop.law_for(robot, masses, run.q_ref)
        known = masses if self.loop.law is None else nominal_masses(robot)
        ahead = self._feedforward(run, law.feedforward, known)
        gains = Gains(law.kp, law.kd, law.integral_gain, law.torque_limit)
        return Controller(gains, Followed(run.q_ref, run.dq_ref, ahead))

    def moved(self, run: Run, values: FloatArray, controller: Controller | None = None) -> Moved:
        """Return the run simulated with these base parameters (n_b,).

        Parameters
        ----------
        controller : stays the same where several parameters are compared; made for `values` by default

        Raises
        ------
        ModelError
            when the mass matrix is not positive definite.
        SimulationError
            when a joint runs away.
        """
        gains, followed = controller or self.controller(run, values)
        stepping = self.loop.stepping(run.step)
        return follow(self.arm, self.standard(values), followed, gains=gains, start=run.start, stepping=stepping)

    def _feedforward(self, run: Run, kind: Feedforward, masses: Masses) -> FloatArray:
        """Return what the law adds ahead, (n_t, n_v): a whole model is that of the robot's description."""
        if kind == "nothing":
            return np.zeros_like(run.q_ref)
        if kind == "gravity":
            return gravity_torque(self.arm.model.robot, run.q_ref, inertia=masses.inertia)
        motion = motion_from_rows(run.q_ref, run.dq_ref, run.ddq_ref)
        nominal = self.problem.base.projection @ nominal_standard_parameters(self.problem.model)
        weights = self.standard(nominal)[self.layout.parameters]
        columns, _ = self.arm.model.columns(replace(motion, step=run.step), self.layout)
        joints = [self.layout.of_joint(j) for j in range(self.arm.model.robot.n_v)]
        return np.ascontiguousarray(np.array([weights[rows] @ columns[rows] for rows in joints]).T)

    def check_following(self, run: Run, moved: Moved) -> None:
        """Refuse a simulated motion that has nothing to do with the measured one.

        Raises
        ------
        SimulationError
            when it is farther from it than half of the motion's own size.
        """
        size = np.linalg.norm(run.q - run.q.mean(axis=1, keepdims=True))
        share = float(np.linalg.norm(moved.q - run.q) / max(size, np.finfo(float).tiny))
        if share > _LOST:
            raise SimulationError(
                "the simulated robot does not follow the measured motion",
                where=run.name,
                expected=f"a distance below {100 * _LOST:.0f} % of the motion",
                got=f"{100 * share:.0f} %",
                remedy="check the law's gains and their units, and that the reference is in the recording's time",
            )

    def rows(self, run: Run, moved: Moved) -> Iterator[Rows]:
        """Yield the trusted filtered rows of the simulated motion with the measured torque beside it."""
        processing = self.problem.processing
        for rows in rows_of_stretches(self.arm.model, self.layout, _cut(run, moved), processing, step=run.step):
            kept = (rows.t >= run.begin) & (rows.t <= run.end)
            if kept.any():
                yield Rows(rows.t[kept], rows.columns[:, kept], rows.tau[:, kept], rows.dq[:, kept])


def joined(pieces: Iterator[Rows]) -> Rows:
    """Return consecutive rows as one piece."""
    parts = list(pieces)
    return Rows(*(np.concatenate(signals, axis=-1) for signals in zip(*parts, strict=True)))


def simulated_runs(problem: Problem, loop: ClosedLoop) -> SimulatedRuns:
    """Return the recordings of a problem, ready to be simulated.

    Raises
    ------
    ModelError
        when a term cannot be simulated, or there is not one reference a recording.
    """
    arm = simulated_arm(problem.model)
    count = len(problem.recordings)
    if loop.references and len(loop.references) != count:
        raise ModelError("closed loop: one reference a recording is needed", expected=count, got=len(loop.references))
    layout = problem.model.layout(problem.base.independent)
    runs, measured = [], []
    for number, recording in enumerate(problem.recordings):
        own = replace(problem, recordings=(recording,))
        rows = joined(own.rows())
        measured.append(rows)
        runs.append(_run(own, recording, loop, number=number, window=(float(rows.t[0]), float(rows.t[-1]))))
    return SimulatedRuns(
        problem=problem, loop=loop, arm=arm, runs=tuple(runs), measured=tuple(measured), layout=layout
    )  # fmt: skip


def _run(problem: Problem, recording: Recording, loop: ClosedLoop, *, number: int, window: tuple[float, float]) -> Run:
    processing = problem.processing
    whole = _joined_stretches(list(stretches(recording, processing)))
    if loop.references:
        asked = loop.references[number].sample(whole.t)
        q_ref, dq_ref, ddq_ref = (np.array(signal) for signal in (asked.q, asked.dq, asked.ddq))
        if q_ref.shape != whole.q.T.shape:
            expected = f"{recording.n_v} joints"
            raise ModelError(
                "a reference does not fit the log", where=recording.name, expected=expected, got=q_ref.shape
            )
    else:
        smooth = whole
        if loop.reference_cutoff < processing.motion_cutoff:
            slower = replace(processing, motion_cutoff=loop.reference_cutoff)
            smooth = _joined_stretches(list(stretches(recording, slower)))
        q_ref, dq_ref, ddq_ref = (np.ascontiguousarray(signal.T) for signal in (smooth.q, smooth.dq, smooth.ddq))
    begin, end = window
    step = uniform_clock(recording, processing.delay).step
    # What delays the torque against the position does not delay the position against the reference.
    late = 0.0 if loop.references else processing.delay
    times, moved = bridged(recording.t, unwrapped(recording.q), step=step)
    return Run(
        name=recording.name,
        t=whole.t,
        q=interpolated(times, moved, whole.t + late),
        tau=whole.tau,
        start=_start(whole, dq_ref, sooner=processing.delay - late),
        q_ref=q_ref,
        dq_ref=dq_ref,
        ddq_ref=ddq_ref,
        step=step,
        begin=begin - 0.5 * clock_step(recording),
        end=end + 0.5 * clock_step(recording),
    )


def _start(whole: Stretch, dq_ref: FloatArray, *, sooner: float) -> FloatArray:
    """Return position and speed to begin with, (2, n_v): a motion's first sample, read that much sooner [s]."""
    speed = dq_ref[0] if dq_ref.any() else whole.dq[:, 0]
    return np.array([whole.q[:, 0] - sooner * whole.dq[:, 0], speed])


def _joined_stretches(parts: list[Stretch]) -> Stretch:
    return Stretch(*(np.concatenate(signals, axis=-1) for signals in zip(*parts, strict=True)))


def _cut(run: Run, moved: Moved) -> Iterator[Stretch]:
    for start in range(0, run.t.size, CHUNK):
        part = slice(start, start + CHUNK)
        yield Stretch(run.t[part], moved.q[:, part], moved.dq[:, part], moved.ddq[:, part], run.tau[:, part])
