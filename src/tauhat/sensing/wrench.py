"""Force and moment at a frame from external joint torques, with covariance, in as many directions as are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import SensingError
from tauhat.robots.kinematics import named_frame
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot
from tauhat.sensing.wrench_kernel import jacobian_kernel, wrench_kernel

Axes: TypeAlias = Literal["base", "frame"]
"""Whose axes directions and wrenches are along: the robot's base, or the frame at which they act."""

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
_HIDDEN = 0.5  # of the variance that is conceivable: a direction with more left is not observed
_UNIT = 1e-6

DIRECTIONS: Mapping[str, FloatArray] = {
    "wrench": read_only(np.eye(6)),
    "force": read_only(np.eye(6)[:, :3]),
    "fx": read_only(np.eye(6)[:, [0]]),
    "fy": read_only(np.eye(6)[:, [1]]),
    "fz": read_only(np.eye(6)[:, [2]]),
}
"""What may be solved for, by name: all six components, a force alone, or along one axis; (6, k)."""


class SensedWrench(NamedTuple):
    """What acts at the frame, for one sample or many.

    wrench : (6,) or (n_t, 6) force, then moment about the frame's origin [N, Nm]
    covariance : (6, 6) or (n_t, 6, 6); zero beside the directions that were asked for
    """

    wrench: FloatArray
    covariance: FloatArray

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the components, (6,) or (n_t, 6) [N, Nm]."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))


