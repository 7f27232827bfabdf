"""Two neural recursions for comparison: Adaline and Hopfield-Tank, on the filtered rows.

Both work on scaled rows: torque of joint j over its residual r_j, every column over its root mean square, so that
`W` has columns of unit size and `e = W z - y` is in standard deviations.

Adaline (normalised least mean squares), one row at a time, all joints of a sample being n_v rows:

    z += mu w (y - w'z) / (w'w)                      converges for 0 < mu < 2, fastest at 1

At a constant step it keeps walking about the solution, the wider the larger mu. Pass p therefore takes `mu / p^(2/3)`:
the steps add up to infinity and their squares do not, as Robbins and Monro (1951) ask. What it solves is least squares
with every row divided by its own length.

Hopfield-Tank: neurons `z = z_0 + c tanh(u)` that cannot leave the box of half width c, driven down the energy
`E = |W z - y|^2 / 2n` of everything seen so far, `A = W'W/n`, `b = W'y/n`:

    u += eta (b - A z)                               eta = 1 / (c trace A): below 2 over the largest slope times
                                                     eigenvalue, hence E never rises

Either has settled when no column goes with the residual any more: the mean of column times residual is below a
tolerance times the torque. (That the values hardly change says nothing: steps shrink, and bad directions are slow.)

Source: Widrow, Hoff, "Adaptive switching circuits", 1960; Tank, Hopfield, "Simple neural optimization networks", 1986;
Alonso, Mendonca, Rocha, "Hopfield neural networks for on-line parameter estimation", 2009.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.filters.outcome import Found, Recursion, residual_weights, solution_of
from tauhat.estimation.filters.samples import row_samples, units_of
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution

_SATURATED = 0.99  # of its box: a parameter there has been stopped by it
_SHRINKING = 2.0 / 3.0  # power of the pass by which Adaline's step shrinks
_SLOW = "it is slow along what the motion hardly shows: raise `passes`, or use least squares on the same rows"


class ScaledRows(NamedTuple):
    """Rows of unit columns (n, n_b), torque in residuals (n,), column units (n_b,), joint weights (n_v,)."""

    matrix: FloatArray
    target: FloatArray
    units: FloatArray
    weights: FloatArray


def scaled_rows(problem: Problem) -> ScaledRows:
    """Return all rows of a problem in scaled form, joints of a sample one after the other."""
    _, weights = residual_weights(problem.evidence)
    samples = list(row_samples(problem))
    matrix = np.concatenate([weights[:, None] * sample.columns for sample in samples])
    target = np.concatenate([weights * sample.tau for sample in samples])
    units_of(problem.evidence)  # refuses silent columns
    units = np.sqrt(np.mean(matrix**2, axis=0))
    return ScaledRows(matrix / units, target, units, weights)


@dataclass(frozen=True, slots=True, kw_only=True)
class Adaline(Recursion):
    """Normalised least mean squares on the filtered rows, pass after pass with a shrinking step.

    step : mu of the first pass
    passes : at most over the recordings
    tolerance : largest mean of scaled column times residual, in parts of the torque, that counts as settled
    """

    key: ClassVar[str] = "adaline"
    step: float = 1.0
    passes: int = 200
    tolerance: float = 5e-4

    def __post_init__(self) -> None:
        super(Adaline, self).__post_init__()
        if not 0.0 < self.step < 2.0:
            raise ModelError("the step of least mean squares is out of range", expected="0 to 2", got=self.step)
        _check_passes(self.passes, self.tolerance)

    def move(self, values: FloatArray, row: FloatArray, target: float, *, step: float) -> FloatArray:
        """Return the scaled values after one row (n_b,)."""
        square = max(float(row @ row), np.finfo(float).tiny)
        return np.asarray(values + step * (target - row @ values) / square * row)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the values after the last pass; the cause says whether they had settled."""
        rows = scaled_rows(problem)
        norms = np.maximum(np.einsum("ij,ij->i", rows.matrix, rows.matrix), np.finfo(float).tiny)
        directions = rows.matrix / norms[:, None]
        level = float(np.sqrt(np.mean(rows.target**2)))
        values = np.zeros(problem.base.n_b)
        for done in range(1, self.passes + 1):
            step = self.step / done**_SHRINKING
            for row, direction, target in zip(rows.matrix, directions, rows.target, strict=True):
                values = values + (step * (target - row @ values)) * direction  # `move`, norms found once
            pull = problem.base.n_b * (rows.target - rows.matrix @ values) @ directions / rows.target.size
            if np.abs(pull).max() <= self.tolerance * level:
                return _solution(problem, rows, values, passes=done, cause=(f"settled after {done} passes", ""))
        cause = f"not settled after {self.passes} passes", _SLOW
        return _solution(problem, rows, values, passes=self.passes, cause=cause)


