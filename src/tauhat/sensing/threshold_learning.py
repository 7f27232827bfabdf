"""What free motion shows without contact, condition by condition, and the thresholds that follow from it.

Per joint and condition (settling after a motion, resting, steps of the joint's own speed) the size of the residual in
free motion is a root mean square, `scale`. A threshold is `level x scale`, with one level per kind of condition, learnt
on the largest residual of each block of time:
    a rate of r alarms an hour allows  p = r block / 3600 alarms a block, shared by the three kinds
    level = the k-th smallest of the n maxima,  k = ceil((n + 1)(1 - p / 3))
which exceeds the maximum of a new block with probability p / 3 at most, whatever the distribution, if blocks are
exchangeable (split conformal prediction). Where k > n the free motion is too short for the rate: the level is then the
largest of all times a margin, which promises nothing but what it is.

Source: Vovk, Gammerman, Shafer, "Algorithmic learning in a random world", 2005.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.errors import SensingError, TauhatWarning
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording
from tauhat.sensing.contact_kernel import MOVING, RESTING, SETTLING
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import CONDITIONS, ContactThresholds, TakenOff
from tauhat.sensing.free_logs import sensed_free
from tauhat.sensing.judged_rows import free_rows
from tauhat.sensing.learnt_error import LearntError, error_of
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.zero import AirPass

_STEPS = (0.3, 1.0)  # of each joint's top speed in free motion, where steps of its scale end
_FEWEST = 0.5  # seconds of a condition that give a scale of its own
_HOUR = 3600.0


def learn_contact_thresholds(
    sensor: ForceSensor,
    free: Sequence[Recording | Log],
    *,
    rate: float = 1.0,
    rules: ContactRules | None = None,
    air: AirPass | None = None,
    error: LearntError | None = None,
) -> ContactThresholds:
    """Return thresholds learnt on recordings without contact; the model should not have been fitted on them.

    Parameters
    ----------
    free : recordings in which nothing touches the arm, at the speeds of the task and with its pauses; of any sample
        rate that the sensor's filter allows
    rate : of false alarms [1/h]
    rules : hysteresis, zero, blocks; as stated in `ContactRules` by default
    air : pass in air that is taken off first, as it is off the logs that are judged
    error : in whose standard errors limits count, as `learnt_from_free_motion` has it (`error_of`); the sensor's own by
        default. The floor of the limits stays that of the sensor given here: an arm at rest is no worse known for an
        error that was learnt in motion

    Raises
    ------
    SensingError
        without free motion, or when the recordings do not fit the sensor.

    Warns
    -----
    TauhatWarning
        when the recordings are too short to promise the rate, or differ so much that one alarms on the others' limits.
    """
    own, followed = error_of(sensor), rules or ContactRules()
    counted = own if error is None else error
    sensed = sensed_free(counted.on(sensor), free, air=air)
    floor = followed.least * own.sizes / counted.sizes
    found = thresholds_of(sensed, slow=sensor.model.slow, rate=rate, rules=followed, floor=floor)
    taken_off: TakenOff = "nothing" if air is None else "air"
    return replace(found, error=counted, taken_off=taken_off, estimate=sensor.model.estimate)


def thresholds_of(
    free: Sequence[SensedLog],
    *,
    slow: FloatArray,
    rate: float = 1.0,
    rules: ContactRules | None = None,
    floor: FloatArray | None = None,
) -> ContactThresholds:
    """Return the same from what was already sensed in free motion.

    Parameters
    ----------
    slow : (n_v,) speed below which a joint stands [rad/s or m/s]
    floor : (n_v,) no limit is below it, in standard errors; `rules.least` by default
    """
    if not free or not any(log.settled.any() for log in free):
        raise SensingError(
            "no free motion to learn thresholds from", remedy="give a log in which nothing touches the arm"
        )
    if not 0.0 < rate < np.inf:
        raise SensingError("rate of false alarms", expected="above zero", got=f"{rate} an hour")
    followed = rules or ContactRules()
    tops = np.max([np.abs(log.dq[log.settled]).max(axis=0) for log in free if log.settled.any()], axis=0)
    edges = np.stack([slow, *(np.maximum(part * tops, slow * (1.0 + part)) for part in _STEPS)])
    judged = [_free_log(log, edges, followed) for log in free]
    scale = _scales(judged, 2 + len(edges))
    maxima = [np.concatenate([log.maxima(scale, kind) for log in judged]) for kind in range(len(CONDITIONS))]
    levels, promised = _levels(maxima, rate * followed.block / _HOUR, followed.margin)
    of_rows = np.concatenate([levels[[SETTLING, RESTING]], np.full(len(edges), levels[MOVING])])
    least = np.full(len(free[0].joint_names), followed.least) if floor is None else floor
    found = ContactThresholds(
        joint_names=free[0].joint_names, edges=edges, limits=np.maximum(of_rows[:, None] * scale, least),
        rules=followed, rate=rate, promised=promised * _HOUR / followed.block,
        seconds=np.sum([log.seconds for log in judged], axis=0), spread=_spread(judged, scale),
    )  # fmt: skip
    _warn(found)
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _FreeLog:
    """A free log: zeroed residual in standard errors, and to what each number belongs.

    x : (n_t, n_v)
    kind : (n_t,) place in CONDITIONS
    row : (n_t, n_v) of the scale
    block : (n_t,) number of the block of time
    step : between samples [s]
    """

    x: FloatArray
    kind: IntArray
    row: IntArray
    block: IntArray
    step: float

    @property
    def seconds(self) -> FloatArray:
        """Return how long each kind of condition lasted, (3,) [s]."""
        return np.asarray(np.bincount(self.kind, minlength=len(CONDITIONS)) * self.step)

    def largest(self, scale: FloatArray) -> FloatArray:
        """Return the largest residual over joints, in parts of the scale, (n_t,)."""
        return np.asarray((self.x / np.take_along_axis(scale, self.row, axis=0)).max(axis=1, initial=0.0))

    def maxima(self, scale: FloatArray, kind: int) -> FloatArray:
        """Return the maximum of each block over its samples of one kind; blocks without any are left out."""
        chosen = self.kind == kind
        blocks, place = np.unique(self.block[chosen], return_inverse=True)
        found = np.zeros(blocks.size)
        np.maximum.at(found, place, self.largest(scale)[chosen])
        return found


def _free_log(log: SensedLog, edges: FloatArray, rules: ContactRules) -> _FreeLog:
    kinds, x, _ = free_rows(log, edges, rules)
    told = log.settled & (log.step * np.arange(1, log.n_t + 1) >= rules.quiet)
    kind, speed = kinds[told], np.abs(log.dq[told])
    steps = np.stack([np.searchsorted(edges[:-1, j], speed[:, j], side="right") for j in range(speed.shape[1])], axis=1)
    return _FreeLog(
        x=x[told], kind=kind, step=log.step,
        row=np.where(kind[:, None] == MOVING, 2 + steps, kind[:, None]),
        block=((log.t[told] - log.t[0]) // rules.block).astype(np.intp),
    )  # fmt: skip


def _scales(free: Sequence[_FreeLog], n_rows: int) -> FloatArray:
    """Return the root mean square by condition and joint; the joint's largest where a condition hardly occurred."""
    x, row = (np.concatenate([getattr(log, name) for log in free]) for name in ("x", "row"))
    scale = np.full((n_rows, x.shape[1]), np.nan)
    step = np.repeat([log.step for log in free], [len(log.x) for log in free])[:, None]
    for k in range(n_rows):
        there = step * (row == k)
        seconds = there.sum(axis=0)
        enough = seconds >= _FEWEST
        scale[k, enough] = np.sqrt((np.square(x) * there).sum(axis=0)[enough] / seconds[enough])
    if np.isnan(scale).all(axis=0).any():
        raise SensingError(
            "free motion is too short for any threshold", expected=f"{_FEWEST} s of one condition or more"
        )
    scale = np.where(np.isnan(scale), np.nanmax(scale, axis=0), scale)
    return np.asarray(np.maximum(scale, np.finfo(float).tiny))


