"""The virtual sensor as a live service runs it: samples by their stamps, bad ones skipped, standing still found out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.control.force.reading import ForceReading
from tauhat.errors import SensingError
from tauhat.sensing.stream import SensorStream, StreamMemory
from tauhat.simulation.contact.running_cell import CellSample
from tauhat.studies.polishing.readers import ForceReader, Place, SensedReading


class StreamedMemory(NamedTuple):
    """What a streamed reading remembers.

    stream : None once the stream has ended: its samples came at another rate
    last : the last sample taken
    held, stood : how many samples in a row had its torque, and how many had its position although the tool was fed
    """

    stream: StreamMemory | None
    last: CellSample | None = None
    held: int = 0
    stood: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StreamedReading(ForceReader):
    """Reads samples as `SensorStream` takes them, and tells a force with whatever error bar it has.

    No reading comes of a sample that is late, repeated or no number, nor of one that stands still: whose torque, or
    whose position while the tool is fed, has been the same to the bit for a while. The filter makes smooth, ever
    changing forces of such samples, so that a polisher could not find out from its readings. Behind a gap the sensor
    starts again; its readings then come with error bars so wide that the polisher does not use them.

    sensed : the sensor, its solvers and its zero
    still_after : samples that are alike in a row
    """

    sensed: SensedReading
    still_after: int = 10

    @property
    def stream(self) -> SensorStream:
        """What takes the samples."""
        return SensorStream(sensor=self.sensed.sensor, name="polishing")

    @property
    def lag(self) -> float:
        """How late a force is told [s]: by the observer and by the filter, `sqrt(2) / w`."""
        sensor = self.sensed.sensor
        cutoff = sensor.cutoff or np.inf
        return float(sensor.observer.lag + np.sqrt(2.0) / (2.0 * np.pi * cutoff))

    def start(self) -> StreamedMemory:
        """Return no sample."""
        return StreamedMemory(self.stream.start())

    def read(
        self, memory: StreamedMemory, sample: CellSample, place: Place
    ) -> tuple[StreamedMemory, ForceReading | None]:
        """Return the force along the tool's axis with its error, None where the sample tells none."""
        if memory.stream is None:
            return memory, None
        try:
            stream, told = self.stream.take(memory.stream, sample.t, sample.q, sample.tau)
        except SensingError:
            return memory._replace(stream=None), None
        if told is None:
            return memory._replace(stream=stream), None
        after = _counted(memory, sample, place)._replace(stream=stream, last=sample)
        if max(after.held, after.stood) >= self.still_after:
            return after, None
        return after, self.sensed.solved(told, place)


def _counted(memory: StreamedMemory, sample: CellSample, place: Place) -> StreamedMemory:
    """Return the memory with the number of samples alike.

    A position that stood while the tool was fed goes on counting as such until it changes: a polisher that holds for
    want of readings comes to rest, and would feed again on the same position.
    """
    last = memory.last
    if last is None:
        return memory
    held = memory.held + 1 if np.array_equal(last.tau, sample.tau) else 0
    fed = int(place.along != 0.0)
    stood = memory.stood + fed if np.array_equal(last.q, sample.q) else 0
    return memory._replace(held=held, stood=stood)
