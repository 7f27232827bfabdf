"""Which terms the model should have: cross-validation over whole recordings, on evidence alone.

From the robust default, one term at a time is added or dropped for the whole robot. Each model is fitted on all
recordings but one and judged on that one, in turn. A single recording is cut into stretches of time instead; they share
warm-up, postures and speeds, and so a change must then gain much more to be believed.

All candidates' columns stand in one evidence; fitting a model is choosing columns, and no recording is read again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.blas import single_threaded
from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import TERMS, TorqueModel
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.iterating import iterated
from tauhat.estimation.least_squares import Estimator, WeightedLeastSquares
from tauhat.estimation.rows import check_recordings
from tauhat.estimation.solution import joint_residuals
from tauhat.estimation.tuning import tuned
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

OPTIONAL = ("viscous-asymmetry", "coulomb", "spring")  # terms that are tried beside the default's
DROPPABLE = ("load-dahl", "stribeck", "cube-root", "viscous-asymmetry", "coulomb", "spring")
_STRETCHES = 6  # of time, of a single recording
LEAST_GAIN = 0.03  # of the error on unseen recordings, for a change to be made
LEAST_GAIN_OF_STRETCHES = 0.1  # of the error on unseen stretches of one recording
_SURE = 3.0  # standard errors over the parts by which the gain must be above zero, too


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One change of the model that was tried.

    term : its key
    change : "add" or "drop"
    gain : by what part the error on unseen data falls
    uncertainty : standard error of the gain over the parts that were left out
    taken : whether the change was made
    """

    term: str
    change: str
    gain: float
    uncertainty: float
    taken: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Structure:
    """How the terms of a model were chosen.

    folds : how many parts of the data were left out in turn
    whole : whether each was a whole recording
    trials : in order; those of a later round start from what the rounds before took
    """

    folds: int
    whole: bool
    trials: tuple[Trial, ...]

    @property
    def words(self) -> str:
        """What was decided and on what grounds, in one sentence."""
        parts = "recordings" if self.whole else "stretches of the one recording"
        made = [trial for trial in self.trials if trial.taken]
        if not self.trials:
            return "too little data to leave any of it out: the default stays"
        if not made:
            return f"no term more or fewer predicts {self.folds} left-out {parts} clearly better: the default stays"
        changes = ", ".join(
            f"{trial.term} {'added' if trial.change == 'add' else 'dropped'} (error {100 * trial.gain:.1f} % less)"
            for trial in made
        )
        return f"{changes}; judged on {self.folds} left-out {parts}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        trials = [asdict(trial) for trial in self.trials]
        return {"folds": self.folds, "whole": self.whole, "trials": trials}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Structure:
        """Return what `to_dict` described."""
        return cls(folds=data["folds"], whole=data["whole"], trials=tuple(Trial(**trial) for trial in data["trials"]))


class Selected(NamedTuple):
    """A model whose terms were chosen, the processing that goes with it, and how it was found."""

    model: TorqueModel
    processing: Processing
    structure: Structure


@single_threaded
def select_model(
    model: TorqueModel,
    recordings: Sequence[Recording],
    *,
    estimator: Estimator | None = None,
    processing: Processing | None = None,
    cutoff: float | None = None,
) -> Selected:
    """Return the model with terms added and dropped by cross-validation; see the head of this file.

    Parameters
    ----------
    model : to start from, usually the robust one
    estimator : weighted least squares by default
    processing : chosen from the recordings by default
    cutoff : only the low-pass of torque and columns [Hz]; the rest is chosen

    Raises
    ------
    RecordingError, ModelError
        as `identify`.
    """
    method = estimator or WeightedLeastSquares()
    check_recordings(model, recordings)
    shaped, settings = tuned(model, recordings, processing=processing, cutoff=cutoff)
    start = iterated(shaped, recordings, settings, method)
    wide, _ = tuned(widest(start), recordings, processing=settings)
    chosen, structure = choose_structure(start, wide, recordings, settings, estimator=method)
    return Selected(chosen, settings, structure)


def widest(model: TorqueModel) -> TorqueModel:
    """Return the model with all optional terms beside its own, except those that one of its own stands for."""
    taken = {key for term in model.terms for key in (term.key, *term.stands_for)}
    return replace(model, terms=(*model.terms, *(TERMS[key]() for key in OPTIONAL if key not in taken)))


