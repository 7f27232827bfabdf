"""Sequential identification: friction first, from segments in which it shows by itself; then inertia on the rest.

1. Runs at constant speed in both directions and reversals are found in the recordings (`segments`).
2. Friction parameters x_F are fitted to them alone: to half the differences of paired runs, `(W+ - W-) x_F / 2`, and to
   what is left of torque and columns about a reversal after a cubic in time is taken out of both. Columns of which
   that leaves little, as of viscous friction, are too like gravity and inertia to be told there.
3. All other parameters are fitted to all rows with friction held, `W_R x_R = tau - W_F x_F`; the error of x_F goes on
   into x_R by `-(W_R'W_R)^-1 W_R'W_F`.

Beside it stands the joint fit of everything to all rows. Where the two differ by more than their errors, the friction
at constant speed is not that of the motion: it is warmer, loaded otherwise, or of another form than the model's.

Source: Grotjahn, Daemi, Heimann, "Friction and rigid body identification of robot dynamics", 2001.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.errors import ModelError
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.filters.outcome import Recursion
from tauhat.estimation.friction import braking_parameters
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, diagnosed
from tauhat.estimation.problem import Problem
from tauhat.estimation.segments import (
    Contrast,
    Reversal,
    SegmentRules,
    constant_runs,
    contrasts,
    reversals,
    tracks,
)
from tauhat.estimation.solution import Solution, stacked

_APART = 1e3  # scaled condition number of the segments above which friction parameters are not told apart
_SMOOTH = 0.2  # part of a column that must be left about a reversal when its cubic is taken out
_SILENT = 1e-9  # a column below this part of the largest is not told by the segments


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionMap:
    """Friction of one joint as measured, a point per pair of runs and bin of position, and per reversal.

    joint : index
    speeds : (n,) [rad/s or m/s], zero at reversals
    positions : (n,) [rad or m]
    friction : (n,) that brakes [Nm or N]
    gravity : (n,) mean of both directions [Nm or N]; at a reversal the torque without the jump
    """

    joint: int
    speeds: FloatArray
    positions: FloatArray
    friction: FloatArray
    gravity: FloatArray

    def __post_init__(self) -> None:
        for array in (self.speeds, self.positions, self.friction, self.gravity):
            read_only(array)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SequentialFit:
    """Friction from segments, the rest with friction held, and the joint fit beside it.

    maps : of friction, one a joint
    friction : indices of the base parameters that were fitted to the segments; others they do not tell
    solution : of both steps
    together : of the joint fit
    pairs, turns : how many pairs of runs and reversals were found
    """

    maps: tuple[FrictionMap, ...]
    friction: IntArray
    solution: Solution
    together: Solution
    pairs: int
    turns: int

    def __post_init__(self) -> None:
        read_only(self.friction)

    @property
    def differences(self) -> FloatArray:
        """Sequential less joint values, (n_b,), in standard errors of both together."""
        spread = np.diag(self.solution.covariance) + np.diag(self.together.covariance)
        return np.asarray((self.solution.values - self.together.values) / np.sqrt(spread))


def identify_sequentially(
    problem: Problem, *, rules: SegmentRules | None = None, estimator: Estimator | None = None
) -> SequentialFit:
    """Return friction from constant-speed and reversal segments, then the rest with friction held.

    Parameters
    ----------
    rules : what counts as a segment
    estimator : of each step and of the joint fit; weighted least squares by default

    Raises
    ------
    ModelError
        when the model has no friction, or a joint has no segment.
    """
    rules, method = rules or SegmentRules(), estimator or WeightedLeastSquares()
    found = tracks(problem)
    tops = np.max([np.abs(track.dq).max(axis=0) for track in found], axis=0)
    runs = [run for track in found for run in constant_runs(track, tops, problem.processing.cutoff, rules=rules)]
    pairs = list(contrasts(runs, rules=rules))
    turns = [turn for track in found for turn in reversals(track, tops, rules=rules)]
    _require_segments(problem, pairs, turns)
    evidence, own = _friction_evidence(problem, pairs, turns)
    first = _first_step(evidence, method)
    return SequentialFit(
        maps=tuple(_map(joint, pairs, turns, problem.processing.cutoff) for joint in range(tops.size)),
        friction=own,
        solution=_held(problem.evidence, own, first, method),
        together=method.fit(problem.evidence),
        pairs=len(pairs),
        turns=len(turns),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SequentialLeastSquares(Recursion):
    """Friction from segments first, then the rest: `identify_sequentially` as an estimator.

    rules : what counts as a segment
    inner : method of each step
    """

    key: ClassVar[str] = "sequential"
    rules: SegmentRules = field(default_factory=SegmentRules)
    inner: Estimator = field(default_factory=WeightedLeastSquares)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution of both steps."""
        return identify_sequentially(problem, rules=self.rules, estimator=self.inner).solution


