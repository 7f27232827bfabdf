"""Kalman filters over state and parameters at once: torque drives the simulated arm, the encoders correct it.

State `(q, dq, x)` with the base parameters x constant. Positions are measured every T; the torque between them drives
the arm in steps of h, by the midpoint rule,

    a = ddq(q, dq, tau; x)      b = ddq(q + h dq/2 + h^2 a/8, dq + h a/2, tau; x)
    q+ = q + h dq + h^2 b/2     dq+ = dq + h b     x+ = x

Torque noise of deviation s, of the mean over T, enters as an acceleration `M^-1 diag(s)` and is added to the covariance
by the columns `[T^2/2; T; 0] M^-1 diag(s)`. Measured are positions, or positions and velocities.

That the measured torque is an input is the method's weak side: its noise is also in the predicted acceleration, by
which the filter judges the inertias, and pulls them up, by about the torque's noise over its signal squared. The noise
of a mean falls with the time it is taken over, hence T is much longer than h.

Noise, where not given: that of positions and velocities from their fourth differences, at least a third of an encoder
count; that of the torque from the residual r of weighted least squares on rows low-passed at f_c, as the mean over T of
white noise that leaves as much there, `s = r / sqrt(2 T f_c)`. Model error thus counts as noise.

Source: Gautier, Poignet, "Extended Kalman filtering and weighted least squares dynamic identification of robot", 2001.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.filters.acceleration import PointAccelerations, point_accelerations
from tauhat.estimation.filters.beginning import Beginning, FirstStretch
from tauhat.estimation.filters.forms import PlainCovariance, SquareRoot
from tauhat.estimation.filters.outcome import Found, Recursion, residual_weights, solution_of
from tauhat.estimation.filters.parameter_filter import DIVERGED
from tauhat.estimation.filters.samples import refuse_memory
from tauhat.estimation.filters.spreading import CentralDifference, Extended, Unscented
from tauhat.estimation.filters.steps import Belief, Innovation, InnovationTest, KalmanFilter
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution
from tauhat.recordings.processing import interpolated, uniform_clock, unwrapped, white_noise
from tauhat.recordings.recording import Recording

_COUNT = 12.0**-0.5  # deviation of rounding to whole encoder counts
_RUN_UP = 0.05  # [s] over which the first velocity is taken
_LEAST = 1e-9  # [rad, m and per second] noise of a recording without any


@dataclass(frozen=True, slots=True, kw_only=True)
class StateNoise:
    """Standard deviations of white noise; empty where they are to be taken from the recordings.

    torque : (n_v,) of the mean between two measurements [Nm or N]
    position, velocity : (n_v,) [rad or m, and per second]
    """

    torque: tuple[float, ...] = ()
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()

    def chosen(self, name: str, found: FloatArray) -> FloatArray:
        """Return the given deviations, else those found."""
        given: tuple[float, ...] = getattr(self, name)
        if not given:
            return found
        if len(given) != found.size or not min(given) > 0.0:
            raise ModelError(f"noise of the {name}", expected=f"{found.size} positive values", got=given)
        return np.array(given)


class StateSample(NamedTuple):
    """From one measurement to the next: time of the latter [s], torque of every step (n, n_v), measurement (n_y,)."""

    t: float
    tau: FloatArray
    measured: FloatArray


class StateSystem(NamedTuple):
    """What a step needs beside belief and sample.

    accelerations : of the model
    step : of the integration [s]
    torque_noise : (n_v,) deviations of the mean torque between two measurements
    noise : (n_y, n_y) root of the measurement's covariance
    """

    accelerations: PointAccelerations
    step: float
    torque_noise: FloatArray
    noise: FloatArray


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
    """Return the columns by which torque noise moves the state until the next measurement, (n_x, n_v)."""
    n_v, time = tau.shape[1], tau.shape[0] * system.step
    drives = np.vstack([tau[0], tau[0] + np.diag(system.torque_noise)])
    points = np.broadcast_to(mean, (n_v + 1, mean.size))
    found = system.accelerations.at(points[:, :n_v], points[:, n_v : 2 * n_v], drives, points[:, 2 * n_v :])
    moved = (found[1:] - found[0]).T
    return np.vstack([0.5 * time**2 * moved, time * moved, np.zeros((mean.size - 2 * n_v, n_v))])


@dataclass(frozen=True, slots=True, kw_only=True)
class StateKalman(Recursion):
    """A Kalman filter over position, velocity and base parameters.

    filter : spreading and form
    beginning : weighted least squares on the first part of each recording by default
    noise : from the recordings by default
    rate : of the measurements at most [Hz]
    longest_step : of the integration; the torque is averaged over each step [s]
    test : what stops it

    Velocities are measurements where the recording has them and the processing takes them.
    """

    key: ClassVar[str] = "ekf"
    filter: KalmanFilter = field(default_factory=KalmanFilter)
    beginning: Beginning = field(default_factory=FirstStretch)
    noise: StateNoise = field(default_factory=StateNoise)
    rate: float = 50.0
    longest_step: float = 4e-3
    test: InnovationTest = field(default_factory=InnovationTest)

    def __post_init__(self) -> None:
        super(StateKalman, self).__post_init__()
        for name in ("rate", "longest_step"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise ModelError(f"state filter: {name}", expected="a positive number", got=value)

    @single_threaded
    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution after the last sample; the last trusted one, with its cause, when the filter diverges."""
        refuse_memory(problem, self.key)
        accelerations = point_accelerations(problem.model, problem.base)
        start = self.beginning.of(problem)
        residual, weights = residual_weights(problem.evidence)
        mean, covariance = start.mean, start.covariance
        cause, advice = "last sample reached", ""
        for recording in start.recordings:
            plan = self._plan(problem, recording, accelerations, residual)
            mean, covariance, verdict = self._through(plan, mean, covariance)
            if verdict:
                cause, advice = f"{recording.name}: diverged {verdict}", DIVERGED
                break
        found = Found(mean, weights, 1, cause, advice)
        return solution_of(problem.evidence, found, covariance=covariance)

    def _through(self, plan: _Plan, mean: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray, str]:
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

    def _plan(
        self, problem: Problem, recording: Recording, accelerations: PointAccelerations, residual: FloatArray
    ) -> _Plan:
        clocked = _clocked(recording, problem.processing.delay, rate=self.rate, longest=self.longest_step)
        velocities = recording.dq is not None and problem.processing.velocity == "velocity"
        position = self.noise.chosen("position", _measurement_noise(recording.q))
        torque = residual / np.sqrt(2.0 * clocked.time * min(problem.processing.cutoff, 0.5 / clocked.time))
        rise = max(1, round(_RUN_UP / clocked.time))
        speed = (clocked.q[rise] - clocked.q[0]) / (rise * clocked.time)
        change = np.abs(clocked.q[2 * rise] - 2.0 * clocked.q[rise] + clocked.q[0]) / (rise * clocked.time)
        unsure = 2.0 * position / (rise * clocked.time) + change + _LEAST
        measured, noise = clocked.q, position
        if velocities and clocked.dq is not None:
            own = self.noise.chosen("velocity", _measurement_noise(clocked.dq))
            measured, noise = np.hstack([clocked.q, clocked.dq]), np.concatenate([position, own])
            speed, unsure = clocked.dq[0], 2.0 * own
        system = StateSystem(accelerations, clocked.step, self.noise.chosen("torque", torque), np.diag(noise))
        state, deviation = np.concatenate([clocked.q[0], speed]), np.concatenate([2.0 * position, unsure])
        return _Plan(system, state, deviation, _samples(clocked, measured))


