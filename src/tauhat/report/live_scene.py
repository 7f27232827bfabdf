"""The arm as it stands now, and the force on it as an arrow with its error ellipsoid."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import TauhatWarning
from tauhat.excitation.limits import robot_body, tool_frame
from tauhat.excitation.limits.link_poses import link_poses
from tauhat.report.arm_scene import draw_arm, move_arm
from tauhat.report.force_marks import ErrorEllipsoid
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import quaternion
from tauhat.sensing.wrench import Axes

_FORCE, _STALE, _ERROR = (190, 10, 20), (120, 120, 120), (130, 60, 200)  # nothing of an arm is violet
_FULL = 0.55  # length of the arrow at full scale, in parts of the reach
_CUT = 0.6  # largest half-axis of the ellipsoid, likewise
_SHAFT, _HEAD, _TIP = 0.012, 0.03, 0.08  # radii and length of the arrow's head, likewise
_WIDTH = 0.5  # of links without a shape of their own: slim, so that they do not hide the force
_AWAY, _AZIMUTH, _HEIGHT, _LOOK = 1.25, 0.9, 0.8, 0.4  # of the camera: parts of the reach, [rad]


class LiveScene:
    """What is drawn of one arm.

    Parameters
    ----------
    server : viser's
    frame : where the force acts; the robot's last where not stated
    axes : whose axes forces are along
    """

    def __init__(self, server: Any, robot: Robot, *, frame: str | None, axes: Axes = "base") -> None:
        self._robot, self._frame, self._axes = robot, tool_frame(robot, frame), axes
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)  # a picture may show capsules where meshes are missing
            body = robot_body(robot, tool_frame(robot))
        poses = body.random_poses()
        far = [np.linalg.norm(part.placed_corners(poses), axis=2).max() for part in body.parts]
        self.reach = max(0.1, *(float(distance) for distance in far))
        self._server = server
        self._links = draw_arm(server.scene, body, reach=self.reach, width=_WIDTH)
        self._arrow = server.scene.add_arrows(
            "/force", np.zeros((1, 2, 3)), _FORCE, shaft_radius=_SHAFT * self.reach, head_radius=_HEAD * self.reach
        )
        self._error = server.scene.add_icosphere("/error", color=_ERROR, opacity=0.45, cast_shadow=False)
        self._colour = _FORCE
        server.scene.configure_default_lights(cast_shadow=False)  # they cost most where there is no GPU
        self._look_on(server.initial_camera)
        self._arrow.visible = self._error.visible = False
        self._move(np.zeros(robot.n_v))

    @property
    def full_length(self) -> float:
        """Length of the arrow of a force of full scale [m]."""
        return _FULL * self.reach

    def largest_error(self, scale: float) -> float:
        """Return the half-axis at which ellipsoids are cut off [N], where the arrow's full scale is `scale` [N]."""
        return scale * _CUT / _FULL

    def show(self, q: FloatArray, force: FloatArray, error: ErrorEllipsoid, *, scale: float) -> None:
        """Draw one moment.

        Parameters
        ----------
        q, force : (n_v,), (3,) position, and force on the arm [N]
        scale : force of an arrow of full length [N]
        """
        with self._server.atomic():
            self._show_force(self._move(q), force, error, scale=scale)

    def hide_force(self) -> None:
        """Draw no force and no error: nothing is sensed any more."""
        self._arrow.visible = self._error.visible = False

    def colour(self, *, stale: bool) -> None:
        """Show the force as of now, or as of long ago."""
        colour = _STALE if stale else _FORCE
        if colour != self._colour:
            self._colour = colour
            self._arrow.colors = np.array(colour, dtype=np.uint8)

    def _move(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Put the arm where it is; return where its frame is, (3,) [m], and how the force's axes are turned, (3, 3)."""
        poses = link_poses(self._robot, np.asarray(q)[:, None])
        move_arm(self._links, poses, 0)
        place, joint = poses.point(self._frame.joint, self._frame.translation)[0], self._frame.joint
        if self._axes == "base":
            return np.asarray(place), np.eye(3)
        return np.asarray(place), self._frame.rotation if joint < 0 else poses.rotation[joint, 0] @ self._frame.rotation

    def _show_force(
        self, pose: tuple[FloatArray, FloatArray], force: FloatArray, error: ErrorEllipsoid, *, scale: float
    ) -> None:
        (place, turned), metres = pose, self.full_length / scale  # per newton
        tip, length = place + metres * (turned @ force), metres * float(np.linalg.norm(force))
        self._arrow.visible = length > 1e-3 * self.reach
        self._arrow.points = np.array([[place, tip]], dtype=np.float32)
        self._arrow.head_length = min(_TIP * self.reach, 0.5 * length)
        self._error.visible = True
        self._error.position, self._error.wxyz = tip, quaternion(turned @ error.axes)
        self._error.scale = tuple(float(value) for value in metres * error.drawn)

    def _look_on(self, camera: Any) -> None:
        distance = _AWAY * self.reach
        camera.position = (distance * np.cos(_AZIMUTH), distance * np.sin(_AZIMUTH), _HEIGHT * self.reach)
        camera.look_at = (0.0, 0.0, _LOOK * self.reach)
