"""Which columns of a linear map are kept as parameters when every parameter that others imply is regrouped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import FAINT, RANK_TOLERANCE

_ROUNDING = 1e-12  # columns and weights below this part of the largest are zero


def independent_columns(matrix: FloatArray, units: Sequence[str], order: Iterable[int]) -> IntArray:
    """Return which columns are kept when they are visited in `order` and those in the span of earlier ones are not.

    As in the numeric base set, what a rounded angle makes of zero does not count: columns below 1e-4 of the largest of
    their unit are passed over, and less than 1e-4 of a column outside the span of the earlier ones is nothing.

    Parameters
    ----------
    matrix : (n, n_p)
    units : of the columns' parameters, (n_p,)

    Returns
    -------
    sorted indices
    """
    norms, names = np.linalg.norm(matrix, axis=0), np.array(units)
    largest = np.array([norms[names == unit].max() for unit in units])
    basis, kept = np.zeros((matrix.shape[0], 0)), []
    for column in order:
        if norms[column] <= max(FAINT * largest[column], _ROUNDING * norms.max()):
            continue
        rest = matrix[:, column] / norms[column]
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > RANK_TOLERANCE:
            kept.append(column)
            basis = np.column_stack([basis, rest / size])
    return np.sort(np.array(kept, dtype=np.intp))


def in_terms_of(matrix: FloatArray, kept: IntArray) -> FloatArray:
    """Return the matrix whose rows span the same space and which is the identity on the columns `kept`, (n_kept, n_p).

    Row k then says which sum of parameters the kept parameter k stands for. Weights of mere rounding are zero.
    """
    scale = np.linalg.norm(matrix, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    weights = np.linalg.lstsq(matrix[:, kept] / scale[kept], matrix / scale, rcond=None)[0]
    weights = weights * scale / scale[kept][:, None]
    weights[np.abs(weights) < _ROUNDING * max(1.0, float(np.abs(weights).max(initial=0.0)))] = 0.0
    weights[:, kept] = np.eye(kept.size)
    return np.asarray(weights)
