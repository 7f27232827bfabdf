"""The true parameters of a simulated robot, which may differ from the nominal ones of its description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import SimulationError
from tauhat.robots.inertia_checks import inertia_defect
from tauhat.robots.joint import central_inertia, inertia_at_origin
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import rotation_about
from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.elasticity import ElasticJoints
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.laws import LAWS, PassiveLaw, SharedDrive, law_from_dict

SYMBOLS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
DRIVES: Mapping[str, str] = {"Ia": "rotor", "Fv": "viscous", "Fc": "coulomb", "To": "offset"}
_OF_LAWS = {letter for law in LAWS.values() for letter in law.letters.values()}
_THINNEST = 1e-6  # smallest spread of a perturbed body along a principal axis, relative to all three


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueParameters:
    """What the plant is made of: `tau = rigid(q, dq, ddq) + rotor ddq + viscous dq + coulomb sign(dq) + offset + laws`.

    Rotor and friction are those of the motor: where the transmission is elastic, their dq and ddq are the motor's.

    inertia : (n_v, 10) `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` about the joint frames [kg, kg m, kg m^2]
    rotor : (n_v,) rotor inertia on the joint side [kg m^2 or kg]
    viscous, coulomb, offset : (n_v,) [Nm s/rad, Nm, Nm] or [N s/m, N, N]
    laws : friction of other kinds, springs and shared motors, added to these
    elasticity : of the joints that are not rigid
    heat : what heats the joints, and how friction depends on it
    attached : tools and payloads, whose inertia adds to that of their links
    """

    inertia: FloatArray
    rotor: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    offset: FloatArray
    laws: tuple[PassiveLaw, ...] = ()
    elasticity: ElasticJoints | None = None
    heat: FrictionHeat | None = None
    attached: tuple[AttachedBody, ...] = ()

    def __post_init__(self) -> None:
        inertia = frozen("inertia", self.inertia, (None, 10), where="true parameters")
        object.__setattr__(self, "inertia", inertia)
        for name in ("rotor", "viscous", "coulomb", "offset"):
            values = frozen(name, getattr(self, name), (inertia.shape[0],), where="true parameters")
            object.__setattr__(self, name, values)
            if name != "offset" and values.min() < 0.0:
                joint = int(np.argmin(values)) + 1
                raise SimulationError(f"{name} is negative", where=f"true parameters, joint {joint}", got=values.min())
        object.__setattr__(self, "laws", tuple(self.laws))
        object.__setattr__(self, "attached", tuple(self.attached))
        for law in self.laws:
            law.check(self.n_v)
        for body in self.attached:
            body.check(self.n_v)
        if self.heat is not None:
            self.heat.check(self.laws, self.n_v)
        if self.elasticity is not None:
            self._check_elasticity(self.elasticity)

    def _check_elasticity(self, elasticity: ElasticJoints) -> None:
        elasticity.check(self.n_v)
        without = [joint + 1 for joint in elasticity.joints if self.rotor[joint] <= 0.0]
        if without:
            remedy = "give the joint a rotor inertia"
            raise SimulationError("an elastic joint needs a rotor", where=f"joint {without[0]}", got=0.0, remedy=remedy)
        for law in self.laws:
            if isinstance(law, SharedDrive) and {law.own, law.other} & set(elasticity.joints):
                got = f"joints {law.own} and {law.other}"
                raise SimulationError("a shared motor needs rigid joints", where=f"law {law.key}", got=got)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.inertia.shape[0])

    @property
    def carried_inertia(self) -> FloatArray:
        """Inertia of the links with what is attached to them, (n_v, 10)."""
        inertia = self.inertia.copy()
        for body in self.attached:
            inertia[body.joint] += body.parameters
        return np.asarray(read_only(inertia))

    def behind_gear(self) -> TrueParameters:
        """Return what a torque sensor behind the gear shows: links and their laws, no rotor, friction or offset."""
        none = np.zeros(self.n_v)
        laws = tuple(law for law in self.laws if law.side == "link")
        return TrueParameters(
            inertia=self.inertia, rotor=none, viscous=none, coulomb=none, offset=none, laws=laws, attached=self.attached
        )

    def value(self, symbol: str, joint: int) -> float:
        """Return the true value of a standard parameter; zero where the plant has nothing of the kind.

        Links are with what is attached to them, friction is that of the reference temperature.

        Raises
        ------
        SimulationError
            when no plant has a parameter of this symbol.
        """
        if symbol not in {*SYMBOLS, *DRIVES, *_OF_LAWS}:
            raise SimulationError("the simulation has no such parameter", got=symbol)
        if symbol in SYMBOLS:
            return float(self.carried_inertia[joint, SYMBOLS.index(symbol)])
        own = float(getattr(self, DRIVES[symbol])[joint]) if symbol in DRIVES else 0.0
        return own + sum(law.true_values().get((symbol, joint), 0.0) for law in self.laws)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data that `from_dict` reads back exactly."""
        arrays = {name: getattr(self, name).tolist() for name in ("inertia", *DRIVES.values())}
        return arrays | {
            "laws": [law.to_dict() for law in self.laws],
            "elasticity": None if self.elasticity is None else self.elasticity.to_dict(),
            "heat": None if self.heat is None else self.heat.to_dict(),
            "attached": [body.to_dict() for body in self.attached],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TrueParameters:
        """Return the parameters that `to_dict` described, in this version or before elasticity, heat and tools.

        Raises
        ------
        SimulationError
            when a field is missing or a law is unknown.
        """
        try:
            arrays = {name: data[name] for name in ("inertia", *DRIVES.values())}
            laws = tuple(law_from_dict(law) for law in data["laws"])
            elasticity, heat = data.get("elasticity"), data.get("heat")
            parts: dict[str, Any] = {
                "elasticity": None if elasticity is None else ElasticJoints.from_dict(elasticity),
                "heat": None if heat is None else FrictionHeat.from_dict(heat),
                "attached": tuple(AttachedBody.from_dict(body) for body in data.get("attached", ())),
            }
        except (KeyError, TypeError, AttributeError) as error:
            raise SimulationError("true parameters are damaged", got=f"{type(error).__name__}: {error}") from error
        return cls(**arrays, laws=laws, **parts)


def nominal_parameters(robot: Robot) -> TrueParameters:
    """Return the parameters of the robot's description, without offset."""
    return TrueParameters(
        inertia=robot.inertia,
        rotor=np.array([joint.rotor_inertia for joint in robot.joints]),
        viscous=np.array([joint.viscous for joint in robot.joints]),
        coulomb=np.array([joint.coulomb for joint in robot.joints]),
        offset=np.zeros(robot.n_v),
    )


def perturbed(robot: Robot, rng: np.random.Generator, *, spread: float = 0.1) -> TrueParameters:
    """Return a random truth around the robot's nominal parameters; every link stays a body of positive density.

    Masses, principal spreads of mass, rotor inertias and friction are multiplied by log-normal factors; centres of mass
    move and principal axes turn; offsets are a fraction of the Coulomb friction. What is zero stays zero.

    Parameters
    ----------
    spread : standard deviation of the relative changes; about half as many radii of gyration for the centres of mass

    Raises
    ------
    SimulationError
        when a nominal link is not a physical body.
    """
    nominal = nominal_parameters(robot)
    links = [perturbed_link(joint.inertia, rng, spread, link=joint.name) for joint in robot.joints]
    factors = np.exp(spread * rng.standard_normal((3, robot.n_v)))
    coulomb = factors[2] * nominal.coulomb
    return TrueParameters(
        inertia=np.array(links),
        rotor=factors[0] * nominal.rotor,
        viscous=factors[1] * nominal.viscous,
        coulomb=coulomb,
        offset=spread * rng.standard_normal(robot.n_v) * coulomb,
    )


def perturbed_link(inertia: FloatArray, rng: np.random.Generator, spread: float, *, link: str) -> FloatArray:
    """Return ten inertial parameters near `inertia` that are those of a body of positive density.

    Works on the second moments of mass about the centre of mass, `S = tr(I)/2 E - I`: any positive S is physical.

    Parameters
    ----------
    inertia : (10,) about the link frame's origin
    link : how messages call it
    """
    mass, com, moments, axes = principal_body(inertia, link=link)
    second = np.maximum(0.5 * moments.sum() - moments, 0.5 * _THINNEST * moments.sum())
    mass_factor = np.exp(spread * rng.standard_normal())
    factors = np.exp(spread * rng.standard_normal(3))
    com = com + axes @ (0.5 * spread * rng.standard_normal(3) * np.sqrt(second / mass))
    direction = rng.standard_normal(3)
    angle = np.array([spread * rng.standard_normal()])
    turned = rotation_about(direction / np.linalg.norm(direction), angle)[0] @ axes
    spread_of_mass = turned @ np.diag(mass_factor * factors * second) @ turned.T
    central = np.trace(spread_of_mass) * np.eye(3) - spread_of_mass
    return inertia_at_origin(mass=mass * mass_factor, com=com, inertia_at_com=central)


def principal_body(inertia: FloatArray, *, link: str) -> tuple[float, FloatArray, FloatArray, FloatArray]:
    """Return mass, centre of mass (3,), principal moments (3,) and axes (3, 3, columns, right-handed) of a link.

    Raises
    ------
    SimulationError
        when no body of positive density has these parameters.
    """
    where = f"link of joint {link}"
    mass, com, central = central_inertia(inertia)
    if mass <= 0.0:
        remedy = "give it a mass in the robot's description or in the true parameters"
        raise SimulationError("the link has no mass", where=where, got=f"{mass:g} kg", remedy=remedy)
    defect = inertia_defect(mass, central)
    if defect:
        remedy = "correct the robot's description or the true parameters"
        raise SimulationError(defect, where=where, remedy=remedy)
    moments, axes = np.linalg.eigh(central)
    axes = axes * np.sign(np.linalg.det(axes))
    return mass, com, moments, axes
