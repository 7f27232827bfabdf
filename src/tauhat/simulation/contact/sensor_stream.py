"""The errors of `SensorErrors` sample after sample: nothing is known of the future.

They are those of `sensors.measure`, with what a stream has to do otherwise. Jitter takes samples early or late about
an instant that lies its half width in the past, so that none is of the future. The relative noise of the torque is a
part of the RMS torque so far. A lost row shows the last one again, and says so. Velocities are not shown.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import SimulationError
from tauhat.simulation.sensors.clock import HALF_WIDTH, refuse_overtaking
from tauhat.simulation.sensors.joint_values import per_joint
from tauhat.simulation.sensors.sensor_errors import SensorErrors

LINK, MOTOR, TORQUE = range(3)  # rows of what is remembered of a control period
_HOUR = 3600.0  # [s]
_BLOCK = 256  # samples whose random numbers are drawn together


class ShownSample(NamedTuple):
    """A row of the controller's log.

    t : its time stamp [s]
    q, tau : (n_v,) [rad or m, Nm or N]
    fresh : whether the row came; otherwise the last one is shown again
    """

    t: float
    q: FloatArray
    tau: FloatArray
    fresh: bool


class Sampling(NamedTuple):
    """How the truth comes to the sensors.

    sample_period, control_period : [s]
    side : LINK or MOTOR, where the encoders are
    behind : how much older than its row the torque is that is remembered [s]
    """

    sample_period: float
    control_period: float
    side: int = LINK
    behind: float = 0.0


class Recall:
    """The last control periods of the truth: what was at any time, up to a longest one ago.

    period : of control [s]
    longest : [s]
    first : (3, n_v) what was before the first period: positions of links and motors, and torque
    """

    __slots__ = ("_period", "_rows")

    def __init__(self, period: float, longest: float, first: FloatArray) -> None:
        self._period = period
        self._rows = np.repeat(first[None], int(np.ceil(longest / period - 1e-9)) + 2, axis=0)

    def note(self, rows: FloatArray) -> None:
        """Append what was at the end of some periods, (n, 3, n_v)."""
        n = min(len(rows), len(self._rows))
        self._rows[:-n] = self._rows[n:]
        self._rows[-n:] = rows[-n:]

    def at(self, ago: float, row: int) -> FloatArray:
        """Return a row (n_v,) as it was some time [s] before the last period's end, on straight lines."""
        whole = ago / self._period
        later = int(whole + 1e-9)
        share = max(whole - later, 0.0)
        newest = len(self._rows) - 1 - later
        value: FloatArray = self._rows[newest, row]
        if share < 1e-9:
            return value
        return np.asarray((1.0 - share) * value + share * self._rows[newest - 1, row])


