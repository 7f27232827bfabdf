"""Cross-validated gain of further columns: how much of a residual they remove where they were not fitted.

The residual `r` of one joint on one recording is cut into stretches of time. On all but one of them
    |r - D u - C b|^2 + s^2 k |u|^2 / w^2
is solved for b, the candidate's free coefficients, and for u, the error of the model's own parameters in deviations of
their covariance (`D D'` is that of the predicted torque); the one left out judges. `s^2` is the variance of the
residual, k how many rows one independent one is worth, and w by how many standard errors parameters may be off: none,
one, and so on to 10 000, whatever predicts best, with b and without. So a column that the model has in other words
gains nothing, parameters that the fit has bent to make up for a missing effect are free to go back, and what refitted
parameters explain by themselves is not credited to an effect: its share is what only the effect can explain.

Source: ridge as prior knowledge, Hoerl, Kennard 1970; blocked cross-validation, Burman, Chow, Nolan 1994.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, IntArray

WIDTHS = (1e-3, 1.0, 10.0, 1e2, 1e3, 1e4)  # standard errors that parameters may be off
_SUREST = 1e-12  # standard error below which there is none
_OPTIMISM = 2.5  # a residual looks shorter in memory after a fit than the noise behind it is
_RIDGE = 1e-6  # of the columns' own squares: candidates that cannot be told from another


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Folds:
    """The squares and products of columns and residual in each stretch of time.

    columns : (m + 1, n), the residual last; of unit root mean square but the parameters' own
    grams : (n_folds, m + 1, m + 1) their products
    n_own : columns of the parameters' errors, which come first
    penalty : `s^2 k`, of one parameter error of one standard error
    """

    columns: FloatArray
    grams: FloatArray
    n_own: int
    penalty: float

    @classmethod
    def of(cls, own: FloatArray, others: FloatArray, residual: FloatArray, *, folds: int, redundancy: float) -> Folds:
        """Return the folds of columns (k, n) and a residual (n,); a row in `redundancy` is independent."""
        size = np.sqrt(np.mean(others**2, axis=1))
        columns = np.vstack([own, others / np.where(size > 0.0, size, 1.0)[:, None], residual])
        grams = np.array([part @ part.T for part in np.array_split(columns, folds, axis=1)])
        return cls(columns=columns, grams=grams, n_own=len(own), penalty=float(np.mean(residual**2)) * redundancy)

    @property
    def squares(self) -> FloatArray:
        """Squared residual of each fold, (n_folds,)."""
        return np.asarray(self.grams[:, -1, -1])

    def left(self, chosen: IntArray, *, width: float) -> FloatArray:
        """Return the squared residual of each fold that the fit on the others leaves, (n_folds,).

        Parameters
        ----------
        chosen : which of the other columns are in
        width : standard errors that the parameters may be off
        """
        return self._judged(self._solutions(chosen, width), chosen)

    def free(self, chosen: IntArray) -> FloatArray:
        """Return the best of `left` over the widths, as a whole."""
        return self.left(chosen, width=self._best_width(chosen))

    def remaining(self, chosen: IntArray) -> FloatArray:
        """Return the residual that a fit of these columns on the whole recording leaves, (n,)."""
        places = self._places(chosen)
        solution = self._solved(self.grams.sum(axis=0)[None], chosen, self._best_width(chosen))[0]
        return np.asarray(self.columns[-1] - solution @ self.columns[places])

    def _best_width(self, chosen: IntArray) -> float:
        return min(WIDTHS, key=lambda width: float(self.left(chosen, width=width).sum()))

    def free_choice(self, fixed: IntArray, choices: tuple[IntArray, ...]) -> tuple[FloatArray, IntArray]:
        """Return what is left when each fold takes the choice that fits best on the others, and all folds together's.

        Parameters
        ----------
        fixed : columns that are in, whatever is chosen
        choices : columns of each choice
        """
        width = self._best_width(fixed)
        inside = np.empty((len(choices), len(self.grams)))
        outside = np.empty_like(inside)
        for row, choice in enumerate(choices):
            chosen = np.concatenate([fixed, choice])
            solutions = self._solutions(chosen, width)
            outside[row] = self._judged(solutions, chosen)
            inside[row] = self._fitted(solutions, chosen)
        best = inside.argmin(axis=0)
        return outside[best, np.arange(len(self.grams))], choices[int(inside.sum(axis=1).argmin())]

    def _places(self, chosen: IntArray) -> IntArray:
        return np.concatenate([np.arange(self.n_own), self.n_own + chosen])

    def _solutions(self, chosen: IntArray, width: float) -> FloatArray:
        """Return the solutions on all folds but one, (n_folds, m)."""
        return self._solved(self.grams.sum(axis=0) - self.grams, chosen, width)

    def _solved(self, training: FloatArray, chosen: IntArray, width: float) -> FloatArray:
        places = self._places(chosen)
        matrix = training[:, places[:, None], places[None]]
        ridge = np.concatenate([np.full(self.n_own, self.penalty / width**2), np.zeros(chosen.size)])
        diagonal = np.einsum("fkk->fk", matrix)
        diagonal += ridge + _RIDGE * diagonal + np.finfo(float).tiny
        return np.asarray(np.linalg.solve(matrix, training[:, places, -1][..., None])[..., 0])

    def _judged(self, solutions: FloatArray, chosen: IntArray) -> FloatArray:
        return self._squares(self.grams, solutions, chosen)

    def _fitted(self, solutions: FloatArray, chosen: IntArray) -> FloatArray:
        return self._squares(self.grams.sum(axis=0) - self.grams, solutions, chosen)

    def _squares(self, grams: FloatArray, solutions: FloatArray, chosen: IntArray) -> FloatArray:
        places = self._places(chosen)
        matrix, right = grams[:, places[:, None], places[None]], grams[:, places, -1]
        bent = np.einsum("fk,fkl,fl->f", solutions, matrix, solutions)
        return np.asarray(grams[:, -1, -1] - 2.0 * np.einsum("fk,fk->f", solutions, right) + bent)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gain:
    """Share of the squared residual that columns remove, with its standard error over the folds and its p-value."""

    share: float
    standard_error: float
    p: float


def gain(before: FloatArray, after: FloatArray, whole: FloatArray) -> Gain:
    """Return the gain from squared residuals `before` to `after`, in parts of `whole`, (n_folds,) each.

    The standard error is that of a ratio of sums over folds, the p-value that of no gain, one-sided, by Student's t.
    """
    from scipy.special import stdtr

    tiny = float(np.finfo(float).tiny)
    count, total = len(whole), max(float(before.sum()), tiny)
    part = float((before - after).sum()) / total
    spread = count / (count - 1) * float(np.sum((before - after - part * before) ** 2))
    error = max(float(np.sqrt(spread)) / total, _SUREST)
    scale = total / max(float(whole.sum()), tiny)
    return Gain(share=scale * part, standard_error=scale * error, p=float(stdtr(count - 1, -part / error)))


def chance_of_gain(before: FloatArray, after: FloatArray, *, columns: int, effective: float) -> float:
    """Return how likely so many columns gain as much by chance among `effective` independent rows, by Fisher's F.

    Folds that are short beside the memory of a residual are not independent of one another; `effective` is counted on
    what the columns leave, so that an effect's own slow shape does not count against it.
    """
    from scipy.special import fdtrc

    left, gained = float(after.sum()), float((before - after).sum())
    free = max(effective / _OPTIMISM - columns - 1.0, 1.0)
    return float(fdtrc(columns, free, gained / columns / max(left / free, np.finfo(float).tiny))) if gained > 0 else 1.0


def passing(p_values: FloatArray, *, rate: float) -> float:
    """Return the largest p-value that counts, so that a share `rate` of what is named is false; -1 where none does.

    Where nothing is there at all, that is the chance of naming anything.

    Source: Benjamini, Hochberg, "Controlling the false discovery rate", 1995.
    """
    ordered = np.sort(p_values)
    allowed = np.flatnonzero(ordered <= rate * np.arange(1, ordered.size + 1) / max(ordered.size, 1))
    return float(ordered[allowed[-1]]) if allowed.size else -1.0
