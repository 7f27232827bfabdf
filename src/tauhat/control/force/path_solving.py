"""Solving a tool's path on a surface for the joints, once, with every refusal by name."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.control.force.path_joints import PathJoints
from tauhat.control.force.surface import Surface
from tauhat.control.force.tool_mount import ToolMount
from tauhat.errors import ControlError, RobotError
from tauhat.robots.inverse_kinematics import FrameKinematics, PoseSolver
from tauhat.robots.kinematics import Pose
from tauhat.robots.robot import Robot

_SPACING = 0.01  # [m] of the nodes, at most
_FEWEST_INTERVALS = 4
_MOST_HALVINGS = 3  # of the spacing, where the joints bend much
_LARGEST_STEP = 0.3  # [rad or m] of a joint from node to node; more means another branch or a turn by 2 pi
_REMEDY = "another place for the surface, another seed, or a shorter path"


def path_joints(
    robot: Robot,
    surface: Surface,
    *,
    tool: ToolMount,
    seed: FloatArray,
    depths: tuple[float, float] = (-0.03, 8e-3),
    tip_tolerance: float = 1e-5,
) -> PathJoints:
    """Return the joints of a tool along a surface's path, checked at every node, surface and both ends of the depths.

    Parameters
    ----------
    seed : (n_v,) near the joint positions at the path's beginning; chooses the branch
    depths : highest and deepest place of the unloaded tip, in depth below the surface [m]
    tip_tolerance : largest distance of the tip from where it belongs, in between [m]

    Raises
    ------
    RobotError
        where the path is out of reach, outside a joint's limits, near a singularity, or jumps to another branch.
    ControlError
        when the depths do not enclose the surface, or the tip misses its tolerance.
    """
    highest, deepest = depths
    if not -np.inf < highest < 0.0 < deepest < np.inf:
        raise ControlError("depths", where="path joints", expected="highest < 0 < deepest", got=depths)
    start = frozen("seed", seed, (robot.n_v,), where=robot.name)
    work = _Work(robot, surface, tool, PoseSolver(robot, tool.frame))
    intervals = max(_FEWEST_INTERVALS, int(np.ceil(2.0 * surface.half / _SPACING)))
    for halvings in range(_MOST_HALVINGS + 1):
        found = _solved_path(work, start, depths, intervals * 2**halvings)
        if found.tip_error <= tip_tolerance:
            return found
    raise ControlError(
        "the tip misses the path between the nodes", where=robot.name,
        expected=f"<= {1e3 * tip_tolerance:g} mm", got=f"{1e3 * found.tip_error:.3g} mm",
        remedy="less height, or a place further from singularities",
    )  # fmt: skip


def _solved_path(work: _Work, seed: FloatArray, depths: tuple[float, float], intervals: int) -> PathJoints:
    half = work.surface.half
    nodes = np.linspace(-half, half, intervals + 1)
    taylor = _taylor(work, nodes, _along(work, nodes, seed))
    ends = [_at_depth(work, nodes, taylor, depth) for depth in depths]
    coefficients = _splines(nodes, _through(taylor, depths, ends))
    found = PathJoints(
        robot=work.robot, nodes=nodes, coefficients=coefficients,
        highest=depths[0], deepest=depths[1], tip_error=0.0,
    )  # fmt: skip
    return replace(found, tip_error=_tip_error(found, work.surface, work.tool))


class _Work(NamedTuple):
    robot: Robot
    surface: Surface
    tool: ToolMount
    solver: PoseSolver


def _along(work: _Work, nodes: FloatArray, seed: FloatArray) -> FloatArray:
    """Return joint positions with the tip on the surface at each node, (n, n_v), each on the branch of the last."""
    positions = np.empty((nodes.size, work.robot.n_v))
    for k, pose in enumerate(work.tool.poses(work.surface, nodes, 0.0)):
        where = f"s = {1e3 * nodes[k]:.0f} mm"
        near = positions[k - 1] if k else seed
        positions[k] = _solved(work.solver, pose, near, where)
        if k:
            _refuse_jump(work.robot, positions[k] - near, where)
    return positions


def _at_depth(work: _Work, nodes: FloatArray, taylor: FloatArray, depth: float) -> FloatArray:
    """Return joint positions with the tip at a depth at each node, (n, n_v), on the branch of those on the surface."""
    near = _powers(depth) @ taylor
    positions = np.empty_like(near)
    for k, pose in enumerate(work.tool.poses(work.surface, nodes, depth)):
        where = f"s = {1e3 * nodes[k]:.0f} mm, depth {1e3 * depth:.0f} mm"
        positions[k] = _solved(work.solver, pose, near[k], where)
        _refuse_jump(work.robot, positions[k] - near[k], where)
    return positions


def _solved(solver: PoseSolver, pose: Pose, near: FloatArray, where: str) -> FloatArray:
    try:
        return solver.position(pose, near)
    except RobotError as error:
        raise RobotError(
            error.what, where=f"{error.where}, {where}", expected=error.expected, got=error.got, remedy=_REMEDY
        ) from error


def _refuse_jump(robot: Robot, step: FloatArray, where: str) -> None:
    joint = int(np.argmax(np.abs(step)))
    if abs(step[joint]) > _LARGEST_STEP:
        raise RobotError(
            "the path needs a jump of a joint, past a limit or to another branch",
            where=f"{robot.name}, {robot.joint_names[joint]}, {where}",
            expected=f"<= {_LARGEST_STEP:g} rad or m from node to node", got=f"{abs(step[joint]):.3g}", remedy=_REMEDY,
        )  # fmt: skip


def _taylor(work: _Work, nodes: FloatArray, q0: FloatArray) -> FloatArray:
    """Return the first coefficients in powers of depth, (n, 3, n_v).

    With the tool's orientation kept, `J q' = (-n, 0)`, and as the tip moves straight, `J q'' + drift(q, q') = 0`. An
    arm with more than six joints takes the shortest of the solutions.
    """
    kinematics = FrameKinematics(work.robot, work.tool.frame)
    normals = work.surface.normals(nodes)
    taylor = np.empty((nodes.size, 3, work.robot.n_v))
    for k, q in enumerate(q0):
        jacobian = kinematics.at(q).jacobian
        slope = np.linalg.lstsq(jacobian, np.concatenate([-normals[k], np.zeros(3)]), rcond=None)[0]
        bend = np.linalg.lstsq(jacobian, -kinematics.drift(q, slope), rcond=None)[0]
        taylor[k] = q, slope, 0.5 * bend
    return taylor


def _powers(depth: float) -> FloatArray:
    return np.array([1.0, depth, depth * depth])


def _through(taylor: FloatArray, depths: tuple[float, float], ends: list[FloatArray]) -> FloatArray:
    """Return coefficients of powers 0 to 4 of depth, (n, 5, n_v): with two more, the exact solutions at both ends."""
    rests = [(end - _powers(depth) @ taylor) / depth**3 for depth, end in zip(depths, ends, strict=True)]
    fourth = (rests[0] - rests[1]) / (depths[0] - depths[1])
    third = rests[0] - depths[0] * fourth
    return np.concatenate([taylor, third[:, None], fourth[:, None]], axis=1)


def _splines(nodes: FloatArray, values: FloatArray) -> FloatArray:
    from scipy.interpolate import CubicSpline

    # SciPy has the highest power first and the segments second
    return np.ascontiguousarray(CubicSpline(nodes, values).c[::-1].swapaxes(0, 1))


def _tip_error(found: PathJoints, surface: Surface, tool: ToolMount) -> float:
    """Return the largest distance of the tip from its place: at and between nodes, over five depths [m]."""
    s = np.linspace(found.nodes[0], found.nodes[-1], 2 * found.nodes.size - 1)
    kinematics = FrameKinematics(found.robot, tool.frame)
    largest = 0.0
    for depth in (found.highest, 0.5 * found.highest, 0.0, 0.5 * found.deepest, found.deepest):
        tips = surface.points(s) - depth * surface.normals(s)
        for length, tip in zip(s, tips, strict=True):
            placement = kinematics.at(found.at(float(length), 0.0, depth, 0.0)[0])
            reached = placement.translation + tool.length * placement.rotation[:, 2]
            largest = max(largest, float(np.linalg.norm(reached - tip)))
    return largest
