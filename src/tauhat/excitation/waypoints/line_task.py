"""What a tool does on straight lines and in the corners between them, in base axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.excitation.point_to_point import Course
from tauhat.robots.transforms import rotation_about


class TaskMotion(NamedTuple):
    """Wanted motion of a tool and of the joints that the tool leaves free.

    rotation : (n_t, 3, 3)
    translation : (n_t, 3) [m]
    spare : (n_t, n_v - 6) positions of the free joints [rad or m]
    velocity, acceleration : (n_t, n_v) linear, angular, free joints
    """

    rotation: FloatArray
    translation: FloatArray
    spare: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """A straight line of the tool with a turn about an axis fixed in it.

    rotation, translation : (3, 3), (3,) [m] pose at the start
    step : (3,) from start to end [m]
    turn : (3,) rotation vector from start to end in the tool's axes [rad]
    spare, spare_step : (n_v - 6,) free joints at the start, and their way [rad or m]
    """

    rotation: FloatArray
    translation: FloatArray
    step: FloatArray
    turn: FloatArray
    spare: FloatArray
    spare_step: FloatArray

    def __post_init__(self) -> None:
        shapes = {"rotation": (3, 3), "translation": (3,), "step": (3,), "turn": (3,), "spare": (None,)}
        for name, shape in {**shapes, "spare_step": (np.size(self.spare),)}.items():
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="line"))

    @property
    def length(self) -> float:
        """Way of the tool's origin [m]."""
        return float(np.linalg.norm(self.step))

    @property
    def angle(self) -> float:
        """Angle of the turn [rad]."""
        return float(np.linalg.norm(self.turn))

    def turned(self, part: FloatArray) -> FloatArray:
        """Return the rotations by parts of the turn in the tool's axes, (n_t, 3, 3)."""
        if self.angle == 0.0:
            return np.broadcast_to(np.eye(3), (part.size, 3, 3))
        return rotation_about(self.turn / self.angle, self.angle * part)

    def task(self, course: Course) -> TaskMotion:
        """Return the motion of the tool at a course along the line."""
        s = course.s[:, None]
        way = np.concatenate([self.step, self.rotation @ self.turn, self.spare_step])
        return TaskMotion(
            rotation=self.rotation @ self.turned(course.s),
            translation=self.translation + s * self.step,
            spare=self.spare + s * self.spare_step,
            velocity=course.ds[:, None] * way,
            acceleration=course.dds[:, None] * way,
        )


def corner_task(first: Line, second: Line, *, ending: Course, beginning: Course) -> TaskMotion:
    """Return the motion of the tool while it still ends one line and already begins the next.

    Ways add up, and turns follow one another: `p = corner + (x - 1) d1 + y d2`, `R = R1 exp(x f1) exp(y f2)`, with x
    and y the parts of both lines.
    """
    before, after = first.task(ending), second.task(beginning)
    turned = before.rotation @ second.turned(beginning.s)
    axis = before.rotation @ second.turn
    spin, extra = before.velocity[:, 3:6], beginning.ds[:, None] * axis
    velocity, acceleration = before.velocity + after.velocity, before.acceleration + after.acceleration
    velocity[:, 3:6] = spin + extra
    acceleration[:, 3:6] = (
        before.acceleration[:, 3:6] + beginning.dds[:, None] * axis + np.cross(spin, extra)
    )  # fmt: skip
    return TaskMotion(
        rotation=turned,
        translation=before.translation + after.translation - second.translation,
        spare=before.spare + after.spare - second.spare,
        velocity=velocity,
        acceleration=acceleration,
    )
