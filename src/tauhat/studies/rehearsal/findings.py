"""What a rehearsal found, for its words, tables and charts."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.excitation.design import Design
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.studies.rehearsal.cells import Cell, best, cells_of, cheapest
from tauhat.studies.rehearsal.trials import NamedSensors, Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """Outcomes and what they come from.

    experiment : what was rehearsed
    designs : of a motion's period, by its length [s]; none where the motion is not designed
    sensors : with which, the worst first
    outcomes : of every robot, length and kind of sensors
    terms, estimator : of the models
    unseen : what the motion is like that was verified on
    target : error that is wanted, as a fraction; None where no answer is asked for
    """

    experiment: PlannedExperiment
    designs: dict[float, Design]
    sensors: tuple[NamedSensors, ...]
    outcomes: tuple[Outcome, ...]
    terms: str
    estimator: str
    unseen: str
    target: float | None

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Figures of every kind of sensors and length."""
        return cells_of(self.outcomes)

    @property
    def robots(self) -> int:
        """How many simulated robots there were."""
        return len({outcome.seed for outcome in self.outcomes})

    @property
    def lengths(self) -> tuple[float, ...]:
        """Lengths of the motions, rising [s]."""
        return tuple(sorted({outcome.seconds for outcome in self.outcomes}))

    @property
    def answer(self) -> Cell | None:
        """The cheapest cell that meets the target; None where none does, or none is asked for."""
        return None if self.target is None else cheapest(self.cells, self.target)

    @property
    def shown(self) -> Cell | None:
        """The cell that is told joint by joint: the answer, or the best one."""
        return self.answer or best(self.cells)
