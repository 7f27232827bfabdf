"""What all estimators that simulate have in common: the controller, the passes, and why they ended."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.simulated_arm import Moved
from tauhat.errors import ModelError, SimulationError
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.evidence import Evidence, evidence_from_rows
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows
from tauhat.estimation.physical import consistent
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import Rows
from tauhat.estimation.simulated_runs import SimulatedRuns, simulated_runs
from tauhat.estimation.solution import Solution, joint_residuals

_HALVINGS = 4  # of a pass whose parameters move no robot, before it is given up
_PHYSICAL = "; values of consistent bodies, because the free ones move no robot"
_UNKNOWN_LOOP = "give the robot's own law, gains and reference; without them the simulation is not the recorded motion"


class Found(NamedTuple):
    """What one pass found, before it is tried in simulation.

    values : (n_b,)
    weights : (n_v,) of the joints' equations
    evidence : what was solved
    """

    values: FloatArray
    weights: FloatArray
    evidence: Evidence


class Tried(NamedTuple):
    """Parameters (n_b,) that move a robot, and how it moves in every run."""

    values: FloatArray
    motions: tuple[Moved, ...]


class _Passed(NamedTuple):
    """The end of a row of passes: the last values, what the last pass found, and why there was no other.

    stopped : whether a pass led to values that move no robot
    """

    tried: Tried
    last: Found
    passes: int
    cause: str
    advice: str
    stopped: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationEstimator(Estimator):
    """A method that simulates the recorded robot with its controller, again and again.

    loop : law, gains and reference
    inner : least squares for the first values and, where the method has one, for the linear problem of every pass
    tolerance : a pass that asks to move the predicted torque by less than this part of the residual is the last
    most_passes : after which the method stops in any case
    """

    loop: ClosedLoop = field(default_factory=ClosedLoop)
    inner: Estimator = field(default_factory=WeightedLeastSquares)
    tolerance: float = 0.02
    most_passes: int = 15

    def __post_init__(self) -> None:
        super(SimulationEstimator, self).__post_init__()
        if not 0.0 < self.tolerance < 1.0:
            raise ModelError(f"{self.key}: tolerance out of range", expected="0 to 1", got=self.tolerance)
        if self.most_passes < 1:
            raise ModelError(f"{self.key}: at least one pass is needed", got=self.most_passes)

    def settings(self) -> dict[str, Any]:
        """Return plain data: loop, inner method and limits."""
        return {
            "ridge": self.ridge,
            "loop": self.loop.to_dict(),
            "inner": {"name": self.inner.key, **self.inner.settings()},
            "tolerance": self.tolerance,
            "most_passes": self.most_passes,
        }

    def solve(self, evidence: Evidence) -> Solved:
        """Return the values of the inner least squares: nothing can be simulated from evidence alone."""
        return self.inner.solve(evidence)

    @single_threaded
    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution after as many passes as it takes.

        Raises
        ------
        ModelError
            when a term cannot be simulated, or neither least squares nor the nominal robot have a positive definite
            mass matrix.
        SimulationError
            when the closed loop is unstable, or does not follow the measured motion.
        """
        check_rows(problem.evidence)
        runs = simulated_runs(problem, self.loop)
        tried = self._first(runs)
        found = self._passed(runs, tried)
        if found.stopped:
            found = self._from_nominal(runs, tried) or found
        return self.solution(runs, found.tried, found.last, (found.passes, found.cause, found.advice))

    def _from_nominal(self, runs: SimulatedRuns, first: Tried) -> _Passed | None:
        """Return the passes from the description's own values; None where these move no robot or end no better.

        Least squares on badly filtered motion can be so far off that the passes lead to no robot at all.
        """
        try:
            nominal = tried_in(runs, runs.problem.base.projection @ nominal_standard_parameters(runs.problem.model))
        except (ModelError, SimulationError):
            return None
        if np.array_equal(nominal.values, first.values):
            return None
        found = self._passed(runs, nominal)
        return None if found.stopped else found

    def _passed(self, runs: SimulatedRuns, tried: Tried) -> _Passed:
        """Return what as many passes as it takes make of these values."""
        cause, advice, passes, stopped = "", "", 0, False
        while not cause:
            passes += 1
            found = self.improved(runs, tried)
            before = tried
            try:
                wanted, tried = self._step(runs, before, found)
            except (ModelError, SimulationError) as error:
                stopped = True
                cause, advice = f"stopped in pass {passes}: {error.what} ({error.where})", _UNKNOWN_LOOP
            else:
                steps = (values - before.values for values in (wanted, tried.values))
                asked, moved = (torque_change(runs.problem.evidence, step, before.values) for step in steps)
                cause, advice = self._reason(passes, asked, moved)
                cause += _PHYSICAL if cause and wanted is not found.values else ""
        return _Passed(tried, found, passes, cause=cause, advice=advice, stopped=stopped)

    @abstractmethod
    def improved(self, runs: SimulatedRuns, tried: Tried) -> Found:
        """Return what one pass makes of parameters and the motions they cause."""

    @abstractmethod
    def solution(self, runs: SimulatedRuns, tried: Tried, found: Found, ending: tuple[int, str, str]) -> Solution:
        """Return the solution after the last pass; `ending` is the number of passes, cause and advice."""

    def accepts(self, runs: SimulatedRuns, before: Tried, after: Tried) -> bool:  # noqa: ARG002
        """Return whether a step is taken as it is, or halved; every step that can be simulated by default."""
        return True

    def linear_problem(self, runs: SimulatedRuns, found: Found) -> Evidence:  # noqa: ARG002
        """Return the evidence of the last pass, to be solved once more under the constraints of physics."""
        return found.evidence

    def _first(self, runs: SimulatedRuns) -> Tried:
        """Return the values of least squares; consistent or nominal ones where these move no robot."""
        problem = runs.problem
        solved = self.inner.solve(problem.evidence)
        try:
            return tried_in(runs, solved.values)
        except (ModelError, SimulationError) as error:
            reason = error
        with suppress(ModelError, SimulationError):
            return tried_in(runs, _consistent(problem, problem.evidence, solved.weights))
        with suppress(ModelError, SimulationError):
            return tried_in(runs, problem.base.projection @ nominal_standard_parameters(problem.model))
        raise reason

    def _step(self, runs: SimulatedRuns, tried: Tried, found: Found) -> tuple[FloatArray, Tried]:
        """Return the values wanted, (n_b,), and those that a robot moves with.

        Wanted are the values found or, where these move no robot, those of consistent bodies that fit as well as such
        can; tried is as far on the way to them as a robot moves and the method accepts.
        """
        wanted, after = found.values, _moving(runs, found.values)
        if after is None:
            with suppress(ModelError):
                wanted = _consistent(runs.problem, self.linear_problem(runs, found), found.weights)
                after = _moving(runs, wanted)
        for halving in range(1, _HALVINGS + 1):
            if after is not None and self.accepts(runs, tried, after):
                return wanted, after
            values = tried.values + (wanted - tried.values) / 2**halving
            after = tried_in(runs, values) if halving == _HALVINGS else _moving(runs, values)
        return wanted, after if after is not None and self.accepts(runs, tried, after) else tried

    def _reason(self, passes: int, asked: float, moved: float) -> tuple[str, str]:
        """Return cause and advice, empty while passes go on; a step that was only taken in part has not converged."""
        words = f"the last pass moved the torque by {100 * moved:.2g} % of the residual"
        if asked < self.tolerance:
            return f"converged after {_counted(passes)}: {words}", ""
        if moved == 0.0:
            step = f"its step, {100 * asked:.2g} % of the residual in the torque"
            return f"stopped in pass {passes}: no part of {step}, lowers the misfit", _UNKNOWN_LOOP
        if passes == self.most_passes:
            return f"stopped after {_counted(passes)}: {words}", _UNKNOWN_LOOP
        return "", ""


