"""The full set of parameters that a simulator or a controller needs, and how an estimate gives it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Term
from tauhat.errors import ExportError
from tauhat.estimation.estimate import Estimate
from tauhat.export.friction import LAWS, FrictionLaw
from tauhat.robots.joint import central_inertia
from tauhat.robots.robot import Robot

_RIGID = ("inertia", "inertia-simple")
_TOLERANCE = 1e-9  # of a link's spread of mass: rounding in printed figures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StandardParameters:
    """Rigid links, rotors and friction: `tau = inertia(q, dq, ddq) + rotor ddq + sum of friction laws (dq)`.

    inertia : (n_v, 10) `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` about the joint frames [kg, kg m, kg m^2]
    rotor : (n_v,) rotor inertia on the joint side [kg m^2 or kg]; zeros by default
    friction : the laws that the model has
    left_out : terms of the model that these parameters do not tell
    """

    inertia: FloatArray
    rotor: FloatArray = field(default_factory=lambda: np.zeros(0))
    friction: tuple[FrictionLaw, ...] = ()
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        inertia = frozen("inertia", self.inertia, (None, 10), where="standard parameters")
        object.__setattr__(self, "inertia", inertia)
        rotor = self.rotor if np.size(self.rotor) else np.zeros(self.n_v)
        object.__setattr__(self, "rotor", frozen("rotor", rotor, (self.n_v,), where="standard parameters"))
        object.__setattr__(self, "friction", tuple(self.friction))
        keys = [law.key for law in self.friction]
        if len(set(keys)) < len(keys):
            raise ExportError("a law of friction is given twice", got=", ".join(keys))
        for law in self.friction:
            if law.n_v != self.n_v:
                raise ExportError(f"friction {law.key} of another robot", expected=f"{self.n_v} joints", got=law.n_v)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.inertia.shape[0])

    def law(self, key: str) -> FrictionLaw | None:
        """Return the law of that name, or None when the model has none."""
        return next((law for law in self.friction if law.key == key), None)

    def of_joint(self, key: str, joint: int) -> float | None:
        """Return a law's only coefficient on one joint, or None when the model has no such law."""
        law = self.law(key)
        return None if law is None else float(law.coefficients[0, joint])


def plain_parameters(
    inertia: FloatArray,
    *,
    rotor: FloatArray | None = None,
    viscous: FloatArray | None = None,
    coulomb: FloatArray | None = None,
    widths: FloatArray | None = None,
) -> StandardParameters:
    """Return parameters with the two textbook laws of friction, or without those that are not given.

    Parameters
    ----------
    inertia : (n_v, 10) about the joint frames
    rotor, viscous, coulomb : (n_v,) [kg m^2, Nm s/rad, Nm] or [kg, N s/m, N]
    widths : (n_v,) of the smooth sign [rad/s or m/s]; the plain sign by default
    """
    laws = []
    if viscous is not None:
        laws.append(FrictionLaw(key="viscous", coefficients=np.asarray(viscous)[None]))
    if coulomb is not None:
        shape = np.zeros(0) if widths is None else widths
        laws.append(FrictionLaw(key="coulomb", coefficients=np.asarray(coulomb)[None], shape=shape))
    return StandardParameters(inertia=inertia, rotor=np.zeros(0) if rotor is None else rotor, friction=tuple(laws))


def standard_parameters(estimate: Estimate, *, without: Collection[str] = ()) -> StandardParameters:
    """Return the full parameters of an estimate, term by term.

    Parameters
    ----------
    without : keys of terms to leave out, so that what cannot be exported does not stop the rest

    Raises
    ------
    ExportError
        when the estimate has base parameters only, when the model has no inertia, when one of its terms cannot be told
        to another program, naming it, or when `without` names a term that it does not have.
    """
    terms, robot = estimate.model.terms, estimate.robot
    _check_terms([term.key for term in terms], without)
    values = np.split(_all_values(estimate), np.cumsum([len(term.parameters(robot)) for term in terms])[:-1])
    parts = {term.key: (term, own) for term, own in zip(terms, values, strict=True)}
    links = next(parts[key] for key in _RIGID if key in parts)
    rotor = _by_joint(*parts["rotor"], robot, ("Ia",))[0] if "rotor" in parts else np.zeros(robot.n_v)
    laws = [_law(term, own, robot) for key, (term, own) in parts.items() if key in LAWS and key not in without]
    return StandardParameters(
        inertia=_by_joint(*links, robot, INERTIAL_SYMBOLS).T,
        rotor=rotor,
        friction=tuple(laws),
        left_out=tuple(key for key in parts if key in without),
    )


