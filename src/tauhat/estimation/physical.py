"""Physically consistent parameters from evidence: the feasible ones that fit best, nearest to the nominal robot.

Torque depends on base parameters only, fewer than the links have. One small convex program gives all standard ones:
the evidence decides what it can, every link stays a body of positive density, friction and rotor inertia stay what they
can be, and a weak pull decides the rest. That is a two-level aim reached in one solve: with D the pull without its
weight `1 / deviation^2`, half the squared error exceeds its least feasible value by no more than `D / deviation^2` of
the best-fitting parameters, a fixed number of squared standard deviations however long the log.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError
from tauhat.estimation.conic_solver import Certificate, binding, certificate, solve_conic
from tauhat.estimation.consistency_objective import GaussianObjective, Objective, objective_of
from tauhat.estimation.consistency_problem import ConeRows, ConsistencyProblem, consistency_problem
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.pseudo_inertia import SIZE, margins, pushed_inside
from tauhat.estimation.solution import joint_residuals

LARGEST_GAP = 1e-5  # proven distance from the optimum, in parts of half the squared error, that is still a solution
_BREACH = 1e-6  # largest breach of a constraint, in coordinates of the order of one
_ROUNDING = 1e-8  # distance of a coordinate from its bound that is none
_UNIT = 10.0  # of the objective for the solver, at most: larger ones cost it digits of the fit
_SOLVED = {"Solved", "AlmostSolved"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConsistentSolution:
    """Standard parameters that a physical robot could have.

    standard : (n_p,) in the model's order
    values : (n_b,) the base parameters they make
    joints : indices of the joints whose links have inertial parameters
    margins : (n_links,) smallest eigenvalue of each link's pseudo-inertia over its trace
    joint_rms : (n_v,) residuals of the fit [Nm or N]
    cost : weighted residual over that of the fit without constraints and pull, less one
    binding : the constraints that hold the fit back, what costs most first
    certificate : proof that nothing feasible is better
    seconds : that building and solving took
    """

    standard: FloatArray
    values: FloatArray
    joints: tuple[int, ...]
    margins: FloatArray
    joint_rms: FloatArray
    cost: float
    binding: tuple[str, ...]
    certificate: Certificate
    seconds: float

    def __post_init__(self) -> None:
        for array in (self.standard, self.values, self.margins, self.joint_rms):
            read_only(array)

    def report(self, constraints: PhysicalConstraints) -> dict[str, Any]:
        """Return what was asked for and what proves the solution, as plain data."""
        proof = self.certificate
        return {
            "pull": constraints.pull.key,
            "deviation": constraints.pull.deviation,
            "margin": constraints.margin,
            "unbounded": list(constraints.unbounded),
            "margins": self.margins.tolist(),
            "cost": self.cost,
            "binding": list(self.binding),
            "gap": float(proof.gap),
            "violation": float(proof.violation),
            "status": proof.status,
        }


@single_threaded
def consistent(
    evidence: Evidence,
    model: TorqueModel,
    base: BaseParameters,
    *,
    weights: FloatArray,
    constraints: PhysicalConstraints | None = None,
) -> ConsistentSolution:
    """Return the physically consistent standard parameters that fit the evidence best, nearest to the nominal robot.

    Parameters
    ----------
    weights : (n_v,) factors on each joint's equations, `Solution.weights` of the free fit
    constraints : physics alone by default

    Raises
    ------
    ModelError
        when constraints contradict each other (names link and constraints), or no solution can be proven.
    """
    start = perf_counter()
    settings = constraints or PhysicalConstraints()
    problem = consistency_problem(evidence, model, base, weights=weights, constraints=settings)
    coordinates, proof, held = solve_consistency(problem, names=model.robot.joint_names)
    standard = problem.coordinates.standard(coordinates)
    values = base.projection @ standard
    return ConsistentSolution(
        standard=standard,
        values=values,
        joints=problem.coordinates.joints,
        margins=margins(problem.coordinates.bodies(coordinates)),
        joint_rms=joint_residuals(evidence, values),
        cost=float(np.sqrt(problem.squared_error(coordinates))) - 1.0,
        binding=held,
        certificate=proof,
        seconds=perf_counter() - start,
    )


class Solved(NamedTuple):
    """Coordinates (n_u,) inside the margins up to rounding, their proof, and the constraints that hold them back."""

    coordinates: FloatArray
    certificate: Certificate
    binding: tuple[str, ...]


def solve_consistency(problem: ConsistencyProblem, *, names: tuple[str, ...]) -> Solved:
    """Return the solution of the convex program.

    Parameters
    ----------
    names : of the robot's joints, for messages

    Raises
    ------
    ModelError
        when constraints contradict each other, or no solution can be proven.
    """
    objective = objective_of(problem)
    result = solve_conic(objective, problem.rows, unit=min(problem.pull.deviation, _UNIT))
    if result.status not in _SOLVED:
        _explain(problem, names)
    coordinates = _inside(problem, result.coordinates)
    proof = certificate(objective, problem.rows, result, coordinates)
    if not (proof.gap <= LARGEST_GAP * (proof.primal + 0.5 * problem.floor) and proof.violation <= _BREACH):
        _explain(problem, names)
        raise ModelError(
            "the physically consistent fit could not be solved",
            got=f"{result.status} after {result.iterations} steps, gap {proof.gap:.2g}, breach {proof.violation:.2g}",
            remedy="bounds may leave hardly any room: widen them, or take a smaller margin",
        )
    held = tuple(_words(problem, row, names) for row in binding(problem.rows, result))
    return Solved(coordinates, proof, held)


def _words(problem: ConsistencyProblem, row: ConeRows, names: tuple[str, ...]) -> str:
    return row.words if row.link < 0 else f"link of joint {names[problem.coordinates.joints[row.link]]}: {row.words}"


def _inside(problem: ConsistencyProblem, coordinates: FloatArray) -> FloatArray:
    """Return the coordinates moved by the solver's rounding so that margins and lower bounds hold."""
    inside = coordinates.copy()
    place = problem.coordinates
    inertial = SIZE * place.n_links
    for row in problem.rows:
        if row.cone == "nonnegative" and row.link < 0:
            index = int(np.argmax(row.matrix[0]))
            bound = -float(row.offset[0])
            inside[index] = bound if inside[index] < bound + _ROUNDING else inside[index]
    bodies = place.bodies(inside)
    pushed = pushed_inside(bodies, problem.margin)
    if place.n_links and (pushed != bodies).any():
        inside[:inertial] = np.linalg.solve(place.matrix[:inertial, :inertial], pushed.ravel())
    return inside


def _explain(problem: ConsistencyProblem, names: tuple[str, ...]) -> None:
    """Raise for the first link whose own constraints contradict each other; links share no constraint."""
    for link, joint in enumerate(problem.coordinates.joints):
        rows = tuple(row for row in problem.rows if row.link == link)
        if _has_body(problem, rows):
            continue
        needed = list(rows)
        for row in rows:
            others = tuple(other for other in needed if other is not row)
            if not _has_body(problem, others):
                needed = list(others)
        words = ", ".join(dict.fromkeys(row.words for row in needed))
        raise ModelError(
            f"no body has {words}, all at once", where=f"link of joint {names[joint]}", remedy="relax one of them"
        )


def _has_body(problem: ConsistencyProblem, rows: tuple[ConeRows, ...]) -> bool:
    """Return whether the constraints leave room: the nearest point to the nominal one can be found."""
    coordinates = problem.coordinates
    n_u = coordinates.n_u
    objective: Objective = GaussianObjective(
        rows=np.column_stack([np.eye(n_u), coordinates.nominal]),
        linear=np.zeros(n_u),
        logs=np.zeros(0),
        constant=0.0,
    )
    return solve_conic(objective, rows).status in _SOLVED
