"""What a task-oriented design found: programs, singular values block by block, and what each stage makes visible."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.information import Information
from tauhat.excitation.task_design.blocks import BLOCKS, Block, Blocks, names_of, told_of
from tauhat.excitation.task_design.regions import TaskRegion
from tauhat.excitation.task_design.stages import TaskStage
from tauhat.excitation.waypoints.motion import WaypointMotion
from tauhat.recordings.recording import Recording

READINGS_PER_SECOND = 20.0  # independent ones: twice a usual low-pass of 10 Hz
_SURE = 1.0  # noise of one reading: what the error of a visible parameter may do to a torque in random states
_NOTHING = 1e-12  # information that is rounding, in parts of the largest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StageDesign:
    """The program of one stage and what it is worth.

    motion : one run of it
    information : (n, n) per reading, of scaled columns with the exact sign
    evaluations, seconds : what the search took
    margins : smallest unused part of each limit of several joints at once, beyond what is left unused
    """

    stage: TaskStage
    motion: WaypointMotion
    information: FloatArray
    evaluations: int
    seconds: float
    margins: dict[str, float]

    @property
    def repeats(self) -> int:
        """How often the program fits into the time of the stage."""
        return self.stage.runs(self.motion.duration)

    @property
    def recorded(self) -> float:
        """How long the program runs in all, at most the time of the stage [s]."""
        return self.repeats * self.motion.duration

    def recording(self, *, rate: float) -> Recording:
        """Return the program run `repeats` times, sampled `rate` times a second, from rest to rest."""
        return self.motion.recording(rate=rate, name=self.stage.name, repeats=self.repeats)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskDesign:
    """The programs of all stages, and what they tell together.

    facts : the columns, scaled by constants; the exact sign
    blocks : which of them are of which kind
    reached : part of the region that the arm reaches from home
    """

    stages: tuple[StageDesign, ...]
    facts: Information
    blocks: Blocks
    region: TaskRegion
    reached: float

    def information(self, upto: int | None = None) -> FloatArray:
        """Return the weighted information per reading of the first `upto` stages, all by default, (n, n)."""
        chosen = self.stages[:upto]
        weights = [found.stage.weight * found.recorded for found in chosen]
        parts = (weight / sum(weights) * found.information for weight, found in zip(weights, chosen, strict=True))
        return np.asarray(sum(parts, start=np.zeros((self.facts.n, self.facts.n))))

    def singular_values(self, block: Block, information: FloatArray) -> FloatArray:
        """Return those of a block's scaled regressor, all other columns unknown, largest first."""
        told = told_of(information, self.blocks.of((block,)))
        return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(told), 0.0))[::-1])

    def errors(self, upto: int | None = None) -> FloatArray:
        """Return how sure the first `upto` stages make the parameters, (n,).

        The standard error of each times what its column is in random states, over the noise of one reading.
        """
        readings = READINGS_PER_SECOND * sum(found.recorded for found in self.stages[:upto])
        eigenvalues, axes = np.linalg.eigh(self.information(upto))
        inverse = 1.0 / np.maximum(eigenvalues, _NOTHING * eigenvalues[-1])
        return np.asarray(np.sqrt((axes**2) @ inverse / readings))

    def visible(self, upto: int | None = None) -> tuple[str, ...]:
        """Return the parameters that the first `upto` stages make visible: those whose `errors` are below 1."""
        return tuple(name for name, error in zip(names_of(self.facts), self.errors(upto), strict=True) if error < _SURE)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data: of every stage alone, of all together, and what became visible when."""
        seen: set[str] = set()
        stages = []
        for count, found in enumerate(self.stages, start=1):
            visible = self.visible(count)
            stages.append(
                {
                    "name": found.stage.name,
                    "counted": list(found.stage.counted),
                    "duration": found.motion.duration,
                    "repeats": found.repeats,
                    "recorded": found.recorded,
                    "moves": len(found.motion.moves),
                    "slowed": len(found.motion.slowed),
                    "evaluations": found.evaluations,
                    "seconds": found.seconds,
                    "limits": dict(found.margins),
                    "blocks": self._of_blocks(found.information),
                    "became_visible": [name for name in visible if name not in seen],
                    "errors_after": self._errors_of_blocks(count),
                }
            )
            seen |= set(visible)
        names = names_of(self.facts)
        return {
            "reached": self.reached,
            "stages": stages,
            "together": {
                "blocks": self._of_blocks(self.information()),
                "visible": len(seen),
                "parameters": len(names),
                "unseen": [name for name in names if name not in seen],
            },
        }

    def _errors_of_blocks(self, upto: int) -> dict[str, float]:
        """Return the root mean square error of each block's parameters after so many stages."""
        errors = self.errors(upto)
        held = {block: errors[self.blocks.of((block,))] for block in BLOCKS}
        return {block: float(np.sqrt(np.mean(values**2))) for block, values in held.items() if values.size}

    def _of_blocks(self, information: FloatArray) -> dict[str, Any]:
        return {block: block_figures(self.singular_values(block, information)) for block in BLOCKS}


def block_figures(singular_values: FloatArray) -> dict[str, Any]:
    """Return singular values and their condition as plain data; infinite where the smallest is rounding."""
    if not singular_values.size:
        return {"singular_values": [], "condition": None}
    smallest, largest = float(singular_values[-1]), float(singular_values[0])
    regular = smallest > np.sqrt(_NOTHING) * largest
    return {"singular_values": singular_values.tolist(), "condition": largest / smallest if regular else None}
