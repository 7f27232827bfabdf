"""Coordinates without units in which every physical link looks alike: what makes the convex program well scaled.

The pseudo-inertia of a link is written `J = L X L'`, with `L L'` a body of the nominal mass and centre whose spread is
made no thinner than a part of the distance between joints. Then X is of the order of one, `J > 0` is `X > 0`, and the
distance `|X - X0|` does not depend on frames or units. Other parameters are divided by the value with which they alone
would make the measured torque.

A description's figures may be placeholders: masses of 1 kg, inertias of 1e-6. The metric therefore grows with the
masses that the measured torque asks for, and where there are no nominal masses it is a ball on every link.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.nominal import DESCRIBED_DRIVES
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Parameter
from tauhat.estimation.pseudo_inertia import SIZE, inertial_parameters, pseudo_inertia, stacked, unstacked
from tauhat.robots.joint import central_inertia
from tauhat.robots.robot import Robot

BREADTH = 0.2  # spread that a link of the metric has at least, in parts of the mean distance between joints
_LIGHT = 0.1  # least mass of a link in the metric, in parts of the median
_THIN = 1e-2  # smallest eigenvalue of a nominal X: thinner nominal bodies are broadened
_HEAVIER = 1e3  # largest factor between the masses that the torque asks for and those of the description
_SILENT = 1e-9  # a column below this part of the largest is rounding and gives no scale
_LENGTH = 0.1  # [m] distance between joints where all coincide


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyCoordinates:
    """The map from coordinates u without units to standard parameters, `x = (matrix u)[places]`.

    joints : (n_links,) indices of the links' joints; the ten u of link k are its stacked X, `u[10 k : 10 k + 10]`
    matrix : (n_u, n_u), block diagonal
    places : (n_p,) where each standard parameter is in `matrix u`
    absent : indices in `matrix u` of inertial parameters that the model takes as zero
    nominal : (n_u,) coordinates of the nominal robot
    roots : (n_links, 4, 4) the factors L
    """

    joints: tuple[int, ...]
    matrix: FloatArray
    places: IntArray
    absent: IntArray
    nominal: FloatArray
    roots: FloatArray

    def __post_init__(self) -> None:
        for array in (self.matrix, self.places, self.absent, self.nominal, self.roots):
            read_only(array)

    @property
    def n_links(self) -> int:
        """Number of links with mass."""
        return len(self.joints)

    @property
    def n_u(self) -> int:
        """Number of coordinates."""
        return int(self.nominal.size)

    @property
    def masses(self) -> FloatArray:
        """Masses of the metric's bodies, (n_links,) [kg]."""
        return np.asarray(np.sum(self.roots[:, 3] ** 2, axis=-1))

    def bodies(self, coordinates: FloatArray) -> FloatArray:
        """Return the links' inertial parameters, (n_links, 10)."""
        return np.asarray((self.matrix @ coordinates)[: SIZE * self.n_links].reshape(-1, SIZE))

    def standard(self, coordinates: FloatArray) -> FloatArray:
        """Return the model's standard parameters, (n_p,)."""
        return np.asarray((self.matrix @ coordinates)[self.places])


def body_coordinates(model: TorqueModel, base: BaseParameters, triangle: FloatArray) -> BodyCoordinates:
    """Return the coordinates for a model and the size of the torque it was measured with.

    Parameters
    ----------
    triangle : (n_f, n_b + 1) factor of the weighted equations in base parameters, the torque last
    """
    parameters = model.parameters
    joints, places, absent = _places(parameters)
    n_u = places.size + absent.size
    projection = np.zeros((base.n_b, n_u))
    projection[:, places] = base.projection
    columns, torque = triangle[:, :-1] @ projection, triangle[:, -1]
    matrix, nominal = _others(model.robot, parameters, places, triangle=np.column_stack([columns, torque]))
    bodies = _metric_bodies(model.robot)[list(joints)]
    inertia = model.robot.inertia[list(joints)]
    pulled = columns[:, : SIZE * len(joints)] @ inertial_parameters(bodies).ravel()
    factor = _mass_factor(pulled, torque, known=model.robot.has_inertia)
    roots = np.asarray(np.linalg.cholesky(factor * bodies), dtype=np.float64)
    for index, root in enumerate(roots):
        block = slice(SIZE * index, SIZE * index + SIZE)
        matrix[block, block] = _link_matrix(root)
        known = inertia[index, 0] > 0.0
        nominal[block] = stacked(_nominal_shape(root, pseudo_inertia(inertia[index]))) if known else stacked(np.eye(4))
    return BodyCoordinates(joints=joints, matrix=matrix, places=places, absent=absent, nominal=nominal, roots=roots)


