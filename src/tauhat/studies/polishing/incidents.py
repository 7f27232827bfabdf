"""What goes wrong in a job: what an incident is, and those of the workpiece."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from tauhat.control.force.reading import Reason
from tauhat.control.force.surface import Surface
from tauhat.robots.transforms import rotation_about
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.material import Region
from tauhat.studies.polishing.readers import ForceReader

Moment: TypeAlias = Literal["start", "approach", "contact", "pass"]
"""When an incident begins: with the job, half way down, at first contact, in the middle of the first pass."""

_ENDLESS = 10.0  # [m] beyond any path
_NOTHING = 1.0  # [N/m] of a skin that bears nothing
_STEPS = 12  # of a skin that gets firm


@dataclass(frozen=True, slots=True, kw_only=True)
class Incident(ABC):
    """Something that goes wrong, and how a job may end then.

    name : how tables call it
    ends : reasons for which the job may be given up; an empty one where it may be done to its end
    by_load_cell : the same where a load cell is read; by default those of `ends`
    moment : when it begins
    """

    name: str
    ends: tuple[Reason, ...]
    by_load_cell: tuple[Reason, ...] = ()
    moment: Moment = "pass"

    @abstractmethod
    def cell(self, cell: Cell, believed: Surface) -> Cell:
        """Return the cell in which it happens, on a surface that is believed to be there."""

    @abstractmethod
    def reader(self, reader: ForceReader, begins: float) -> ForceReader:
        """Return what then reads the force.

        begins : time of the log [s]
        """

    def jump(self, cell: Cell) -> float:  # noqa: ARG002
        """Return by which factor the force changes at once, whatever the robot does."""
        return 1.0

    def spoils(self, number: int) -> bool:  # noqa: ARG002
        """Return whether the sample of this number since the beginning does not reach the reader as it is."""
        return False


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkpieceIncident(Incident):
    """The workpiece is not as believed; samples are as they should be."""

    def reader(self, reader: ForceReader, begins: float) -> ForceReader:  # noqa: ARG002
        """Return the reader as it is."""
        return reader


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherSkin(WorkpieceIncident):
    """The skin has another stiffness from the middle of the path on.

    before, behind : the middle [N/m]; before it, None: as it is
    """

    before: float | None = None
    behind: float

    def cell(self, cell: Cell, believed: Surface) -> Cell:  # noqa: ARG002
        """Return the cell with another material."""
        regions = [Region(0.0, _ENDLESS, self.behind)]
        if self.before is not None:
            regions.append(Region(-_ENDLESS, 0.0, self.before))
        return _of_regions(cell, regions)

    def jump(self, cell: Cell) -> float:
        """Return the factor between two springs in series with the tool, both pressed alike."""
        tool, before = cell.tool.stiffness, self.before or cell.material.stiffness
        return (1.0 / tool + 1.0 / before) / (1.0 / tool + 1.0 / self.behind)


@dataclass(frozen=True, slots=True, kw_only=True)
class SoftSpot(WorkpieceIncident):
    """From the middle of the path on, the skin bears nothing for a while, and then more and more again.

    Where a tip has sunk in by the share x of what tool and skin yield together, the skin's stiffness is that of the
    tool times `1 / x - 1`. x falls in even steps, as a ball comes up at the edge of a hole: a skin that were firm again
    from one point to the next would hit the tip that is deep in it, which no edge does.

    length, edge : of the stretch that bears nothing, and of the one behind it [m]
    """

    length: float
    edge: float

    def cell(self, cell: Cell, believed: Surface) -> Cell:  # noqa: ARG002
        """Return the cell with a soft spot."""
        tool, firm = cell.tool.stiffness, cell.material.stiffness
        sunk = np.linspace(1.0, tool / (tool + firm), _STEPS + 2)[1:-1]
        ends = self.length + self.edge * np.arange(_STEPS + 1) / _STEPS
        rising = [
            Region(float(start), float(end), tool * (1.0 / share - 1.0))
            for start, end, share in zip(ends[:-1], ends[1:], sunk.tolist(), strict=True)
        ]
        return _of_regions(cell, [Region(0.0, self.length, _NOTHING), *rising])


@dataclass(frozen=True, slots=True, kw_only=True)
class MovedSurface(WorkpieceIncident):
    """The workpiece is not where it is believed.

    raised : along the outward normal [m]
    tilted : about the path's local y [rad]; positive: the path falls along the first pass
    """

    moment: Moment = "start"
    raised: float = 0.0
    tilted: float = 0.0

    def cell(self, cell: Cell, believed: Surface) -> Cell:
        """Return the cell with its workpiece elsewhere."""
        turned = rotation_about(np.array([0.0, 1.0, 0.0]), np.array([self.tilted]))[0]
        place = believed.place + self.raised * believed.rotation[:, 2]
        return replace(cell, surface=replace(believed, place=place, rotation=believed.rotation @ turned))


def _of_regions(cell: Cell, regions: list[Region]) -> Cell:
    return replace(cell, material=replace(cell.material, regions=tuple(regions)))
