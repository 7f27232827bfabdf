"""IDIM-IV: instrumental variables from a simulation of the closed loop.

In `tau = W x + e` the regressor W is made of measured positions. Their noise is in W and, through differences and the
controller's reaction, in e: least squares is biased, and filters only hide it. Instruments Z, correlated with the true
regressor but not with the noise, remove the bias: the regressor of the *simulated* robot under the same law and
reference, with the parameters of the pass before,

    Z' V (tau - W x) = 0          Z = Y(q_s, dq_s, ddq_s),   V the joints' squared weights

Solved without normal equations: with `Z = Q R`, columns scaled, `(Q'W) x = Q'tau`. All of it comes from the triangular
factors of [Z W tau], joint by joint and block of time by block of time, so that a pass costs one simulation.

Error bars: with `M = Q'W` white noise gives `s^2 M^-1 M^-T`; the delete-a-block jackknife solves
`(M - M_g) x = c - c_g` once a group, and widens it where residuals are correlated (`solution`).

A fit under physical constraints needs an objective. It is that of two-stage least squares, joint by joint,
`sum_j v_j |Q_j'(tau_j - W_j x)|^2`: the same orthogonality conditions, each joint's own, as well met as physics allows.

Source: Janot, Vandanjon, Gautier, "A generic instrumental variable approach for industrial robot identification", 2014.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import Layout
from tauhat.errors import ModelError
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence, evidence_from_rows
from tauhat.estimation.least_squares import degrees_of_freedom
from tauhat.estimation.rows import Rows
from tauhat.estimation.simulated_runs import SimulatedRuns, joined
from tauhat.estimation.simulating import Found, SimulationEstimator, Tried
from tauhat.estimation.solution import RANK, Solution, joint_residuals, joint_torques, time_groups, widened


class Paired(NamedTuple):
    """Weighted rows over all base parameters: instruments, regressor (n, n_b) each, torque (n,)."""

    instruments: FloatArray
    regressor: FloatArray
    torque: FloatArray


class Projection(NamedTuple):
    """The instruments' coordinates: `M = Q'W`, `c = Q'tau`, and the triangle R of Z with its column norms."""

    matrix: FloatArray
    right: FloatArray
    triangle: FloatArray
    scale: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class InstrumentalVariables(SimulationEstimator):
    """The measured torque and regressor, made orthogonal to the regressor of a simulation.

    Source: Janot, Vandanjon, Gautier 2014.
    """

    key: ClassVar[str] = "idim-iv"

    def improved(self, runs: SimulatedRuns, tried: Tried) -> Found:
        """Return the solution with the instruments of these motions."""
        paired = _paired_evidence(runs, tried)
        weights = self.inner.solve(runs.problem.evidence).weights
        rows = _weighted(paired, paired.total, weights)
        return Found(_solved(_projected(rows)), weights, paired)

    def linear_problem(self, runs: SimulatedRuns, found: Found) -> Evidence:
        """Return the orthogonality conditions of every joint, in the form of least squares."""
        return _projected_evidence(runs.problem.evidence, found.evidence, found.values)

    def solution(self, runs: SimulatedRuns, tried: Tried, found: Found, ending: tuple[int, str, str]) -> Solution:
        """Return values and sandwich error bars of the last instruments."""
        passes, cause, advice = ending
        measured = runs.problem.evidence
        rows = _weighted(found.evidence, found.evidence.total, found.weights)
        projection = _projected(rows)
        singular = np.linalg.svd(projection.matrix / np.linalg.norm(rows.regressor, axis=0), compute_uv=False)
        return Solution(
            values=tried.values.copy(),
            covariance=_covariance(found, projection, tried.values),
            weights=found.weights,
            joint_rms=joint_residuals(measured, tried.values),
            torque_rms=joint_torques(measured),
            rank=int((singular > RANK * singular[0]).sum()),
            condition=float(singular[0] / singular[-1]) if singular[-1] > 0.0 else np.inf,
            degrees=degrees_of_freedom(measured),
            passes=passes,
            cause=cause,
            advice=advice,
            evidence=_projected_evidence(measured, found.evidence, tried.values),
        )