def directions_named(name: str) -> FloatArray:
    """Return the directions of this name, (6, k).

    Raises
    ------
    SensingError
        when there are none.
    """
    if name not in DIRECTIONS:
        raise SensingError(
            "unknown directions of a wrench", expected=", ".join(DIRECTIONS), got=name[:60],
            remedy=advice_on_name(name, DIRECTIONS),
        )  # fmt: skip
    return DIRECTIONS[name]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WrenchSolver:
    """A frame and the directions in which something may act there.

    The fewer directions, the less joint errors are taken for force: polishing knows its normal.

    robot : geometry
    frame : where it acts; the robot's last where not stated
    directions : (6, k) unit wrenches, force then moment; all others are taken to be zero
    axes : whose axes directions and results are along
    largest : conceivable force and moment, as standard deviations [N, Nm]: where joints cannot tell, the answer is
        zero plus or minus this; raise it for arms that push with more than twice as much
    correlation : (n_v, n_v) of the joints' errors, as free motion teaches it; none by default
    sizes : (k,) conceivable sizes of the single directions, where more is known than `largest` says; a friction that
        cannot be more than a few newtons is then not blown up by errors of the joints [N, Nm]
    """

    robot: Robot
    frame: str | None = None
    directions: FloatArray = field(default_factory=lambda: DIRECTIONS["wrench"])
    axes: Axes = "base"
    largest: tuple[float, float] = (300.0, 60.0)
    correlation: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    sizes: FloatArray = field(default_factory=lambda: np.zeros(0))
    _links: NDArray[np.void] = field(init=False, repr=False)
    _place: tuple[Any, ...] = field(init=False, repr=False)
    _spread: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        directions = frozen("directions", self.directions, (6, None), where="wrench")
        object.__setattr__(self, "directions", directions)
        lengths = np.linalg.norm(directions, axis=0)
        if not 1 <= directions.shape[1] <= 6 or np.linalg.matrix_rank(directions) < directions.shape[1]:
            raise SensingError("directions of a wrench", expected="one to six, none a sum of the others")
        if (np.abs(lengths - 1.0) > _UNIT).any():
            raise SensingError("directions of a wrench", expected="unit length each", got=lengths.tolist())
        if self.axes not in {"base", "frame"} or not all(0.0 < value < np.inf for value in self.largest):
            raise SensingError(
                "axes and largest wrench", expected="base or frame, two sizes above zero", got=(self.axes, self.largest)
            )
        object.__setattr__(self, "correlation", _correlation(self.correlation, self.robot.n_v))
        name = self.robot.frames[-1].name if self.frame is None and self.robot.frames else self.frame
        place = named_frame(self.robot, name or self.robot.joint_names[-1])
        object.__setattr__(self, "frame", place.name)
        object.__setattr__(self, "_links", kernel_tree(self.robot).links)
        object.__setattr__(self, "_place", (place.joint, np.array(place.rotation), np.array(place.translation)))
        usual = 1.0 / np.linalg.norm(directions / np.repeat(self.largest, 3)[:, None], axis=0)
        object.__setattr__(self, "_spread", _spread(self.sizes, usual))

    @property
    def task(self) -> tuple[Any, ...]:
        """Links, place, directions, largest wrench, whether directions turn with the frame, and correlation."""
        return self._links, self._place, self.directions, self._spread, self.axes == "frame", self.correlation

    def jacobian(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the Jacobian of the frame's origin in base axes, (6, n_v), and the frame's rotation, (3, 3)."""
        n_v = self.robot.n_v
        work, jacobian = np.empty(40 * (n_v + 1)), np.empty((6, n_v))
        jacobian_kernel(self._links, self._place, frozen("q", q, (n_v,), where="wrench"), work, jacobian)
        return jacobian, work[40 * n_v : 40 * n_v + 9].reshape(3, 3).copy()

    def at(self, q: FloatArray, tau: FloatArray, variance: FloatArray) -> SensedWrench:
        """Return what acts at one position.

        Parameters
        ----------
        q, tau, variance : (n_v,) position, external torque and its variance
        """
        single = self.along(*(np.asarray(value)[None] for value in (q, tau, variance)))
        return SensedWrench(single.wrench[0], single.covariance[0])

    def along(
        self, q: FloatArray, tau: FloatArray, variance: FloatArray, *, own: FloatArray | None = None
    ) -> SensedWrench:
        """Return what acts along positions, one by one.

        Parameters
        ----------
        q, tau, variance : (n_t, n_v) position, external torque, and the variance of errors that belong together
        own : (n_t, n_v) variance of what each joint is wrong by beside them; none by default
        """
        n_v = self.robot.n_v
        rows = [frozen(name, value, (None, n_v), where="wrench") for name, value in (("q", q), ("tau", tau))]
        spread = frozen("variance", variance, rows[0].shape, where="wrench")
        if not (spread > 0.0).all():
            raise SensingError("variance of external torque", expected="above zero", got=float(spread.min()))
        beside = np.zeros(spread.shape) if own is None else frozen("own", own, spread.shape, where="wrench")
        if not (beside >= 0.0).all():
            raise SensingError("own variance of external torque", expected="not negative", got=float(beside.min()))
        solved = np.empty((len(rows[0]), 1 + self._spread.size, self._spread.size))
        _along(self.task, rows[0], (rows[1], spread, beside), solved)
        wrench = solved[:, 0] @ self.directions.T
        covariance = self.directions @ solved[:, 1:] @ self.directions.T
        return SensedWrench(wrench, covariance)

    def hidden(self, covariance: FloatArray) -> FloatArray:
        """Return the directions that the joints do not tell, orthonormal in parts of `largest`, (6, n).

        They have half of their conceivable variance or more left, in the scaling of the solve (`sizes`).

        Parameters
        ----------
        covariance : (6, 6) of one sensed wrench
        """
        own = np.linalg.pinv(self.directions)
        shares, axes = np.linalg.eigh(own @ covariance @ own.T / np.outer(self._spread, self._spread))
        hidden = self.directions @ (self._spread[:, None] * axes[:, shares > _HIDDEN])
        return np.asarray(np.linalg.qr(hidden / np.repeat(self.largest, 3)[:, None])[0])


def _spread(sizes: FloatArray, usual: FloatArray) -> FloatArray:
    """Return conceivable sizes of all directions, (k,): the usual ones where none are given."""
    if not np.size(sizes):
        return np.asarray(read_only(usual))
    given = frozen("sizes", sizes, usual.shape, where="wrench")
    if not (given > 0.0).all():
        raise SensingError("conceivable sizes of directions", expected="above zero", got=given.tolist())
    return given


def _correlation(values: FloatArray, n_v: int) -> FloatArray:
    """Return a correlation of the joints' errors, (n_v, n_v), after refusing what is none; empty: that of none."""
    if not np.size(values):
        return np.asarray(read_only(np.eye(n_v)))
    matrix = frozen("correlation", values, (n_v, n_v), where="wrench")
    alike = np.abs(matrix - matrix.T).max() < _UNIT and np.abs(matrix.diagonal() - 1.0).max() < _UNIT
    if not alike or np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise SensingError(
            "correlation of the joints' errors", expected="symmetric, ones on the diagonal, positive definite",
            got=matrix.tolist(),
        )  # fmt: skip
    return matrix


@njit(cache=True, nogil=True, error_model="numpy")
def _along(task, q, torque, out):  # type: ignore[no-untyped-def]
    links, place, directions, spread, turned, correlation = task
    n_t, n_v = q.shape
    links_work, jacobian = np.empty(40 * (n_v + 1)), np.empty((6, n_v))
    k_all, inputs = spread.size, np.empty((3, n_v))
    work = np.empty((k_all, k_all)), np.empty((k_all + 1, n_v)), np.empty((n_v, n_v))
    along = directions.copy()
    for k in range(n_t):
        jacobian_kernel(links, place, q[k], links_work, jacobian)
        if turned:
            turn_directions(directions, links_work[40 * n_v :], along)
        inputs[0], inputs[1], inputs[2] = torque[0][k], torque[1][k], torque[2][k]
        wrench_kernel(jacobian, (along, spread, correlation), inputs, work, out[k])


@njit(cache=True, nogil=True, error_model="numpy")
def turn_directions(directions, rotation, out):  # type: ignore[no-untyped-def]
    """Fill `out` (6, k) with directions of the frame's axes in base axes; `rotation` holds its 9 numbers row by row."""
    for a in range(directions.shape[1]):
        for r in range(6):
            own, first = 3 * (r % 3), r - r % 3
            out[r, a] = (
                rotation[own] * directions[first, a]
                + rotation[own + 1] * directions[first + 1, a]
                + rotation[own + 2] * directions[first + 2, a]
            )