class SensorStream:
    """The sensors of one robot, read once a sample period; offsets, factors and phases not drawn yet are drawn.

    errors : of the sensors
    sampling : when and where they look
    first : (3, n_v) the truth at rest before the start

    Raises
    ------
    SimulationError
        when an error has not one value a joint, torque is asked for from the future, or jitter lets samples overtake.
    """

    def __init__(
        self, errors: SensorErrors, *, sampling: Sampling, first: FloatArray, rng: np.random.Generator
    ) -> None:
        n_v = first.shape[1]
        _refuse(errors, sampling.sample_period)
        self._errors = errors.drawn(n_v, rng)
        self._rng = rng
        self._offset = per_joint("torque_offset", self._errors.torque_offset, n_v)
        self._factor = per_joint("torque_factor", self._errors.torque_factor, n_v)
        self._step = per_joint("encoder_step", errors.encoder_step, n_v)
        self._noise = per_joint("torque_noise", errors.torque_noise, n_v)
        self._relative = per_joint("relative_torque_noise", errors.relative_torque_noise, n_v)
        self._drift = per_joint("torque_drift", errors.torque_drift, n_v)
        self._walk = per_joint("torque_walk", errors.torque_walk, n_v)
        self._ripples = _ripples_of(self._errors, n_v)
        self._latest = HALF_WIDTH * errors.sampling_jitter
        self._side, self._behind = sampling.side, sampling.behind
        longest = 2.0 * self._latest + max(errors.torque_delay, 0.0)
        self._recall = Recall(sampling.control_period, longest, first)
        self._walked, self._before = np.zeros(n_v), 0.0
        self._squares, self._count = np.zeros(n_v), 0
        self._last: ShownSample | None = None
        self._losing = False
        self._drawn = np.empty((0, 2, n_v))

    def note(self, rows: FloatArray) -> None:
        """Remember the truth at the end of some control periods, (n, 3, n_v)."""
        self._recall.note(rows)

    def show(self, t: float) -> ShownSample:
        """Return what the log shows at the clock's tick t, which never falls [s]."""
        errors = self._errors
        noise, walk = self._random()
        ago = self._latest * (1.0 + self._uniform()) if self._latest else 0.0
        tau = self._torque(t - ago, ago, noise, walk)
        q = _counted(self._recall.at(ago, self._side), self._step)
        stamp = t if errors.stamps == "ticks" else t - ago
        if errors.stamp_jitter:
            stamp += HALF_WIDTH * errors.stamp_jitter * self._uniform()
        if self._lost() and self._last is not None:
            return self._last._replace(fresh=False)
        self._last = ShownSample(stamp, read_only(q), read_only(tau), fresh=True)
        return self._last

    def _torque(self, instant: float, ago: float, noise: FloatArray, walk: FloatArray) -> FloatArray:
        """Return the torque shown at an instant some time ago, (n_v,)."""
        read = max(ago + self._errors.torque_delay - self._behind, 0.0)
        true = self._recall.at(read, TORQUE)
        shown = self._factor * true + self._offset
        for side, amplitude, order, phase in self._ripples:
            shown += amplitude * np.sin(order * self._recall.at(ago + self._errors.torque_delay, side) + phase)
        hours = max(instant - self._before, 0.0) / _HOUR
        self._before = max(instant, self._before)
        self._walked += self._walk * np.sqrt(hours) * walk
        shown += self._drift * (instant / _HOUR) + self._walked
        return np.asarray(shown + self._deviation(true) * noise)

    def _deviation(self, true: FloatArray) -> FloatArray:
        if not self._relative.any():
            return self._noise
        self._squares += true**2
        self._count += 1
        return np.hypot(self._noise, self._relative * np.sqrt(self._squares / self._count))

    def _random(self) -> FloatArray:
        """Return unit noise for the torque and its walk, (2, n_v); drawn in blocks, which costs a tenth."""
        if not len(self._drawn):
            self._drawn = self._rng.standard_normal((_BLOCK, 2, self._noise.size))
        row, self._drawn = self._drawn[0], self._drawn[1:]
        return np.asarray(row)

    def _uniform(self) -> float:
        return float(self._rng.uniform(-1.0, 1.0))

    def _lost(self) -> bool:
        """Return whether this row is lost: the chain of two states that `sensors.clock` draws stretches of."""
        share, run = self._errors.lost_samples, self._errors.lost_run
        if not share:
            return False
        turn = 1.0 / run if self._losing else min(1.0, share / (run * (1.0 - share)))
        if self._rng.uniform() < turn:
            self._losing = not self._losing
        return self._losing


def _ripples_of(errors: SensorErrors, n_v: int) -> list[tuple[int, FloatArray, FloatArray, FloatArray]]:
    """Return side, amplitude, order by the joint's angle, and phase of each ripple."""
    found = []
    for ripple in errors.ripples:
        values = {name: per_joint(f"ripple.{name}", getattr(ripple, name), n_v) for name in ("amplitude", "order")}
        on_motor = ripple.turns == "motor"
        ratio = per_joint("ripple.gear_ratio", ripple.gear_ratio, n_v) if on_motor else np.ones(n_v)
        phase = per_joint("ripple.phase", 0.0 if ripple.phase is None else ripple.phase, n_v)
        found.append((MOTOR if on_motor else LINK, values["amplitude"], values["order"] * ratio, phase))
    return found


def _counted(values: FloatArray, step: FloatArray) -> FloatArray:
    """Return values (n_v,) rounded to multiples of step (n_v,); a step of zero leaves them as they are."""
    coarse = step > 0.0
    whole = np.where(coarse, step, 1.0)
    return np.where(coarse, whole * np.rint(values / whole), values)


def _refuse(errors: SensorErrors, sample_period: float) -> None:
    if errors.torque_delay < 0.0:
        raise SimulationError(
            "a stream cannot show torque of the future", expected="torque_delay >= 0", got=errors.torque_delay
        )
    refuse_overtaking(errors, sample_period)
