"""Online closed-loop input error: a parallel model follows the robot, and what it needs beside the torque teaches it.

The parallel model has position p and a velocity v = dp - L e of reference, e = q - p. A PD controller closes its loop
on the robot: with `s = dq - v = de + L e` it adds the torque `K s = K de + K L e`, gains `kd = K`, `kp = K L`,

    M(q; x) dv/dt + C(q, dq; x) v + g(q; x) + f(dq; x) = tau + K s

The left side is linear in x, `Y x` with Y = Y(q, dq, v, dv/dt). The input error K s is the torque that the model needs
and the robot did not, and moves the parameters:

    dx/dt = -G Y' s

With the true x* subtracted, `M ds/dt + (C + K) s = Y (x - x*)`, and since dM/dt - 2 C is skew-symmetric

    V = s'M s / 2 + (x - x*)' G^-1 (x - x*) / 2       dV/dt = -s'K s <= 0

for every constant positive definite G; docs/methods/filter-estimators.md has the whole proof. C must be the one of
Christoffel symbols. It is had without them: the regressor gives `c(u) = C(q, u) u`, and C(q, a) b is symmetric and
bilinear, so that `C(q, dq) v = c((dq + v)/2) - c((dq - v)/2)`.

Where the parameters leave no mass matrix, they are put back to the nearest ones, in the metric of G^-1, that do: those
with `u'M(q; x)u >= least` are a half-space that holds x*, and going to it brings x nearer to x*, so that V only falls.

With torque noise s is never zero, and dv/dt holds a part `K s / M` of it: the mean of `Y's` then pulls inertias down,
in proportion to K. The loop is therefore no faster than the motion needs.

G is the inverse of the mean of `W'K^-1 W` over the filtered rows W of the recordings, over the time T: all directions
then learn alike, at 1/T, while the model follows the robot closely.

Source: Slotine, Li, "On the adaptive control of robot manipulators", 1987, here with robot and model in each other's
place; Landau, Karimi, "Recursive algorithms for identification in closed loop", 1997 (parallel models).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.control.adaptive import even_learning
from tauhat.dynamics.model import Layout, TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.filters.beginning import Beginning, FirstStretch
from tauhat.estimation.filters.outcome import Found, Recursion, residual_weights, solution_of
from tauhat.estimation.filters.samples import motion_samples, refuse_memory, row_samples
from tauhat.estimation.friction import braking_parameters
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution, joint_residuals
from tauhat.recordings.processing import Stretch

_LOST = 1e3  # the model is lost when its speed is off by this many times the robot's largest
_LEAST = (0.005, 0.1)  # bounds of the least eigenvalue that a scaled mass matrix must have
_OF_FIRST = 1.0 / 3.0  # of the least eigenvalue with the parameters to begin with
_PUT_BACK = 8  # times at most that the parameters are put back in one step


class ParallelState(NamedTuple):
    """Position p and reference velocity v of the model (n_v,), parameters x (n_b,)."""

    p: FloatArray
    v: FloatArray
    values: FloatArray


class DrivenSample(NamedTuple):
    """The robot at one time: time [s], q, dq and torque (n_v,)."""

    t: float
    q: FloatArray
    dq: FloatArray
    tau: FloatArray


class InputError(NamedTuple):
    """What one step saw: s (n_v,), input error K s (n_v,) [Nm or N], and the model's regressor Y (n_v, n_b)."""

    s: FloatArray
    torque: FloatArray
    columns: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ParallelModel:
    """The model beside the robot, with the gains of its loop and of its learning.

    braking : (n_b,) which parameters are of friction: theirs are the columns at the robot's own speed
    gain : (n_v,) K [Nm s/rad or N s/m]
    inertia : (n_v,) mean of each joint, as begun with [kg m^2 or kg]
    least : eigenvalue of the mass matrix, its rows and columns scaled by the roots of these
    stiffness : L [1/s]
    learning : (n_b, n_b) G
    step : of the clock [s]
    """

    model: TorqueModel
    layout: Layout
    supports: tuple[NDArray[np.intp], ...]
    braking: NDArray[np.bool_]
    gain: FloatArray
    inertia: FloatArray
    least: float
    stiffness: float
    learning: FloatArray
    step: float

    def __post_init__(self) -> None:
        for array in (self.braking, self.gain, self.inertia, self.learning):
            read_only(array)

    def stepped(self, state: ParallelState, sample: DrivenSample) -> tuple[ParallelState, InputError]:
        """Return the state one step on, and the input error.

        Raises
        ------
        numpy.linalg.LinAlgError
            when the model's mass matrix is not positive definite.
        """
        error = sample.q - state.p
        s = sample.dq - state.v
        torque = self.gain * s
        still, slopes = self._regressors(sample.q, sample.dq, state.v)
        values = self._put_back(state.values, slopes)
        mass = np.array([slope @ values for slope in slopes]).T
        change = np.linalg.solve(mass, sample.tau + torque - still @ values)
        columns = still + np.tensordot(change, slopes, axes=1)
        h = self.step
        after = ParallelState(
            state.p + h * (state.v + self.stiffness * error),
            state.v + h * change,
            values - h * (self.learning @ (columns.T @ s)),
        )
        return after, InputError(s, torque, columns)

    def _put_back(self, values: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the nearest parameters whose mass matrix is large enough; the same ones when theirs is."""
        scale = 1.0 / np.sqrt(self.inertia)
        for _ in range(_PUT_BACK):
            mass = np.array([slope @ values for slope in slopes]).T
            size, axes = np.linalg.eigh(0.5 * (mass + mass.T) * np.outer(scale, scale))
            if size[0] >= 0.5 * self.least:
                return values
            axis = axes[:, 0] * scale
            normal = np.einsum("k,j,kjb->b", axis, axis, slopes)
            moved = self.learning @ normal
            values = values + moved * (self.least - normal @ values) / (normal @ moved)
        raise np.linalg.LinAlgError("the mass matrix is not positive definite")

    def mass(self, q: FloatArray, values: FloatArray) -> FloatArray:
        """Return the model's mass matrix, (n_v, n_v)."""
        _, slopes = self._regressors(q, np.zeros_like(q), np.zeros_like(q))
        return np.array([slope @ values for slope in slopes]).T

    def _regressors(self, q: FloatArray, dq: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return Y without acceleration (n_v, n_b), and what a unit acceleration of each joint adds (n_v, n_v, n_b)."""
        n_v = q.size
        speeds = np.vstack([0.5 * (dq + v), 0.5 * (dq - v), dq, np.zeros((n_v + 1, n_v))])
        changes = np.vstack([np.zeros((4, n_v)), np.eye(n_v)])
        places = np.tile(q[:, None], (1, n_v + 4))
        motion = Motion(q=places, dq=np.ascontiguousarray(speeds.T), ddq=np.ascontiguousarray(changes.T))
        columns, _ = self.model.columns(motion, self.layout)
        whole = np.zeros((n_v + 4, n_v, self.learning.shape[0]))
        for joint, support in enumerate(self.supports):
            whole[:, joint, support] = columns[self.layout.of_joint(joint)].T
        still = np.where(self.braking, whole[2], whole[0] - whole[1] + whole[3])
        return still, whole[4:] - whole[3]


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaptiveInputError(Recursion):
    """The online closed-loop input-error estimator with a parallel model.

    beginning : weighted least squares on the first part of each recording by default
    bandwidth : K over the mean inertia of each joint, of the model's loop [Hz]
    stiffness : L in parts of the bandwidth
    time : T of the learning [s]
    passes : over the recordings; the values are the mean over the last one
    rate : of the model's clock at most [Hz]
    """

    key: ClassVar[str] = "adaptive"
    beginning: Beginning = field(default_factory=FirstStretch)
    bandwidth: float = 1.0
    stiffness: float = 0.5
    time: float = 5.0
    passes: int = 3
    rate: float = 250.0

    def __post_init__(self) -> None:
        super(AdaptiveInputError, self).__post_init__()
        for name in ("bandwidth", "stiffness", "time", "rate"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise ModelError(f"adaptive estimator: {name}", expected="a positive number", got=value)
        if self.passes < 1:
            raise ModelError("at least one pass is needed", got=self.passes)

    @single_threaded
    def fit_problem(self, problem: Problem) -> Solution:
        """Return the mean of the parameters over the last pass; the last trusted ones when the model is lost."""
        refuse_memory(problem, self.key)
        start = self.beginning.of(problem)
        motions = [motion_samples(problem, recording, rate=self.rate) for recording in start.recordings]
        _, weights = residual_weights(problem.evidence)
        values, cause, advice = start.mean, f"{self.passes} passes done", ""
        mean = values
        for _ in range(self.passes):
            total, count = np.zeros_like(values), 0
            for recording, motion in zip(start.recordings, motions, strict=True):
                parallel = parallel_model(problem, motion, start.mean, settings=self)
                trail, summed, lost = _followed(parallel, motion, values, every=self.time)
                values = trail[-1]
                total, count = total + summed, count + motion.t.size
                if lost:
                    cause, advice = f"{recording.name}: stopped {lost}", "begin closer, lower the bandwidth or raise T"
                    trusted = _trusted(problem.evidence, (start.mean, *trail[:-1]), weights)
                    return solution_of(problem.evidence, Found(trusted, weights, self.passes, cause, advice))
            mean = total / count
        return solution_of(problem.evidence, Found(mean, weights, self.passes, cause, advice))


def parallel_model(
    problem: Problem, motion: Stretch, values: FloatArray, *, settings: AdaptiveInputError
) -> ParallelModel:
    """Return the parallel model for one motion, its gains made from the parameters to begin with.

    Raises
    ------
    ModelError
        when a joint has no inertia with these parameters, or the clock is too slow for the bandwidth.
    """
    base = problem.base
    step = float(motion.t[1] - motion.t[0])
    rate = 2.0 * np.pi * settings.bandwidth
    if rate * step > 0.5:
        raise ModelError(
            "the clock is too slow for the bandwidth of the parallel model",
            expected=f"<= {0.5 / (2.0 * np.pi * step):.3g} Hz",
            got=f"{settings.bandwidth:g} Hz",
        )
    bare = ParallelModel(
        model=problem.model,
        layout=problem.model.layout(base.independent),
        supports=problem.evidence.supports,
        braking=braking_parameters(problem.model)[base.independent],
        gain=np.ones(problem.model.robot.n_v),
        inertia=np.ones(problem.model.robot.n_v),
        least=_LEAST[1],
        stiffness=settings.stiffness * rate,
        learning=np.eye(base.n_b),
        step=step,
    )
    poses = motion.q[:, :: max(1, motion.t.size // 50)].T
    masses = np.array([bare.mass(q, values) for q in poses])
    inertia = np.diagonal(masses.mean(axis=0)).copy()
    if not inertia.min() > 0.0:
        joint = problem.model.robot.joint_names[int(np.argmin(inertia))]
        raise ModelError("no inertia to begin with", where=joint, remedy="begin with other values (beginning=...)")
    smallest = np.linalg.eigvalsh(masses / np.sqrt(np.outer(inertia, inertia))).min()
    bare = replace(bare, inertia=inertia, least=float(np.clip(_OF_FIRST * smallest, *_LEAST)))
    return _with_gains(problem, bare, gain=rate * inertia, time=settings.time)


def _with_gains(problem: Problem, bare: ParallelModel, *, gain: FloatArray, time: float) -> ParallelModel:
    mean = np.zeros_like(bare.learning)
    count = 0
    for sample in row_samples(problem):
        mean += sample.columns.T @ (sample.columns / gain[:, None])
        count += 1
    return replace(bare, gain=gain, learning=even_learning(mean / count, time=time))


def _followed(
    parallel: ParallelModel, motion: Stretch, values: FloatArray, *, every: float
) -> tuple[list[FloatArray], FloatArray, str]:
    """Return the parameters every so many seconds and at the end, their sum, and why the model was lost."""
    state = ParallelState(motion.q[:, 0].copy(), motion.dq[:, 0].copy(), values)
    bound = _LOST * max(np.abs(motion.dq).max(), np.finfo(float).tiny)
    total, trail, kept = np.zeros_like(values), [values], float(motion.t[0])
    for k, t in enumerate(motion.t):
        sample = DrivenSample(float(t), motion.q[:, k], motion.dq[:, k], motion.tau[:, k])
        try:
            after, seen = parallel.stepped(state, sample)
        except np.linalg.LinAlgError:
            return [*trail, state.values], total, f"at {t:.2f} s: the model's mass matrix is not positive definite"
        if not np.abs(seen.s).max() < bound:
            return [*trail, state.values], total, f"at {t:.2f} s: the model runs away from the robot"
        state = after
        total += state.values
        if t - kept >= every:
            trail, kept = [*trail, state.values], float(t)
    return [*trail, state.values], total, ""


def _trusted(evidence: Evidence, trail: tuple[FloatArray, ...], weights: FloatArray) -> FloatArray:
    """Return the latest parameters that explain the recordings no worse than the first did.

    A model that runs away has spoilt its parameters long before its speed tells.
    """
    errors = [float(np.linalg.norm(weights * joint_residuals(evidence, values))) for values in trail]
    return next(values for values, error in zip(reversed(trail), reversed(errors), strict=True) if error <= errors[0])
