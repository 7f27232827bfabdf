"""What all arms showed together: quartiles of errors, paired ratios, and what the designs are worth block by block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion, motion_from_rows
from tauhat.excitation.task_design.blocks import BLOCKS, Block, told_of
from tauhat.excitation.task_design.found import READINGS_PER_SECOND, block_figures
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.studies.local_global.arms import ArmFigures
from tauhat.studies.local_global.motions import GLOBAL, Motions
from tauhat.studies.local_global.task import Polishing

FITS = ("local", GLOBAL, "both", "one stage")
_GRID = 4000  # samples of a motion whose information is told


class Quartiles(NamedTuple):
    """Of a figure over the arms."""

    low: float
    median: float
    high: float


class BlockFigures(NamedTuple):
    """What motions tell of one block of columns while all others are unknown.

    condition : of the scaled columns; infinite where one is not seen
    error : root mean square of what the standard error of each parameter does to a torque in random states, over the
        noise of one reading
    """

    condition: float
    error: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """Figures of every arm.

    frictions : of the plants; the first is the study's own, others are there to compare with
    arms : by friction, the same seeds in the same order
    blocks : by model, what its motions tell of each block of columns
    """

    robot: Robot
    work: Polishing
    motions: Motions
    frictions: tuple[str, ...]
    arms: Mapping[str, tuple[ArmFigures, ...]]
    blocks: Mapping[str, Mapping[Block, BlockFigures]]

    @property
    def count(self) -> int:
        """Number of arms of each friction."""
        return len(self.arms[self.frictions[0]])

    def errors(self, fit: str, judged: str, friction: str | None = None) -> FloatArray:
        """Return the error over torque of every arm, (n_arms,)."""
        arms = self.arms[friction or self.frictions[0]]
        return np.array([arm.errors[fit, judged].relative for arm in arms])

    def quartiles(self, fit: str, judged: str, friction: str | None = None) -> Quartiles:
        """Return the quartiles of the error over torque."""
        return _quartiles(self.errors(fit, judged, friction))

    def ratio(self, fit: str, other: str, judged: str, friction: str | None = None) -> Quartiles:
        """Return the quartiles of one model's error over another's on the same arm."""
        return _quartiles(self.errors(fit, judged, friction) / self.errors(other, judged, friction))

    def wins(self, fit: str, other: str, judged: str, friction: str | None = None) -> int:
        """Return on how many arms one model predicts better than another."""
        better = self.errors(fit, judged, friction) < self.errors(other, judged, friction)
        return int(np.count_nonzero(better))

    def joints(self, fit: str, judged: str) -> FloatArray:
        """Return the median error of each joint, (n_v,) [Nm or N]."""
        arms = self.arms[self.frictions[0]]
        return np.asarray(np.median([arm.errors[fit, judged].joints for arm in arms], axis=0))

    def torque(self, judged: str) -> FloatArray:
        """Return the median root mean square torque of each joint, (n_v,) [Nm or N]."""
        return np.asarray(np.median([arm.torque[judged] for arm in self.arms[self.frictions[0]]], axis=0))

    def fitted(self, fit: str) -> float:
        """Return the median residual over torque on the logs that were fitted."""
        return float(np.median([arm.fitted[fit] for arm in self.arms[self.frictions[0]]]))


def blocks_of_fit(motions: Motions, fit: str) -> dict[Block, BlockFigures]:
    """Return what the motions that a model is fitted to tell of each block, all of equal weight a second."""
    facts, places = motions.stages.facts, motions.stages.blocks
    fitted = [motions.fitted[name] for name in motions.fits[fit]]
    seconds = motions.seconds(fit)
    information = np.zeros((facts.n, facts.n))
    for motion in fitted:
        information += motion.duration / seconds * facts.matrix(_sampled(motion))
    eigenvalues, axes = np.linalg.eigh(information)
    inverse = 1.0 / np.maximum(eigenvalues, np.finfo(float).eps * eigenvalues[-1])
    errors = np.sqrt((axes**2) @ inverse / (READINGS_PER_SECOND * seconds))
    found: dict[Block, BlockFigures] = {}
    for block in BLOCKS:
        counted = places.of((block,))
        told = np.sqrt(np.maximum(np.linalg.eigvalsh(told_of(information, counted)), 0.0))[::-1]
        condition = block_figures(told)["condition"]
        error = float(np.sqrt(np.mean(errors[counted] ** 2)))
        found[block] = BlockFigures(np.inf if condition is None else condition, error)
    return found


def _sampled(motion: Trajectory) -> Motion:
    """Return a motion at evenly spaced times."""
    t = (np.arange(_GRID) + 0.5) * (motion.duration / _GRID)
    samples = motion.sample(np.asarray(t))
    return motion_from_rows(samples.q, samples.dq, samples.ddq)


def _quartiles(values: FloatArray) -> Quartiles:
    return Quartiles(*(float(value) for value in np.quantile(values, (0.25, 0.5, 0.75))))
