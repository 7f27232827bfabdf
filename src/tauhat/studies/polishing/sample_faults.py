"""Samples that do not reach a reader as they are, and a sensor that grows unsure of itself."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.control.force.reading import ForceReading
from tauhat.control.force.surface import Surface
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.running_cell import CellSample
from tauhat.studies.polishing.incidents import Incident
from tauhat.studies.polishing.readers import ForceReader, Place

_STREAM = 20261126


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleFault(Incident):
    """Samples of the log and of the load cell are spoilt; the cell is as it should be.

    bad, good : samples in a row that are spoilt and that are not, in turns
    count : number of samples for which this lasts
    """

    bad: int = 1
    good: int = 0
    count: float = np.inf

    def cell(self, cell: Cell, believed: Surface) -> Cell:  # noqa: ARG002
        """Return the cell as it is."""
        return cell

    def reader(self, reader: ForceReader, begins: float) -> ForceReader:
        """Return a reader that is given what is left of the samples."""
        return SpoiltReader(reader=reader, fault=self, begins=begins)

    def spoils(self, number: int) -> bool:
        """Return whether it is the turn of a bad sample."""
        return 0 <= number < self.count and number % (self.bad + self.good) < self.bad

    @abstractmethod
    def spoilt(self, sample: CellSample, before: CellSample, number: int) -> CellSample | None:
        """Return what arrives in place of a sample, None where nothing does.

        before : the last sample before the incident
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Frozen(SampleFault):
    """Parts of the sample stay as they were.

    parts : of `t`, `q`, `tau`, `load_cell`
    """

    parts: tuple[str, ...] = ("q", "tau", "load_cell")

    def spoilt(self, sample: CellSample, before: CellSample, number: int) -> CellSample | None:  # noqa: ARG002
        """Return the sample with old parts."""
        return sample._replace(**{part: getattr(before, part) for part in self.parts})


@dataclass(frozen=True, slots=True, kw_only=True)
class Replaced(SampleFault):
    """Torque and load cell show one number.

    value : [Nm or N]
    """

    value: float

    def spoilt(self, sample: CellSample, before: CellSample, number: int) -> CellSample | None:  # noqa: ARG002
        """Return the sample with that number."""
        return sample._replace(tau=np.full(sample.tau.shape, self.value), load_cell=self.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scattered(SampleFault):
    """Torque and load cell show random numbers, the same in every run.

    width : standard deviation [Nm or N]
    about : part of what they should show about which the numbers are
    """

    width: float
    about: float = 0.0

    def spoilt(self, sample: CellSample, before: CellSample, number: int) -> CellSample | None:  # noqa: ARG002
        """Return the sample with those numbers."""
        drawn = self.width * np.random.default_rng([_STREAM, number]).standard_normal(sample.tau.size + 1)
        return sample._replace(
            tau=self.about * sample.tau + drawn[1:], load_cell=float(self.about * sample.load_cell + drawn[0])
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Negated(SampleFault):
    """Torque and load cell have the other sign."""

    def spoilt(self, sample: CellSample, before: CellSample, number: int) -> CellSample | None:  # noqa: ARG002
        """Return the sample with the other sign."""
        return sample._replace(tau=-sample.tau, load_cell=-sample.load_cell)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost(SampleFault):
    """Samples do not arrive."""

    def spoilt(self, sample: CellSample, before: CellSample, number: int) -> CellSample | None:  # noqa: ARG002
        """Return nothing."""
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class WiderBar(Incident):
    """The sensor is less and less sure of itself.

    growth : of the standard deviation [N/s]
    """

    growth: float

    def cell(self, cell: Cell, believed: Surface) -> Cell:  # noqa: ARG002
        """Return the cell as it is."""
        return cell

    def reader(self, reader: ForceReader, begins: float) -> ForceReader:
        """Return a reader with a growing error bar."""
        return DoubtfulReader(reader=reader, growth=self.growth, begins=begins)


class Spoiling(NamedTuple):
    """The reader's own memory, the last sample before the incident, and how many came since."""

    reader: Any
    before: CellSample | None = None
    number: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpoiltReader(ForceReader):
    """A reader whose samples are spoilt from a time on.

    begins : [s]
    """

    reader: ForceReader
    fault: SampleFault
    begins: float

    def start(self) -> Spoiling:
        """Return the reader's memory."""
        return Spoiling(self.reader.start())

    def read(self, memory: Spoiling, sample: CellSample, place: Place) -> tuple[Spoiling, ForceReading | None]:
        """Return what the reader makes of what arrives; None where nothing does."""
        before, number = memory.before, memory.number
        if before is None or sample.t < self.begins:
            inner, reading = self.reader.read(memory.reader, sample, place)
            return Spoiling(inner, sample), reading
        spoils = self.fault.spoils(number)
        arrives = self.fault.spoilt(sample, before, number) if spoils else sample
        if arrives is None:
            return memory._replace(number=number + 1), None
        inner, reading = self.reader.read(memory.reader, arrives, place)
        return Spoiling(inner, before, number + 1), reading


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DoubtfulReader(ForceReader):
    """A reader whose error bar grows from a time on.

    growth : [N/s]
    begins : [s]
    """

    reader: ForceReader
    growth: float
    begins: float

    def start(self) -> Any:
        """Return the reader's memory."""
        return self.reader.start()

    def read(self, memory: Any, sample: CellSample, place: Place) -> tuple[Any, ForceReading | None]:
        """Return the reading with its error bar."""
        memory, reading = self.reader.read(memory, sample, place)
        if reading is None:
            return memory, None
        return memory, reading._replace(std=reading.std + self.growth * max(0.0, sample.t - self.begins))