def _counted(passes: int) -> str:
    return "1 pass" if passes == 1 else f"{passes} passes"


def tried_in(runs: SimulatedRuns, values: FloatArray) -> Tried:
    """Return the motions of every run with these parameters.

    Raises
    ------
    ModelError
        when the mass matrix is not positive definite.
    SimulationError
        when the closed loop is unstable or does not follow the measured motion.
    """
    motions = []
    for run in runs.runs:
        moved = runs.moved(run, values)
        runs.check_following(run, moved)
        motions.append(moved)
    return Tried(values, tuple(motions))


def _moving(runs: SimulatedRuns, values: FloatArray) -> Tried | None:
    """Return the motions with these parameters; None where they move no robot."""
    try:
        return tried_in(runs, values)
    except (ModelError, SimulationError):
        return None


def merged_evidence(runs: SimulatedRuns, pieces: Iterable[Rows]) -> Evidence:
    """Return the evidence of one piece of rows a recording."""
    parts = (
        evidence_from_rows(runs.layout, runs.problem.base, (piece,), name=run.name)
        for run, piece in zip(runs.runs, pieces, strict=True)
    )
    return reduce(Evidence.merged, parts)


def torque_change(evidence: Evidence, change: FloatArray, values: FloatArray) -> float:
    """Return by how much a change of the parameters moves the predicted torque, over the residual.

    Each joint counts by its own residual.
    """
    residual = np.maximum(joint_residuals(evidence, values), np.finfo(float).tiny)
    squares = [
        np.sum((factor[:, :-1] @ change[support]) ** 2)
        for support, factor in zip(evidence.supports, evidence.total.factors, strict=True)
    ]
    return float(np.sqrt(np.mean(np.array(squares) / evidence.n_t / residual**2)))


def _consistent(problem: Problem, evidence: Evidence, weights: FloatArray) -> FloatArray:
    """Return the values of bodies of positive density that fit the evidence best, (n_b,)."""
    return consistent(evidence, problem.model, problem.base, weights=weights).values
