"""An arm with elastic joints about a pose: two masses and a spring a joint, and its simulation.

Small motions apart, with links coupled by their mass matrix M and by the slope S of gravity, motors with inertia B,

    B ddtheta + Fv dtheta + Fc tanh(dtheta / w) + k (theta - q) + d (dtheta - dq) = tau - g(pose)
    M ddq + S q = k (theta - q) + d (dtheta - dq)

Source: Spong, "Modeling and control of elastic joint robots", 1987.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.rigid_body import gravity_torque, mass_matrix
from tauhat.errors import ModelError
from tauhat.estimation.elastic_kernel import elastic_kernel
from tauhat.robots.robot import Robot

_NUDGE = 1e-5  # [rad or m] over which the slope of gravity is taken
_SUBSTEP = 0.05  # largest change of dry friction per substep, in parts of what would turn it over
_MOST_SUBSTEPS = 200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElasticArm:
    """What is known of an arm about a pose.

    mass : (n_v, n_v) M of the links, without rotors [kg m^2 or kg]
    gravity : (n_v,) torque that holds the pose [Nm or N]
    gravity_slope : (n_v, n_v) S [Nm/rad or N/m]
    motor_inertia : (n_v,) B, joint side [kg m^2 or kg]
    viscous, coulomb : (n_v,) of the motors
    widths : (n_v,) of the smooth sign [rad/s or m/s]
    stiffness, damping : (n_v,) of the joints, where they are known
    """

    mass: FloatArray
    gravity: FloatArray
    gravity_slope: FloatArray
    motor_inertia: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    widths: FloatArray
    stiffness: FloatArray | None = None
    damping: FloatArray | None = None

    def __post_init__(self) -> None:
        n_v = np.asarray(self.motor_inertia).size
        for name in ("mass", "gravity_slope"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (n_v, n_v), where="elastic arm"))
        for name in ("gravity", "motor_inertia", "viscous", "coulomb", "widths"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (n_v,), where="elastic arm"))
        for name in ("stiffness", "damping"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(name, getattr(self, name), (n_v,), where="elastic arm"))
        if not (np.linalg.eigvalsh(self.mass).min() > 0.0 and min(self.motor_inertia.min(), self.widths.min()) > 0.0):
            raise ModelError("an elastic arm needs positive inertias of links and motors, and widths")
        if min(self.viscous.min(), self.coulomb.min()) < 0.0:
            raise ModelError("friction of an elastic arm's motors is negative")

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.motor_inertia.size)


def elastic_arm(
    robot: Robot, pose: FloatArray, *, inertia: FloatArray | None = None, width: float = 0.01
) -> ElasticArm:
    """Return the arm about a pose (n_v,), with the description's motors.

    Parameters
    ----------
    inertia : (n_v, 10) of the links; nominal by default
    width : of the smooth sign of the motors' dry friction [rad/s or m/s]

    Raises
    ------
    ModelError
        when a motor has no inertia: replace it in the robot's joints.
    """
    at = frozen("pose", pose, (robot.n_v,))[None]
    slope = np.empty((robot.n_v, robot.n_v))
    for joint in range(robot.n_v):
        step = np.zeros_like(at)
        step[0, joint] = _NUDGE
        ahead, behind = (gravity_torque(robot, at + sign * step, inertia=inertia)[0] for sign in (1.0, -1.0))
        slope[:, joint] = (ahead - behind) / (2.0 * _NUDGE)
    return ElasticArm(
        mass=mass_matrix(robot, at, inertia=inertia)[0],
        gravity=gravity_torque(robot, at, inertia=inertia)[0],
        gravity_slope=slope,
        motor_inertia=np.array([joint.rotor_inertia for joint in robot.joints]),
        viscous=np.array([joint.viscous for joint in robot.joints]),
        coulomb=np.array([joint.coulomb for joint in robot.joints]),
        widths=np.full(robot.n_v, width),
    )


def simulate_elastic(
    arm: ElasticArm, tau: FloatArray, *, step: float, stiffness: FloatArray, damping: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far motors and links move from the pose, (n_t, n_v) each; torque is held over each step.

    Parameters
    ----------
    tau : (n_t, n_v) torque of the motors [Nm or N]
    step : [s]
    stiffness, damping : (n_v,) of the joints [Nm/rad, Nm s/rad] or [N/m, N s/m]
    """
    from scipy.linalg import expm

    n_v = arm.n_v
    eager = float(np.max(arm.coulomb * step / (arm.motor_inertia * arm.widths)))
    substeps = int(np.clip(np.ceil(eager / _SUBSTEP), 1, _MOST_SUBSTEPS))
    inside, outside = np.diag(stiffness), np.diag(damping)
    rates = np.zeros((5 * n_v, 5 * n_v))
    motor, turning, link, moving = (slice(k * n_v, (k + 1) * n_v) for k in range(4))
    rates[motor, turning] = rates[link, moving] = np.eye(n_v)
    per_motor = 1.0 / arm.motor_inertia[:, None]
    rates[turning, motor], rates[turning, link] = -per_motor * inside, per_motor * inside
    rates[turning, turning] = -per_motor * (outside + np.diag(arm.viscous))
    rates[turning, moving], rates[turning, 4 * n_v :] = per_motor * outside, np.diag(per_motor[:, 0])
    rates[moving, motor], rates[moving, turning] = np.linalg.solve(arm.mass, inside), np.linalg.solve(arm.mass, outside)
    rates[moving, link] = -np.linalg.solve(arm.mass, inside + arm.gravity_slope)
    rates[moving, moving] = -np.linalg.solve(arm.mass, outside)
    whole = expm(rates * (step / substeps))
    out = np.empty((tau.shape[0], 4 * n_v))
    linear = (np.ascontiguousarray(whole[: 4 * n_v, : 4 * n_v]), np.ascontiguousarray(whole[: 4 * n_v, 4 * n_v :]))
    friction = np.vstack([arm.coulomb, arm.widths])
    elastic_kernel(linear, friction, np.ascontiguousarray(tau - arm.gravity), substeps, out)
    return out[:, motor].copy(), out[:, link].copy()
