"""The convex program of a physically consistent fit, in coordinates without units.

    minimise  |F u - g|^2 / 2 + pull(u)    subject to    B u + c in K

`[F g]` is the evidence in standard deviations of its own residual, one small triangle whatever the log's length; K is a
product of half-lines, second-order cones and cones of positive semidefinite matrices. The pull makes the objective
strictly convex, so that there is one solution although the torque depends on fewer numbers than there are parameters.

Source: Sousa, Cortesão, "Physical feasibility of robot base inertial parameter identification: a linear matrix
inequality approach", 2014; ellipsoids: Wensing, Kim, Slotine 2018.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import INERTIAL_SYMBOLS
from tauhat.errors import ModelError
from tauhat.estimation.body_coordinates import BodyCoordinates, body_coordinates, inertial_rows, shape_rows
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.physical_constraints import Box, Ellipsoid, LinkConstraints, PhysicalConstraints, Pull
from tauhat.estimation.pseudo_inertia import SIZE, stacked
from tauhat.estimation.solution import weighted_rows

Cone: TypeAlias = Literal["zero", "nonnegative", "second order", "semidefinite"]

_QUIET = 1e-4  # least residual that is believed, in parts of the torque
_WELL = 1e-8  # smallest over largest pivot of columns of unit norm with which the triangle has full rank


class ConeRows(NamedTuple):
    """The condition `matrix u + offset in cone`; link -1 where it concerns none."""

    cone: Cone
    matrix: FloatArray
    offset: FloatArray
    link: int
    words: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConsistencyProblem:
    """A weighted least-squares fit with physical constraints and a pull.

    coordinates : what u means
    fit : (n_f, n_u + 1) the factor [F g] in standard deviations of the residual
    floor : squared error that no parameters remove, in the same units
    precision : (n_u,) weight of the pull on each coordinate
    pull : Gaussian or entropic
    rows : the constraints, scalar ones first
    margin : of the pseudo-inertias
    """

    coordinates: BodyCoordinates
    fit: FloatArray
    floor: float
    precision: FloatArray
    pull: Pull
    rows: tuple[ConeRows, ...]
    margin: float

    def __post_init__(self) -> None:
        for array in (self.fit, self.precision, *(part for row in self.rows for part in (row.matrix, row.offset))):
            read_only(array)

    def squared_error(self, coordinates: FloatArray) -> float:
        """Return the squared error of the fit over that of the free fit, both with what nothing can remove."""
        rest = self.fit[:, :-1] @ coordinates - self.fit[:, -1]
        return float(rest @ rest + self.floor) / self.floor


def consistency_problem(
    evidence: Evidence,
    model: TorqueModel,
    base: BaseParameters,
    *,
    weights: FloatArray,
    constraints: PhysicalConstraints,
) -> ConsistencyProblem:
    """Return the convex program for evidence on the model's base parameters.

    Parameters
    ----------
    weights : (n_v,) factors on each joint's equations

    Raises
    ------
    ModelError
        when a constrained link or unbounded parameter does not exist, or the torque is zero throughout.
    """
    whole = _weighted_triangle(evidence, weights)
    triangle, rest = whole[: evidence.n_b], whole[evidence.n_b :, -1]
    coordinates = body_coordinates(model, base, triangle)
    torque = _reachable(triangle)
    squares = float(rest @ rest) + float(np.sum((triangle[:, -1] - torque) ** 2))
    freedom = max(1, evidence.n_v * evidence.n_t - evidence.n_b)
    least = _QUIET**2 * float(np.sum(whole[:, -1] ** 2))
    if least <= 0.0:
        raise ModelError("the torque is zero throughout", remedy="name the right torque columns in the map")
    variance = max(squares, least) / freedom
    projection = np.zeros((evidence.n_b, coordinates.n_u))
    projection[:, coordinates.places] = base.projection
    columns = triangle[:, :-1] @ (projection @ coordinates.matrix)
    known = _known_links(model, coordinates, constraints)
    return ConsistencyProblem(
        coordinates=coordinates,
        fit=np.column_stack([columns, torque]) / np.sqrt(variance),
        floor=float(freedom),
        precision=_precision(coordinates, known, constraints),
        pull=constraints.pull,
        rows=tuple(_all_rows(model, coordinates, known, constraints)),
        margin=constraints.margin,
    )


def _weighted_triangle(evidence: Evidence, weights: FloatArray) -> FloatArray:
    """Return the factor of all joints' weighted equations over the base parameters, the torque last."""
    rows = weighted_rows(evidence, weights)
    norms = np.linalg.norm(rows, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    return np.asarray(np.linalg.qr(rows / scale, mode="r") * scale)


def _reachable(triangle: FloatArray) -> FloatArray:
    """Return the part of the torque's column that parameters can make; all of it where the triangle has full rank."""
    norms = np.linalg.norm(triangle[:, :-1], axis=0)
    scaled = triangle[:, :-1] / np.where(norms > 0.0, norms, 1.0)
    pivots = np.abs(np.diag(scaled))
    if scaled.shape[0] == scaled.shape[1] and pivots.min() > _WELL * pivots.max():
        return triangle[:, -1]
    return np.asarray(scaled @ np.linalg.lstsq(scaled, triangle[:, -1], rcond=_WELL)[0])


def _known_links(
    model: TorqueModel, coordinates: BodyCoordinates, constraints: PhysicalConstraints
) -> tuple[LinkConstraints, ...]:
    """Return the constraints of every link, without bounds where none are given."""
    given = {link.joint: link for link in constraints.links}
    names = tuple(model.robot.joints[joint].name for joint in coordinates.joints)
    unknown = sorted(set(given) - set(names))
    if unknown:
        raise ModelError(
            "a constrained link does not exist", where=model.robot.name, expected=", ".join(names), got=unknown[0]
        )
    return tuple(given.get(name, LinkConstraints(joint=name)) for name in names)


def _precision(
    coordinates: BodyCoordinates, known: tuple[LinkConstraints, ...], constraints: PhysicalConstraints
) -> FloatArray:
    precision = np.full(coordinates.n_u, constraints.pull.deviation**-2.0)
    trusts = np.repeat([link.trust for link in known], SIZE)
    precision[: trusts.size] *= trusts
    return precision


def _all_rows(
    model: TorqueModel,
    coordinates: BodyCoordinates,
    known: tuple[LinkConstraints, ...],
    constraints: PhysicalConstraints,
) -> list[ConeRows]:
    """Return all constraints, ordered by cone."""
    rows = [_absent_row(coordinates, index) for index in coordinates.absent]
    rows += _lower_bounds(model, coordinates, constraints)
    for link, bounds in enumerate(known):
        rows += _link_rows(coordinates, link, bounds, constraints)
    order: dict[Cone, int] = {"zero": 0, "nonnegative": 1, "second order": 2, "semidefinite": 3}
    return sorted(rows, key=lambda row: order[row.cone])


def _absent_row(coordinates: BodyCoordinates, index: int) -> ConeRows:
    row = coordinates.matrix[index : index + 1]
    symbol = INERTIAL_SYMBOLS[index % SIZE]
    words = f"{symbol} taken as zero by the model"
    return ConeRows("zero", row / np.linalg.norm(row), np.zeros(1), int(index) // SIZE, words)


def _lower_bounds(model: TorqueModel, coordinates: BodyCoordinates, constraints: PhysicalConstraints) -> list[ConeRows]:
    """Return the bounds of all parameters that are not inertial: those are bounded by the pseudo-inertia."""
    parameters = model.parameters
    symbols = sorted({parameter.symbol for parameter in parameters} - set(INERTIAL_SYMBOLS))
    unknown = sorted(set(constraints.unbounded) - set(symbols))
    if unknown:
        raise ModelError("no such parameter to leave unbounded", expected=", ".join(symbols), got=", ".join(unknown))
    rows = []
    for parameter, place in zip(parameters, coordinates.places, strict=True):
        bounded = np.isfinite(parameter.lower) and parameter.symbol not in constraints.unbounded
        if place >= SIZE * coordinates.n_links and bounded:
            row = np.zeros((1, coordinates.n_u))
            row[0, place] = 1.0
            offset = np.array([-parameter.lower / coordinates.matrix[place, place]])
            rows.append(ConeRows("nonnegative", row, offset, -1, f"{parameter.name} of at least {parameter.lower:g}"))
    return rows


def _link_rows(
    coordinates: BodyCoordinates, link: int, bounds: LinkConstraints, constraints: PhysicalConstraints
) -> list[ConeRows]:
    """Return the constraints of one link, over its ten coordinates written into all."""
    root, mass = coordinates.roots[link], float(coordinates.masses[link])
    pieces = [*_mass_pieces(root, mass, bounds, constraints), *_place_pieces(root, bounds)]
    pieces.append(
        ("semidefinite", _margin_matrix(root, constraints.margin), np.zeros(SIZE), _margin_words(constraints))
    )
    rows = []
    for cone, matrix, offset, words in pieces:
        whole = np.zeros((matrix.shape[0], coordinates.n_u))
        whole[:, SIZE * link : SIZE * link + SIZE] = matrix
        rows.append(ConeRows(cone, whole, offset, link, words))
    return rows


_Piece: TypeAlias = tuple[Cone, FloatArray, FloatArray, str]


def _margin_words(constraints: PhysicalConstraints) -> str:
    return f"a pseudo-inertia with a margin of {constraints.margin:g}"


def _margin_matrix(root: FloatArray, margin: float) -> FloatArray:
    """Return the matrix (10, 10) that takes X to the stack of `L^-1 (J - margin tr(J) E) L^-T`."""
    inverse = np.linalg.solve(root, np.eye(4))
    return np.eye(SIZE) - margin * np.outer(stacked(inverse @ inverse.T), shape_rows(root, np.eye(4)))


def _mass_pieces(
    root: FloatArray, mass: float, bounds: LinkConstraints, constraints: PhysicalConstraints
) -> list[_Piece]:
    row = inertial_rows(root, np.eye(1, SIZE)) / mass
    lower, upper = bounds.mass
    least = lower if lower > 0.0 else min(constraints.least_mass * mass, 0.5 * upper)
    pieces: list[_Piece] = [("nonnegative", row, np.array([-least / mass]), f"a mass of at least {least:.4g} kg")]
    if np.isfinite(upper):
        pieces.append(("nonnegative", -row, np.array([upper / mass]), f"a mass of at most {upper:.4g} kg"))
    return pieces


def _place_pieces(root: FloatArray, bounds: LinkConstraints) -> list[_Piece]:
    pieces: list[_Piece] = []
    if isinstance(bounds.centre, Box):
        weights = np.zeros((6, SIZE))
        weights[:3, 1:4], weights[:3, 0] = np.eye(3), -bounds.centre.lower
        weights[3:, 1:4], weights[3:, 0] = -np.eye(3), bounds.centre.upper
        rows = inertial_rows(root, weights)
        rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        pieces.append(("nonnegative", rows, np.zeros(6), "a centre of mass inside its box"))
    elif bounds.centre is not None:
        rows = inertial_rows(root, _centre_weights(bounds.centre))
        rows = rows / np.linalg.norm(rows[0])
        pieces.append(("second order", rows, np.zeros(4), "a centre of mass inside its ellipsoid"))
    if bounds.body is not None:
        row = shape_rows(root, _inside(bounds.body))[None]
        pieces.append(("nonnegative", row / np.linalg.norm(row), np.zeros(1), "a body inside its ellipsoid"))
    return pieces


def _centre_weights(ellipsoid: Ellipsoid) -> FloatArray:
    """Return the weights (4, 10) of `(m, W (m c - m c0))`: its tail is no longer than its head inside."""
    weights = np.zeros((4, SIZE))
    weights[0, 0] = 1.0
    weights[1:, 1:4] = ellipsoid.whitening
    weights[1:, 0] = -ellipsoid.whitening @ ellipsoid.centre
    return weights


def _inside(ellipsoid: Ellipsoid) -> FloatArray:
    """Return Q (4, 4) of the mean of `1 - |W (p - c)|^2` over the mass, `tr(J Q)`: not negative for a body inside."""
    shape = ellipsoid.whitening.T @ ellipsoid.whitening
    side = (shape @ ellipsoid.centre)[:, None]
    return np.block([[-shape, side], [side.T, np.full((1, 1), 1.0 - float(ellipsoid.centre @ side[:, 0]))]])
