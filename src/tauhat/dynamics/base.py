"""Base parameters: the minimal set that the torque depends on, by rank-revealing QR of the whole model.

Columns are visited in a fixed order of preference, base to tip, and a column that the ones before it span is regrouped
into them: `tau = Y x = Y_b (x_independent + K x_dependent)`. The order puts m, mz and Iyy of a link last, so that they
are regrouped into the link before, as the closed-form rules of Gautier and Khalil do.

Source: Gautier, "Numerical calculation of the base inertial parameters of robots", 1991.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms import Inertia, InertiaWithoutProducts
from tauhat.errors import ModelError, TauhatWarning
from tauhat.robots.robot import Robot

RANK_TOLERANCE = 1e-4  # part of a column that must stick out of the span before it; less is a rounded angle, too
FAINT = 1e-4  # a column below this part of the largest of its unit is a rounded angle, as 1.5708 for pi/2
CLEAR_GAP = 1e3  # smallest factor between the last kept and the first dropped part that needs no warning
_SEED = 20240229
_STATES = 400
_REVERSALS = 0.2  # share of the steps that turn back
_PART = 1e-3  # of a column of unit norm: a smaller part in a sum is rounding
_TEMPERATURES = (10.0, 60.0)  # [deg C]
_STEP = 0.01  # [s] between the states, for terms that carry a state
_PREFERENCE = ("Ixx", "Ixy", "Ixz", "Iyz", "Izz", "mx", "my", "mz", "Iyy", "m")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseParameters:
    """Which columns are independent and how the others regroup into them.

    names : of the model's standard parameters, n_p
    independent : (n_b,) indices of the kept columns
    dependent : indices of the regrouped columns
    regrouping : (n_b, n_dependent) matrix K of `x_b = x_independent + K x_dependent`
    unidentifiable : indices of columns that never load any joint
    """

    names: tuple[str, ...]
    independent: IntArray
    dependent: IntArray
    regrouping: FloatArray
    unidentifiable: IntArray

    @property
    def n_b(self) -> int:
        """Number of base parameters."""
        return int(self.independent.size)

    @property
    def projection(self) -> FloatArray:
        """Matrix (n_b, n_p) that takes standard to base parameters."""
        projection = np.zeros((self.n_b, len(self.names)))
        projection[np.arange(self.n_b), self.independent] = 1.0
        projection[:, self.dependent] = self.regrouping
        return projection

    def formulas(self, *, digits: int = 4) -> tuple[str, ...]:
        """Return each base parameter as a sum a person can read, e.g. `Izz_1 + Iyy_2 + 0.1806 m_3`."""
        return tuple(self._formula(row, digits) for row in range(self.n_b))

    def _formula(self, row: int, digits: int) -> str:
        text = str(self.names[self.independent[row]])
        for column, weight in zip(self.dependent, self.regrouping[row], strict=True):
            if weight != 0.0:
                size = "" if abs(abs(weight) - 1.0) < 0.5 * 10.0**-digits else f"{abs(weight):.{digits}g} "
                text += f" {'-' if weight < 0 else '+'} {size}{self.names[column]}"
        return text


def random_motion(robot: Robot, n_t: int, rng: np.random.Generator) -> Motion:
    """Return independent random states inside the robot's limits, (n_v, n_t) each.

    Unlimited joints, and those whose limits leave them less than a twentieth of that, turn within +-pi or slide within
    +-1 m; speeds and accelerations are of the order of one unless limited.
    """
    scale = np.array([np.pi if joint.kind == "revolute" else 1.0 for joint in robot.joints])
    lower = np.where(np.isfinite(robot.lower), robot.lower, -scale)
    upper = np.where(np.isfinite(robot.upper), robot.upper, scale)
    roomy = upper - lower > 0.1 * scale
    lower, upper = np.where(roomy, lower, -scale), np.where(roomy, upper, scale)
    speed = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 2.0)
    speed = np.where(speed > 0, speed, 2.0)
    shape = (robot.n_v, n_t)
    return Motion(
        q=lower[:, None] + (upper - lower)[:, None] * rng.random(shape),
        dq=speed[:, None] * rng.uniform(-1.0, 1.0, shape),
        ddq=3.0 * speed[:, None] * rng.uniform(-1.0, 1.0, shape),
        step=_STEP,
        temperature=rng.spawn(1)[0].uniform(*_TEMPERATURES, shape),  # from a stream of its own: the others stay
    )


def creeping_motion(robot: Robot, n_t: int, rng: np.random.Generator) -> Motion:
    """Return states that creep to and fro in steps and at speeds of all sizes, (n_v, n_t) each.

    Among random states no friction law shows its shape: every step is longer than any pre-sliding, hardly any speed is
    low. Here steps are between 1e-6 and 0.1 rad or m, speeds between 1e-4 and one times the limit.
    """
    states = random_motion(robot, n_t, rng)
    shape = states.q.shape
    turns = np.cumprod(np.where(rng.random(shape) < _REVERSALS, -1.0, 1.0), axis=1)
    steps = turns * 10.0 ** rng.uniform(-6.0, -1.0, shape)
    speeds = np.abs(states.dq).max(axis=1, keepdims=True) * 10.0 ** rng.uniform(-4.0, 0.0, shape)
    return replace(states, q=states.q[:, :1] + np.cumsum(steps, axis=1), dq=turns * speeds)


def base_parameters(model: TorqueModel, *, tolerance: float = RANK_TOLERANCE) -> BaseParameters:
    """Return the minimal parameter set of the whole model; deterministic.

    Parameters
    ----------
    tolerance : a column is dependent when less than this part of its norm is left outside the span of those before it

    Raises
    ------
    ModelError
        when no parameter loads any joint, or two terms load a joint in the same way.

    Warns
    -----
    TauhatWarning
        when kept and dropped columns are not clearly apart.
    """
    triangle, norms = _sampled_triangle(model)
    order = np.array(sorted(range(model.n_p), key=lambda index: _preference(model, index)))
    visible = _visible(model, norms)
    if not visible.any():
        raise ModelError("no parameter of the model loads any joint", where=model.robot.name)
    _refuse_alike(model, triangle / np.where(visible, norms, 1.0), visible, tolerance)
    independent, remainders = _sift(triangle / np.where(visible, norms, 1.0), order[visible[order]], tolerance)
    _warn_of_small_gap(remainders, tolerance)
    dependent = np.setdiff1d(np.flatnonzero(visible), independent)
    regrouping = _regrouping(triangle, norms, independent, dependent)
    return BaseParameters(
        names=tuple(parameter.name for parameter in model.parameters),
        independent=read_only(independent),
        dependent=read_only(dependent),
        regrouping=read_only(regrouping),
        unidentifiable=read_only(np.flatnonzero(~visible)),
    )


def independent_among(model: TorqueModel, wanted: IntArray, *, tolerance: float = RANK_TOLERANCE) -> IntArray:
    """Return which of the `wanted` parameters are independent of each other, whatever the others are; sorted indices.

    A payload changes the ten parameters of one link: what matters is whether these can be told apart, not whether they
    can be told from the rest.
    """
    triangle, norms = _sampled_triangle(model)
    visible = _visible(model, norms)
    order = np.array(sorted((int(index) for index in wanted if visible[index]), key=lambda i: _preference(model, i)))
    if not order.size:
        return np.zeros(0, dtype=np.intp)
    independent, _ = _sift(triangle / np.where(visible, norms, 1.0), order, tolerance)
    return independent


def _preference(model: TorqueModel, index: int) -> tuple[int, int, int]:
    parameter = model.parameters[index]
    if parameter.symbol in _PREFERENCE:
        return (0, parameter.joint, _PREFERENCE.index(parameter.symbol))
    return (1, index, 0)


def _visible(model: TorqueModel, norms: FloatArray) -> NDArray[np.bool_]:
    """Return which columns are not zero, (n_p,); what comes from rigid bodies may be a rounded angle: nothing, too."""
    units = np.array([parameter.unit for parameter in model.parameters])
    bodies = _of_bodies(model)
    return np.array(
        [
            norm > (FAINT * norms[bodies & (units == unit)].max() if body else 0.0)
            for norm, unit, body in zip(norms, units, bodies, strict=True)
        ]
    )


def _of_bodies(model: TorqueModel) -> NDArray[np.bool_]:
    """Return which parameters' columns come from the rigid bodies: their own, and those of load friction, (n_p,)."""
    rigid = (Inertia, InertiaWithoutProducts)
    owned = [isinstance(term, rigid) or term.iterated for term in model.terms for _ in term.parameters(model.robot)]
    return np.array(owned, dtype=np.bool_)


