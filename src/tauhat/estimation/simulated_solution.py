"""What an estimator that simulates ends with: its last linear problem, beside the residuals on the measured motion."""

from __future__ import annotations

from tauhat.arrays import FloatArray
from tauhat.estimation.least_squares import degrees_of_freedom
from tauhat.estimation.simulated_runs import SimulatedRuns
from tauhat.estimation.simulating import Found, Tried
from tauhat.estimation.solution import Solution, joint_residuals, joint_torques, rank_and_condition


def simulated_solution(
    runs: SimulatedRuns, tried: Tried, found: Found, ending: tuple[int, str, str], *, covariance: FloatArray
) -> Solution:
    """Return the values that were simulated last, with diagnostics of the linear problem around them.

    Parameters
    ----------
    found : the last linear problem, whose weights and evidence the error bars come from
    ending : number of passes, cause and advice
    covariance : of the values, (n_b, n_b)
    """
    passes, cause, advice = ending
    rank, condition = rank_and_condition(found.evidence, found.weights)
    return Solution(
        values=tried.values.copy(),
        covariance=covariance,
        weights=found.weights,
        joint_rms=joint_residuals(runs.problem.evidence, tried.values),
        torque_rms=joint_torques(runs.problem.evidence),
        rank=rank,
        condition=condition,
        degrees=degrees_of_freedom(found.evidence),
        passes=passes,
        cause=cause,
        advice=advice,
        evidence=found.evidence,
    )
