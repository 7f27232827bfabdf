"""Typical plants of each kind of friction: the level of the robot's description, in another form.

Every kind leaves the friction torque near what the description says and changes how it depends on speed, direction,
displacement, load or another joint. Widths and Stribeck speeds are parts of each joint's speed limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.terms import GasSpring, Shaped
from tauhat.errors import SimulationError
from tauhat.robots.robot import Robot
from tauhat.simulation.laws import (
    BalancingSpring,
    Bristles,
    CubeRootDrag,
    DirectionalFriction,
    DirectionalViscous,
    GasCylinder,
    LoadedBristles,
    LoadedCoulomb,
    PolynomialDrag,
    SharedDrive,
    SmoothCoulomb,
    StribeckBump,
)
from tauhat.simulation.parameters import TrueParameters, perturbed

LENGTHS = (1e-4, 3e-3)  # [rad or m] of fine and coarse bristles, at a scale of one
_SHARP = 0.01  # width of a smooth sign, in parts of the speed limit
_SHARPEST = 3e-4  # the same, where the plant's sign is sharp
_BESIDE_STRIBECK = 0.1  # the same, in parts of the Stribeck speed


def typical_plant(robot: Robot, kind: str, *, rng: np.random.Generator, spread: float = 0.1) -> TrueParameters:
    """Return a random truth around the robot's description with friction of one kind of `KINDS`.

    Parameters
    ----------
    kind : what of the friction is not plain, e.g. `dahl`
    spread : of the parameters around the description

    Raises
    ------
    SimulationError
        when the kind is unknown.
    """
    if kind not in KINDS:
        raise SimulationError("unknown kind of plant", expected=", ".join(KINDS), got=kind)
    return KINDS[kind](robot, perturbed(robot, rng, spread=spread), rng)


def top_speeds(robot: Robot) -> FloatArray:
    """Return the joints' speed limits, (n_v,) [rad/s or m/s]; one where there is none."""
    return np.where(np.isfinite(robot.velocity_limit) & (robot.velocity_limit > 0.0), robot.velocity_limit, 1.0)


def matching_model(robot: Robot, kind: str, truth: TrueParameters) -> TorqueModel:
    """Return the torque model that has the terms of such a plant, their shapes to be chosen."""
    keys = MODEL_TERMS[kind].split(",")
    cylinders = [law for law in truth.laws if isinstance(law, GasCylinder)]
    springs = tuple(
        GasSpring(
            joint=law.joint, distance=law.distance, lever=law.lever, angle=law.angle, area=law.area, volume=law.volume
        )
        for law in cylinders
    )
    return TorqueModel(robot=robot, terms=(*torque_model(robot, keys).terms, *springs))


def with_true_shapes(model: TorqueModel, truth: TrueParameters) -> TorqueModel:
    """Return the model whose widths, speeds and scales are those of the plant, practically sharp where it is sharp."""
    shapes = {"coulomb": _SHARPEST * top_speeds(model.robot)}
    for law in truth.laws:
        if isinstance(law, SharedDrive) and isinstance(law.dry, Bristles):
            shapes["coupling-dahl"] = law.dry.fine_length / LENGTHS[0]
        elif type(law) in _SHAPES:
            key, shape = _SHAPES[type(law)]
            shapes[key] = shape(law)
    for term in model.terms:
        if isinstance(term, Shaped) and term.key in shapes:
            model = model.with_term(term.with_shape(shapes[term.key].tolist()))
    return model


def _efforts(robot: Robot) -> FloatArray:
    return np.where(np.isfinite(robot.effort_limit), robot.effort_limit, 100.0)


def _plain(_: Robot, truth: TrueParameters, __: np.random.Generator) -> TrueParameters:
    return truth