def _places(parameters: tuple[Parameter, ...]) -> tuple[tuple[int, ...], IntArray, IntArray]:
    """Return the links' joints, where each parameter goes, links first, and which inertial ones the model lacks."""
    inertial = [parameter.symbol in INERTIAL_SYMBOLS for parameter in parameters]
    pairs = tuple(zip(parameters, inertial, strict=True))
    joints = tuple(sorted({parameter.joint for parameter, is_inertial in pairs if is_inertial}))
    places, others = [], SIZE * len(joints)
    for parameter, is_inertial in pairs:
        if is_inertial:
            places.append(SIZE * joints.index(parameter.joint) + INERTIAL_SYMBOLS.index(parameter.symbol))
        else:
            places.append(others)
            others += 1
    absent = np.setdiff1d(np.arange(others), places)
    return joints, np.array(places, dtype=np.intp), absent


def _others(
    robot: Robot, parameters: tuple[Parameter, ...], places: IntArray, *, triangle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the diagonal map and nominal coordinates of what is not inertial; the links' blocks are still empty."""
    sizes = np.linalg.norm(triangle, axis=0)
    norms, size, n_u = sizes[:-1], sizes[-1], sizes.size - 1
    scale = np.divide(size, norms, out=np.ones(n_u), where=norms > _SILENT * norms.max())
    nominal = np.zeros(n_u)
    for parameter, place in zip(parameters, places, strict=True):
        if parameter.symbol in DESCRIBED_DRIVES:
            value = float(getattr(robot.joints[parameter.joint], DESCRIBED_DRIVES[parameter.symbol]))
            scale[place] = max(scale[place], value)
            nominal[place] = value / scale[place]
    return np.diag(scale), nominal


def _metric_bodies(robot: Robot) -> FloatArray:
    """Return a pseudo-inertia for every link that has a mass and a spread in all directions, (n_v, 4, 4)."""
    distances = np.array([np.linalg.norm(joint.translation) for joint in robot.joints])
    length = float(distances[distances > 0.0].mean()) if (distances > 0.0).any() else _LENGTH
    known = robot.inertia[:, 0] > 0.0
    usual = float(np.median(robot.inertia[known, 0])) if known.any() else 1.0
    bodies = []
    for inertia in robot.inertia:
        mass, centre, central = central_inertia(inertia)
        weight = max(mass, _LIGHT * usual) if mass > 0.0 else usual
        values, axes = np.linalg.eigh(0.5 * np.trace(central) * np.eye(3) - central)
        spread = np.maximum(values, 0.0) / mass if mass > 0.0 else np.zeros(3)
        second = (axes * (spread + (BREADTH * length) ** 2)) @ axes.T + np.outer(centre, centre)
        bodies.append(weight * np.block([[second, centre[:, None]], [centre[None], np.ones((1, 1))]]))
    return np.array(bodies)


def _mass_factor(pulled: FloatArray, torque: FloatArray, *, known: bool) -> float:
    """Return how much heavier the metric's bodies must be to make the measured torque; never lighter than nominal."""
    size = float(pulled @ pulled)
    factor = float(pulled @ torque) / size if size > 0.0 else 1.0
    return float(np.clip(factor, 1.0 if known else 1.0 / _HEAVIER, _HEAVIER))


def _link_matrix(root: FloatArray) -> FloatArray:
    """Return the matrix (10, 10) that takes a stacked X to the inertial parameters of `J = L X L'`."""
    bodies = root @ unstacked(np.eye(SIZE)) @ root.T
    return inertial_parameters(bodies).T


def _nominal_shape(root: FloatArray, pseudo: FloatArray) -> FloatArray:
    half = np.linalg.solve(root, pseudo)
    values, axes = np.linalg.eigh(np.linalg.solve(root, half.T))
    return np.asarray((axes * np.maximum(values, _THIN)) @ axes.T)


def shape_rows(root: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the row (10,) of `tr(weights J)` over a link's stacked X; `weights` symmetric (4, 4)."""
    return stacked(root.T @ weights @ root)


def inertial_rows(root: FloatArray, weights: FloatArray) -> FloatArray:
    """Return rows (n, 10) over a link's stacked X of weights (n, 10) over its inertial parameters."""
    return np.asarray(weights @ _link_matrix(root))
