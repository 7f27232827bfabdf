"""The tool: a tip that slides along the tool's axis on a spring, with a sphere at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, check_fields
from tauhat.errors import SimulationError
from tauhat.robots.robot import Frame, Robot
from tauhat.simulation.attached import AttachedBody

TIP = "tip"
"""Name of the frame at the foremost point of the tip."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CompliantTool:
    """A spring along z of the frame that carries it, a damper beside it, a light tip with a sphere before it.

    Where the cell starts, the spring is set so that the weight of the tip does not bend it. The weight still hangs on
    the arm, and elsewhere part of it bends the spring: what the spring shows is not the force of the contact.

    length : from the frame's origin to the foremost point of the tip at rest, along the frame's z [m]
    stiffness : of the spring [N/m]
    damping : of the tip's slide [N s/m]
    tip_mass : of what moves [kg]
    tip_radius : of the sphere that touches [m]
    """

    length: float = 0.15
    stiffness: float = 1e4
    damping: float = 20.0
    tip_mass: float = 0.2
    tip_radius: float = 0.01

    def __post_init__(self) -> None:
        check_fields(self, error=SimulationError, name="compliant tool", or_zero=("damping",))
        if self.length < self.tip_radius:
            raise SimulationError(
                "compliant tool, length", expected=f"at least the radius of the tip, {self.tip_radius:g} m",
                got=self.length,
            )  # fmt: skip

    def tip_body(self, frame: Frame) -> AttachedBody:
        """Return the tip at rest as a body bolted to the link: a point mass in the middle of its sphere."""
        middle = np.array([0.0, 0.0, self.length - self.tip_radius])
        return AttachedBody(
            name=TIP, mass=self.tip_mass, joint=frame.joint, centre=frame.translation + frame.rotation @ middle
        )

    def tip_frame(self, frame: Frame) -> Frame:
        """Return the frame at the foremost point of the tip at rest, its axes those of the carrying frame."""
        foremost: FloatArray = frame.translation + self.length * frame.rotation[:, 2]
        return Frame(name=TIP, joint=frame.joint, rotation=frame.rotation, translation=foremost)


def carrying_frame(robot: Robot, name: str) -> Frame:
    """Return the frame that carries the tool: the robot's last one where `name` is empty.

    Raises
    ------
    SimulationError
        when the robot has no frame, or the frame does not move.
    RobotError
        when there is no frame of that name.
    """
    from tauhat.robots.kinematics import named_frame

    if not (name or robot.frames):
        raise SimulationError("no frame that could carry the tool", where=robot.name, remedy="name a joint")
    frame = named_frame(robot, name) if name else robot.frames[-1]
    if frame.joint < 0:
        raise SimulationError("the tool is on a frame that does not move", where=f"{robot.name}, frame {frame.name}")
    return frame
