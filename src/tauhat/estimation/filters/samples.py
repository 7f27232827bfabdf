"""Samples of a problem one by one, for methods that go through a recording in time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.problem import Problem
from tauhat.recordings.filters import FirFilter, filtered
from tauhat.recordings.processing import Stretch, stretches
from tauhat.recordings.recording import Recording


class RowSample(NamedTuple):
    """One filtered sample of `tau = columns @ x`: time [s], (n_v, n_b) and (n_v,) [Nm or N]."""

    t: float
    columns: FloatArray
    tau: FloatArray


def row_samples(problem: Problem) -> Iterator[RowSample]:
    """Yield the problem's filtered rows sample by sample."""
    layout = problem.model.layout(problem.base.independent)
    n_v, n_b = problem.model.robot.n_v, problem.base.n_b
    for rows in problem.rows():
        whole = np.zeros((rows.t.size, n_v, n_b))
        for joint, support in enumerate(problem.evidence.supports):
            whole[:, joint, support] = rows.columns[layout.of_joint(joint)].T
        for k, t in enumerate(rows.t):
            yield RowSample(float(t), whole[k], rows.tau[:, k])


def motion_samples(problem: Problem, recording: Recording, *, rate: float) -> Stretch:
    """Return the low-passed motion and raw torque on a clock of at most `rate` [Hz].

    The torque is averaged over a step, centred on the time of the motion: an average over the step behind it would be
    half a step late, which is worth several per cent of dry friction.
    """
    parts = list(stretches(recording, problem.processing))
    whole = Stretch(*(np.concatenate(part, axis=-1) for part in zip(*parts, strict=True)))
    step = float(whole.t[1] - whole.t[0])
    every = max(1, round(1.0 / (rate * step)))
    kept = slice(0, whole.t.size // every * every, every)
    tau = filtered(whole.tau, FirFilter(kernel=_centred(every)))
    return Stretch(whole.t[kept], whole.q[:, kept], whole.dq[:, kept], whole.ddq[:, kept], tau[:, kept])


def _centred(every: int) -> FloatArray:
    """Return the weights of a mean over `every` samples about the middle one; of an even number the ends count half."""
    half = every // 2
    weights = np.ones(2 * half + 1)
    if every % 2 == 0:
        weights[[0, -1]] = 0.5
    return np.asarray(weights / every)


def units_of(evidence: Evidence) -> tuple[FloatArray, FloatArray]:
    """Return the root mean square of every parameter's column over all joints (n_b,), and of each torque (n_v,).

    Raises
    ------
    ModelError
        when a column or a torque is zero.
    """
    squares, torques = np.zeros(evidence.n_b), np.zeros(evidence.n_v)
    for joint, (support, factor) in enumerate(zip(evidence.supports, evidence.total.factors, strict=True)):
        squares[support] += np.sum(factor[:, :-1] ** 2, axis=0)
        torques[joint] = np.sum(factor[:, -1] ** 2)
    if not (squares.min() > 0.0 and torques.min() > 0.0):
        raise ModelError(
            "a base parameter never loads a joint, or a torque is zero throughout",
            remedy="record a motion that moves every joint, or lock those that stand still",
        )
    return np.sqrt(squares / evidence.n_t), np.sqrt(torques / evidence.n_t)


def with_recordings(problem: Problem, recordings: tuple[Recording, ...]) -> Problem:
    """Return the same problem on other recordings; its evidence stays that of all."""
    return replace(problem, recordings=recordings)


def refuse_memory(problem: Problem, method: str) -> None:
    """Refuse terms that remember the past or change with the fit: a simulated state cannot hold them here.

    Raises
    ------
    ModelError
        when there is one.
    """
    for term in problem.model.terms:
        if term.stateful or term.iterated:
            raise ModelError(
                f"{method} cannot use term {term.key}, whose columns depend on more than the present state",
                remedy="identify with pointwise terms, e.g. --model inertia,rotor,viscous,coulomb,offset",
            )
