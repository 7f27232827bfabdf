"""Closed-loop output error: the parameters whose simulation under the robot's controller comes nearest to the log.

    CLOE  minimise |q - q_s(x)|           CLIE  minimise |tau - tau_s(x)|, the torque the simulated controller asks for

by Gauss-Newton. Both sides pass the same low-pass. The sensitivities are finite differences: one simulation a
parameter, spread over threads, the controller kept as it is. `J x_new = e + J x` is linear in the new parameters, so
that one pass is a least-squares problem like any other, with evidence, weights by each joint's own residual, and error
bars. A step that does not lower the misfit is halved.

Source: Landau, "An output error recursive algorithm for unbiased identification in closed loop", 1997; Gautier, Janot,
Vandanjon 2013 compare both for robots.
"""

from __future__ import annotations

import os
from abc import abstractmethod
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import reduce
from typing import Any, ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import Layout
from tauhat.dynamics.simulated_arm import Moved
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence, evidence_from_rows
from tauhat.estimation.least_squares import WeightedLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import Rows
from tauhat.estimation.simulated_runs import Run, SimulatedRuns
from tauhat.estimation.simulated_solution import simulated_solution
from tauhat.estimation.simulating import Found, SimulationEstimator, Tried
from tauhat.estimation.solution import Solution, honest_covariance, joint_torques
from tauhat.recordings.filters import filtered