def _levels(maxima: Sequence[FloatArray], p: float, margin: float) -> tuple[FloatArray, float]:
    """Return the level of each kind, and the alarms a block that are promised."""
    share, levels, promised = p / len(maxima), np.zeros(len(maxima)), 0.0
    for kind, values in enumerate(maxima):
        if not values.size:
            continue
        rank = int(np.ceil((values.size + 1) * (1.0 - share)))
        enough = rank <= values.size
        levels[kind] = np.sort(values)[rank - 1] if enough else margin * values.max()
        promised += share if enough else 1.0 / (values.size + 1)
    return np.where(levels > 0.0, levels, levels.max()), max(promised, p)


def _spread(free: Sequence[_FreeLog], scale: FloatArray) -> float:
    """Return how far the largest residual of one recording is above that of all others."""
    tops = np.array([[log.maxima(scale, kind).max(initial=0.0) for log in free] for kind in range(len(CONDITIONS))])
    if len(free) == 1:
        return np.nan
    others = np.stack([np.delete(tops, k, axis=1).max(axis=1) for k in range(len(free))], axis=1)
    ratios = tops[others > 0.0] / others[others > 0.0]
    return float(ratios.max(initial=0.0))


def _warn(found: ContactThresholds) -> None:
    if not found.keeps_rate:
        warnings.warn(
            f"{found.seconds.sum():.0f} s of free motion can promise {found.promised:.0f} false alarms an hour, "
            f"asked for: {found.rate:g}; thresholds are {found.rules.margin:g} x the largest residual; "
            "give more recordings without contact",
            TauhatWarning,
            stacklevel=3,
        )
    if found.spread > found.rules.margin:
        warnings.warn(
            f"one recording without contact shows {found.spread:.2f} x the residual of all others: expect false alarms "
            "in motions that are like none of them",
            TauhatWarning,
            stacklevel=3,
        )
