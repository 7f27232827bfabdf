"""The least-squares problem in arm and payload, `tau_unloaded = Y_b x`, `tau_loaded = Y_b (x + P p)`, on evidence.

The unknowns are (x, p), or p alone with x from an estimate. Then p moves with the estimate's error e as
`-(A'A)^-1 A' B e` with A and B the weighted columns of payload and arm, and its covariance has two parts: the loaded
run's own, by leaving out blocks of time, and the estimate's carried over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.model import TorqueModel
from tauhat.estimation.block import Block
from tauhat.estimation.estimate import Estimate, input_log
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.least_squares import WeightedLeastSquares
from tauhat.estimation.loaded_run import TEN, PayloadColumns, loaded_model
from tauhat.estimation.solution import Solution, joint_residuals, joint_torques, weighted_rows
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot

_PASSES = 3  # load friction and payload follow each other


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadProblem:
    """What is to be found.

    estimate : of the arm alone
    hung : where the payload hangs
    before : evidence of unloaded recordings; None when the estimate is taken as it is
    mass : of the payload [kg], where known
    """

    estimate: Estimate
    hung: PayloadColumns
    before: Evidence | None
    mass: float | None

    @property
    def n_x(self) -> int:
        """Number of the arm's parameters among the unknowns."""
        return self.estimate.base.n_b if self.before is not None else 0

    def evidence(self, loaded: Evidence) -> Evidence:
        """Return the evidence on all unknowns, the payload's last."""
        kept = self.hung.kept_columns
        if self.before is None:
            return _of_payload_alone(loaded, self.estimate.values, kept)
        return _of_both(self.before, loaded, kept)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadFit:
    """The last pass, without physical constraints.

    problem : what was to be found
    model : of the loaded run, its load friction made for arm and payload
    evidence : of the loaded run on the arm's base parameters
    whole : evidence on all unknowns
    arm : (n_b,) parameters of the arm alone
    free : (10,) parameters of the payload, zero where the motion sees nothing
    covariance : of all unknowns that are not known beforehand: zero rows and columns for a known mass
    weights, degrees, condition : of the solution
    """

    problem: PayloadProblem
    model: TorqueModel
    evidence: Evidence
    whole: Evidence
    arm: FloatArray
    free: FloatArray
    covariance: FloatArray
    weights: FloatArray
    degrees: int
    condition: float

    def __post_init__(self) -> None:
        for array in (self.arm, self.free, self.covariance, self.weights):
            read_only(array)

    @property
    def payload_covariance(self) -> FloatArray:
        """Covariance of the payload's kept parameters, (k, k), the estimate's share included."""
        own = self.covariance[self.problem.n_x :, self.problem.n_x :]
        if self.problem.n_x:
            return own
        carried = self.slope
        return np.asarray(own + carried @ self.problem.estimate.covariance @ carried.T)

    @property
    def slope(self) -> FloatArray:
        """How the payload's kept parameters follow the arm's when those are given, (k, n_b)."""
        rows, kept = weighted_rows(self.evidence, self.weights)[:, :-1], self.problem.hung.kept_columns
        free = np.arange(kept.shape[1]) if self.problem.mass is None else np.arange(1, kept.shape[1])
        columns = rows @ kept[:, free]
        scale = np.linalg.norm(columns, axis=0)
        slope = np.zeros((kept.shape[1], rows.shape[1]))
        slope[free] = -np.linalg.lstsq(columns / scale, rows, rcond=None)[0] / scale[:, None]
        return slope

    def payload_evidence(self) -> Evidence:
        """Return what the recordings say of the payload whatever the arm is, weighted, as evidence of one joint."""
        n_x = self.problem.n_x
        triangle = np.asarray(np.linalg.qr(weighted_rows(self.whole, self.weights), mode="r"))
        block = Block(factors=(triangle[n_x:, n_x:].copy(),), n_t=self.whole.n_v * self.whole.n_t)
        n_b = self.whole.n_b - n_x
        return Evidence(supports=(np.arange(n_b),), n_b=n_b, blocks=(block,), recordings=self.whole.recordings)

    def arm_with(self, payload: FloatArray) -> FloatArray:
        """Return the arm's parameters that fit best with these ten of the payload, (n_b,)."""
        n_x = self.problem.n_x
        if not n_x:
            return self.arm
        rows = weighted_rows(self.whole, self.weights)
        base = self.problem.hung.base
        rest = rows[:, -1] - rows[:, n_x:-1] @ (base.projection @ payload)
        scale = np.linalg.norm(rows[:, :n_x], axis=0)
        return np.asarray(np.linalg.lstsq(rows[:, :n_x] / scale, rest, rcond=None)[0] / scale)


def fit_payload(problem: PayloadProblem, loaded: Sequence[Recording], *, processing: Processing) -> PayloadFit:
    """Return the payload, and the arm where unloaded evidence is given, that fit best."""
    estimate, hung, n_x = problem.estimate, problem.hung, problem.n_x
    iterated = any(term.iterated for term in estimate.model.terms)
    arm, free = np.array(estimate.values), np.zeros(TEN)
    place = n_x if problem.mass is not None else -1
    for _ in range(_PASSES if iterated else 1):
        model = loaded_model(estimate, arm, free, hung.link)
        evidence = collect_all(model, estimate.base, loaded, processing)
        whole = problem.evidence(evidence)
        solution = WeightedLeastSquares().fit(_without(whole, place, problem.mass))
        values = _with(solution.values, place, problem.mass)
        arm = values[:n_x] if n_x else arm
        free = hung.ten(values[n_x:])
    return PayloadFit(
        problem=problem,
        model=model,
        evidence=evidence,
        whole=whole,
        arm=np.array(arm),
        free=free,
        covariance=_with_zeros(solution, place),
        weights=np.array(solution.weights),
        degrees=solution.degrees,
        condition=solution.condition,
    )


