"""Least squares and total least squares for a homogeneous problem with one known number.

Rows `A = [C, k, T]` stand for `C y + k + T g = 0`: clean columns C, the column k whose coefficient is one, and noisy
columns T. Errors of a leave-a-block-out jackknife, each run by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray

_RANK = 1e-10  # singular values below this part of the largest are zero

Method: TypeAlias = Callable[[FloatArray, float], FloatArray]


def ordinary_solution(rows: FloatArray, clean: int) -> FloatArray:
    """Return (y, 1, g) that leaves the least of `C y + T g = -k`, (n,).

    Parameters
    ----------
    rows : (n_rows, n)
    clean : number of columns without noise, k the last of them
    """
    others = np.delete(rows, clean - 1, axis=1)
    scale = _norms(others)
    found = np.linalg.lstsq(others / scale, -rows[:, clean - 1], rcond=_RANK)[0] / scale
    return np.insert(found, clean - 1, 1.0)


def total_solution(rows: FloatArray, clean: int, noise: FloatArray) -> FloatArray:
    """Return (y, 1, g) by mixed least squares and total least squares, (n,).

    QR of `[C k | T]` leaves the triangle R22 in g alone. Its expected square is that of the truth plus the noise's,
    `diag(noise)`, so the direction of g is the last right singular vector of `R22 noise^(-1/2)`.

    Parameters
    ----------
    noise : (n - clean,) expected sum of squares of the noise in each noisy column
    """
    scale = _norms(rows)
    triangle = np.asarray(np.linalg.qr(rows / scale, mode="r"))
    size = np.sqrt(noise) / scale[clean:]
    _, _, axes = np.linalg.svd(triangle[clean:, clean:] / size)
    noisy = axes[-1] / size
    rest = np.linalg.lstsq(triangle[:clean, :clean], -triangle[:clean, clean:] @ noisy, rcond=_RANK)[0]
    found = np.concatenate([rest, noisy]) / scale
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(found / found[clean - 1])


def _norms(columns: FloatArray) -> FloatArray:
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > 0.0, norms, 1.0)


class Jackknifed(NamedTuple):
    """A solution on everything and its covariance."""

    values: FloatArray
    covariance: FloatArray


def jackknifed(stacks: Sequence[Sequence[FloatArray]], methods: Sequence[Method]) -> tuple[Jackknifed, ...]:
    """Return what each method finds, with the covariance by leaving out one block of time of one run after the other.

    Parameters
    ----------
    stacks : for every run its blocks of rows
    methods : each takes rows and the share of all blocks' rows that they are
    """
    small = [[_triangle([block]) for block in stack] for stack in stacks]
    whole = _triangle([block for stack in small for block in stack])
    values = [method(whole, 1.0) for method in methods]
    covariances = [np.zeros((found.size, found.size)) for found in values]
    blocks = sum(len(stack) for stack in small)
    for run, stack in enumerate(small):
        if len(stack) < 2:
            continue
        others = [block for other, part in enumerate(small) if other != run for block in part]
        outside = [_triangle([*others, *stack[:k], *stack[k + 1 :]]) for k in range(len(stack))]
        share = (len(stack) - 1) / len(stack)
        for place, (method, found) in enumerate(zip(methods, values, strict=True)):
            moves = np.array([method(rows, 1.0 - 1.0 / blocks) - found for rows in outside])
            covariances[place] += share * moves.T @ moves
    return tuple(Jackknifed(*pair) for pair in zip(values, covariances, strict=True))


def _triangle(blocks: Sequence[FloatArray]) -> FloatArray:
    return np.asarray(np.linalg.qr(np.vstack(blocks), mode="r"))