def _require_segments(problem: Problem, pairs: list[tuple[Contrast, ...]], turns: list[Reversal]) -> None:
    seen = {pair[0].joint for pair in pairs} | {turn.joint for turn in turns}
    names = [name for joint, name in enumerate(problem.model.robot.joint_names) if joint not in seen]
    if names:
        raise ModelError(
            "no segment shows the friction by itself",
            where=", ".join(names),
            remedy="record each joint alone at several constant speeds, both ways over the same range",
        )


def _friction_evidence(
    problem: Problem, pairs: list[tuple[Contrast, ...]], turns: list[Reversal]
) -> tuple[Evidence, IntArray]:
    """Return the evidence of the segments on the friction parameters they tell, one block a segment, and which."""
    friction = np.flatnonzero(braking_parameters(problem.model)[problem.base.independent])
    if not friction.size:
        raise ModelError("the model has no friction to identify first", remedy="add viscous and coulomb")
    n_v = problem.model.robot.n_v
    rows = [(pair[0].joint, _pair_rows(pair)) for pair in pairs] + [(turn.joint, _turn_rows(turn)) for turn in turns]
    norms = np.linalg.norm([np.linalg.norm(part[:, friction], axis=0) for _, part in rows], axis=0)
    own = friction[(norms > _SILENT * norms.max()) & (norms > 0.0)]
    if not own.size:
        raise ModelError("the segments tell no friction parameter", remedy="record runs at several constant speeds")
    supports = tuple(np.flatnonzero(np.isin(own, support)) for support in problem.evidence.supports)
    blocks = tuple(_block(joint, part[:, [*own, -1]], supports, n_v) for joint, part in rows)
    return Evidence(supports=supports, n_b=int(own.size), blocks=blocks, recordings=("segments",)), own


def _first_step(evidence: Evidence, method: Estimator) -> Solution:
    """Return the fit of friction to the segments.

    Raises
    ------
    ModelError
        when they cannot tell its parameters apart, as runs at one speed cannot tell viscous from dry friction.
    """
    solution = method.fit(evidence)
    if solution.rank < evidence.n_b or solution.condition > _APART:
        raise ModelError(
            "the segments cannot tell the friction parameters apart",
            expected=f"condition below {_APART:g}",
            got=f"rank {solution.rank} of {evidence.n_b}, condition {solution.condition:.3g}",
            remedy="record runs at several constant speeds, both ways",
        )
    return solution


def _block(joint: int, rows: FloatArray, supports: tuple[IntArray, ...], n_v: int) -> Block:
    factors = [
        rows[:, [*support, -1]] if index == joint else np.zeros((0, support.size + 1))
        for index, support in enumerate(supports)
    ]
    return Block(factors=tuple(factors), n_t=max(1, round(rows.shape[0] / n_v)))


def _pair_rows(pair: Iterable[Contrast]) -> FloatArray:
    """Return columns and friction of each bin, times the root of the rows behind it, (n_bins, n_b + 1)."""
    return np.array([np.sqrt(own.rows) * np.append(own.columns, own.friction) for own in pair])


