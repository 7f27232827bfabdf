"""Recursive least squares with forgetting: the estimate at every time, from what the past still says.

A square-root information filter on evidence. With H the half-life and dt the time since the last row, the factors of
the past shrink by `0.5^(dt / 2H)` (their squares by `0.5^(dt / H)`), and new rows merge by one QR:

    R(t) = qr([0.5^(dt / 2H) R(t - dt); Y_j(t) tau_j(t)])     for every joint

Each row is forgotten by its own age, so that the result does not depend on how the stream is cut. Joints' weights
follow from the remembered residuals, as in weighted least squares; without forgetting it is just that.

Error bars: rows of weights w are worth `n = (sum w)^2 / sum w^2` whole ones (Kish). Steady excitation and white
residuals of variance `s^2 = sum w e^2 / sum w` then make the covariance `s^2 (sum w^2 / sum w) (A'WA)^-1`, and of the
groups of time of the jackknife the same share counts as of the rows.

Source: Bierman, "Factorization methods for discrete sequential estimation", 1977, ch. 5; Ljung, "System
identification", 1999, ch. 11.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.errors import ModelError
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows, degrees_of_freedom
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import RepeatedRows, repeated_rows
from tauhat.estimation.rows import Rows
from tauhat.estimation.solution import (
    Solution,
    honest_covariance,
    joint_residuals,
    joint_torques,
    rank_and_condition,
)

_LEAST = np.finfo(float).eps ** 2  # weight that is left at least: less would make factors denormal and says nothing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Memory:
    """What is remembered at a time.

    block : per joint the factor of what was seen, rows times the root of what is left of them
    t : of the last row [s]; nothing was seen before where it is minus infinity
    rows : left, per joint: their weights' sum
    seen : rows, per joint
    """

    block: Block
    t: float
    rows: float
    seen: int


class _Worth(NamedTuple):
    """How many whole rows the remembered ones are worth, per joint; the sums of their weights, and of these squared."""

    rows: float
    total: float
    squares: float


class Track(NamedTuple):
    """Parameters along time.

    t : (n,) [s] since the first recording's first row; recordings follow each other without a pause
    values : (n, n_b)
    """

    t: FloatArray
    values: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class RecursiveLeastSquares(Estimator):
    """Weighted least squares on a fading memory; the solution is that at the end.

    half_life : time after which a row counts half [s]; None: never forgotten
    power : of the joints' residuals in their weights
    """

    key: ClassVar[str] = "recursive"
    half_life: float | None = 60.0
    power: float = 0.5

    def __post_init__(self) -> None:
        super(RecursiveLeastSquares, self).__post_init__()
        WeightedLeastSquares(power=self.power)
        if self.half_life is not None and not 0.0 < self.half_life < np.inf:
            raise ModelError("the half-life must be positive", got=f"{self.half_life} s")

    @property
    def rate(self) -> float:
        """Half-lives a second [1/s]."""
        return 0.0 if self.half_life is None else 1.0 / self.half_life

    def solve(self, evidence: Evidence) -> Solved:
        """Return the solution without forgetting: evidence does not know the age of its rows."""
        return self._weighted.solve(evidence)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution at the end of the last recording."""
        if self.half_life is None:
            return self._weighted.fit(problem.evidence)
        check_rows(problem.evidence)
        rows = repeated_rows(problem)
        worth = self._worth(rows)
        faded = self.faded(rows)
        solved = self._weighted.solve(faded)
        rank, condition = rank_and_condition(faded, solved.weights)
        left = np.exp2(-_starts(problem)[-1] * self.rate)
        spread = _variance(faded, solved, worth)
        return Solution(
            values=solved.values,
            covariance=honest_covariance(faded, solved.weights, solved.values, ridge=self.ridge, variance=spread),
            weights=solved.weights,
            joint_rms=joint_residuals(problem.evidence, solved.values),
            torque_rms=joint_torques(problem.evidence),
            rank=rank,
            condition=condition,
            degrees=max(1, round((degrees_of_freedom(faded) + 1) * worth.rows / faded.n_t) - 1),
            passes=solved.passes,
            cause=f"solved at the end; of the first row {float(f'{100 * left:.2g}'):g} % is left",
            evidence=faded,
        )

    def start(self, problem: Problem) -> Memory:
        """Return the memory of nothing."""
        factors = tuple(np.zeros((0, support.size + 1)) for support in problem.evidence.supports)
        return Memory(block=Block(factors=factors, n_t=0), t=-np.inf, rows=0.0, seen=0)

    def step(self, memory: Memory, piece: Rows, bounds: IntArray) -> Memory:
        """Return the memory after more rows.

        Parameters
        ----------
        piece : consecutive rows after those remembered
        bounds : of each joint's columns, `Layout.bounds`
        """
        end = float(piece.t[-1])
        left = np.exp2((piece.t - end) * self.rate)
        past = float(np.exp2((memory.t - end) * self.rate)) if memory.seen else 0.0
        factors = []
        for joint, old in enumerate(memory.block.factors):
            columns = piece.columns[bounds[joint] : bounds[joint + 1]]
            new = np.sqrt(left) * np.concatenate([columns, piece.tau[joint : joint + 1]])
            factors.append(np.vstack([np.sqrt(past) * old, new.T]))
        seen = memory.seen + piece.t.size
        return Memory(
            block=Block(factors=tuple(factors), n_t=seen).reduced(),
            t=end,
            rows=past * memory.rows + float(left.sum()),
            seen=seen,
        )

    def values(self, memory: Memory, supports: tuple[IntArray, ...], n_b: int) -> FloatArray:
        """Return the parameters that the memory holds, (n_b,).

        Parameters
        ----------
        supports : per joint, which parameters load it, `Evidence.supports`
        """
        return self._weighted.solve(Evidence(supports=supports, n_b=n_b, blocks=(memory.block,))).values

    def track(self, problem: Problem, *, every: float) -> Track:
        """Return the parameters along the recordings.

        Parameters
        ----------
        every : time between the values [s]; there are none before there are more rows than parameters
        """
        rows, starts = repeated_rows(problem), _starts(problem)
        memory, evidence = self.start(problem), problem.evidence
        times: list[float] = []
        values: list[FloatArray] = []
        for index, pieces in enumerate(rows.recordings()):
            for part in (part for piece in pieces for part in _cut(piece, every)):
                memory = self.step(memory, part._replace(t=part.t + starts[index]), rows.layout.bounds)
                if evidence.n_v * memory.seen > evidence.n_b:
                    times.append(memory.t)
                    values.append(self.values(memory, evidence.supports, evidence.n_b))
        return Track(np.array(times), np.array(values).reshape(-1, evidence.n_b))

    def faded(self, rows: RepeatedRows) -> Evidence:
        """Return the evidence of all rows, each times the root of what is left of it at the end."""
        starts, n_v = _starts(rows.problem), len(rows.places)
        return rows.weighted(lambda piece, index: np.tile(self._left(piece.t + starts[index], starts[-1]), (n_v, 1)))

    def _worth(self, rows: RepeatedRows) -> _Worth:
        """Return what the remembered rows are worth.

        Raises
        ------
        ModelError
            when that is no more than there are parameters.
        """
        starts, evidence = _starts(rows.problem), rows.problem.evidence
        total, squares = 0.0, 0.0
        for index, pieces in enumerate(rows.recordings()):
            for piece in pieces:
                left = np.exp2((piece.t + starts[index] - starts[-1]) * self.rate)
                total, squares = total + float(left.sum()), squares + float(left @ left)
        if evidence.n_v * total <= evidence.n_b:
            raise ModelError(
                f"a half-life of {self.half_life:g} s leaves {evidence.n_v * total:.2g} filtered rows, which cannot "
                f"determine {evidence.n_b} base parameters",
                remedy="remember longer",
            )
        return _Worth(total**2 / squares, total, squares)

    def _left(self, t: FloatArray, end: float) -> FloatArray:
        return np.maximum(np.exp2((t - end) * self.rate), _LEAST)

    @property
    def _weighted(self) -> WeightedLeastSquares:
        return WeightedLeastSquares(power=self.power, ridge=self.ridge)


def _variance(faded: Evidence, solved: Solved, worth: _Worth) -> float:
    """Return the variance of the weighted residuals, made for the faded rows' own bend; see the head of this file."""
    squares = float(np.sum((solved.weights * joint_residuals(faded, solved.values)) ** 2)) * faded.n_t
    free = max(1.0, faded.n_v * worth.rows - faded.n_b) / worth.rows
    return squares / worth.total / free * worth.squares / worth.total


def _starts(problem: Problem) -> FloatArray:
    """Return what takes each recording's time to the common one, and the end of all, (n_recordings + 1,) [s]."""
    ends = np.cumsum([recording.duration for recording in problem.recordings])
    before = ends - [float(recording.t[-1]) for recording in problem.recordings]
    return np.append(before, ends[-1])


def _cut(piece: Rows, span: float) -> Iterator[Rows]:
    """Yield the piece in stretches of at most `span` seconds."""
    place = np.floor((piece.t - piece.t[0]) / span)
    edges = [0, *(np.flatnonzero(np.diff(place)) + 1).tolist(), piece.t.size]
    for start, stop in pairwise(edges):
        yield Rows(piece.t[start:stop], piece.columns[:, start:stop], piece.tau[:, start:stop], piece.dq[:, start:stop])
