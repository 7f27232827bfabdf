"""The plant: a MuJoCo model of any robot, independent of the library's own dynamics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, IntArray, frozen
from tauhat.errors import MissingExtraError, SimulationError
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot
from tauhat.simulation.laws import SharedDrive
from tauhat.simulation.parameters import TrueParameters, nominal_parameters, principal_body

# Coulomb friction is MuJoCo's friction-loss constraint, made nearly rigid: time constant of two steps (the shortest
# that stays stable) and an impedance just below one. Slipping, its force is exactly +-coulomb; measured on 6-joint arms
# in Fourier motion it differs from the ideal law in 2 to 3 % of the samples, at rest or coming to rest, never above
# 4e-3 rad/s. With MuJoCo's default softness it differs up to 0.1 rad/s and a loaded joint creeps. A smooth sign as
# applied torque is the worse truth: explicit, it is stable only with a width above timestep * coulomb / inertia (0.05
# rad/s for 2 Nm on 0.02 kg m^2), and it can never hold a joint still.
FRICTION_IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)
FRICTION_TIME_STEPS = 2.0
# Costs nothing at one iteration a step; with MuJoCo's 1e-8 single samples miss the equation of motion by up to 4e-3.
_SOLVER_TOLERANCE = 1e-15

Furnishing: TypeAlias = Callable[[Any, Any], None]
"""What else there is in the model: takes the mujoco module and the `mujoco.MjSpec` with the robot in it, to add to."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plant:
    """A robot as a MuJoCo model; joint frames are those of the robot, no contacts, no joint limits.

    robot : geometry and gravity
    parameters : inertia and friction it is built with
    model : the `mujoco.MjModel`
    dof : (n_v,) index of each joint of the robot among the model's (MuJoCo numbers a tree depth first)
    """

    robot: Robot
    parameters: TrueParameters
    model: Any
    dof: IntArray

    @property
    def timestep(self) -> float:
        """Step of the integrator [s]."""
        return float(self.model.opt.timestep)


