"""Error bars that know that shapes were chosen, too.

A width, a speed or a length that was chosen on the same recordings is not known exactly, and coefficients beside it are
less sure than if it were. To first order a shape s adds one unknown, `d ln s`, with the column `d(Y x)/d ln s`, which
the covariance is taken with (variable projection; Golub, Pereyra 1973). A shape is known beforehand to a factor of
about `e^PRIOR`: without that, a term whose coefficient is zero would leave its shape, and so its neighbours, unbounded.

The same holds for the rotors that are regrouped into links: how much of their sum the rotor has is found by friction
that grows with the load alone (`rotor_load`), and is an unknown beside it, known beforehand to `PRIOR` of the sum.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms import Parameter, Shaped, Term
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.problem import Problem
from tauhat.estimation.rotor_load import RotorLoad, rotor_load
from tauhat.estimation.solution import Solution, honest_covariance, joint_residuals, solve
from tauhat.robots.robot import Robot

PRIOR = 0.7  # standard deviation of the logarithm of a shape before the recordings are looked at: a factor of two
_STEP = 0.05  # of the logarithm, in the difference quotient
_LARGEST_MOVE = 0.35  # of the logarithm of a shape in one step
_RIDGE = 1e-9
_FAINT = 1e-6  # of the largest such column: a term that is not there has no shape


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeSlope(Term):
    """The derivative of a shaped term's torque by the logarithm of each value of its shape, one parameter a value.

    term : with its shape
    coefficients : of the term's columns, as its parameters
    """

    key: ClassVar[str] = "shape-slope"
    stateful: ClassVar[bool] = True
    term: Shaped
    coefficients: tuple[float, ...]

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return one parameter for each value that shapes anything."""
        return tuple(
            Parameter(symbol="dln", joint=joint, unit="1") for joint in self.term.shaped_joints(robot).values()
        )

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the values that shape what loads it."""
        values, shaping = np.array(list(self.term.shaped_joints(robot)), dtype=np.intp), self.term.shaping(robot)
        return tuple(np.flatnonzero(np.isin(values, shaping[own])) for own in self.term.support(robot))

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the difference quotient; the states of both its ends are stacked."""
        before = (None, None) if state is None else (state[0], state[1])
        upper, after_upper = self._torques(robot, motion, 1.0 + _STEP, before[0])
        lower, after_lower = self._torques(robot, motion, 1.0 / (1.0 + _STEP), before[1])
        width = 2.0 * np.log1p(_STEP)
        slopes = tuple((up - low) / width for up, low in zip(upper, lower, strict=True))
        if after_upper is None or after_lower is None:
            return slopes, None
        return slopes, np.stack([after_upper, after_lower])

    def _torques(
        self, robot: Robot, motion: Motion, factor: float, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return on each joint the torque of the columns that each value of its support shapes, (n_support, n_t)."""
        form = self.term.with_shape([factor * value for value in self.term.shape])
        columns, after = form.columns(robot, motion, state)
        weights, shaping = np.array(self.coefficients), self.term.shaping(robot)
        values = np.array(list(self.term.shaped_joints(robot)), dtype=np.intp)
        torques = []
        for rows, own, places in zip(columns, self.term.support(robot), self.support(robot), strict=True):
            picked = shaping[own] == values[places][:, None]
            torques.append((picked * weights[own]) @ rows)
        return tuple(torques), after


Slope: TypeAlias = ShapeSlope | RotorLoad


def covariance_with_shapes(problem: Problem, solution: Solution, *, ridge: float = 0.0) -> FloatArray:
    """Return the covariance of the base parameters, (n_b, n_b), with shapes and regrouped rotors among the unknowns.

    Parameters
    ----------
    solution : of the problem; its own covariance takes the shapes as known, and is returned where there are none
    ridge : of the estimator
    """
    rotors = rotor_load(problem.model, problem.base, solution.values)
    slopes: tuple[Slope, ...] = (*_slopes(problem, solution), *(() if rotors is None else (rotors,)))
    if not slopes:
        return solution.covariance
    evidence = _widened(problem, slopes)
    n_b = problem.base.n_b
    sizes = _column_sizes(evidence)
    kept = np.flatnonzero((np.arange(evidence.n_b) < n_b) | (sizes > _FAINT * sizes[:n_b].max()))
    evidence = evidence.keeping(kept)
    if kept.size == n_b:
        return solution.covariance
    known = _with_prior(evidence, n_b, solution.values)
    values = solve(known, solution.weights, ridge=ridge)
    wide = honest_covariance(known, solution.weights, values, ridge=ridge)[:n_b, :n_b]
    spread = np.sqrt(np.maximum(np.diag(wide), np.diag(solution.covariance)) / np.diag(wide))
    return np.asarray(wide * np.outer(spread, spread))


def nearer_shapes(problem: Problem, solution: Solution, keys: Collection[str]) -> TorqueModel:
    """Return the model with the shapes of the terms `keys` moved to where the linearised residual is least.

    One Gauss-Newton step on all coefficients and all shapes together, from the shapes that a grid left; no shape moves
    by more than a factor of 1.4.
    """
    slopes = tuple(slope for slope in _slopes(problem, solution) if slope.term.key in keys)
    model = problem.model
    if not slopes:
        return model
    moves, start = _moves(problem, slopes, values=solution.values, weights=solution.weights), 0
    for slope in slopes:
        places = list(slope.term.shaped_joints(model.robot))
        factors = np.ones(len(slope.term.shape))
        factors[places] = np.exp(np.clip(moves[start : start + len(places)], -_LARGEST_MOVE, _LARGEST_MOVE))
        start += len(places)
        model = model.with_term(slope.term.with_shape((factors * slope.term.shape).tolist()))
    return model


def rotor_moves(problem: Problem, rotors: RotorLoad, *, values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return by how much more of the regrouped numbers the rotors have than the load says, in parts, (n_rotors,).

    One Gauss-Newton step on all coefficients and all rotors together.

    Parameters
    ----------
    values, weights : (n_b,), (n_v,) of the fit with the load as it is
    """
    return _moves(problem, (rotors,), values=values, weights=weights)


def _moves(problem: Problem, slopes: Sequence[Slope], *, values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the Gauss-Newton step of the unknowns behind the base parameters; zero where they hardly act."""
    evidence, n_b = _widened(problem, slopes), problem.base.n_b
    sizes = _column_sizes(evidence)
    kept = np.flatnonzero((np.arange(evidence.n_b) < n_b) | (sizes > _FAINT * sizes[:n_b].max()))
    known = _with_prior(evidence.keeping(kept), n_b, values)
    moves = np.zeros(evidence.n_b)
    moves[kept] = solve(known, weights, ridge=_RIDGE)
    return moves[n_b:]


def _slopes(problem: Problem, solution: Solution) -> tuple[ShapeSlope, ...]:
    model, base = problem.model, problem.base
    standard = np.zeros(model.n_p)
    standard[base.independent] = solution.values
    slopes, start = [], 0
    for term in model.terms:
        count = len(term.parameters(model.robot))
        own = standard[start : start + count]
        start += count
        if isinstance(term, Shaped) and term.shape and own.any():
            slopes.append(ShapeSlope(term=term, coefficients=tuple(own.tolist())))
    return tuple(slopes)


def _widened(problem: Problem, slopes: Sequence[Slope]) -> Evidence:
    """Return the evidence on the base parameters and, behind them, the shapes and rotors."""
    model, base = problem.model, problem.base
    added = _Bundle(slopes=tuple(slopes))
    wide = replace(model, terms=(*model.terms, added))
    names = tuple(parameter.name for parameter in wide.parameters)
    kept = np.concatenate([base.independent, np.arange(model.n_p, len(names))])
    nothing = np.zeros(0, dtype=np.intp)
    chosen = BaseParameters(
        names=names,
        independent=kept,
        dependent=nothing,
        regrouping=np.zeros((kept.size, 0)),
        unidentifiable=np.setdiff1d(np.arange(len(names)), kept),
    )
    return problem.collected(wide, chosen)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bundle(Term):
    """Several slopes as one term: a model has each kind of term once."""

    key: ClassVar[str] = "shape-slopes"
    stateful: ClassVar[bool] = True
    slopes: tuple[Slope, ...]

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        return tuple(parameter for slope in self.slopes for parameter in slope.parameters(robot))

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        starts = np.cumsum([0, *(len(slope.parameters(robot)) for slope in self.slopes)])
        parts = [slope.support(robot) for slope in self.slopes]
        return tuple(
            np.concatenate([start + part[joint] for start, part in zip(starts[:-1], parts, strict=True)])
            for joint in range(robot.n_v)
        )

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        before = [None] * len(self.slopes) if state is None else list(state)
        made = [slope.columns(robot, motion, part) for slope, part in zip(self.slopes, before, strict=True)]
        joined = tuple(np.concatenate([own[joint] for own, _ in made]) for joint in range(robot.n_v))
        after = np.empty(len(made), dtype=object)
        after[:] = [part for _, part in made]
        return joined, after


def _column_sizes(evidence: Evidence) -> FloatArray:
    squares = np.zeros(evidence.n_b)
    for support, factor in zip(evidence.supports, evidence.total.factors, strict=True):
        squares[support] += np.sum(factor[:, :-1] ** 2, axis=0)
    return np.sqrt(squares)


def _with_prior(evidence: Evidence, n_b: int, values: FloatArray) -> Evidence:
    """Return the evidence with what is known of shapes beforehand, in equal parts in every block of time."""
    unmoved = np.concatenate([values, np.zeros(evidence.n_b - n_b)])
    noise = np.maximum(joint_residuals(evidence, unmoved), np.finfo(float).tiny)
    share = 1.0 / (PRIOR * np.sqrt(len(evidence.blocks)))
    extra = []
    for joint, support in enumerate(evidence.supports):
        places = np.flatnonzero(support >= n_b)
        rows = np.zeros((places.size, support.size + 1))
        rows[np.arange(places.size), places] = share * noise[joint]
        extra.append(rows)
    blocks = tuple(
        Block(
            factors=tuple(np.vstack([factor, rows]) for factor, rows in zip(block.factors, extra, strict=True)),
            n_t=block.n_t,
        )
        for block in evidence.blocks
    )
    return evidence.of_blocks(blocks)
