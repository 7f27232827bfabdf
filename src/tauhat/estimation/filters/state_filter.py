"""Kalman filters over state and parameters at once: torque drives the simulated arm, the encoders correct it.

State `(q, dq, x)` with the base parameters x constant. Positions are measured every T; the torque between them drives
the arm in steps of h, by the midpoint rule,

    a = ddq(q, dq, tau; x)      b = ddq(q + h dq/2 + h^2 a/8, dq + h a/2, tau; x)
    q+ = q + h dq + h^2 b/2     dq+ = dq + h b     x+ = x

White torque noise, of deviation s in the mean over T, makes accelerations `A = M^-1 diag(s)` and is added to the
covariance by the columns `[T^2/2; T; 0] A` and `[T^2/sqrt(12); 0; 0] A`. Measured are positions, or positions and
velocities.

That the measured torque is an input is the method's weak side: its noise is also in the predicted acceleration, by
which the filter judges the inertias, and pulls them up by the ratio of noise to acceleration torque, both squared,
inside the band in which the filter trusts the encoders more than the torque. That band ends where the noise of the
position is as large as what the torque's noise makes of it, at `w_b^2 = |A| / position noise`. For good encoders it is
far wider than the motion. The noise of the position is therefore taken as at least `|A| / w_b^2`, with w_b given.

Noise, where not given: that of positions and velocities from their fourth differences, at least a third of an encoder
count; that of the torque from the residual r of weighted least squares on rows low-passed at f_c, as the mean over T of
white noise that leaves as much there, `s = r / sqrt(2 T f_c)`. Model error thus counts as noise.

Source: Gautier, Poignet, "Extended Kalman filtering and weighted least squares dynamic identification of robot", 2001.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.filters.acceleration import point_accelerations
from tauhat.estimation.filters.beginning import Beginning, FirstStretch
from tauhat.estimation.filters.forms import PlainCovariance, SquareRoot
from tauhat.estimation.filters.outcome import Found, Recursion, residual_weights, solution_of
from tauhat.estimation.filters.parameter_filter import DIVERGED
from tauhat.estimation.filters.samples import refuse_memory
from tauhat.estimation.filters.spreading import CentralDifference, Extended, Unscented
from tauhat.estimation.filters.state_plan import (
    FoundNoise,
    StateNoise,
    StatePlan,
    StateSample,
    StateSystem,
    clocked_recording,
    measurement_noise,
    noise_accelerations,
    state_plan,
)
from tauhat.estimation.filters.steps import Belief, Innovation, InnovationTest, KalmanFilter
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution
from tauhat.recordings.recording import Recording


def state_step(
    kalman: KalmanFilter, system: StateSystem, belief: Belief, sample: StateSample
) -> tuple[Belief, Innovation]:
    """Return the belief over `(q, dq, x)` at the next measurement, and after it.

    Raises
    ------
    numpy.linalg.LinAlgError
        when a covariance or a mass matrix is not positive definite.
    """
    n_y = sample.measured.size
    driven = _driven(system, belief.mean, sample.tau)
    ahead = kalman.predict(belief, lambda points: _moved(system, points, sample.tau), driven)
    return kalman.correct(ahead, lambda points: points[:, :n_y], sample.measured, system.noise)


def _moved(system: StateSystem, points: FloatArray, tau: FloatArray) -> FloatArray:
    """Return the points one measurement on."""
    n_v, h = tau.shape[1], system.step
    q, dq, values = points[:, :n_v], points[:, n_v : 2 * n_v], points[:, 2 * n_v :]
    for own in tau:
        drive = np.broadcast_to(own, q.shape)
        first = system.accelerations.at(q, dq, drive, values)
        middle = system.accelerations.at(q + 0.5 * h * dq + 0.125 * h**2 * first, dq + 0.5 * h * first, drive, values)
        q, dq = q + h * dq + 0.5 * h**2 * middle, dq + h * middle
    return np.hstack([q, dq, values])


def _driven(system: StateSystem, mean: FloatArray, tau: FloatArray) -> FloatArray:
    """Return the columns by which torque noise moves the state until the next measurement, (n_x, 2 n_v)."""
    n_v, time = tau.shape[1], tau.shape[0] * system.step
    moved = noise_accelerations(system.accelerations, mean, tau[0], system.torque_noise)
    rest = np.zeros((mean.size - 2 * n_v, n_v))
    along = np.vstack([0.5 * time**2 * moved, time * moved, rest])
    return np.hstack([along, np.vstack([time**2 / np.sqrt(12.0) * moved, 0.0 * moved, rest])])


@dataclass(frozen=True, slots=True, kw_only=True)
class StateKalman(Recursion):
    """A Kalman filter over position, velocity and base parameters.

    filter : spreading and form
    beginning : weighted least squares on the first part of each recording by default
    noise : from the recordings by default
    rate : of the measurements at most [Hz]
    longest_step : of the integration; the torque is averaged over each step [s]
    band : in which encoders are trusted more than the torque, at most [Hz]
    test : what stops it

    Velocities are measurements where the recording has them and the processing takes them.
    """

    key: ClassVar[str] = "ekf"
    filter: KalmanFilter = field(default_factory=KalmanFilter)
    beginning: Beginning = field(default_factory=FirstStretch)
    noise: StateNoise = field(default_factory=StateNoise)
    rate: float = 50.0
    longest_step: float = 4e-3
    band: float = 2.0
    test: InnovationTest = field(default_factory=InnovationTest)

    def __post_init__(self) -> None:
        super(StateKalman, self).__post_init__()
        for name in ("rate", "longest_step", "band"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise ModelError(f"state filter: {name}", expected="a positive number", got=value)

    @single_threaded
    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution after the last sample; the last trusted one, with its cause, when the filter diverges."""
        refuse_memory(problem, self.key)
        start = self.beginning.of(problem)
        residual, weights = residual_weights(problem.evidence)
        mean, covariance = start.mean, start.covariance
        cause, advice = "last sample reached", ""
        for recording in start.recordings:
            try:
                plan = self._plan(problem, recording, residual, mean)
            except np.linalg.LinAlgError as error:
                verdict = f"at its beginning: {error}"
            else:
                mean, covariance, verdict = self._through(plan, mean, covariance)
            if verdict:
                cause, advice = f"{recording.name}: diverged {verdict}", DIVERGED
                break
        found = Found(mean, weights, 1, cause, advice)
        return solution_of(problem.evidence, found, covariance=covariance)

    def _plan(self, problem: Problem, recording: Recording, residual: FloatArray, mean: FloatArray) -> StatePlan:
        """Return how a recording is filtered, with the deviations given, and the recording's own where none are."""
        takes = recording.dq is not None and problem.processing.velocity == "velocity"
        measured = measurement_noise(recording.dq) if takes and recording.dq is not None else None
        noise = FoundNoise(
            self.noise.chosen("torque", residual),
            bool(self.noise.torque),
            problem.processing.cutoff,
            self.noise.chosen("position", measurement_noise(recording.q)),
            None if measured is None else self.noise.chosen("velocity", measured),
        )
        clocked = clocked_recording(recording, problem.processing.delay, rate=self.rate, longest_step=self.longest_step)
        accelerations = point_accelerations(problem.model, problem.base)
        return state_plan(clocked, accelerations, mean, noise=noise, band=self.band)

    def _through(self, plan: StatePlan, mean: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray, str]:
        """Return mean and covariance of the parameters after one recording, and why the filter stopped early."""
        n = plan.state.size
        whole = np.zeros((n + mean.size, n + mean.size))
        whole[:n, :n], whole[n:, n:] = np.diag(plan.deviation**2), covariance
        averaged, verdict, at = 1.0, "", 0.0
        trusted = Belief(np.concatenate([plan.state, mean]), self.filter.form.start(whole))
        for sample in plan.samples:
            try:
                belief, innovation = state_step(self.filter, plan.system, trusted, sample)
            except np.linalg.LinAlgError as error:
                verdict = str(error) or "a covariance lost its positive definiteness"
            else:
                averaged = self.test.averaged(averaged, innovation.surprise)
                verdict = self.test.verdict(belief, averaged)
            if verdict:
                at = sample.t
                break
            trusted = belief
        final = self.filter.covariance(trusted)[n:, n:]
        return trusted.mean[n:], final, f"at {at:.2f} s: {verdict}" if verdict else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SquareRootExtendedKalman(StateKalman):
    """The extended filter in square-root form."""

    key: ClassVar[str] = "ekf-root"
    filter: KalmanFilter = field(default_factory=lambda: KalmanFilter(spreading=Extended(), form=SquareRoot()))


@dataclass(frozen=True, slots=True, kw_only=True)
class UnscentedKalman(StateKalman):
    """The unscented filter."""

    key: ClassVar[str] = "ukf"
    filter: KalmanFilter = field(default_factory=lambda: KalmanFilter(spreading=Unscented(), form=PlainCovariance()))


@dataclass(frozen=True, slots=True, kw_only=True)
class SquareRootUnscentedKalman(StateKalman):
    """The unscented filter in square-root form."""

    key: ClassVar[str] = "ukf-root"
    filter: KalmanFilter = field(default_factory=lambda: KalmanFilter(spreading=Unscented(), form=SquareRoot()))


@dataclass(frozen=True, slots=True, kw_only=True)
class CentralDifferenceKalman(StateKalman):
    """The central-difference filter."""

    key: ClassVar[str] = "cdkf"
    filter: KalmanFilter = field(
        default_factory=lambda: KalmanFilter(spreading=CentralDifference(), form=PlainCovariance())
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SquareRootCentralDifferenceKalman(StateKalman):
    """The central-difference filter in square-root form."""

    key: ClassVar[str] = "cdkf-root"
    filter: KalmanFilter = field(default_factory=lambda: KalmanFilter(spreading=CentralDifference(), form=SquareRoot()))
