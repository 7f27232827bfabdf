"""Joint references of a tool on a surface, from arc length and depth, in a few microseconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.control.force.polish_memory import PolishCommand
from tauhat.errors import ControlError, RobotError
from tauhat.robots.robot import Robot

_ROUNDED = 1e-9  # [m] by which a command may pass an end

_POWERS, _ORDERS = 4, 5  # of arc length and of depth


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathJoints:
    """Joint positions over arc length s and depth d: `q = sum_j d^j c_j(s)`, j = 0 to 4; `path_joints` makes it.

    c0 has the tip on the surface; c1 is the joints' motion by depth, `J c1 = (-n, 0)`; c2 keeps the tip on the normal,
    `2 J c2 = -drift(c0, c1)`; with c3 and c4 the ends of the checked depths are met exactly. All are cubic splines over
    the nodes, so that speeds are continuous.

    robot : whose joints they are
    nodes : (n,) arc lengths, evenly spaced [m]
    coefficients : (n - 1, 4, 5, n_v) of c0 to c4 in powers of `s - node`
    highest, deepest : depths for which it was checked [m]
    tip_error : largest distance of the tip from where it belongs, between the nodes and over the checked depths [m]
    """

    robot: Robot
    nodes: FloatArray
    coefficients: FloatArray
    highest: float
    deepest: float
    tip_error: float

    def __post_init__(self) -> None:
        nodes = frozen("nodes", self.nodes, (None,), where="path joints")
        shape = (nodes.size - 1, _POWERS, _ORDERS, self.robot.n_v)
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(
            self, "coefficients", frozen("coefficients", self.coefficients, shape, where="path joints")
        )  # fmt: skip

    def at(self, s: float, ds: float, depth: float, ddepth: float) -> tuple[FloatArray, FloatArray]:
        """Return positions and speeds of the joints, (n_v,) each [rad or m, and per second].

        Parameters
        ----------
        s, ds : arc length and its speed [m, m/s]
        depth, ddepth : of the unloaded tip below the surface, and its speed [m, m/s]

        Raises
        ------
        ControlError
            beyond the path or the depths that were checked; also where a number is not finite.
        """
        nodes = self.nodes
        inside = nodes[0] - _ROUNDED <= s <= nodes[-1] + _ROUNDED
        if not (inside and self.highest - _ROUNDED <= depth <= self.deepest + _ROUNDED):
            expected = f"s {nodes[0]:g} to {nodes[-1]:g} m, depth {self.highest:g} to {self.deepest:g} m"
            raise ControlError("command off the path", where="path joints", expected=expected, got=f"{s:g}, {depth:g}")
        step = (nodes[-1] - nodes[0]) / (nodes.size - 1)
        segment = max(0, min(nodes.size - 2, int((s - nodes[0]) / step)))
        u = s - nodes[segment]
        powers = np.array([[1.0, u, u * u, u**3], [0.0, 1.0, 2.0 * u, 3.0 * u * u]])
        square = depth * depth
        by_depth = np.array([
            [1.0, depth, square, square * depth, square * square],
            [0.0, 1.0, 2.0 * depth, 3.0 * square, 4.0 * square * depth],
        ])  # fmt: skip
        terms = np.tensordot(powers, self.coefficients[segment], axes=1)
        q, along_normal = by_depth @ terms[0]
        return q, ds * (by_depth[0] @ terms[1]) + ddepth * along_normal

    def follow(self, command: PolishCommand) -> tuple[FloatArray, FloatArray]:
        """Return positions and speeds of the joints for a polisher's command, (n_v,) each."""
        return self.at(command.s, command.ds, command.depth, command.ddepth)

    def check_speeds(self, *, feed: float, depth_speed: float) -> None:
        """Refuse speeds that a joint cannot follow on this path.

        Parameters
        ----------
        feed, depth_speed : largest along the path and along the normal [m/s]

        Raises
        ------
        RobotError
            names the joint.
        """
        rows = [
            np.abs(self.at(float(s), way * feed, depth, depth_speed)[1])
            for s in self.nodes
            for depth in (self.highest, 0.0, self.deepest)
            for way in (-1.0, 1.0)
        ]
        fastest = np.max(rows, axis=0)
        over = fastest > self.robot.velocity_limit
        if over.any():
            joint = int(np.argmax(over))
            raise RobotError(
                "the path is too fast for a joint", where=f"{self.robot.name}, {self.robot.joint_names[joint]}",
                expected=f"<= {self.robot.velocity_limit[joint]:.4g} rad/s or m/s", got=f"{fastest[joint]:.4g}",
                remedy="a lower feed, or another place for the surface",
            )  # fmt: skip
