"""Controller gains for a robot nobody has tuned: one bandwidth for all joints, stable at the control rate."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.laws import PDGravity
from tauhat.errors import SimulationError
from tauhat.robots.robot import Robot

_POSES = 32  # poses along the motion at which the mass matrix is looked at
_STABILITY = 0.4  # largest damping per control step; a sampled velocity loop is unstable at 2


def tracking_gains(robot: Robot, q: FloatArray, *, bandwidth: float, control_rate: float) -> PDGravity:
    """Return critically damped gains from the nominal inertia along a motion, within the robot's torque limits.

    `kp = w^2 D, kd = 2 w D` with D the mean diagonal of the mass matrix. w is `2 pi bandwidth`, lowered where inertial
    coupling between joints would make the sampled loop unstable.

    Parameters
    ----------
    q : (n_t, n_v) the motion [rad or m]
    bandwidth : [Hz]
    control_rate : [Hz]
    """
    from tauhat.dynamics.rigid_body import mass_matrix

    poses = q[:: max(1, len(q) // _POSES)]
    rotor = np.array([joint.rotor_inertia for joint in robot.joints])
    mass = mass_matrix(robot, poses) + np.diag(rotor)
    diagonal = np.diagonal(mass, axis1=1, axis2=2).mean(axis=0)
    # Eigenvalues of M^-1 D are the decay rates of joint velocities per unit of 2 w.
    coupling = float(np.abs(np.linalg.eigvals(np.linalg.solve(mass, np.diag(diagonal)))).max())
    w = min(2.0 * np.pi * bandwidth, _STABILITY * control_rate / (2.0 * coupling))
    return PDGravity(kp=w**2 * diagonal, kd=2.0 * w * diagonal, torque_limit=_torque_limit(robot))


def _torque_limit(robot: Robot) -> FloatArray:
    for joint in robot.joints:
        if joint.limits.effort <= 0.0:
            remedy = "set the joint's effort limit, or leave it out if unknown"
            raise SimulationError(
                "the joint has no torque", where=f"joint {joint.name}", got="effort limit 0", remedy=remedy
            )
    return robot.effort_limit
