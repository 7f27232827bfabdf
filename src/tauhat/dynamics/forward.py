"""Forward dynamics of a whole batch of states: the acceleration that joint torques cause."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.dynamics.forward_kernel import forward_kernel, mass_kernel
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ArrayError, ModelError
from tauhat.robots.robot import Robot


class Masses(NamedTuple):
    """What makes a robot's mass matrix.

    inertia : (n_v, 10) standard parameters; base parameters do as well, the regrouped ones zero
    rotor : (n_v,) rotor inertia, joint side, or (n_v, n_v) where motors turn with two joints [kg m^2 or kg]
    """

    inertia: FloatArray
    rotor: FloatArray


def nominal_masses(robot: Robot) -> Masses:
    """Return the masses of the robot's description."""
    return Masses(robot.inertia, np.array([joint.rotor_inertia for joint in robot.joints]))


def forward_dynamics(
    robot: Robot,
    q: FloatArray,
    dq: FloatArray,
    tau: FloatArray,
    *,
    masses: Masses | None = None,
    threads: int = 1,
) -> FloatArray:
    """Return the accelerations `M^-1 (tau - bias)` of frictionless rigid links, (n_t, n_v) [rad/s^2 or m/s^2].

    Subtract friction from `tau` before; it depends on the speed alone.

    Parameters
    ----------
    q, dq, tau : (n_t, n_v)
    masses : the robot's nominal ones by default
    threads : over how many threads the samples are spread

    Raises
    ------
    ArrayError
        when shapes do not fit the robot.
    ModelError
        when the mass matrix is not positive definite: no acceleration exists.

    Source: Walker, Orin, "Efficient dynamic computer simulation of robotic mechanisms", 1982; Featherstone 2008.
    """
    states = [frozen(name, value, (None, robot.n_v)) for name, value in (("q", q), ("dq", dq), ("tau", tau))]
    if len({state.shape[0] for state in states}) > 1:
        raise ArrayError("q, dq and tau differ in length", got=[state.shape[0] for state in states])
    body = _kernel_body(robot, masses)
    out = np.empty_like(states[0])
    edges = np.linspace(0, out.shape[0], threads + 1).astype(int)

    def part(begin: int, end: int) -> tuple[int, int]:
        rows = slice(begin, end)
        sample, joint = forward_kernel(body, tuple(state[rows] for state in states), out[rows])
        return begin + int(sample), int(joint)

    if threads == 1:
        failures = [part(0, out.shape[0])]
    else:
        with ThreadPoolExecutor(threads) as pool:
            failures = list(pool.map(lambda edge: part(*edge), pairwise(edges)))
    for sample, joint in failures:
        if joint >= 0:
            raise not_a_body(robot, joint, f"sample {sample}")
    return out


def rotor_mass_matrix(robot: Robot, q: FloatArray, *, masses: Masses | None = None) -> FloatArray:
    """Return the mass matrices with the rotors in them, (n_t, n_v, n_v) [kg m^2 or kg].

    Parameters
    ----------
    q : (n_t, n_v)
    masses : the robot's nominal ones by default
    """
    positions = frozen("q", q, (None, robot.n_v))
    out = np.empty((positions.shape[0], robot.n_v, robot.n_v))
    mass_kernel(_kernel_body(robot, masses), positions, out)
    return out


def rotor_matrix(rotor: FloatArray, n_v: int, *, where: str = "") -> FloatArray:
    """Return rotor inertia as it stands in the mass matrix, (n_v, n_v); one value a joint, (n_v,), is its diagonal.

    Raises
    ------
    ArrayError
        when it is neither, not finite, or not symmetric.
    """
    if np.ndim(rotor) < 2:
        return np.asarray(read_only(np.diag(frozen("rotor", rotor, (n_v,), where=where))))
    matrix = frozen("rotor", rotor, (n_v, n_v), where=where)
    if not np.array_equal(matrix, matrix.T):
        raise ArrayError("rotor inertia is not symmetric", where=where, got=matrix.tolist())
    return matrix


def not_a_body(robot: Robot, joint: int, where: str) -> ModelError:
    """Return the error of a mass matrix that is not positive definite."""
    return ModelError(
        "the mass matrix is not positive definite: these parameters move no robot",
        where=f"joint {robot.joint_names[joint]}, {where}",
        remedy="start from physical parameters (identify with --physical), or record a richer motion",
    )


def _kernel_body(robot: Robot, masses: Masses | None = None) -> tuple[NDArray[np.generic], ...]:
    """Return links, inertia and rotors, as the forward kernels take them."""
    inertia, rotor = nominal_masses(robot) if masses is None else masses
    return (
        kernel_tree(robot).links,
        frozen("inertia", inertia, (robot.n_v, 10)),
        rotor_matrix(rotor, robot.n_v),
    )
