"""A Kalman filter over the parameters alone, with the filtered rows of the inverse dynamics as measurements.

State x, measurement of every row `tau_k = W_k x + noise`, noise of deviation r_j on joint j. The measurement is linear,
so that every spreading gives the same filter: recursive least squares with weights 1/r_j. With a forgetting factor g
the covariance grows by 1/g before every row, and what is T = 1/(1 - g) rows old counts 1/e.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.filters.beginning import Beginning, Diffuse
from tauhat.estimation.filters.forms import SquareRoot
from tauhat.estimation.filters.outcome import Found, Recursion, residual_weights, solution_of
from tauhat.estimation.filters.samples import RowSample, row_samples, with_recordings
from tauhat.estimation.filters.steps import Belief, Innovation, InnovationTest, KalmanFilter
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution

DIVERGED = "do not use these values: begin closer (beginning=...), or check the torque's unit and sign"


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterKalman(Recursion):
    """Recursive least squares as a Kalman filter on the filtered rows.

    filter : spreading and form; the square-root form by default
    beginning : diffuse by default
    forgetting : factor g on what is known, per row; 1 forgets nothing
    test : what stops it

    The noise of each joint is the residual of weighted least squares on the same rows.
    """

    key: ClassVar[str] = "parameter-kalman"
    filter: KalmanFilter = field(default_factory=lambda: KalmanFilter(form=SquareRoot()))
    beginning: Beginning = field(default_factory=Diffuse)
    forgetting: float = 1.0
    test: InnovationTest = field(default_factory=InnovationTest)

    def __post_init__(self) -> None:
        super(ParameterKalman, self).__post_init__()
        if not 0.5 < self.forgetting <= 1.0:
            raise ModelError("the forgetting factor is out of range", expected="0.5 to 1", got=self.forgetting)

    def step(self, belief: Belief, sample: RowSample, noise: FloatArray) -> tuple[Belief, Innovation]:
        """Return the belief after one row of all joints, with `noise` (n_v, n_v), root of its covariance."""
        grown = Belief(belief.mean, self.filter.form.scaled(belief.kept, 1.0 / self.forgetting))
        return self.filter.correct(grown, lambda points: points @ sample.columns.T, sample.tau, noise)

    @single_threaded
    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution after the last row; the last trusted one, with its cause, when the filter diverges."""
        start = self.beginning.of(problem)
        deviation, weights = residual_weights(problem.evidence)
        noise = np.diag(deviation)
        belief = trusted = self.filter.start(start.mean, start.covariance)
        averaged, cause, advice = 1.0, "last row reached", ""
        for sample in row_samples(with_recordings(problem, start.recordings)):
            try:
                belief, innovation = self.step(belief, sample, noise)
            except np.linalg.LinAlgError:
                verdict = "the covariance lost its positive definiteness"
            else:
                averaged = self.test.averaged(averaged, innovation.surprise)
                verdict = self.test.verdict(belief, averaged)
            if verdict:
                cause, advice = f"diverged at {sample.t:.2f} s: {verdict}", DIVERGED
                break
            trusted = belief
        found = Found(trusted.mean, weights, 1, cause, advice)
        whole = self.forgetting == 1.0 and not advice and isinstance(self.beginning, Diffuse)
        return solution_of(problem.evidence, found, covariance=None if whole else self.filter.covariance(trusted))
