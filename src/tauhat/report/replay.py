"""A recorded or designed motion as a film: where each link is, and how much of its limits each joint uses."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RecordingError
from tauhat.excitation.limits import Body, MotionLimits, link_capsules, motion_limits, tool_frame
from tauhat.excitation.limits.link_poses import LinkPoses, link_poses
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot

_CLOSE = 0.9  # used part of a limit from which its bar warns
_SIGNALS = ("position", "velocity", "acceleration")
_COLOURS = ("#3b7dd8", "#d39a1a", "#c9483b")  # within, close to, beyond a limit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replay:
    """A robot's run, frame by frame.

    body : the capsules that stand for the robot
    t : (n_t,) from zero [s]
    poses : of all links
    used : (n_t, n_v, n_s) part of the position, velocity and acceleration limit in use, as far as recorded
    """

    body: Body
    t: FloatArray
    poses: LinkPoses
    used: FloatArray

    @property
    def duration(self) -> float:
        """Length of the run [s]."""
        return float(self.t[-1])

    @property
    def reach(self) -> float:
        """Largest distance of a joint from the base during the run, and of the tool, at least 0.1 [m]."""
        starts, ends = self.body.ends(self.poses)
        return max(0.1, float(np.linalg.norm(np.concatenate([starts, ends]), axis=2).max()))

    def index(self, time: float) -> int:
        """Return the frame shown at a time [s]."""
        return int(np.clip(np.searchsorted(self.t, time, side="right") - 1, 0, self.t.size - 1))

    def margins(self, index: int) -> str:
        """Return as HTML how much of each limit every joint uses in a frame, a bar each; beyond 100 % in red."""
        names, largest = self.body.robot.joint_names, self.used.max(axis=0)
        rows = []
        for joint, name in enumerate(names):
            bars = "".join(
                _bar(signal, float(self.used[index, joint, k]), float(largest[joint, k]))
                for k, signal in enumerate(_SIGNALS[: self.used.shape[2]])
            )
            rows.append(f'<div style="margin:4px 0"><b>{escape(name)}</b>{bars}</div>')
        return f'<div style="font:12px sans-serif;padding:0 0.8em">{"".join(rows)}</div>'


def replay(robot: Robot, recording: Recording) -> Replay:
    """Return the film of a recording.

    Raises
    ------
    RecordingError
        when it has another number of joints than the robot.
    """
    if recording.q.shape[1] != robot.n_v:
        raise RecordingError(
            "a motion of another robot",
            where=recording.name,
            expected=f"{robot.n_v} joints of {robot.name}",
            got=recording.q.shape[1],
            remedy="name the robot with --robot, and lock a gripper's joints with --lock",
        )
    body = link_capsules(robot, tool_frame(robot))
    used = _used(motion_limits(robot), recording)
    return Replay(body=body, t=recording.t - recording.t[0], poses=link_poses(robot, recording.q.T), used=used)


def _used(limits: MotionLimits, recording: Recording) -> FloatArray:
    middle, reach = 0.5 * (limits.upper + limits.lower), 0.5 * (limits.upper - limits.lower)
    parts = [np.abs(recording.q - middle) / reach]
    for signal, limit in ((recording.dq, limits.velocity), (recording.ddq, limits.acceleration)):
        if signal is None:
            break
        parts.append(np.abs(signal) / limit)
    return np.stack(parts, axis=2)


def _bar(signal: str, used: float, largest: float) -> str:
    colour = _COLOURS[int(used > _CLOSE) + int(used > 1.0)]
    inner = f"width:{100 * min(used, 1.0):.0f}%;height:100%;background:{colour}"
    outer = "flex:1;height:8px;background:#8883;border-radius:3px;overflow:hidden"
    return (
        f'<div style="display:flex;align-items:center;gap:6px"><span style="width:76px">{signal}</span>'
        f'<div style="{outer}"><div style="{inner}"></div></div>'
        f'<span style="width:92px;text-align:right">{100 * used:.0f} % (max {100 * largest:.0f})</span></div>'
    )
