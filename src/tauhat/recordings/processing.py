"""How a recording becomes motion: uniform clock, low-passed position with its derivatives, torque beside it.

The way of the samples, chunk by chunk with the same result whatever the chunks:
    recording -> uniform clock -> q, dq, ddq from one zero-phase kernel, tau as measured -> (regressor columns) ->
    the parallel filter: the same zero-phase low-pass and decimation on every column and on the torque.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.errors import RecordingError
from tauhat.recordings.filters import FirFilter, differentiators, low_pass, with_context
from tauhat.recordings.recording import Recording

VelocitySource: TypeAlias = Literal["position", "velocity"]

CHUNK = 4096
ROWS_PER_CUTOFF = 4.0  # kept rows per second and hertz of cut-off: twice the band's own rate
_NOISE_SPEEDS = 5.0
_LEAST_SPAN = 20.0  # a joint moves when its range is that many encoder counts, or deviations of its noise
STANDSTILL = 0.02  # part of the largest speed below which a joint counts as standing
GAP_STEPS = 20.0  # a step of the clock longer than this many usual ones is a gap that cannot be bridged
_LOST = 1.5  # a step of the clock longer than this many has lost samples in it
_RUN_UP = 0.25  # of the gap: how far away, at least, are the samples that tell the slope at its edges


@dataclass(frozen=True, slots=True, kw_only=True)
class Processing:
    """Settings that turn a recording into rows of a least-squares problem; kept in the estimate.

    cutoff : low-pass of torque and of every regressor column [Hz]
    motion_cutoff : low-pass of the position before it is differentiated [Hz]
    velocity : differentiate from the measured "position", or take the measured "velocity" and differentiate once
    delay : how much later than the torque the position was logged [s]; motion is read that much further on
    """

    cutoff: float
    motion_cutoff: float
    velocity: VelocitySource = "position"
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name in ("cutoff", "motion_cutoff"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise RecordingError(f"{name} must be a positive frequency", got=f"{value} Hz")
        if self.velocity not in {"position", "velocity"}:
            raise RecordingError("unknown source of velocity", expected="position or velocity", got=self.velocity)
        if not np.isfinite(self.delay):
            raise RecordingError("the delay must be a number of seconds", got=self.delay)

    def decimation(self, rate: float) -> int:
        """Return every how many samples a row is kept at this rate [Hz]."""
        return max(1, int(rate / (ROWS_PER_CUTOFF * self.cutoff)))

    def parallel_filter(self, rate: float) -> FirFilter:
        """Return the filter that torque and regressor columns share at this rate [Hz]."""
        return low_pass(self.cutoff, rate, decimation=self.decimation(rate))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self)


class Stretch(NamedTuple):
    """Consecutive samples on a uniform clock, joints first: `(n_v, n)` each; `t` (n,) [s]; temperature may be empty."""

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    temperature: FloatArray = np.zeros((0, 0))


def clock_step(recording: Recording) -> float:
    """Return the step of the uniform clock: the tenth percentile of the recording's steps [s].

    A controller that loses samples leaves steps of two or three periods between those of one: mean and median would
    then be coarser than the log is where it is whole. Never less than a quarter of the mean step: bunched time stamps
    say nothing about the clock.
    """
    steps = np.diff(recording.t)
    return float(max(np.quantile(steps, 0.1), 0.25 * steps.mean()))


class Clock(NamedTuple):
    """A uniform clock: first time and step [s], number of ticks."""

    start: float
    step: float
    n_t: int

    def ticks(self, begin: int, end: int) -> FloatArray:
        """Return the times of ticks `begin` to `end`, end excluded."""
        return np.asarray(self.start + self.step * np.arange(begin, end), dtype=np.float64)


def uniform_clock(recording: Recording, delay: float = 0.0) -> Clock:
    """Return the clock on which both the torque at t and the position at t + `delay` lie inside the recording."""
    step = clock_step(recording)
    start = float(recording.t[0]) + max(0.0, -delay)
    stop = float(recording.t[-1]) - max(0.0, delay)
    return Clock(start, step, int(np.floor((stop - start) / step + 1e-9)) + 1)


def moving_window(recording: Recording) -> tuple[float, float]:
    """Return the times between which the robot moves [s]: standstill at both ends left out.

    A joint moves when its speed over 50 ms exceeds 2 % of its largest in the recording and five times what its
    encoder's noise alone would make. A recording without motion is kept whole.
    """
    q = unwrapped(recording.q)
    span = max(1, round(0.05 / clock_step(recording)))
    if recording.n_t <= 2 * span:
        return float(recording.t[0]), float(recording.t[-1])
    speed = np.abs(q[span:] - q[:-span]) / (recording.t[span:] - recording.t[:-span])[:, None]
    noise = white_noise(q) * np.sqrt(2.0) / (span * clock_step(recording))
    threshold = np.maximum(STANDSTILL * speed.max(axis=0), _NOISE_SPEEDS * noise)
    moving = np.flatnonzero((speed > threshold)[:, moving_joints(recording)].any(axis=1))
    if not moving.size:
        return float(recording.t[0]), float(recording.t[-1])
    return float(recording.t[moving[0]]), float(recording.t[min(moving[-1] + span, recording.n_t - 1)])


def moving_joints(recording: Recording) -> NDArray[np.bool_]:
    """Return which joints move at all in the recording, and do not only flicker by a few encoder counts, (n_v,)."""
    q = unwrapped(recording.q)
    jumps = np.abs(np.diff(q, axis=0))
    count = np.min(jumps, axis=0, where=jumps > 0, initial=np.inf)
    grain = np.maximum(white_noise(q), np.where(np.isfinite(count), count, 0.0))
    return np.asarray(np.ptp(q, axis=0) > _LEAST_SPAN * grain)


def white_noise(signal: FloatArray) -> FloatArray:
    """Return the deviation of the white part of each column of `signal` (n_t, n), by its fourth differences.

    White noise of deviation s gives fourth differences of deviation `sqrt(70) s`; the median is robust against motion.
    """
    return np.asarray(np.median(np.abs(np.diff(signal, 4, axis=0)), axis=0) / (0.6745 * np.sqrt(70.0)))


def unwrapped(q: FloatArray) -> FloatArray:
    """Return the positions without jumps of a whole turn: no joint moves half a turn between two samples."""
    if np.abs(np.diff(q, axis=0)).max(initial=0.0) <= np.pi:
        return q
    return np.unwrap(q, axis=0)


def stretches(recording: Recording, processing: Processing, *, chunk: int = CHUNK) -> Iterator[Stretch]:
    """Yield the recording's motion on a uniform clock, consecutive and without overlap; torque is not filtered.

    Raises
    ------
    RecordingError
        when a channel is missing or a gap of the clock is too long to bridge.
    """
    _require(recording, processing)
    clock = uniform_clock(recording, processing.delay)
    filters = differentiators(processing.motion_cutoff, 1.0 / clock.step)
    half = filters[0].half
    done = 0
    for window in with_context(_uniform_chunks(recording, processing, clock, chunk), half):
        n = window.shape[1] - 2 * half
        stretch = _differentiated(window, clock.ticks(done, done + n), filters, processing)
        yield stretch._replace(temperature=_temperature(recording, stretch.t + processing.delay))
        done += n


def _temperature(recording: Recording, t: FloatArray) -> FloatArray:
    """Return the temperatures at the times t, (n_v, n); (0, n) where none is measured."""
    if recording.temperature is None:
        return np.zeros((0, t.size))
    return interpolated(recording.t, recording.temperature, t)


def _require(recording: Recording, processing: Processing) -> None:
    if recording.tau is None:
        raise RecordingError(
            "no torque in the log",
            where=recording.name,
            got=", ".join(recording.channels()),
            remedy="name the torque or current columns in the map's [torque] section",
        )
    if processing.velocity == "velocity" and recording.dq is None:
        raise RecordingError(
            "the model was fitted on measured velocity and the log has none",
            where=recording.name,
            remedy="name the velocity columns in the map's [velocity] section",
        )
    steps = np.diff(recording.t)
    longest = int(steps.argmax())
    if steps[longest] > GAP_STEPS * np.median(steps) and steps[longest] > 0.1:
        raise RecordingError(
            "the log has a gap in time that cannot be bridged",
            where=f"{recording.name}, row {longest + 1}",
            got=f"{steps[longest]:.3g} s",
            remedy="cut the log there with --rows and give both parts",
        )


def _uniform_chunks(recording: Recording, processing: Processing, clock: Clock, chunk: int) -> Iterator[FloatArray]:
    """Yield [position or velocity source, torque] stacked by rows on the uniform clock."""
    motion = [unwrapped(recording.q)]
    if processing.velocity == "velocity" and recording.dq is not None:
        motion.append(recording.dq)
    moved = np.concatenate(motion, axis=1)
    torque = recording.tau if recording.tau is not None else np.zeros_like(recording.q)
    times, moved = bridged(recording.t, moved, step=clock.step)
    _, torque = bridged(recording.t, torque, step=clock.step)
    for start in range(0, clock.n_t, chunk):
        t = clock.ticks(start, min(start + chunk, clock.n_t))
        yield np.concatenate([interpolated(times, moved, t + processing.delay), interpolated(times, torque, t)])


def bridged(t: FloatArray, signals: FloatArray, *, step: float) -> tuple[FloatArray, FloatArray]:
    """Return times and signals (n_t, n) with the samples that a clock of this step has lost put back, on cubics.

    A straight line across a gap has a kink at both edges, and its second derivative is a burst: gaps of 90 ms made the
    residual of a 20 Hz model twenty times larger. Slopes at the edges are those of parabolas through the edges and a
    sample a quarter of the gap away, so that the noise of the samples is not magnified.
    """
    steps = np.diff(t)
    gap = np.flatnonzero(steps > _LOST * step)
    if not gap.size:
        return t, signals
    left, right, width = signals[gap], signals[gap + 1], steps[gap][:, None]
    before = np.maximum(np.searchsorted(t, t[gap] - _RUN_UP * steps[gap], side="right") - 1, 0)
    after = np.minimum(np.searchsorted(t, t[gap + 1] + _RUN_UP * steps[gap]), t.size - 1)
    rise = right - left
    bend_left = _bend(rise, width, left - signals[before], (t[gap] - t[before])[:, None])
    bend_right = _bend(rise, width, signals[after] - right, (t[after] - t[gap + 1])[:, None])
    lost = np.round(steps[gap] / step).astype(np.intp) - 1
    place = np.repeat(np.arange(gap.size), lost)
    order = np.arange(place.size) - np.repeat(np.cumsum(lost) - lost, lost) + 1
    u = (order / (lost[place] + 1.0))[:, None]
    cubic = left[place] + u * rise[place] + u * (1 - u) * ((1 - u) * bend_left[place] - u * bend_right[place])
    where = gap[place] + 1
    return np.insert(t, where, t[gap[place]] + u[:, 0] * steps[gap[place]]), np.insert(signals, where, cubic, axis=0)


def _bend(rise: FloatArray, width: FloatArray, beside: FloatArray, run_up: FloatArray) -> FloatArray:
    """Return by how much more a signal would rise over a gap at the slope of its edge; nothing where no run-up is."""
    far = np.where(run_up > 0, run_up, 1.0)
    slope = (beside / far * width + rise / width * run_up) / (width + run_up)
    return np.asarray(np.where(run_up > 0, slope * width - rise, 0.0))


def interpolated(t: FloatArray, signals: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return `signals` (n_t, n) at the times `wanted`, linearly between samples, as (n, n_wanted)."""
    right = np.clip(np.searchsorted(t, wanted, side="left"), 1, t.size - 1)
    weight = np.clip((wanted - t[right - 1]) / (t[right] - t[right - 1]), 0.0, 1.0)
    mixed = signals[right - 1] + weight[:, None] * (signals[right] - signals[right - 1])
    return np.ascontiguousarray(mixed.T)


def _differentiated(
    window: FloatArray, t: FloatArray, filters: tuple[FirFilter, FirFilter, FirFilter], processing: Processing
) -> Stretch:
    smooth, first, second = filters
    half = smooth.half
    if processing.velocity == "velocity":
        n_v = window.shape[0] // 3
        dq, ddq = smooth.apply(window[n_v : 2 * n_v]), first.apply(window[n_v : 2 * n_v])
    else:
        n_v = window.shape[0] // 2
        dq, ddq = first.apply(window[:n_v]), second.apply(window[:n_v])
    tau = window[-n_v:, half : window.shape[1] - half]
    return Stretch(t, smooth.apply(window[:n_v]), dq, ddq, tau)
