"""Plants with elastic joints, heat, tools, and with every effect at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio

from tauhat.robots import Robot
from tauhat.robots.joint import Joint, inertia_at_origin
from tauhat.robots.kinematics import pinocchio_model
from tauhat.simulation import AttachedBody, ElasticJoints, FrictionHeat, TrueParameters, nominal_parameters, perturbed
from tauhat.simulation.laws import (
    BalancingSpring,
    Bristles,
    CubeRootDrag,
    GasCylinder,
    LoadedCoulomb,
    SharedDrive,
    SmoothCoulomb,
    StribeckBump,
)

LINK, ROTOR = 0.3, 0.1
TOOL = AttachedBody(
    name="gripper", mass=2.0, centre=np.array([0.01, -0.02, 0.08]), inertia=np.diag([0.004, 0.005, 0.002])
)


def turntable() -> Robot:
    """One vertical joint without gravity's torque: a link of inertia LINK and a rotor of inertia ROTOR."""
    link = inertia_at_origin(mass=2.0, com=np.zeros(3), inertia_at_com=np.diag([0.2, 0.2, LINK]))
    joint = Joint(
        name="table", kind="revolute", parent=-1, rotation=np.eye(3), translation=np.zeros(3),
        axis=np.array([0.0, 0.0, 1.0]), inertia=link, rotor_inertia=ROTOR,
    )  # fmt: skip
    return Robot(name="turntable", joints=(joint,))


def turntable_truth(**changes: Any) -> TrueParameters:
    return replace(nominal_parameters(turntable()), **changes)


def spring_gear(stiffness: float, damping: float = 0.0, gap: float = 0.0) -> ElasticJoints:
    return ElasticJoints(joints=(0,), stiffness=np.array([stiffness]), damping=np.array([damping]), gap=np.array([gap]))


def heat_of(n_v: int, **changes: Any) -> FrictionHeat:
    constants: dict[str, Any] = {
        "heating": np.full(n_v, 0.05), "time_constant": np.full(n_v, 20.0), "initial": np.full(n_v, 25.0),
        "viscous": np.full(n_v, -0.01), "coulomb": np.full(n_v, -0.005),
    }  # fmt: skip
    return FrictionHeat(**(constants | changes))


def every_law(truth: TrueParameters) -> tuple[Any, ...]:
    n, width = truth.n_v, np.full(truth.n_v, 0.02)
    dry = SmoothCoulomb(torque=0.3 * truth.coulomb[-1:], width=np.array([0.05]))
    return (
        StribeckBump(torque=0.4 * truth.coulomb, speed=np.full(n, 0.1), width=width),
        CubeRootDrag(coefficient=0.3 * truth.coulomb),
        Bristles(
            fine=0.3 * truth.coulomb, coarse=0.2 * truth.coulomb,
            fine_length=np.full(n, 3e-3), coarse_length=np.full(n, 1e-2),
        ),
        LoadedCoulomb(ratio=np.full(n, 0.05), width=width),
        SharedDrive(own=n - 1, other=n - 2, ratio=1.0, inertia=0.05, viscous=0.3, dry=dry),
        BalancingSpring(rate=np.linspace(0.0, 2.0, n)),
        GasCylinder(joint=1, energy=100.0, distance=0.5, lever=0.1, angle=np.pi / 2, area=2e-3, volume=1e-3),
    )  # fmt: skip


def with_every_effect(robot: Robot, seed: int = 0) -> TrueParameters:
    """Elastic joints but for the last two, two of them with a gap; all kinds of friction, heated; a tool."""
    truth = perturbed(robot, np.random.default_rng(seed))
    n = robot.n_v
    laws, elastic = every_law(truth), tuple(range(n - 2))
    slopes = np.zeros((len(laws), n))
    slopes[:4] = -0.004
    gap = np.zeros(n - 2)
    gap[[0, -1]] = 2e-4
    return replace(
        truth,
        coulomb=0.5 * truth.coulomb,
        offset=0.1 * np.arange(n),
        laws=laws,
        elasticity=ElasticJoints(
            joints=elastic, stiffness=np.linspace(8000.0, 3000.0, n - 2), damping=np.full(n - 2, 5.0), gap=gap
        ),
        heat=heat_of(n, laws=slopes),
        attached=(TOOL,),
    )


def loaded_model(robot: Robot, truth: TrueParameters) -> tuple[pinocchio.Model, pinocchio.Data]:
    """Pinocchio's model of the true links, with what is attached appended by Pinocchio itself."""
    pairs = zip(robot.joints, truth.inertia, strict=True)
    bare = replace(robot, joints=tuple(replace(joint, inertia=link) for joint, link in pairs))
    model = pinocchio_model(bare)
    for body in truth.attached:
        joint = model.njoints - 1 if body.joint == -1 else 1 + body.joint
        inertia = pinocchio.Inertia(body.mass, body.centre, body.inertia)
        model.appendBodyToJoint(joint, inertia, pinocchio.SE3.Identity())
    return model, model.createData()
