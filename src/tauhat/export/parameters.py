"""The full set of parameters that a simulator or a controller needs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExportError
from tauhat.export.drives import CoupledMotors, LoadedGasSpring
from tauhat.export.friction import FrictionLaw
from tauhat.export.plain_friction import PlainFriction, textbook_friction
from tauhat.robots.joint import central_inertia
from tauhat.robots.robot import Robot

_TOLERANCE = 1e-9  # of a link's spread of mass: rounding in printed figures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StandardParameters:
    """Rigid links, rotors, springs, coupled motors and friction: all that makes the torque of a model.

    inertia : (n_v, 10) `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` about the joint frames [kg, kg m, kg m^2]
    rotor : (n_v,) rotor inertia on the joint side [kg m^2 or kg]; zeros by default
    springs : (n_v,) stiffness of springs that balance the joints [Nm/rad or N/m]; zeros by default
    friction : the laws that the model has
    gas_spring, motors : where the model has them
    plain : what stands for all friction where there are words for damping and dry friction only; by default the
        viscous and the Coulomb law, whatever other laws there are
    left_out : terms of the model that these parameters do not tell
    """

    inertia: FloatArray
    rotor: FloatArray = field(default_factory=lambda: np.zeros(0))
    springs: FloatArray = field(default_factory=lambda: np.zeros(0))
    friction: tuple[FrictionLaw, ...] = ()
    gas_spring: LoadedGasSpring | None = None
    motors: CoupledMotors | None = None
    plain: PlainFriction | None = None
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        where = "standard parameters"
        object.__setattr__(self, "inertia", frozen("inertia", self.inertia, (None, 10), where=where))
        for name in ("rotor", "springs"):
            given = getattr(self, name)
            values = given if np.size(given) else np.zeros(self.n_v)
            object.__setattr__(self, name, frozen(name, values, (self.n_v,), where=where))
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

    @property
    def plain_friction(self) -> PlainFriction:
        """Damping and dry friction: `plain`, or else the viscous and the Coulomb law."""
        return textbook_friction(self.friction) if self.plain is None else self.plain

    @property
    def with_memory(self) -> tuple[str, ...]:
        """Names of the laws whose torque depends on the way that the joints came."""
        laws = tuple(law.key for law in self.friction if law.has_memory)
        return (*laws, self.motors.key) if self.motors is not None and self.motors.has_memory else laws

    def law(self, key: str) -> FrictionLaw | None:
        """Return the law of that name, or None when the model has none."""
        return next((law for law in self.friction if law.key == key), None)


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