class _Plan(NamedTuple):
    """How one recording is filtered: system, first state and its deviations (2 n_v,), samples."""

    system: StateSystem
    state: FloatArray
    deviation: FloatArray
    samples: Iterator[StateSample]


class _Clocked(NamedTuple):
    """A recording on a coarser clock.

    time, step : between measurements, and of the integration [s]
    t, q, dq : (n,), (n, n_v) each, at the measurements
    tau : (n - 1, n_steps, n_v) means over each step between them
    """

    time: float
    step: float
    t: FloatArray
    q: FloatArray
    dq: FloatArray | None
    tau: FloatArray


def _clocked(recording: Recording, delay: float, *, rate: float, longest: float) -> _Clocked:
    clock = uniform_clock(recording, delay)
    ticks_a_step = max(1, int(longest / clock.step + 1e-9))
    n_steps = max(1, round(1.0 / (rate * clock.step * ticks_a_step)))
    every = n_steps * ticks_a_step
    count = (clock.n_t - 1) // every
    ticks = clock.ticks(0, count * every + 1)
    if recording.tau is None:
        raise ModelError("no torque in the log", where=recording.name)
    torque = interpolated(recording.t, recording.tau, ticks[:-1] + 0.5 * clock.step)
    mean = torque.reshape(recording.n_v, count, n_steps, ticks_a_step).mean(axis=3).transpose(1, 2, 0)
    coarse = ticks[::every]
    q = interpolated(recording.t, unwrapped(recording.q), coarse + delay).T
    dq = None if recording.dq is None else interpolated(recording.t, recording.dq, coarse + delay).T
    return _Clocked(every * clock.step, ticks_a_step * clock.step, coarse, q, dq, mean)


def _measurement_noise(signal: FloatArray) -> FloatArray:
    """Return the deviation of each column of a measured signal: white noise, and rounding to its smallest step."""
    jumps = np.abs(np.diff(signal, axis=0))
    count = np.min(jumps, axis=0, where=jumps > 0, initial=np.inf)
    coarse = np.array([np.unique(column).size < column.size // 2 for column in signal.T])
    rounding = np.where(coarse & np.isfinite(count), _COUNT * count, 0.0)
    return np.maximum(np.maximum(white_noise(signal), rounding), _LEAST)


def _samples(clocked: _Clocked, measured: FloatArray) -> Iterator[StateSample]:
    for k, tau in enumerate(clocked.tau):
        yield StateSample(float(clocked.t[k + 1]), tau, measured[k + 1])


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
