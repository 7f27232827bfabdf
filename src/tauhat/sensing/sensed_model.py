"""An estimate as a force observer reads it: links, rotors, friction in two parts, and how wrong it is."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.control.model_torque import model_torque
from tauhat.dynamics.base import random_motion
from tauhat.dynamics.forward import Masses, rotor_mass_matrix, rotor_matrix
from tauhat.dynamics.passive_kernel import DAHL, ELEMENT, LOAD_DAHL
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError, SensingError
from tauhat.estimation.estimate import Estimate
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot
from tauhat.sensing.thermal import SensedHeat, parted

_STRENGTH = 100.0
_STATES, _SEED = 100, 20240229
STANDING = 0.02  # rad/s or m/s, in parts of the top speed, below which a joint counts as standing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensedModel:
    """The parts of a model that an observer needs.

    robot : geometry and gravity
    inertia : (n_v, 10); base parameters do as well
    rotor : (n_v, n_v) [kg m^2 or kg]; (n_v,) where each motor turns with one joint
    sliding : friction, springs and offsets that follow from speed and position, as `dynamics.passive_kernel` has them
    bristles : friction with a memory of the displacement; its states follow the position as measured
    rms : (n_v,) of the model's error where the joint moves [Nm or N]
    slow : (n_v,) speed below which a joint counts as standing [rad/s or m/s]
    heat : how friction changes with the warmth of the joints; None: it does not
    stretch : (n_v,) what standard errors of external torque are multiplied with where they are told, one by default;
        observers themselves go by `rms`
    estimate : fingerprint of the estimate, whatever tool is carried; empty: nobody knows
    """

    robot: Robot
    inertia: FloatArray
    rotor: FloatArray
    sliding: NDArray[np.void]
    bristles: NDArray[np.void]
    rms: FloatArray
    slow: FloatArray
    heat: SensedHeat | None = None
    stretch: FloatArray = field(default_factory=lambda: np.ones(0))
    estimate: str = ""

    def __post_init__(self) -> None:
        n_v = self.robot.n_v
        object.__setattr__(self, "stretch", self.stretch if np.size(self.stretch) else np.ones(n_v))
        for name, shape in (("inertia", (n_v, 10)), *((name, (n_v,)) for name in ("rms", "slow", "stretch"))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="sensed model"))
        object.__setattr__(self, "rotor", rotor_matrix(self.rotor, n_v, where="sensed model"))
        for name in ("sliding", "bristles"):
            elements = np.array(getattr(self, name))
            if elements.dtype != ELEMENT:
                raise ModelError(f"{name} of a sensed model", expected="elements of friction", got=elements.dtype)
            object.__setattr__(self, name, read_only(elements))
        if self.heat is not None and len(self.heat.slopes) != n_v:
            raise SensingError("heat of a sensed model", expected=f"{n_v} joints", got=len(self.heat.slopes))
        if not all((values > 0.0).all() for values in (self.rms, self.slow, self.stretch)):
            raise SensingError("errors and slow speeds of a model", expected="above zero", got=self.rms.tolist())

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.robot.n_v

    @property
    def strength(self) -> FloatArray:
        """Largest torque of each joint, (n_v,) [Nm or N]; a hundred times the model's error where none is stated."""
        stated = self.robot.effort_limit
        return np.where(np.isfinite(stated) & (stated > 0.0), stated, _STRENGTH * self.rms)

    @property
    def random_positions(self) -> FloatArray:
        """Positions that stand for all, always the same, (n, n_v) [rad or m]."""
        return np.asarray(random_motion(self.robot, _STATES, np.random.default_rng(_SEED)).q.T)

    @property
    def typical_inertia(self) -> FloatArray:
        """Mean diagonal of the mass matrix over random positions, rotors included, (n_v,) [kg m^2 or kg]."""
        q = self.random_positions
        masses = rotor_mass_matrix(self.robot, q, masses=Masses(self.inertia, self.rotor))
        return np.asarray(masses.diagonal(axis1=1, axis2=2).mean(axis=0))

    def carrying(self, body: FloatArray, link: str = "") -> SensedModel:
        """Return the model with a tool or payload on the link of a joint; a negative one is taken off.

        Parameters
        ----------
        body : (10,) `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` about the origin of the joint's frame
        link : name of the joint; the last one by default

        Raises
        ------
        SensingError
            when there is no such joint.
        """
        names = self.robot.joint_names
        joint = link or names[-1]
        if joint not in names:
            raise SensingError(
                "no such link for a tool", expected=", ".join(names), got=joint[:60],
                remedy=advice_on_name(joint, names),
            )  # fmt: skip
        inertia = self.inertia.copy()
        inertia[names.index(joint)] += frozen("body", body, (10,), where="tool")
        return replace(self, inertia=inertia)

    def body(self) -> tuple[NDArray[Any], ...]:
        """Links, inertia, rotor, sliding elements and bristles, as the kernels read them."""
        return kernel_tree(self.robot).links, self.inertia, self.rotor, self.sliding, self.bristles


def sensed_model(estimate: Estimate) -> SensedModel:
    """Return an estimate as an observer reads it.

    Friction that warms up is that of the beginning of the fitted recording; what it becomes is in `heat`.

    Raises
    ------
    ModelError
        when a term has no value at a single state: friction that changes with a measured temperature.
    """
    parts = parted(estimate)
    torque = model_torque(parts.model, parts.standard)
    remembered = np.isin(torque.elements["kind"], (DAHL, LOAD_DAHL))
    tops = np.ones(torque.n_v) if estimate.top_speeds is None else estimate.top_speeds
    return SensedModel(
        robot=estimate.robot,
        inertia=torque.inertia,
        rotor=torque.rotor,
        sliding=torque.elements[~remembered],
        bristles=torque.elements[remembered],
        rms=np.maximum(estimate.joint_rms, np.finfo(float).tiny),
        slow=STANDING * np.maximum(tops, np.finfo(float).tiny),
        heat=parts.heat,
        estimate=_fingerprint(estimate),
    )


def _fingerprint(estimate: Estimate) -> str:
    """Return a hash of model and values: the same before and after a file."""
    values = np.asarray(estimate.values, dtype="<f8").tobytes()
    return hashlib.sha256(estimate.model.fingerprint.encode() + values).hexdigest()[:16]
