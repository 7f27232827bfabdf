"""A payload as a body: mass, centre and central inertia with error bars, and the best body that physics allows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Inertia
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.loaded_run import TEN, PayloadColumns
from tauhat.estimation.physical import consistent
from tauhat.estimation.physical_constraints import Box, Ellipsoid, LinkConstraints, PhysicalConstraints
from tauhat.robots.joint import Joint, central_inertia, inertia_at_origin
from tauhat.robots.robot import Robot

GYRATION = 0.05  # [m] radius of gyration that a payload is taken to have where the recordings do not tell
_LIGHTEST = 1e-3  # [kg] least mass of the body that the fit starts from
_PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A body as people speak of it, in the axes of the link that carries it, with half 95 % intervals.

    mass : [kg]
    centre : (3,) from the origin of the link's frame [m]
    inertia : (3, 3) about the centre of mass [kg m^2]
    mass_half, centre_half, inertia_half : half of the 95 % interval of each
    centre_seen, inertia_seen : (3,), (3, 3) which of the numbers the recordings tell; the others are guesses
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray
    mass_half: float
    centre_half: FloatArray
    inertia_half: FloatArray
    centre_seen: tuple[bool, ...]
    inertia_seen: tuple[tuple[bool, ...], ...]

    def __post_init__(self) -> None:
        for name, shape in (("centre", (3,)), ("inertia", (3, 3)), ("centre_half", (3,)), ("inertia_half", (3, 3))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="payload"))


def central_jacobian(values: FloatArray) -> FloatArray:
    """Return the derivatives (10, 10) of `m, c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` about the centre by the ten parameters.

    With the first moment h = m c: `c = h / m`, `I_c = I - (h.h E - h h') / m`.
    """
    mass, moment = values[0], values[1:4]
    jacobian = np.eye(TEN)
    jacobian[1:4, 1:4] = np.eye(3) / mass
    jacobian[1:4, 0] = -moment / mass**2
    steiner = moment @ moment * np.eye(3) - np.outer(moment, moment)
    for row, (a, b) in enumerate(_PAIRS, start=4):
        jacobian[row, 0] = steiner[a, b] / mass**2
        slope = 2.0 * moment * float(a == b)
        slope[a] -= moment[b]
        slope[b] -= moment[a]
        jacobian[row, 1:4] = -slope / mass
    return jacobian


def body_of(
    values: FloatArray, free: FloatArray, covariance: FloatArray, quantile: float, pure: tuple[bool, ...]
) -> Body:
    """Return the body of ten parameters, with error bars from the fit without constraints.

    A moment of inertia counts as seen when the fit without constraints finds it positive by more than half its
    interval; a product, when both of its moments do. What it cannot be told from zero, physics alone decides.

    Parameters
    ----------
    values, free : (10,) with and without physical constraints
    covariance : (10, 10) of `free`
    quantile : of Student's t
    pure : which of the ten are found alone
    """
    mass, centre, inertia = central_inertia(values)
    jacobian = central_jacobian(free)
    half = quantile * np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))
    inertia_half = np.zeros((3, 3))
    for (a, b), width in zip(_PAIRS, half[4:], strict=True):
        inertia_half[a, b] = inertia_half[b, a] = width
    centre_seen = pure[1:4]
    found = central_inertia(free)[2]
    alone = {pair: pure[4 + k] for k, pair in enumerate(_PAIRS)}
    moment_seen = [
        alone[a, a] and all(centre_seen[b] for b in range(3) if b != a) and found[a, a] > inertia_half[a, a]
        for a in range(3)
    ]
    seen = tuple(
        tuple(bool(moment_seen[a] and moment_seen[b] and alone[min(a, b), max(a, b)]) for b in range(3))
        for a in range(3)
    )
    return Body(
        mass=mass, centre=centre, inertia=inertia, mass_half=float(half[0]), centre_half=half[1:4],
        inertia_half=inertia_half, centre_seen=centre_seen, inertia_seen=seen,
    )  # fmt: skip


def physical_payload(
    estimate: Estimate,
    hung: PayloadColumns,
    evidence: Evidence,
    free: FloatArray,
    *,
    mass: tuple[float, float],
    centre: Box | Ellipsoid | None,
) -> FloatArray:
    """Return the ten parameters (10,) of the body of positive density that fits best.

    The payload is the only link of a robot of its own, so that the convex program of a whole arm serves as it is.

    Parameters
    ----------
    evidence : of the kept parameters alone, weighted, as of one joint
    free : (10,) the fit without constraints: where the pull leads
    mass : smallest and largest [kg]
    centre : where the centre of mass may be, in the link's frame

    Raises
    ------
    ModelError
        when no body keeps to the bounds.
    """
    joint = estimate.robot.joints[hung.link]
    model = _lone_link(joint, _guess(free, mass))
    bounds = LinkConstraints(joint=joint.name, mass=mass, centre=centre)
    found = consistent(
        evidence,
        model,
        hung.base,
        weights=np.ones(1),
        constraints=PhysicalConstraints(links=(bounds,)),
    )
    return np.array(found.standard)


def _lone_link(joint: Joint, body: FloatArray) -> TorqueModel:
    lone = replace(joint, parent=-1, inertia=body)
    return TorqueModel(robot=Robot(name="payload", joints=(lone,)), terms=(Inertia(),))


def _guess(free: FloatArray, mass: tuple[float, float]) -> FloatArray:
    weight = float(np.clip(max(free[0], _LIGHTEST), *mass))
    centre = free[1:4] / weight
    return inertia_at_origin(mass=weight, com=centre, inertia_at_com=weight * GYRATION**2 * np.eye(3))