def _refuse_alike(model: TorqueModel, scaled: FloatArray, visible: NDArray[np.bool_], tolerance: float) -> None:
    """Refuse two terms of which one's columns are a sum of the other's: they are fitted twice, and mean nothing apart.

    Rigid bodies are left out: a rotor's inertia, a spring or an offset may well be regrouped into theirs.
    """
    owner = np.array([term.key for term in model.terms for _ in term.parameters(model.robot)])
    rigid = [term.key for term in model.terms if isinstance(term, Inertia | InertiaWithoutProducts)]
    drives = np.flatnonzero(visible & ~np.isin(owner, rigid))
    kept, _ = _sift(scaled, drives, tolerance)
    for column in np.setdiff1d(drives, kept):
        weights = np.linalg.lstsq(scaled[:, kept], scaled[:, column], rcond=None)[0]
        others = [key for key in owner[kept[np.abs(weights) > _PART]] if key != owner[column]]
        if others:
            joint = model.robot.joint_names[model.parameters[column].joint]
            raise ModelError(
                f"terms {others[0]} and {owner[column]} cannot be told apart on {joint}",
                remedy=f"leave out {others[0]} or {owner[column]}",
            )


def _sampled_triangle(model: TorqueModel) -> tuple[FloatArray, FloatArray]:
    """Return the triangular factor of the regressor on random states, (n_p, n_p), and its column norms."""
    rng = np.random.default_rng(_SEED)
    motions = [random_motion(model.robot, _STATES, rng)]
    if any(term.key != Inertia.key for term in model.terms):
        motions.append(creeping_motion(model.robot, _STATES, rng))
    layout = model.layout()
    parts = []
    for motion in motions:
        columns, _ = model.columns(motion, layout)
        for joint in range(model.robot.n_v):
            rows = layout.of_joint(joint)
            part = np.zeros((motion.n_t, model.n_p))
            part[:, layout.parameters[rows]] = columns[rows].T
            parts.append(part)
    stacked = np.vstack(parts)
    norms = np.linalg.norm(stacked, axis=0)
    triangle = np.linalg.qr(stacked / np.where(norms > 0, norms, 1.0), mode="r") * norms
    return triangle, norms