def carrying_estimate(
    fit: PayloadFit, payload: FloatArray, recordings: Sequence[Recording], processing: Processing
) -> Estimate:
    """Return the estimate of arm and payload together: base parameters `x + P p`, friction that feels the payload.

    Its robot's nominal inertia holds the payload, too, where the description has masses at all.
    """
    estimate, hung = fit.problem.estimate, fit.problem.hung
    values = fit.arm_with(payload) + hung.kept_columns @ (hung.base.projection @ payload)
    if fit.problem.n_x:
        whole = np.hstack([np.eye(estimate.base.n_b), hung.kept_columns])
        covariance = whole @ fit.covariance @ whole.T
        inputs = tuple(input_log(recording) for recording in recordings)
    else:
        carried = np.eye(estimate.base.n_b) + hung.kept_columns @ fit.slope
        covariance = carried @ estimate.covariance @ carried.T
        covariance += hung.kept_columns @ fit.covariance @ hung.kept_columns.T
        inputs = (*estimate.inputs, *(input_log(recording) for recording in recordings))
    link = estimate.robot.joint_names[hung.link]
    return replace(
        estimate,
        model=replace(fit.model, robot=_carrying(estimate.robot, hung.link, payload)),
        values=values,
        covariance=covariance,
        degrees=fit.degrees if fit.problem.n_x else min(fit.degrees, estimate.degrees),
        processing=processing,
        estimator={**estimate.estimator, "payload": {"link": link, "values": payload.tolist()}},
        joint_rms=joint_residuals(fit.evidence, values),
        torque_rms=joint_torques(fit.evidence),
        inputs=inputs,
    )


def _carrying(robot: Robot, link: int, payload: FloatArray) -> Robot:
    if not robot.has_inertia:
        return robot
    joints = list(robot.joints)
    joints[link] = replace(joints[link], inertia=joints[link].inertia + payload)
    return replace(robot, joints=tuple(joints))


def _of_payload_alone(loaded: Evidence, values: FloatArray, kept: FloatArray) -> Evidence:
    """Return evidence on p of the torque that the arm's parameters leave."""
    own = [np.flatnonzero(np.abs(kept[support]).max(axis=0) > 0.0) for support in loaded.supports]
    blocks = []
    for block in loaded.blocks:
        factors = []
        for factor, support, picked in zip(block.factors, loaded.supports, own, strict=True):
            rest = factor[:, -1] - factor[:, :-1] @ values[support]
            factors.append(np.column_stack([factor[:, :-1] @ kept[np.ix_(support, picked)], rest]))
        blocks.append(Block(factors=tuple(factors), n_t=block.n_t))
    return replace(loaded, supports=tuple(own), n_b=kept.shape[1], blocks=tuple(blocks), fingerprint="")


def _of_both(before: Evidence, loaded: Evidence, kept: FloatArray) -> Evidence:
    """Return evidence on (x, p) of runs without and with the payload."""
    n_b = before.n_b
    own = [np.flatnonzero(np.abs(kept[support]).max(axis=0) > 0.0) for support in before.supports]
    nothing = np.zeros_like(kept)
    blocks = [_widened(block, before.supports, own, nothing) for block in before.blocks]
    blocks += [_widened(block, loaded.supports, own, kept) for block in loaded.blocks]
    supports = tuple(np.append(support, n_b + picked) for support, picked in zip(before.supports, own, strict=True))
    return Evidence(
        supports=supports,
        n_b=n_b + kept.shape[1],
        blocks=tuple(blocks),
        recordings=(*before.recordings, *loaded.recordings),
    )


def _widened(block: Block, supports: tuple[IntArray, ...], own: list[IntArray], kept: FloatArray) -> Block:
    factors = []
    for factor, support, picked in zip(block.factors, supports, own, strict=True):
        columns = factor[:, :-1]
        factors.append(np.column_stack([columns, columns @ kept[np.ix_(support, picked)], factor[:, -1]]))
    return Block(factors=tuple(factors), n_t=block.n_t)


def _without(evidence: Evidence, place: int, value: float | None) -> Evidence:
    """Return the evidence on the other parameters when the one at `place` is known; unchanged for None."""
    if value is None:
        return evidence
    spots = [np.flatnonzero(support == place) for support in evidence.supports]
    blocks = []
    for block in evidence.blocks:
        factors = [factor.copy() for factor in block.factors]
        for factor, spot in zip(factors, spots, strict=True):
            factor[:, -1] -= value * factor[:, spot].sum(axis=1)
        blocks.append(Block(factors=tuple(factors), n_t=block.n_t))
    others = np.delete(np.arange(evidence.n_b), place)
    return replace(evidence, blocks=tuple(blocks)).keeping(others)


def _with(values: FloatArray, place: int, value: float | None) -> FloatArray:
    return values if value is None else np.insert(values, place, value)


def _with_zeros(solution: Solution, place: int) -> FloatArray:
    """Return the covariance with a row and column of zeros at `place`, for what is known; unchanged for -1."""
    if place < 0:
        return np.array(solution.covariance)
    return np.insert(np.insert(solution.covariance, place, 0.0, axis=0), place, 0.0, axis=1)