def _turn_rows(turn: Reversal) -> FloatArray:
    """Return columns and torque about a reversal, without the cubic in time that fits best, (n, n_b + 1).

    Columns that are nearly cubics are zero.
    """
    track, rows = turn.track, turn.rows
    table = np.column_stack([track.columns[rows, turn.joint], track.tau[rows, turn.joint]])
    basis, _ = np.linalg.qr(np.vander(track.t[rows] - turn.t, 4))
    left = table - basis @ (basis.T @ table)
    about = np.linalg.norm(table - table.mean(axis=0), axis=0)
    left[:, :-1] *= np.linalg.norm(left[:, :-1], axis=0) > _SMOOTH * about[:-1]
    return np.asarray(left)


def _map(joint: int, pairs: list[tuple[Contrast, ...]], turns: list[Reversal], cutoff: float) -> FrictionMap:
    points = [
        (own.speed, own.position, own.friction, own.gravity) for pair in pairs for own in pair if own.joint == joint
    ]
    jumps = [_jump(turn, cutoff) for turn in turns if turn.joint == joint]
    table = np.array([*points, *(jump for jump in jumps if jump)]).reshape(-1, 4)
    return FrictionMap(
        joint=joint,
        speeds=table[:, 0].copy(),
        positions=table[:, 1].copy(),
        friction=table[:, 2].copy(),
        gravity=table[:, 3].copy(),
    )


def _jump(turn: Reversal, cutoff: float) -> tuple[float, float, float, float] | None:
    """Return speed zero, position, half the jump and mean of the torque; None where too few rows are clear of it.

    The rows within half a period of the cut-off are left out: the filter has smeared the jump over them.
    """
    track, rows = turn.track, turn.rows
    since = track.t[rows] - turn.t
    clear = np.abs(since) >= 0.5 / cutoff
    if min((clear & (since < 0)).sum(), (clear & (since > 0)).sum()) < 2:
        return None
    after = np.sign(track.dq[rows, turn.joint])
    basis = np.column_stack([np.ones_like(since), since, after])[clear]
    values = np.linalg.lstsq(basis, track.tau[rows, turn.joint][clear], rcond=None)[0]
    return 0.0, float(np.interp(turn.t, track.t, track.q[:, turn.joint])), float(values[2]), float(values[0])


def _held(evidence: Evidence, own: IntArray, first: Solution, method: Estimator) -> Solution:
    """Return the solution of all parameters with those of `own` held at the first step's values."""
    rest = np.setdiff1d(np.arange(evidence.n_b), own)
    values, covariance = np.zeros(evidence.n_b), np.zeros((evidence.n_b, evidence.n_b))
    values[own] = first.values
    covariance[np.ix_(own, own)] = first.covariance
    second = method.fit(_without(evidence, own, first.values).keeping(rest))
    values[rest] = second.values
    carried = _carried(evidence, own, rest, second.weights)
    across = carried @ first.covariance
    covariance[np.ix_(rest, own)], covariance[np.ix_(own, rest)] = across, across.T
    covariance[np.ix_(rest, rest)] = second.covariance + across @ carried.T
    return diagnosed(
        evidence,
        Solved(values, second.weights.copy(), first.passes + second.passes),
        covariance=covariance,
        degrees=min(first.degrees, second.degrees),
        cause="friction fitted to its segments, the rest with friction held",
    )


def _without(evidence: Evidence, own: IntArray, values: FloatArray) -> Evidence:
    """Return the evidence whose torque lacks what the parameters `own` make with these values."""
    known = np.zeros(evidence.n_b)
    known[own] = values

    def lessened(block: Block) -> Block:
        factors = []
        for factor, support in zip(block.factors, evidence.supports, strict=True):
            part = factor.copy()
            part[:, -1] -= factor[:, :-1] @ known[support]
            factors.append(part)
        return Block(factors=tuple(factors), n_t=block.n_t)

    return replace(evidence, blocks=tuple(lessened(block) for block in evidence.blocks))


def _carried(evidence: Evidence, own: IntArray, rest: IntArray, weights: FloatArray) -> FloatArray:
    """Return how the other parameters move with those held, (n_rest, n_own)."""
    whole, _ = stacked(evidence, evidence.total, weights)
    scale = np.linalg.norm(whole[:, rest], axis=0)
    return np.asarray(-np.linalg.lstsq(whole[:, rest] / scale, whole[:, own], rcond=None)[0] / scale[:, None])