_BY_RESIDUAL = WeightedLeastSquares(power=1.0)
_WEAKEST = 1e-3  # of the largest torque: a joint with less is taken to have that much


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputError(SimulationEstimator):
    """Gauss-Newton on an output of the simulated closed loop.

    difference : by which a parameter is changed for its sensitivity, in parts of the torque of the joint it loads most
    threads : simulations at a time; as many as the machine has processors where zero
    """

    difference: float = 1e-3
    threads: int = 0

    def __post_init__(self) -> None:
        super(OutputError, self).__post_init__()
        if not 0.0 < self.difference < 1.0:
            raise ModelError(f"{self.key}: difference out of range", expected="0 to 1", got=self.difference)
        if self.threads < 0:
            raise ModelError(f"{self.key}: threads cannot be negative", got=self.threads)

    @abstractmethod
    def measured(self, run: Run) -> FloatArray:
        """Return what was logged, (n_v, n_t)."""

    @abstractmethod
    def simulated(self, moved: Moved) -> FloatArray:
        """Return the same of a simulation, (n_v, n_t)."""

    def settings(self) -> dict[str, Any]:
        """Return plain data."""
        return {**super(OutputError, self).settings(), "difference": self.difference}

    def improved(self, runs: SimulatedRuns, tried: Tried) -> Found:
        """Return the Gauss-Newton solution around these parameters."""
        steps = self.difference * _scales(runs.problem.evidence)
        pairs = zip(runs.runs, tried.motions, strict=True)
        evidence = reduce(
            Evidence.merged, (self._linear(runs, run, tried.values, (moved, steps)) for run, moved in pairs)
        )
        solved = _BY_RESIDUAL.solve(evidence)
        return Found(solved.values, solved.weights, evidence)

    def accepts(self, runs: SimulatedRuns, before: Tried, after: Tried) -> bool:
        """Return whether the step has lowered the misfit."""
        return self._misfit(runs, after) < self._misfit(runs, before)

    def solution(self, runs: SimulatedRuns, tried: Tried, found: Found, ending: tuple[int, str, str]) -> Solution:
        """Return values and error bars of the last linear problem; residuals are those of the torque."""
        covariance = honest_covariance(found.evidence, found.weights, found.values, ridge=0.0)
        return simulated_solution(runs, tried, found, ending, covariance=covariance)

    def _linear(self, runs: SimulatedRuns, run: Run, values: FloatArray, around: tuple[Moved, FloatArray]) -> Evidence:
        """Return the evidence of `J x_new = e + J x` of one run."""
        moved, steps = around
        controller = runs.controller(run, values)
        t, here = self._filtered(runs, run, self.simulated(moved))

        def column(index: int) -> FloatArray:
            changed = values.copy()
            changed[index] += steps[index]
            there = self._filtered(runs, run, self.simulated(runs.moved(run, changed, controller)))[1]
            return np.asarray((there - here) / steps[index])

        with ThreadPoolExecutor(self.threads or os.cpu_count() or 1) as pool:
            slopes = np.array(list(pool.map(column, range(values.size))))
        target = self._filtered(runs, run, self.measured(run))[1] - here + np.tensordot(values, slopes, axes=1)
        n_v, n_b = target.shape[0], values.size
        layout = Layout(np.tile(runs.problem.base.independent, n_v), n_b * np.arange(n_v + 1), ())
        rows = Rows(t, slopes.transpose(1, 0, 2).reshape(n_v * n_b, -1), target, np.zeros_like(target))
        return evidence_from_rows(layout, runs.problem.base, (rows,), name=run.name)

    def _filtered(self, runs: SimulatedRuns, run: Run, signal: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return times and a signal (n_v, n_t) low-passed and decimated, where rows are trusted."""
        low_pass = runs.problem.processing.parallel_filter(1.0 / run.step)
        smooth = filtered(signal, low_pass)
        t = run.t[:: low_pass.decimation]
        kept = (t >= run.begin) & (t <= run.end)
        return t[kept], smooth[:, kept]

    def _misfit(self, runs: SimulatedRuns, tried: Tried) -> float:
        """Return the sum of the logarithms of the joints' residuals: their likelihood with unknown noise."""
        squares = 0.0
        for run, moved in zip(runs.runs, tried.motions, strict=True):
            error = self._filtered(runs, run, self.measured(run) - self.simulated(moved))[1]
            squares = squares + np.sum(error**2, axis=1)
        return float(np.sum(np.log(np.maximum(squares, np.finfo(float).tiny))))


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoopOutputError(OutputError):
    """The simulated position comes nearest to the measured one; only with the robot's own law, gains and reference.

    A law tuned to the parameters, or a reference made of the measured position, is followed by any parameters.

    Source: Landau 1997; Gautier, Janot, Vandanjon 2013.
    """

    key: ClassVar[str] = "cloe"

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution.

        Raises
        ------
        ModelError
            when law or reference are not known.
        """
        if not self.loop.known:
            raise ModelError(
                "the position error of a closed loop says nothing without the robot's own law and reference",
                remedy="give both (--controller, or a ClosedLoop with law and references), or take idim-iv or didim",
            )
        return super(ClosedLoopOutputError, self).fit_problem(problem)

    def measured(self, run: Run) -> FloatArray:
        """Return the position [rad or m]."""
        return run.q

    def simulated(self, moved: Moved) -> FloatArray:
        """Return the position [rad or m]."""
        return moved.q


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoopInputError(OutputError):
    """The torque that the simulated controller asks for comes nearest to the measured one.

    Source: Gautier, Janot, Vandanjon 2013 (the same with DIDIM's simplified sensitivities).
    """

    key: ClassVar[str] = "clie"

    def measured(self, run: Run) -> FloatArray:
        """Return the torque [Nm or N]."""
        return run.tau

    def simulated(self, moved: Moved) -> FloatArray:
        """Return the torque of the simulated controller [Nm or N]."""
        return moved.tau


def _scales(evidence: Evidence) -> FloatArray:
    """Return for each parameter the change that alters the torque of the joint it loads most by its whole size."""
    torque = joint_torques(evidence)
    torque = np.maximum(torque, _WEAKEST * torque.max())
    share = np.zeros(evidence.n_b)
    for joint, (support, factor) in enumerate(zip(evidence.supports, evidence.total.factors, strict=True)):
        column = np.linalg.norm(factor[:, :-1], axis=0) / np.sqrt(evidence.n_t)
        share[support] = np.maximum(share[support], column / torque[joint])
    return np.asarray(1.0 / np.maximum(share, np.finfo(float).tiny))
