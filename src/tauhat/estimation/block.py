"""Factors of one stretch of a log: what evidence is kept in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Block:
    """Factors of one stretch of time.

    factors : per joint (k, p_j + 1), k <= p_j + 1 after reduction; the last column is the torque
    n_t : number of rows that went in, per joint
    log : which recording they are of, for `block_merging`
    """

    factors: tuple[FloatArray, ...]
    n_t: int
    log: str = ""

    def __post_init__(self) -> None:
        for factor in self.factors:
            read_only(factor)

    def merged(self, other: Block) -> Block:
        """Return the block of both stretches."""
        pairs = zip(self.factors, other.factors, strict=True)
        factors = tuple(reduced(np.vstack(pair)) for pair in pairs)
        return Block(factors=factors, n_t=self.n_t + other.n_t, log=self.log)

    def reduced(self) -> Block:
        """Return the same block with every factor no taller than wide."""
        return replace(self, factors=tuple(reduced(factor) for factor in self.factors))

    def of_log(self, log: str) -> Block:
        """Return the same block under the name of a recording."""
        return replace(self, log=log)


def reduced(rows: FloatArray) -> FloatArray:
    """Return a factor with the same Gram matrix and no more rows than columns."""
    if rows.shape[0] <= rows.shape[1]:
        return rows
    from scipy.linalg.lapack import dgeqrf

    packed, _, _, _ = dgeqrf(rows)
    factor = np.array(packed[: rows.shape[1]], order="C")
    factor[_below_diagonal(rows.shape[1])] = 0.0
    return factor


@cache
def _below_diagonal(size: int) -> NDArray[np.bool_]:
    # Made once: np.triu makes its mask anew, in twice the time that everything else here takes.
    mask = np.tri(size, k=-1, dtype=np.bool_)
    mask.setflags(write=False)
    return mask
