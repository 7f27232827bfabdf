"""The rows of a problem as often as a method needs them: kept where they are few, made again where they are many."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.model import Layout
from tauhat.estimation.evidence import MOST_BLOCKS, Evidence, evidence_from_rows
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.estimation.solution import MOST_GROUPS

MOST_BYTES = 2**28  # of rows that are kept; a longer log is read again at every pass


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RepeatedRows:
    """Filtered rows of every recording, one recording after the other.

    layout : which regressor entries the rows hold
    places : per joint, which base parameters these are, (p_j,)
    kept : one piece a recording; empty where they are read again
    """

    problem: Problem
    layout: Layout
    places: tuple[IntArray, ...]
    kept: tuple[Rows, ...]

    def recordings(self) -> Iterator[Iterable[Rows]]:
        """Yield the rows of each recording."""
        if self.kept:
            yield from ((piece,) for piece in self.kept)
            return
        for recording in self.problem.recordings:
            yield filtered_rows(self.problem.model, self.layout, recording, self.problem.processing)

    def __iter__(self) -> Iterator[Rows]:
        """Yield all rows."""
        for pieces in self.recordings():
            yield from pieces

    def residuals(self, rows: Rows, values: FloatArray) -> FloatArray:
        """Return measured less predicted torque of a piece, (n_v, n) [Nm or N]."""
        predicted = [values[place] @ rows.columns[self.layout.of_joint(j)] for j, place in enumerate(self.places)]
        return np.asarray(rows.tau - np.array(predicted))

    def weighted(self, weigh: Callable[[Rows, int], FloatArray], *, most_blocks: int = MOST_BLOCKS) -> Evidence:
        """Return the evidence of all rows, each times the root of its weight, in blocks for error bars.

        Parameters
        ----------
        weigh : from a piece and the number of its recording to weights (n_v, n) of its equations
        """
        base, counts = self.problem.base, np.diff(self.layout.bounds)
        share = -(-self.problem.evidence.n_t // MOST_GROUPS)
        parts = [
            evidence_from_rows(
                self.layout,
                base,
                (_times(piece, np.sqrt(weigh(piece, index)), counts) for piece in pieces),
                name=self.problem.recordings[index].name,
                most_blocks=most_blocks,
                first_rows=max(share, 1),
            )
            for index, pieces in enumerate(self.recordings())
        ]
        return reduce(Evidence.merged, parts)


def repeated_rows(problem: Problem) -> RepeatedRows:
    """Return the problem's rows, kept in memory where they take less than `MOST_BYTES`."""
    model, base = problem.model, problem.base
    layout = model.layout(base.independent)
    place = np.full(len(base.names), -1)
    place[base.independent] = np.arange(base.n_b)
    places = tuple(place[layout.parameters[layout.of_joint(joint)]] for joint in range(model.robot.n_v))
    kept = problem.kept
    if not kept and 8 * problem.evidence.n_t * layout.parameters.size <= MOST_BYTES:
        kept = tuple(
            _joined(filtered_rows(model, layout, recording, problem.processing)) for recording in problem.recordings
        )
    return RepeatedRows(problem=problem, layout=layout, places=places, kept=kept)


def remembered(problem: Problem) -> Problem:
    """Return the problem with its rows, where they are few enough to keep, for several methods in turn."""
    return replace(problem, kept=repeated_rows(problem).kept)


def _joined(pieces: Iterable[Rows]) -> Rows:
    return Rows(*(np.concatenate(parts, axis=-1) for parts in zip(*pieces, strict=True)))


def _times(rows: Rows, roots: FloatArray, counts: IntArray) -> Rows:
    return rows._replace(columns=rows.columns * np.repeat(roots, counts, axis=0), tau=rows.tau * roots)