def _paired_evidence(runs: SimulatedRuns, tried: Tried) -> Evidence:
    """Return the evidence whose factors hold [Z_j W_j tau_j]; supports name every parameter twice."""
    layout, base = runs.layout, runs.problem.base
    joints = [layout.of_joint(joint) for joint in range(layout.bounds.size - 1)]
    twice = Layout(
        np.concatenate([np.tile(layout.parameters[rows], 2) for rows in joints]), 2 * layout.bounds, layout.sources
    )
    parts = []
    for run, moved, measured in zip(runs.runs, tried.motions, runs.measured, strict=True):
        simulated = joined(runs.rows(run, moved))
        columns = [part.columns[rows] for rows in joints for part in (simulated, measured)]
        both = Rows(measured.t, np.concatenate(columns), measured.tau, measured.dq)
        parts.append(evidence_from_rows(twice, base, (both,), name=run.name))
    return reduce(Evidence.merged, parts)


def _weighted(paired: Evidence, block: Block, weights: FloatArray) -> Paired:
    instruments, regressors, torques = [], [], []
    for weight, support, factor in zip(weights, paired.supports, block.factors, strict=True):
        count = support.size // 2
        own = np.zeros((2, factor.shape[0], paired.n_b))
        own[0][:, support[:count]] = weight * factor[:, :count]
        own[1][:, support[count:]] = weight * factor[:, count:-1]
        instruments.append(own[0])
        regressors.append(own[1])
        torques.append(weight * factor[:, -1])
    return Paired(np.vstack(instruments), np.vstack(regressors), np.concatenate(torques))


def _projected(rows: Paired) -> Projection:
    scale = np.linalg.norm(rows.instruments, axis=0)
    if not (scale > 0.0).all():
        raise ModelError(
            f"{int((scale <= 0.0).sum())} of {scale.size} base parameters never load a joint in the simulated motion",
            remedy="record a motion that moves every joint, all together, or lock those that stand still",
        )
    basis, triangle = np.linalg.qr(rows.instruments / scale)
    return Projection(basis.T @ rows.regressor, basis.T @ rows.torque, triangle, scale)


def _solved(projection: Projection) -> FloatArray:
    norms = np.linalg.norm(projection.matrix, axis=0)
    left, singular, right = np.linalg.svd(projection.matrix / norms)
    kept = singular > RANK * singular[0]
    return np.asarray(right[kept].T @ ((left[:, kept].T @ projection.right) / singular[kept]) / norms)


def _covariance(found: Found, projection: Projection, values: FloatArray) -> FloatArray:
    """Return the sandwich covariance, (n_b, n_b); see the head of this file."""
    from scipy.linalg import solve_triangular

    paired, weights = found.evidence, found.weights
    rows = _weighted(paired, paired.total, weights)
    count = paired.n_v * paired.n_t
    variance = float(np.sum((rows.torque - rows.regressor @ values) ** 2)) / max(1, count - paired.n_b)
    root = np.linalg.pinv(projection.matrix, rcond=RANK)
    white = variance * (root @ root.T)
    groups = time_groups(paired)
    if len(groups) == 1:
        return white
    moves = []
    for block in groups:
        part = _weighted(paired, block, weights)
        turned = solve_triangular(projection.triangle, (part.instruments / projection.scale).T, trans="T")
        own = turned @ part.regressor
        score = turned @ (part.torque - part.regressor @ values)
        # (M - M_g) x_g = c - c_g, and M x = c: the solution moves by -(M - M_g)^-1 (c_g - M_g x).
        moves.append(-np.linalg.lstsq(projection.matrix - own, score, rcond=RANK)[0])
    return widened(white, np.array(moves))


def _projected_evidence(measured: Evidence, paired: Evidence, values: FloatArray) -> Evidence:
    """Return what a fit under constraints solves: per joint [Q_j'W_j Q_j'tau_j] and what no parameters explain."""
    factors = []
    for support, factor in zip(paired.supports, paired.total.factors, strict=True):
        count = support.size // 2
        basis, _ = np.linalg.qr(factor[:, :count])
        inside = basis.T @ factor[:, count:]
        errors = [part[:, :-1] @ values[support[count:]] - part[:, -1] for part in (factor[:, count:], inside)]
        rest = np.zeros((1, count + 1))
        rest[0, -1] = np.sqrt(max(0.0, float(errors[0] @ errors[0] - errors[1] @ errors[1])))
        factors.append(np.vstack([inside, rest]))
    return replace(measured, blocks=(Block(factors=tuple(factors), n_t=measured.n_t),), fingerprint="")
