"""DIDIM: direct and inverse dynamic identification, from the torque alone.

The robot is simulated in closed loop with the parameters x_k of the pass before. Its simulated motion, free of any
noise, makes the regressor of the measured torque:

    tau = Y(q_s(x_k), dq_s(x_k), ddq_s(x_k)) x + rho          x_{k+1} by (weighted) least squares

The sensitivity of the simulated motion itself is left out: a controller that tracks its reference makes it small, since
the motion then hardly depends on the parameters. Measured positions serve for the first values and nothing else.

Source: Gautier, Janot, Vandanjon, "A new closed-loop output error method for parameter identification of robot
dynamics", 2013.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tauhat.estimation.simulated_runs import SimulatedRuns, joined
from tauhat.estimation.simulated_solution import simulated_solution
from tauhat.estimation.simulating import Found, SimulationEstimator, Tried, merged_evidence
from tauhat.estimation.solution import Solution, honest_covariance


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectInverse(SimulationEstimator):
    """Least squares of the measured torque on the simulated motion, repeated until the two agree.

    Source: Gautier, Janot, Vandanjon 2013.
    """

    key: ClassVar[str] = "didim"

    def improved(self, runs: SimulatedRuns, tried: Tried) -> Found:
        """Return the least-squares solution on the simulated motions."""
        pairs = zip(runs.runs, tried.motions, strict=True)
        evidence = merged_evidence(runs, (joined(runs.rows(run, moved)) for run, moved in pairs))
        solved = self.inner.solve(evidence)
        return Found(solved.values, solved.weights, evidence)

    def solution(self, runs: SimulatedRuns, tried: Tried, found: Found, ending: tuple[int, str, str]) -> Solution:
        """Return values and error bars of the last linear problem; residuals are those on the measured motion."""
        covariance = honest_covariance(found.evidence, found.weights, tried.values, ridge=self.inner.ridge)
        return simulated_solution(runs, tried, found, ending, covariance=covariance)