def choose_structure(
    model: TorqueModel,
    wide: TorqueModel,
    recordings: Sequence[Recording],
    processing: Processing,
    *,
    estimator: Estimator,
) -> tuple[TorqueModel, Structure]:
    """Return the model with the terms that predict unseen data best, and how that was found.

    Parameters
    ----------
    model : to start from, its shapes chosen
    wide : the same with the optional terms, their shapes chosen
    """
    folds = _Folds.of(wide, recordings, processing, estimator=estimator)
    present = {term.key for term in model.terms}
    trials: list[Trial] = []
    while folds.suffice:
        levels = folds.log_errors(present)
        tried = [
            _trial(key, change, levels - folds.log_errors(present ^ {key}))
            for key, change in _changes(wide, present, trials)
        ]
        worthy = [trial for trial in tried if folds.believes(trial)]
        best = max(worthy, key=lambda trial: trial.gain, default=None)
        trials += [replace(trial, taken=trial is best) for trial in tried]
        if best is None:
            break
        present ^= {best.term}
    terms = tuple(term for term in wide.terms if term.key in present)
    structure = Structure(folds=len(folds.parts), whole=folds.whole, trials=tuple(trials))
    return replace(model, terms=terms), structure


def _trial(key: str, change: str, falls: FloatArray) -> Trial:
    """Return what the falls of the logarithmic error on every part say about a change."""
    return Trial(
        term=key,
        change=change,
        gain=float(1.0 - np.exp(-falls.mean())),
        uncertainty=float(falls.std(ddof=1) / np.sqrt(falls.size)),
        taken=False,
    )


def _changes(wide: TorqueModel, present: set[str], trials: Sequence[Trial]) -> Iterator[tuple[str, str]]:
    """Yield each term that may be added or dropped; what was changed once is not changed back."""
    changed = {trial.term for trial in trials if trial.taken}
    for term in wide.terms:
        if term.key in changed:
            continue
        if term.key not in present:
            yield term.key, "add"
        elif term.key in DROPPABLE:
            yield term.key, "drop"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Folds:
    """Evidence of the widest model in parts, each of which is left out in turn.

    parts : blocks of each part
    columns : of each term's key, the columns of the evidence
    """

    evidence: Evidence
    parts: tuple[tuple[Block, ...], ...]
    columns: dict[str, IntArray]
    estimator: Estimator
    whole: bool

    @classmethod
    def of(
        cls, wide: TorqueModel, recordings: Sequence[Recording], processing: Processing, *, estimator: Estimator
    ) -> _Folds:
        base = base_parameters(wide)
        each = [collect_all(wide, base, [recording], processing) for recording in recordings]
        owner = [term.key for term in wide.terms for _ in term.parameters(wide.robot)]
        kept = [owner[index] for index in base.independent]
        whole = len(recordings) > 1
        parts = [evidence.blocks for evidence in each] if whole else [(b,) for b in each[0].merged_blocks(_STRETCHES)]
        return cls(
            evidence=each[0],
            parts=tuple(tuple(part) for part in parts),
            columns={term.key: np.flatnonzero([key == term.key for key in kept]) for term in wide.terms},
            estimator=estimator,
            whole=whole,
        )

    @property
    def suffice(self) -> bool:
        """Whether there is something to leave out, and what is left can determine the widest model."""
        rows = [sum(block.n_t for block in part) for part in self.parts]
        fewest = (sum(rows) - max(rows)) * self.evidence.n_v
        return len(rows) > 1 and fewest > self.evidence.n_b

    def believes(self, trial: Trial) -> bool:
        """Return whether a change gains enough, and on most parts, to be made."""
        least = LEAST_GAIN if self.whole else LEAST_GAIN_OF_STRETCHES
        return trial.gain > max(least, _SURE * trial.uncertainty)

    def log_errors(self, present: set[str]) -> FloatArray:
        """Return for each part that is left out the mean over joints of the logarithm of the error there."""
        columns = np.sort(np.concatenate([own for key, own in self.columns.items() if key in present]))
        levels = []
        for index, part in enumerate(self.parts):
            others = [block for other, blocks in enumerate(self.parts) if other != index for block in blocks]
            values = self.estimator.solve(self.evidence.of_blocks(others).keeping(columns)).values
            errors = joint_residuals(self.evidence.of_blocks(part).keeping(columns), values)
            levels.append(float(np.mean(np.log(np.maximum(errors, np.finfo(float).tiny)))))
        return np.array(levels)
