"""Iterative hybrid least squares: joint weights, row weights and the shape of friction, found together.

Three loops, one inside the other:

1. weights of the joints from their residuals' scale, as in weighted least squares;
2. weights of the rows from their own residuals, as in reweighted least squares;
3. outermost, the shapes of friction (widths, Stribeck velocities, lengths) by variable projection on rows weighted so.

A shape that was chosen on all rows alike is pulled by the rows that the model explains worst. Here these count less,
the shapes around the present ones are looked at again, and the fit with new shapes weighs the rows anew, until no shape
changes.

Source: Han, Wu, Liu, Xiong, "An iterative approach for accurate dynamic model identification of industrial robots",
2020.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Shaped
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence, Gather, collect_all
from tauhat.estimation.losses import Cauchy, Loss
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import repeated_rows
from tauhat.estimation.robust import ReweightedLeastSquares, mended
from tauhat.estimation.rows import Rows
from tauhat.estimation.shapes import chosen_form

WIDER = (0.6, 1.0, 1.7)  # of the present shape: where another is looked for, and again more closely


@dataclass(frozen=True, slots=True, kw_only=True)
class HybridLeastSquares(ReweightedLeastSquares):
    """Reweighted least squares whose shapes of friction follow the weights.

    loss : of the scaled residuals, Cauchy's by default
    rounds : of shapes and weights, at most
    """

    key: ClassVar[str] = "hybrid"
    loss: Loss = field(default_factory=Cauchy)
    rounds: int = 3

    def __post_init__(self) -> None:
        super(HybridLeastSquares, self).__post_init__()
        if self.rounds < 1:
            raise ModelError("at least one round is needed", got=self.rounds)

    def settled(self, problem: Problem) -> Problem:
        """Return the problem whose model has the shapes that fit the weighted rows best."""
        cleaned, _ = mended(problem, self.spike)
        for _ in range(self.rounds):
            model = self._reshaped(cleaned)
            if model == cleaned.model or model.fingerprint == cleaned.model.fingerprint:
                break
            cleaned = _with_model(cleaned, model)
        return problem if cleaned.model is problem.model else _with_model(problem, cleaned.model)

    def _reshaped(self, problem: Problem) -> TorqueModel:
        """Return the model with every chosen shape looked at again on the rows as the fit weighs them."""
        model = problem.model
        shaped = [term for term in model.terms if isinstance(term, Shaped) and term.shape]
        if not shaped:
            return model
        gather = self._gathering(problem)
        for term in shaped:
            forms = [term.with_shape([factor * value for value in term.shape]) for factor in WIDER]
            model = model.with_term(chosen_form(model, problem.base, forms, gather))
        return model

    def _gathering(self, problem: Problem) -> Gather:
        """Return what collects the evidence of any model on the same rows, weighted by the fit of this one.

        One weight a row and joint is kept: other models' rows are at the same times.
        """
        rows = repeated_rows(problem)
        found = self.fixed_point(rows)
        times: list[FloatArray] = []
        weights: list[FloatArray] = []
        for pieces in rows.recordings():
            own = [(piece.t, self.row_weights(rows, piece, found.values, found.scales)) for piece in pieces]
            times.append(np.concatenate([t for t, _ in own]))
            weights.append(np.concatenate([weight for _, weight in own], axis=1))

        def weight_of(piece: Rows, index: int) -> FloatArray:
            first = int(np.searchsorted(times[index], piece.t[0]))
            return weights[index][:, first : first + piece.t.size]

        def gather(model: TorqueModel, base: BaseParameters, most_blocks: int) -> Evidence:
            other = repeated_rows(replace(problem, model=model, base=base, kept=()))
            return other.weighted(weight_of, most_blocks=most_blocks)

        return gather


def _with_model(problem: Problem, model: TorqueModel) -> Problem:
    base = base_parameters(model)
    evidence = collect_all(model, base, problem.recordings, problem.processing)
    return replace(problem, model=model, base=base, evidence=evidence, kept=())