def _check_terms(keys: Sequence[str], without: Collection[str]) -> None:
    if not set(_RIGID) & set(keys):
        raise ExportError("the model has no inertia to export", expected="term inertia", got=", ".join(keys))
    allowed = {*_RIGID, "rotor", *LAWS}
    optional = [key for key in keys if key not in {*_RIGID, "rotor"}]
    unknown = sorted(set(without) - set(optional))
    if unknown:
        expected = ", ".join(optional) or "no name"
        raise ExportError("no such term to leave out", expected=expected, got=", ".join(unknown))
    for key in keys:
        if key not in allowed and key not in without:
            remedy = f"identify without it, or leave it out with `--without {key}`"
            raise ExportError(f"term {key} is more than a function of a joint's speed", where="export", remedy=remedy)


def _all_values(estimate: Estimate) -> FloatArray:
    values: Any = getattr(estimate, "standard", None)
    if values is None:
        raise ExportError(
            "the estimate has base parameters only, whose sums leave open what each link weighs",
            where=estimate.robot.name,
            remedy="identify with --physical",
        )
    return frozen("standard", values, (estimate.model.n_p,), where="estimate")


def _law(term: Term, values: FloatArray, robot: Robot) -> FrictionLaw:
    form = LAWS[term.key]
    shape = np.array(getattr(term, form.shape_field)) if form.shape_field else np.zeros(0)
    return FrictionLaw(key=term.key, coefficients=_by_joint(term, values, robot, form.symbols), shape=shape)


def _by_joint(term: Term, values: FloatArray, robot: Robot, symbols: Sequence[str]) -> FloatArray:
    """Return a term's values by symbol and joint, (n_symbols, n_v), zero where a joint has none."""
    table = np.zeros((len(symbols), robot.n_v))
    for parameter, value in zip(term.parameters(robot), values, strict=True):
        table[symbols.index(parameter.symbol), parameter.joint] = value
    return table


def check_parameters(robot: Robot, parameters: StandardParameters) -> None:
    """Refuse parameters of another robot, and links that are no bodies.

    Raises
    ------
    ExportError
        naming the links and what is wrong with the first.
    """
    if parameters.n_v != robot.n_v:
        raise ExportError("parameters of another robot", where=robot.name, expected=robot.n_v, got=parameters.n_v)
    defects = {joint.name: body_defect(row) for joint, row in zip(robot.joints, parameters.inertia, strict=True)}
    broken = [name for name, defect in defects.items() if defect]
    if broken:
        more = f" (and those of {', '.join(broken[1:])})" if broken[1:] else ""
        raise ExportError(
            f"no body has this inertia: {defects[broken[0]]}",
            where=f"link of joint {broken[0]}{more}",
            remedy="identify with --physical",
        )
    if parameters.rotor.min() < 0.0:
        joint = robot.joints[int(parameters.rotor.argmin())].name
        raise ExportError("the rotor inertia is negative", where=f"joint {joint}", got=f"{parameters.rotor.min():g}")


def body_defect(inertia: FloatArray) -> str:
    """Return why no body of non-negative density has these ten parameters, or "".

    The second moments of mass about its centre, `S = tr(I)/2 E - I`, must be positive semi-definite. A link of ten
    zeros is no body, but harmless.
    """
    mass, _, central = central_inertia(inertia)
    if mass <= 0.0:
        return f"its mass is {mass:g} kg" if np.abs(inertia).max() > 0.0 else ""
    spread = np.linalg.eigvalsh(second_moments(central))
    if spread[0] < -_TOLERANCE * np.abs(spread).max():
        return f"its mass is spread negatively along one axis, {spread[0]:.3g} kg m^2"
    return ""


def second_moments(inertia: FloatArray) -> FloatArray:
    """Return `S = tr(I)/2 E - I`, the second moments of mass (3, 3), of a tensor of inertia (3, 3) [kg m^2]."""
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)
