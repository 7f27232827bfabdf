"""The virtual force sensor: external joint torque and wrench with error bars, from position and motor torque alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.errors import SensingError
from tauhat.estimation.estimate import Estimate
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording
from tauhat.robots.fitting import check_joint_order
from tauhat.sensing import sensor_kernel as kernel
from tauhat.sensing import stamp_kernel as stamp
from tauhat.sensing.causal_filter import HIGHEST, CausalFilter
from tauhat.sensing.frozen import frozen_along
from tauhat.sensing.observer_kernel import DISTURBANCE
from tauhat.sensing.observers import MomentumObserver, Observer
from tauhat.sensing.sample_rate import check_rate
from tauhat.sensing.sensed_log import SampleCounts, SensedLog
from tauhat.sensing.sensed_model import SensedModel, sensed_model
from tauhat.sensing.thermal_kernel import VARIANCE, WARMTH
from tauhat.sensing.torque_observer import SensedWarmth, TorqueObserver
from tauhat.sensing.wrench import WrenchSolver

Stamps: TypeAlias = Literal["auto", "exact", "jittered"]
"""Whether samples were taken at their time stamps, or evenly with stamps that jitter; auto: as positions tell."""

STAMPS: Mapping[str, int] = {"auto": stamp.AUTO, "exact": stamp.EXACT, "jittered": stamp.JITTERED}
CUTOFF = 10.0  # [Hz]
_BRIDGED_STEPS, _BRIDGED = 5.0, 0.02  # lost samples are put back over so many steps, or so long [s]
_CHUNK = 2**16  # [samples] between which Python may be interrupted
_NO_LAG = read_only(np.zeros(1))
_HALF = 0.5  # period that a stamp may be late


class Sensed(NamedTuple):
    """What one sample told.

    tau, variance : (n_v,) external torque and its variance [Nm or N]
    q : (n_v,) position to which it belongs, as late as it is
    dq : (n_v,) filtered velocity
    raw : (n_v,) mean external torque since the sample before, not smoothed
    wrench : (6,) force, then moment, at the frame [N, Nm]
    covariance : (6, 6) of the wrench
    settled : whether the last start is forgotten
    lag : (n_v,) what the torque changed by within the observer's delay; the covariance holds it [Nm or N]
    """

    tau: FloatArray
    variance: FloatArray
    q: FloatArray
    dq: FloatArray
    raw: FloatArray
    wrench: FloatArray
    covariance: FloatArray
    settled: bool = True
    lag: FloatArray = _NO_LAG


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ForceSensor:
    """A model, a sample rate and an observer: pure steps, and the same along a log.

    Its memory is a vector that nobody has to look into.

    model : what the estimate knows of the arm, with its tool
    rate : of the samples [Hz]
    observer : of the external torque; the momentum observer at 20 1/s by default
    cutoff : of the filter that position and torque share [Hz]; 10, or what the rate allows
    delay : how much later than the torque the position was logged [s]; the torque then waits, else the position
    wrench : frame and directions; a full wrench at the robot's last frame by default
    stamps : what time stamps say; `auto` is told by the positions, in motion within a second
    """

    model: SensedModel
    rate: float
    observer: Observer = field(default_factory=MomentumObserver)
    cutoff: float | None = None
    delay: float = 0.0
    wrench: WrenchSolver | None = None
    stamps: Stamps = "auto"
    _machine: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not 0.0 < self.rate < np.inf:
            raise SensingError("rate of the samples", expected="above zero", got=f"{self.rate} Hz")
        if not abs(self.delay) < 1.0:
            raise SensingError("delay of a channel", expected="below 1 s", got=f"{self.delay} s")
        if self.stamps not in STAMPS:
            raise SensingError("time stamps", expected=", ".join(STAMPS), got=str(self.stamps)[:60])
        solver = self.solver
        if solver.robot.fingerprint != self.model.robot.fingerprint:
            raise SensingError("the wrench is of another robot", expected=self.model.robot.name, got=solver.robot.name)
        cutoff = min(CUTOFF, HIGHEST / self.step) if self.cutoff is None else self.cutoff
        object.__setattr__(self, "wrench", solver)
        object.__setattr__(self, "cutoff", cutoff)
        observer = TorqueObserver(model=self.model, step=self.step, observer=self.observer, cutoff=cutoff)
        numbers = [self.step, self._forgetting(cutoff), self.delay * self.rate, self.longest_bridged]
        numbers += [STAMPS[self.stamps], np.exp(-self.step / self.observer.lag)]
        limits = read_only(np.array(numbers)), read_only(self.model.strength)
        object.__setattr__(self, "_machine", (*observer.parts, solver.task, limits))

    @property
    def step(self) -> float:
        """Time between samples [s]."""
        return 1.0 / self.rate

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.model.n_v

    @property
    def solver(self) -> WrenchSolver:
        """Of the wrench."""
        return self.wrench or WrenchSolver(robot=self.model.robot)

    @property
    def longest_bridged(self) -> float:
        """Time without samples above which the sensor starts again [s]: five steps, but no less than 20 ms."""
        return max((_BRIDGED_STEPS + _HALF) * self.step, _BRIDGED)

    def _forgetting(self, cutoff: float) -> float:
        """Return how fast a start is forgotten [1/s]: the slower of filter and observer."""
        slowest = self.observer.gain / (self.n_v if self.observer.kind == DISTURBANCE else 1)
        return min(slowest, CausalFilter(cutoff=cutoff, step=self.step).damping / 2.0)

    def start(self) -> FloatArray:
        """Return the memory before the first sample."""
        ring = 0 if self.delay == 0.0 else int(abs(self.delay) * self.rate) + 2
        memory = np.zeros(kernel.size_of(self.n_v, self.model.bristles.size, ring))
        memory[stamp.LATEST], memory[stamp.BELIEVED] = np.nan, float(self.stamps == "exact")
        return read_only(memory)

    def advance(self, memory: FloatArray, q: FloatArray, tau: FloatArray) -> tuple[FloatArray, Sensed]:
        """Return the memory one period later and what the sample told.

        Parameters
        ----------
        q, tau : (n_v,) position and motor torque, joint side, as measured [rad or m, Nm or N]

        Raises
        ------
        SensingError
            when the sample is not finite, or the observer needs a mass matrix of a body and the model has none here.
        """
        last = memory[stamp.LATEST]
        t = 0.0 if np.isnan(last) else last + self.step
        after, sensed, code = self.take(memory, t, q, tau)
        if sensed is None:
            raise SensingError("a sample that is no sample", where=f"{t:.3f} s", got=f"reason {code}")
        return after, sensed

    def take(
        self, memory: FloatArray, t: float, q: FloatArray, tau: FloatArray
    ) -> tuple[FloatArray, Sensed | None, int]:
        """Return the memory behind a stamped sample, what it told if it was taken, and a code of `stamp_kernel`.

        Parameters
        ----------
        t : time stamp [s]
        q, tau : as in `advance`

        Raises
        ------
        SensingError
            when the mass matrix is needed and that of no body, or the sample is of another number of joints.
        """
        n_v = self.n_v
        if len(q) != n_v or len(tau) != n_v:
            raise SensingError("a sample of another robot", expected=f"{n_v} joints", got=f"{len(q)} and {len(tau)}")
        stamped = np.empty(1 + 2 * n_v)
        stamped[0], stamped[1 : 1 + n_v], stamped[1 + n_v :] = t, q, tau
        state, out = memory.copy(), (np.empty((kernel.OUT, n_v)), np.empty((7, 6)))
        code = kernel.take_one(self._machine, stamped, state, out)
        if code == stamp.NO_BODY:
            raise self.observer.no_body()
        if code > stamp.RESTARTED:
            return state, None, code
        tau, variance, q, dq, raw, lag = out[0]
        settled = kernel.behind_start(self._machine[3][0][1] * state[stamp.AGE]) < kernel.SETTLED
        return state, Sensed(tau, variance, q, dq, raw, out[1][0], out[1][1:], bool(settled), lag), code

    def along(self, log: Recording | Log) -> SensedLog:
        """Return what is sensed along a log; causal: a sample knows none after it.

        Samples that are late, repeated or not finite are counted and left out; behind a gap the sensor starts again.

        Raises
        ------
        SensingError
            when the log is of another robot or rate, or has no torque; or the mass matrix is needed and of no body.
        """
        codes, results = np.empty(log.n_t, dtype=np.intp), _results(log.n_t, self.n_v)
        windows = self._windows(log, range(0, log.n_t, _CHUNK), results, codes)
        filled = max((taken for _, taken in windows), default=0)
        return self._sensed(log, codes, tuple(result[:filled] for result in results))

    def warmth(self, memory: FloatArray) -> SensedWarmth:
        """Return the warmth of the joints behind a sample; nan by an observer that follows none."""
        rows = kernel.split(memory.copy(), self.n_v, self.model.bristles.size)[2]
        return SensedWarmth(rows[WARMTH].copy(), rows[VARIANCE].copy())

    def warmth_along(self, log: Recording | Log, *, points: int = 1000) -> tuple[FloatArray, SensedWarmth]:
        """Return times (n,) and the warmth of the joints there, (n, n_v), at about so many places along a log.

        Raises
        ------
        SensingError
            as `along`, and when the observer follows no warmth.
        """
        self.observer.check_follows_warmth()
        codes, results = np.empty(log.n_t, dtype=np.intp), _results(log.n_t, self.n_v)
        starts = range(0, log.n_t, max(1, min(_CHUNK, log.n_t // points)))
        told = [self.warmth(state) for state, _ in self._windows(log, starts, results, codes)]
        last = np.array([*starts[1:], log.n_t]) - 1
        kept = np.flatnonzero(codes[last] <= stamp.RESTARTED)
        theta, variance = (np.stack(part)[kept] for part in zip(*told, strict=True))
        return np.array(log.t[last[kept]]), SensedWarmth(theta, variance)

    def _windows(
        self, log: Recording | Log, starts: range, results: tuple[Any, ...], codes: IntArray
    ) -> Iterator[tuple[FloatArray, int]]:
        """Fill results and codes window by window; yield the memory behind each, and how many samples were taken."""
        torque = _torque(self.model, log)
        check_rate(log.t, self.rate, where=log.name)
        state, filled = self.start().copy(), 0
        for first in starts:
            window = slice(first, first + starts.step)
            samples = tuple(np.array(part[window], dtype=np.float64, order="C") for part in (log.t, log.q, torque))
            rest = tuple(result[filled:] for result in results)
            count = kernel.take_all(self._machine, samples, state, rest, codes[window])
            if count < 0:
                raise self.observer.no_body()
            filled += count
            yield state, filled

    def _sensed(self, log: Recording | Log, codes: IntArray, results: tuple[Any, ...]) -> SensedLog:
        solver = self.solver
        rows = np.flatnonzero(codes <= stamp.RESTARTED)
        if not rows.size:
            raise SensingError("no sample of the log can be used", where=log.name, got=f"{log.n_t} samples")
        frozen = 0 if log.tau is None else frozen_along(log.q[rows], log.tau[rows])
        names = ("q", "dq", "tau", "tau_std", "raw", "wrench", "wrench_std", "settled", "lag", "force_shared")
        joints = self.model.robot.joints
        return SensedLog(
            name=log.name, joint_names=tuple(joint.name for joint in joints),
            prismatic=tuple(joint.name for joint in joints if joint.effort_unit == "N"),
            frame=str(solver.frame), axes=solver.axes, step=self.step, t=np.array(log.t[rows]), rows=rows,
            counts=counted(codes)._replace(frozen=frozen), believed=int(np.count_nonzero(results[-1])),
            **dict(zip(names, results[:-1], strict=True)),
        )  # fmt: skip


def force_sensor(
    estimate: Estimate,
    *,
    rate: float,
    observer: Observer | None = None,
    cutoff: float | None = None,
    wrench: WrenchSolver | None = None,
    stamps: Stamps = "auto",
) -> ForceSensor:
    """Return the force sensor that an estimate makes of a robot.

    Parameters
    ----------
    rate : of the samples [Hz]
    observer, cutoff, wrench, stamps : as of `ForceSensor`

    Raises
    ------
    ModelError
        when a term of the model has no value at a single state.
    SensingError
        settings that mean nothing.
    """
    return ForceSensor(
        model=sensed_model(estimate), rate=rate, observer=observer or MomentumObserver(), cutoff=cutoff,
        delay=estimate.processing.delay, wrench=wrench, stamps=stamps,
    )  # fmt: skip


def counted(codes: IntArray) -> SampleCounts:
    """Return how many samples were taken and why others were not, by their codes in order."""
    counts = np.bincount(codes, minlength=stamp.NO_BODY)
    taken = int(counts[stamp.TAKEN] + counts[stamp.RESTARTED])
    return SampleCounts(
        taken=taken, late=int(counts[stamp.LATE]), repeated=int(counts[stamp.REPEATED]),
        not_finite=int(counts[stamp.NOT_FINITE]), restarts=max(0, int(counts[stamp.RESTARTED]) - 1),
    )  # fmt: skip


def _torque(model: SensedModel, log: Recording | Log) -> FloatArray:
    """Return the torque of a log, after refusing one of another robot."""
    names = log.joint_names
    if log.tau is None:
        raise SensingError(
            "no torque in the log", where=log.name, remedy="name its columns in the map's [torque] section"
        )
    if len(names) != model.n_v:
        raise SensingError(
            "the log is of another robot", where=log.name, expected=f"{model.n_v} joints", got=len(names)
        )
    check_joint_order(model.robot, names, where=log.name)
    unnamed = list(names) == [f"joint_{index + 1}" for index in range(len(names))]
    if not unnamed and set(names) != set(model.robot.joint_names):
        expected = ", ".join(model.robot.joint_names)
        raise SensingError("the log is of another robot", where=log.name, expected=expected, got=", ".join(names))
    return log.tau


def _results(n_t: int, n_v: int) -> tuple[Any, ...]:
    flags = (np.empty(n_t, dtype=np.bool_) for _ in range(2))
    columns = (np.empty((n_t, n)) for n in (*[n_v] * 5, 6, 6, n_v, 3))
    *before, lag, shared = columns
    return (*before, next(flags), lag, shared, next(flags))
