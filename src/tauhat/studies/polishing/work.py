"""The work: places of the workpiece before the arm, flat and curved, as believed and as they really are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.path_joints import PathJoints
from tauhat.control.force.path_solving import path_joints
from tauhat.control.force.polish_settings import PolishLimits, PolishTask
from tauhat.control.force.surface import CylindricalSurface, FlatSurface, Surface
from tauhat.control.force.tool_mount import ToolMount
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import rotation_about

Shape: TypeAlias = Literal["flat", "curved"]
SHAPES: tuple[Shape, ...] = ("flat", "curved")


class Posture(NamedTuple):
    """A place for the workpiece.

    place : middle of the path in the base frame [m]
    heading : of the path, about the base's z [rad]
    tilt : of the surface, about the path's local y [rad]
    seed : joint positions near those of the path's beginning [rad]
    """

    place: tuple[float, float, float]
    heading: float
    tilt: float
    seed: tuple[float, ...]

    def rotation(self) -> FloatArray:
        """Return the surface's axes in the base frame, (3, 3): x along the path, z outwards."""
        turned = rotation_about(np.array([0.0, 0.0, 1.0]), np.array([self.heading]))[0]
        tilted = rotation_about(np.array([0.0, 1.0, 0.0]), np.array([self.tilt]))[0]
        return np.asarray(turned @ tilted)


POSTURES: Mapping[str, tuple[Posture, ...]] = {
    "ur10e": (
        Posture((0.55, -0.20, 0.15), 0.0, 0.0, (2.3, -1.8, 2.5, -2.2, -1.6, 3.8)),
        Posture((0.75, 0.25, 0.20), np.pi / 2.0, 0.0, (0.4, -3.5, 1.4, 0.5, -1.6, 0.4)),
        Posture((0.90, -0.10, 0.25), np.pi / 4.0, 0.0, (2.7, -1.3, 1.7, -2.0, -1.6, 3.5)),
        Posture((-0.10, 0.75, 0.20), 0.0, 0.3, (-1.6, -1.4, 1.9, -2.1, -1.3, 0.0)),
    ),
}
"""Places of the workpiece by the arm's name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkSettings:
    """What is polished, and what is not known of it.

    task, limits : of the polisher
    radius : of the curved workpiece [m]
    tilted, beside : standard deviations of the true surface about the believed one, turned about its x and y [rad], and
        along its normal [m]
    way_in : speed of the tool on its way along the path and back above it, before it comes down [m/s]
    """

    task: PolishTask = field(default_factory=PolishTask)
    limits: PolishLimits = field(default_factory=lambda: PolishLimits(height=0.01, misplaced=0.005, deepest=0.012))
    radius: float = 0.4
    tilted: float = 5e-3
    beside: float = 1e-3
    way_in: float = 0.1

    def believed(self, posture: Posture, shape: Shape) -> Surface:
        """Return the surface that the path is planned on."""
        place, rotation = np.array(posture.place), posture.rotation()
        if shape == "flat":
            return FlatSurface(place=place, rotation=rotation, half=self.task.half)
        return CylindricalSurface(place=place, rotation=rotation, half=self.task.half, radius=self.radius)

    def real(self, believed: Surface, rng: np.random.Generator) -> Surface:
        """Return where the workpiece really is."""
        turns = self.tilted * rng.standard_normal(2)
        about_x = rotation_about(np.array([1.0, 0.0, 0.0]), turns[:1])[0]
        about_y = rotation_about(np.array([0.0, 1.0, 0.0]), turns[1:])[0]
        lifted = believed.place + self.beside * rng.standard_normal() * believed.rotation[:, 2]
        return replace(believed, place=lifted, rotation=believed.rotation @ about_x @ about_y)

    def joints(self, robot: Robot, posture: Posture, believed: Surface, mount: ToolMount) -> PathJoints:
        """Return the joints along the believed surface, over all depths of a job, and of the same in air above it."""
        depths = (-2.0 * self.limits.height, self.limits.deepest)
        return path_joints(robot, believed, tool=mount, seed=np.array(posture.seed), depths=depths)


def postures_of(robot: Robot) -> tuple[Posture, ...]:
    """Return the places of the workpiece before this arm.

    Raises
    ------
    ModelError
        when there are none.
    """
    if robot.name not in POSTURES:
        raise ModelError("no places for a workpiece", where=robot.name, expected=", ".join(POSTURES))
    return POSTURES[robot.name]