@dataclass(frozen=True, slots=True, kw_only=True)
class HopfieldTank(Recursion):
    """Bounded neurons that descend the energy of all rows seen so far.

    box : half width c of each scaled parameter's box, in parts of what would make the whole torque
    passes : over the recordings at most; from the second on all rows are known
    tolerance : as in `Adaline`
    """

    key: ClassVar[str] = "hopfield"
    box: float = 20.0
    passes: int = 200
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        super(HopfieldTank, self).__post_init__()
        if not 0.0 < self.box < np.inf:
            raise ModelError("the neurons' box must be positive", got=self.box)
        _check_passes(self.passes, self.tolerance)

    def move(self, neurons: FloatArray, gram: FloatArray, right: FloatArray, *, size: float) -> FloatArray:
        """Return the neurons' inputs after one step down the energy `z'A z/2 - b'z`, `z = size tanh(u)`."""
        values = size * np.tanh(neurons)
        return np.asarray(neurons + (right - gram @ values) / (size * np.trace(gram)))

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the values after the last pass; the cause says whether they had settled, or met their box."""
        rows = scaled_rows(problem)
        size = self.box * float(np.sqrt(np.mean(rows.target**2)))
        n, n_v = rows.target.size, problem.model.robot.n_v
        gram, right = np.zeros((problem.base.n_b,) * 2), np.zeros(problem.base.n_b)
        neurons = np.zeros(problem.base.n_b)
        for k in range(0, n, n_v):
            part = slice(k, k + n_v)
            gram += rows.matrix[part].T @ rows.matrix[part] / n
            right += rows.matrix[part].T @ rows.target[part] / n
            neurons = self.move(neurons, gram, right, size=size)
        return self._settled(problem, rows, (gram, right, size), neurons)

    def _settled(
        self, problem: Problem, rows: ScaledRows, energy: tuple[FloatArray, FloatArray, float], neurons: FloatArray
    ) -> Solution:
        """Return the solution after further passes on all rows."""
        gram, right, size = energy
        each = rows.target.size // problem.model.robot.n_v
        for done in range(2, self.passes + 1):
            for _ in range(each):
                neurons = self.move(neurons, gram, right, size=size)
            filled = np.tanh(neurons)
            if np.abs(filled).max() > _SATURATED:
                met = f"{int((np.abs(filled) > _SATURATED).sum())} parameters met their box"
                return _solution(problem, rows, size * filled, passes=done, cause=(met, "raise `box`"))
            if np.abs(right - gram @ (size * filled)).max() <= self.tolerance * size / self.box:
                return _solution(problem, rows, size * filled, passes=done, cause=(f"settled after {done} passes", ""))
        cause = f"not settled after {self.passes} passes", _SLOW
        return _solution(problem, rows, size * np.tanh(neurons), passes=self.passes, cause=cause)


def _solution(
    problem: Problem, rows: ScaledRows, values: FloatArray, *, passes: int, cause: tuple[str, str]
) -> Solution:
    """Return the solution of scaled values; `cause` holds cause and advice."""
    return solution_of(problem.evidence, Found(values / rows.units, rows.weights, passes, *cause))


def _check_passes(passes: int, tolerance: float) -> None:
    if not (passes >= 1 and 0.0 < tolerance < 1.0):
        raise ModelError(
            "passes and tolerance", expected="at least 1, and between 0 and 1", got=f"{passes}, {tolerance}"
        )
