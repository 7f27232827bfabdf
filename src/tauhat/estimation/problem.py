"""The problem that an estimator is given: a settled model, recordings, their filters, and the evidence of both."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError
from tauhat.estimation.evidence import MOST_BLOCKS, Evidence, Gather, gathering
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """What there is to identify, and from what.

    model : terms with their shapes chosen
    base : its base parameters
    recordings : as measured
    processing : filters of torque and columns
    evidence : of all recordings, through these filters
    kept : filtered rows of each recording, where several methods share them; empty: made when asked for
    gather : makes evidence where the recordings are read by workers, and `recordings` is empty; None: made here
    """

    model: TorqueModel
    base: BaseParameters
    recordings: tuple[Recording, ...]
    processing: Processing
    evidence: Evidence
    kept: tuple[Rows, ...] = ()
    gather: Gather | None = None

    def rows(self) -> Iterator[Rows]:
        """Yield the filtered rows of every recording again, for methods that need each sample.

        Raises
        ------
        ModelError
            when the recordings are read by workers, who send evidence alone.
        """
        if self.gather is not None:
            raise ModelError("rows of the recordings are wanted, and only their evidence is here")
        layout = self.model.layout(self.base.independent)
        for recording in self.recordings:
            yield from filtered_rows(self.model, layout, recording, self.processing)

    def collected(self, model: TorqueModel, base: BaseParameters, *, most_blocks: int = MOST_BLOCKS) -> Evidence:
        """Return the evidence of all recordings on the kept columns of another model, through the same filters."""
        gather = self.gather or gathering(self.recordings, self.processing)
        return gather(model, base, most_blocks)