def _sift(scaled: FloatArray, order: IntArray, tolerance: float) -> tuple[IntArray, FloatArray]:
    """Gram-Schmidt over columns of unit norm in the given order; return the kept ones and every column's remainder."""
    basis = np.zeros((scaled.shape[0], 0))
    kept, remainders = [], []
    for column in order:
        rest = scaled[:, column]
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        remainders.append(size)
        if size > tolerance:
            kept.append(column)
            basis = np.column_stack([basis, rest / size])
    return np.sort(np.array(kept, dtype=np.intp)), np.array(remainders)


def _warn_of_small_gap(remainders: FloatArray, tolerance: float) -> None:
    kept, dropped = remainders[remainders > tolerance], remainders[remainders <= tolerance]
    if dropped.size and kept.min() < CLEAR_GAP * max(dropped.max(), np.finfo(float).eps):
        warnings.warn(
            f"base parameters are not clearly apart: smallest kept part {kept.min():.1e}, "
            f"largest dropped {dropped.max():.1e}",
            TauhatWarning,
            stacklevel=3,
        )


def _regrouping(triangle: FloatArray, norms: FloatArray, independent: IntArray, dependent: IntArray) -> FloatArray:
    if not dependent.size:
        return np.zeros((independent.size, 0))
    scaled = triangle / np.where(norms > 0, norms, 1.0)
    weights = np.linalg.lstsq(scaled[:, independent], scaled[:, dependent], rcond=None)[0]
    weights = weights * norms[dependent] / norms[independent][:, None]
    weights[np.abs(weights) < 1e-9 * max(1.0, np.abs(weights).max())] = 0.0
    return weights