def _smooth(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    width = top_speeds(robot) * rng.uniform(0.005, 0.03, truth.n_v)
    return _instead_of_coulomb(truth, SmoothCoulomb(torque=truth.coulomb, width=width))


def _cube_root(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    law = CubeRootDrag(coefficient=rng.uniform(0.3, 1.0, truth.n_v) * truth.coulomb / np.cbrt(top_speeds(robot)))
    return replace(truth, viscous=0.5 * truth.viscous, laws=(*truth.laws, law))


def _viscous_asymmetry(_: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    difference = rng.uniform(-0.3, 0.3, truth.n_v) * truth.viscous
    return replace(truth, laws=(*truth.laws, DirectionalViscous(difference=difference)))


def _asymmetric(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    part = rng.uniform(0.7, 1.3, (2, truth.n_v))
    law = DirectionalFriction(
        viscous_forwards=truth.viscous,
        viscous_backwards=part[0] * truth.viscous,
        coulomb_forwards=truth.coulomb,
        coulomb_backwards=part[1] * truth.coulomb,
        width=_SHARP * top_speeds(robot),
    )
    nothing = np.zeros(truth.n_v)
    return replace(truth, viscous=nothing, coulomb=nothing, offset=nothing, laws=(*truth.laws, law))


def _stribeck(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    speed = top_speeds(robot) * rng.uniform(0.02, 0.1, truth.n_v)
    part = rng.uniform(0.3, 0.8, truth.n_v)
    law = StribeckBump(torque=part * truth.coulomb, speed=speed, width=_BESIDE_STRIBECK * speed)
    return replace(truth, laws=(*truth.laws, law))


def _polynomial(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    top = top_speeds(robot)
    speed = top * rng.uniform(0.05, 0.2, truth.n_v)
    law = PolynomialDrag(
        constant=truth.coulomb,
        linear=truth.viscous,
        square=-0.4 * truth.viscous / top,
        cube=0.1 * truth.viscous / top**2,
        bump=rng.uniform(0.3, 0.8, truth.n_v) * truth.coulomb,
        speed=speed,
        width=_BESIDE_STRIBECK * speed,
    )
    nothing = np.zeros(truth.n_v)
    return replace(truth, viscous=nothing, coulomb=nothing, laws=(*truth.laws, law))


def _dahl(_: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    part, scale = rng.uniform(0.5, 0.8, truth.n_v), np.exp(rng.uniform(np.log(0.5), np.log(2.0), truth.n_v))
    law = Bristles(
        fine=part * truth.coulomb,
        coarse=(1.0 - part) * truth.coulomb,
        fine_length=LENGTHS[0] * scale,
        coarse_length=LENGTHS[1] * scale,
    )
    return _instead_of_coulomb(truth, law)


def _load_coulomb(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    law = LoadedCoulomb(ratio=rng.uniform(0.05, 0.15, truth.n_v), width=_SHARP * top_speeds(robot))
    return replace(truth, laws=(*truth.laws, law))


def _load_dahl(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    law = LoadedBristles(ratio=rng.uniform(0.05, 0.15, truth.n_v), length=np.full(truth.n_v, LENGTHS[0]))
    bent = _dahl(robot, truth, rng)
    return replace(bent, laws=(*bent.laws, law))


def _coupling(robot: Robot, truth: TrueParameters, _: np.random.Generator) -> TrueParameters:
    speed = top_speeds(robot)[-1] + top_speeds(robot)[-2]
    torque = truth.coulomb[-1:]
    return _with_shared_drive(truth, SmoothCoulomb(torque=torque, width=np.array([_SHARP * speed])))


def _coupling_dahl(_: Robot, truth: TrueParameters, __: np.random.Generator) -> TrueParameters:
    fine = 0.6 * truth.coulomb[-1:]
    short, long = np.array(LENGTHS)[:, None]
    return _with_shared_drive(truth, Bristles(fine=fine, coarse=fine / 1.5, fine_length=short, coarse_length=long))


def _spring(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    rate = rng.uniform(0.02, 0.06, truth.n_v) * _efforts(robot)
    return replace(truth, laws=(*truth.laws, BalancingSpring(rate=rate)))


def _gas_spring(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    energy = rng.uniform(0.8, 1.6) * float(_efforts(robot)[1])
    law = GasCylinder(joint=1, energy=energy, distance=0.5, lever=0.1, angle=np.pi / 2, area=2e-3, volume=1e-3)
    return replace(truth, laws=(*truth.laws, law))


def _everything(robot: Robot, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
    return _load_dahl(robot, _cube_root(robot, truth, rng), rng)


def _instead_of_coulomb(truth: TrueParameters, law: SmoothCoulomb | Bristles) -> TrueParameters:
    return replace(truth, coulomb=np.zeros(truth.n_v), laws=(*truth.laws, law))


def _with_shared_drive(truth: TrueParameters, dry: SmoothCoulomb | Bristles) -> TrueParameters:
    """Return the plant whose last motor turns with the joint before, too: half of what the last joint's own were."""
    own = truth.n_v - 1
    drive = SharedDrive(
        own=own,
        other=own - 1,
        ratio=1.0,
        inertia=0.5 * float(truth.rotor[own]),
        viscous=0.5 * float(truth.viscous[own]),
        dry=dry,
    )
    left = np.where(np.arange(truth.n_v) == own, 0.5, 1.0)
    return replace(truth, rotor=left * truth.rotor, viscous=left * truth.viscous, laws=(*truth.laws, drive))


KINDS: Mapping[str, Callable[[Robot, TrueParameters, np.random.Generator], TrueParameters]] = {
    "plain": _plain,
    "coulomb": _smooth,
    "cube-root": _cube_root,
    "viscous-asymmetry": _viscous_asymmetry,
    "asymmetric": _asymmetric,
    "stribeck": _stribeck,
    "polynomial": _polynomial,
    "dahl": _dahl,
    "load-coulomb": _load_coulomb,
    "load-dahl": _load_dahl,
    "coupling": _coupling,
    "coupling-dahl": _coupling_dahl,
    "spring": _spring,
    "gas-spring": _gas_spring,
    "cube-root-dahl-load": _everything,
}
"""Every kind of plant by the friction or drive that it has, and what makes it of nominal parameters."""
_SHAPES: Mapping[type, tuple[str, Callable[[Any], FloatArray]]] = {
    SmoothCoulomb: ("coulomb", lambda law: law.width),
    DirectionalFriction: ("asymmetric", lambda law: law.width),
    StribeckBump: ("stribeck", lambda law: law.speed),
    PolynomialDrag: ("polynomial", lambda law: law.speed),
    Bristles: ("dahl", lambda law: law.fine_length / LENGTHS[0]),
    LoadedCoulomb: ("load-coulomb", lambda law: law.width),
}
MODEL_TERMS: Mapping[str, str] = {
    "plain": "inertia,rotor,viscous,coulomb,offset",
    "coulomb": "inertia,rotor,viscous,coulomb,offset",
    "cube-root": "inertia,rotor,viscous,cube-root,coulomb,offset",
    "viscous-asymmetry": "inertia,rotor,viscous,viscous-asymmetry,coulomb,offset",
    "asymmetric": "inertia,rotor,asymmetric",
    "stribeck": "inertia,rotor,viscous,coulomb,stribeck,offset",
    "polynomial": "inertia,rotor,polynomial,offset",
    "dahl": "inertia,rotor,viscous,dahl,offset",
    "load-coulomb": "inertia,rotor,viscous,coulomb,load-coulomb,offset",
    "load-dahl": "inertia,rotor,viscous,dahl,load-dahl,offset",
    "coupling": "inertia,rotor,coupling,viscous,coulomb,offset",
    "coupling-dahl": "inertia,rotor,coupling-dahl,viscous,coulomb,offset",
    "spring": "inertia,rotor,spring,viscous,coulomb,offset",
    "gas-spring": "inertia,rotor,viscous,coulomb,offset",
    "cube-root-dahl-load": "inertia,rotor,viscous,cube-root,dahl,load-dahl,offset",
}