def load_mujoco() -> Any:
    """Return the mujoco module.

    Raises
    ------
    MissingExtraError
        when it is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError("mujoco", "simulation") from error
    return mujoco


def build_plant(
    robot: Robot,
    *,
    parameters: TrueParameters | None = None,
    timestep: float = 5e-4,
    furnish: Furnishing | None = None,
) -> Plant:
    """Return the robot as a MuJoCo model.

    Parameters
    ----------
    parameters : inertia and friction; the robot's nominal ones by default
    timestep : of the integrator [s]
    furnish : adds tools and workpieces; the link of joint k, from one, is the body `link_k`

    Raises
    ------
    SimulationError
        when a link is not a physical body, naming it, or the parameters are of another robot.
    MissingExtraError
        when MuJoCo is not installed.
    """
    mujoco = load_mujoco()
    parameters = nominal_parameters(robot) if parameters is None else parameters
    if parameters.n_v != robot.n_v:
        raise SimulationError(
            "true parameters of another robot", where=robot.name, expected=f"{robot.n_v} joints", got=parameters.n_v
        )
    if not (np.isfinite(timestep) and timestep > 0.0):
        raise SimulationError("timestep", where=robot.name, expected="a positive time", got=timestep)
    specification = _specification(mujoco, robot, parameters, timestep)
    if furnish is not None:
        furnish(mujoco, specification)
    model = _compiled(mujoco, specification, robot)
    names = [_joint_name(index) for index in range(robot.n_v)]
    dof = np.array([int(model.joint(name).dofadr[0]) for name in names], dtype=np.intp)
    _set_drives(mujoco, model, dof, parameters)
    return Plant(robot=robot, parameters=parameters, model=model, dof=dof)


def plant_gravity_torque(plant: Plant, q: FloatArray) -> FloatArray:
    """Return the torque that holds the plant still without friction, (n_t, n_v) [Nm or N], from MuJoCo.

    Parameters
    ----------
    q : (n_t, n_v) [rad or m]
    """
    mujoco = load_mujoco()
    q = frozen("q", q, (None, plant.robot.n_v), where=plant.robot.name)
    data = mujoco.MjData(plant.model)
    torque = np.empty(q.shape)
    for row, position in enumerate(q):
        data.qpos[plant.dof] = position
        mujoco.mj_fwdPosition(plant.model, data)
        mujoco.mj_fwdVelocity(plant.model, data)
        torque[row] = data.qfrc_bias[plant.dof]
    return torque


def plant_torque(plant: Plant, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
    """Return the torque of the plant's links and rotors along a motion without friction, (n_t, n_v), from MuJoCo.

    Parameters
    ----------
    q, dq, ddq : (n_t, n_v)
    """
    mujoco = load_mujoco()
    motion = [frozen(name, x, (None, plant.robot.n_v)) for name, x in (("q", q), ("dq", dq), ("ddq", ddq))]
    data, dof = mujoco.MjData(plant.model), plant.dof
    torque, moved = np.empty(motion[0].shape), np.empty(plant.model.nv)
    for row, (position, speed, acceleration) in enumerate(zip(*motion, strict=True)):
        data.qpos[dof], data.qvel[dof], data.qacc[dof] = position, speed, acceleration
        mujoco.mj_fwdPosition(plant.model, data)
        mujoco.mj_fwdVelocity(plant.model, data)
        mujoco.mj_mulM(plant.model, data, moved, data.qacc)
        torque[row] = (moved + data.qfrc_bias)[dof]
    return torque


def _specification(mujoco: Any, robot: Robot, parameters: TrueParameters, timestep: float) -> Any:
    specification = mujoco.MjSpec()
    option, disable = specification.option, mujoco.mjtDisableBit
    option.timestep = timestep
    option.gravity = robot.gravity
    option.tolerance = _SOLVER_TOLERANCE
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Without auto-reset a diverging state stays visible instead of silently starting again from zero.
    option.disableflags |= int(disable.mjDSBL_CONTACT) | int(disable.mjDSBL_AUTORESET)
    bodies: list[Any] = []
    inertia = parameters.carried_inertia
    for index, joint in enumerate(robot.joints):
        parent = specification.worldbody if joint.parent < 0 else bodies[joint.parent]
        body = parent.add_body(
            name=f"link_{index + 1}", pos=joint.translation, quat=_quaternion(mujoco, joint.rotation)
        )
        _add_joint(mujoco, body, joint, index)
        _set_inertia(mujoco, body, inertia[index], joint.name)
        bodies.append(body)
    for law in parameters.laws:
        if isinstance(law, SharedDrive):
            _add_shared_rotor(specification, law)
    return specification


def _add_joint(mujoco: Any, body: Any, joint: Joint, index: int) -> None:
    kinds = {"revolute": mujoco.mjtJoint.mjJNT_HINGE, "prismatic": mujoco.mjtJoint.mjJNT_SLIDE}
    body.add_joint(name=_joint_name(index), type=kinds[joint.kind], axis=joint.axis)


def _add_shared_rotor(specification: Any, drive: SharedDrive) -> None:
    """Add a rotor that turns with two joints: the armature of a tendon whose length is the motor's position."""
    tendon = specification.add_tendon(armature=drive.inertia)
    tendon.wrap_joint(_joint_name(drive.own), 1.0)
    tendon.wrap_joint(_joint_name(drive.other), drive.ratio)


def _set_inertia(mujoco: Any, body: Any, inertia: FloatArray, link: str) -> None:
    mass, com, moments, axes = principal_body(inertia, link=link)
    moments[2] = min(moments[2], moments[0] + moments[1])  # MuJoCo refuses a flat body for one rounding error
    body.explicitinertial = True
    body.mass = mass
    body.ipos = com
    body.iquat = _quaternion(mujoco, axes)
    body.inertia = moments


def _compiled(mujoco: Any, specification: Any, robot: Robot) -> Any:
    try:
        return specification.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise SimulationError("MuJoCo refuses the robot", where=robot.name, got=error) from error


def _set_drives(mujoco: Any, model: Any, dof: IntArray, parameters: TrueParameters) -> None:
    elastic = [] if parameters.elasticity is None else list(parameters.elasticity.joints)
    rotor = parameters.rotor.copy()
    rotor[elastic] = 0.0  # an elastic joint's rotor turns outside MuJoCo, at the other end of its spring
    model.dof_armature[dof] = rotor
    model.dof_damping[dof] = parameters.viscous
    model.dof_frictionloss[dof] = parameters.coulomb
    model.dof_solref[:] = (FRICTION_TIME_STEPS * model.opt.timestep, 1.0)
    model.dof_solimp[:] = FRICTION_IMPEDANCE
    # Constants that depend on the inertias, the scale of the friction constraint among them.
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _quaternion(mujoco: Any, rotation: FloatArray) -> FloatArray:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion


def _joint_name(index: int) -> str:
    # The robot's own names may clash with what MuJoCo reserves.
    return f"joint_{index + 1}"
