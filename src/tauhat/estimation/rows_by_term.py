"""Filtered rows of a few recordings, remembered term by term: models that share a term share its columns.

Settings are chosen by fitting one model after another to the same sample, and most of its terms stay as they are. Their
columns are made and filtered once, when they are first asked for. What is kept is as long as the sample, so this is for
samples alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import Layout, TorqueModel
from tauhat.dynamics.terms.term import Term
from tauhat.estimation.evidence import Evidence, collected
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.recordings.processing import Processing, Stretch, stretches
from tauhat.recordings.recording import Recording
from tauhat.workers import merged_as_tree


class RowsByTerm:
    """Evidence of recordings on models of one robot, one after another, through the same filters.

    `gather` is a `Gather`.

    Parameters
    ----------
    recordings : a sample that fits into memory
    processing : filters of torque and columns
    """

    def __init__(self, recordings: Iterable[Recording], processing: Processing) -> None:
        self.processing = processing
        self._logs = tuple(_Log(recording, processing) for recording in recordings)

    def gather(self, model: TorqueModel, base: BaseParameters, most_blocks: int) -> Evidence:
        """Return what `collect_all` makes of these recordings, but for rounding.

        Only the terms of the last model are remembered.

        Raises
        ------
        RecordingError
            when a recording does not fit the model.
        ModelError
            when no row is left.
        """
        parts = (
            collected(model, base, log.recording, rows_of=partial(log.rows, model), most_blocks=most_blocks)
            for log in self._logs
        )
        return merged_as_tree(Evidence.merged, parts)


class _Known(NamedTuple):
    """All columns of a term, and per joint in which row each column of its support is."""

    columns: FloatArray
    places: tuple[IntArray, ...]


class _Log:
    """One recording and what is known of it."""

    def __init__(self, recording: Recording, processing: Processing) -> None:
        self.recording, self._processing = recording, processing
        self._motion: tuple[Stretch, ...] = ()
        self._known: dict[Term, _Known] = {}
        self._plain: Rows | None = None  # of the robot alone: time, torque and velocity

    def rows(self, model: TorqueModel, layout: Layout) -> list[Rows]:
        """Return all rows as one piece; none where no row is left."""
        known = {term: self._known.get(term) or self._made(model, term) for term in model.terms}
        self._known, plain = known, self._plain
        if plain is None:
            return []
        columns = np.empty((layout.parameters.size, plain.t.size))
        for term, sources in zip(model.terms, layout.sources, strict=True):
            for (picked, target), place in zip(sources, known[term].places, strict=True):
                columns[target] = known[term].columns[place[picked]]
        return [plain._replace(columns=columns)]

    def _made(self, model: TorqueModel, term: Term) -> _Known:
        """Return all columns of a term of the model, filtered."""
        self._motion = self._motion or tuple(stretches(self.recording, self._processing))
        alone = TorqueModel(robot=model.robot, terms=(term,))
        layout = alone.layout()
        pieces = list(filtered_rows(alone, layout, self.recording, self._processing, motion=self._motion))
        places = tuple(target for _, target in layout.sources[0])
        if not pieces:
            return _Known(np.zeros((layout.parameters.size, 0)), places)
        whole = Rows(*(np.concatenate(part, axis=-1) for part in zip(*pieces, strict=True)))
        self._plain = whole._replace(columns=np.zeros((0, whole.t.size)))
        return _Known(whole.columns, places)
