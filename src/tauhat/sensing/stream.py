"""Stamped samples one by one, as they come from a robot: taken, or counted and skipped.

What becomes of a sample:
    a number that is none, or beyond 1e9          skipped, `not_finite`
    not after the last one                        skipped, `late` or `repeated`; 50 in a row: the clock was set back
    within five periods (or 20 ms) of the last    taken; lost samples between are put back on straight lines
    later than that                               taken, and everything starts again with wide error bars
    the same to the bit as those before it        taken; counted as `frozen` from ten in a row on
Stamps are believed or counted as whole periods, as positions tell (see `stamp_kernel`). The rate is judged over 100
samples at a time: the usual step has to be the sensor's within 5 %, or the mean one where there are no gaps, or, where
many samples are lost, the one of which the steps are whole multiples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.sensing import stamp_kernel as stamp
from tauhat.sensing.frozen import IN_A_ROW, newly_frozen
from tauhat.sensing.sample_rate import check_rate
from tauhat.sensing.sensed_log import SampleCounts
from tauhat.sensing.sensor import ForceSensor, Sensed

JUDGED = 100  # samples over which the rate is measured


class StreamMemory(NamedTuple):
    """What a stream remembers.

    sensor : the sensor's memory
    times : since the rate was judged [s]
    counts : what became of samples
    last : position and torque of the last sample taken, as bytes
    alike : samples in a row that were like the one before them
    """

    sensor: FloatArray
    times: tuple[float, ...]
    counts: SampleCounts
    last: bytes = b""
    alike: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorStream:
    """A sensor that reads stamped samples.

    sensor : model, observer, rate
    name : what messages call the stream
    judged : samples over which the rate is measured; None where it is known to be the sensor's
    """

    sensor: ForceSensor
    name: str = "stream"
    judged: int | None = JUDGED

    def start(self) -> StreamMemory:
        """Return the memory before the first sample."""
        return StreamMemory(self.sensor.start(), (), SampleCounts())

    def take(
        self, memory: StreamMemory, t: float, q: FloatArray, tau: FloatArray
    ) -> tuple[StreamMemory, Sensed | None]:
        """Return the memory behind a sample, and what it told, None where it was skipped.

        Parameters
        ----------
        t : time stamp [s]
        q, tau : (n_v,) position and motor torque, joint side [rad or m, Nm or N]

        Raises
        ------
        SensingError
            when samples come at another rate than the sensor's, or are of another number of joints.
        """
        after, sensed, code = self.sensor.take(memory.sensor, t, q, tau)
        counts = _with(memory.counts, code)
        if sensed is None:
            return memory._replace(sensor=after, counts=counts), None
        times = self._judged((*memory.times, t))
        last = q.tobytes() + tau.tobytes()
        alike = memory.alike + 1 if last == memory.last else 0
        if alike >= IN_A_ROW:
            counts = counts._replace(frozen=counts.frozen + newly_frozen(alike))
        return StreamMemory(after, times, counts, last, alike), sensed

    def _judged(self, times: tuple[float, ...]) -> tuple[float, ...]:
        """Return the times that are still to be judged, after refusing those of another rate."""
        if self.judged is None:
            return ()
        if len(times) <= self.judged:
            return times
        check_rate(np.array(times), self.sensor.rate, where=f"{self.name}, {times[-1]:.6g} s")
        return times[-1:]


def _with(counts: SampleCounts, code: int) -> SampleCounts:
    if code > stamp.RESTARTED:
        name = {stamp.LATE: "late", stamp.REPEATED: "repeated"}.get(code, "not_finite")
        return counts._replace(**{name: getattr(counts, name) + 1})
    again = int(code == stamp.RESTARTED and counts.taken > 0)
    return counts._replace(taken=counts.taken + 1, restarts=counts.restarts + again)
