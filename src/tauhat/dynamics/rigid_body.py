"""Rigid-body dynamics of a whole batch of states: regressor, inverse dynamics, mass matrix, bias, gravity."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.motion import Motion, motion_from_rows
from tauhat.dynamics.newton_euler_kernel import newton_euler_kernel
from tauhat.dynamics.regressor_kernel import regressor_kernel
from tauhat.dynamics.tree import KernelTree, kernel_tree
from tauhat.errors import ArrayError
from tauhat.robots.robot import Robot


def regressor(robot: Robot, q: FloatArray, dq: FloatArray, ddq: FloatArray, *, threads: int = 1) -> FloatArray:
    """Return Y with `tau = Y @ standard parameters` for rigid links.

    Parameters
    ----------
    q, dq, ddq : (n_t, n_v) [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    threads : over how many threads the samples are spread

    Returns
    -------
    (n_t, n_v, 10 n_v), a view with time last in memory; parameters link by link in the order
    `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz`.

    Raises
    ------
    ArrayError
        when shapes do not fit the robot.

    Source: Atkeson, An, Hollerbach, "Estimation of inertial parameters of manipulator loads and links", 1986.
    """
    motion = _checked(robot, q, dq, ddq)
    return inertial_columns(kernel_tree(robot), motion, threads=threads).transpose(2, 1, 0)


def inertial_columns(
    tree: KernelTree, motion: Motion, *, out: FloatArray | None = None, threads: int = 1
) -> FloatArray:
    """Return the regressor in kernel layout, (10 n_v, n_v, n_t); zero where a link does not load a joint.

    Parameters
    ----------
    out : zeroed array to fill; entries of links that do not load a joint are never touched
    threads : over how many threads the samples are spread
    """
    columns = np.zeros((10 * motion.n_v, motion.n_v, motion.n_t)) if out is None else out
    if threads == 1:
        regressor_kernel(tree.links, motion.q, motion.dq, motion.ddq, columns)
        return columns
    edges = np.linspace(0, motion.n_t, threads + 1).astype(int)
    with ThreadPoolExecutor(threads) as pool:
        parts = [(motion.samples(a, b), columns[:, :, a:b]) for a, b in pairwise(edges)]
        list(pool.map(lambda part: inertial_columns(tree, part[0], out=part[1]), parts))
    return columns


def inverse_dynamics(
    robot: Robot, q: FloatArray, dq: FloatArray, ddq: FloatArray, *, inertia: FloatArray | None = None
) -> FloatArray:
    """Return the rigid-body joint torques, (n_t, n_v) [Nm or N].

    Parameters
    ----------
    q, dq, ddq : (n_t, n_v)
    inertia : (n_v, 10) standard parameters; the robot's nominal ones by default

    Source: Luh, Walker, Paul, "On-line computational scheme for mechanical manipulators", 1980.
    """
    parameters = frozen("inertia", robot.inertia if inertia is None else inertia, (robot.n_v, 10))
    torque = rigid_torque(kernel_tree(robot), _checked(robot, q, dq, ddq), parameters)
    return np.ascontiguousarray(torque.T)


def rigid_torque(tree: KernelTree, motion: Motion, inertia: FloatArray) -> FloatArray:
    """Return the rigid-body torque in kernel layout, (n_v, n_t)."""
    torque = np.empty((motion.n_v, motion.n_t))
    newton_euler_kernel(tree.links, inertia, motion.q, motion.dq, motion.ddq, torque)
    return torque


def mass_matrix(robot: Robot, q: FloatArray, *, inertia: FloatArray | None = None) -> FloatArray:
    """Return the joint-space mass matrices, (n_t, n_v, n_v) [kg m^2 or kg], without rotor inertia.

    Column k is the torque of a unit acceleration of joint k at rest without gravity.
    """
    q = np.asarray(q, dtype=np.float64)
    weightless = robot.with_gravity((0.0, 0.0, 0.0))
    rest = np.zeros_like(q)
    mass = np.empty((*q.shape, robot.n_v))
    for k in range(robot.n_v):
        unit = rest.copy()
        unit[:, k] = 1.0
        mass[:, :, k] = inverse_dynamics(weightless, q, rest, unit, inertia=inertia)
    return mass


def bias_torque(robot: Robot, q: FloatArray, dq: FloatArray, *, inertia: FloatArray | None = None) -> FloatArray:
    """Return Coriolis, centrifugal and gravity torque, (n_t, n_v): inverse dynamics without acceleration."""
    return inverse_dynamics(robot, q, dq, np.zeros_like(np.asarray(q, dtype=np.float64)), inertia=inertia)


def gravity_torque(robot: Robot, q: FloatArray, *, inertia: FloatArray | None = None) -> FloatArray:
    """Return the torque that holds the robot still, (n_t, n_v) [Nm or N]."""
    rest = np.zeros_like(np.asarray(q, dtype=np.float64))
    return inverse_dynamics(robot, q, rest, rest, inertia=inertia)


def _checked(robot: Robot, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> Motion:
    arrays = [frozen(name, value, (None, robot.n_v)) for name, value in (("q", q), ("dq", dq), ("ddq", ddq))]
    if len({array.shape[0] for array in arrays}) > 1:
        raise ArrayError("q, dq and ddq differ in length", got=[array.shape[0] for array in arrays])
    return motion_from_rows(*arrays)
