"""Random programs of moves that each controller's language has words for, as plans of a UR5e or a CRS A465."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from sample_arms import WORKING_POSES
from tauhat.errors import ExcitationError
from tauhat.excitation import JointMove, LineMove, ToolLimits, WaypointMotion, WaypointSettings, Zone, waypoint_motion
from tauhat.export.programs import ProgramSettings, signed_joints
from tauhat.robots import Pose, forward_kinematics, load_robot

TOOL = ToolLimits(speed=0.5, acceleration=4.0, turn_speed=2.0, turn_acceleration=16.0)


def zone(key: str, rng: np.random.Generator, *, line: bool, line_next: bool) -> Zone | None:
    """Return a zone that the language can say."""
    if rng.random() < 0.4 or (key == "krl" and line != line_next):
        return None
    by_radius = {"urscript": True, "rapid": True, "fanuc": False, "krl": line}.get(key, rng.random() < 0.5)
    if by_radius:
        return Zone(radius=float(rng.choice([0.005, 0.01, rng.uniform(0.001, 0.012)])))
    return Zone(part=float(rng.integers(1, 20)) / 50.0)


def overrides(key: str, rng: np.random.Generator) -> tuple[float, float]:
    speed, acceleration = rng.uniform(0.2, 1.0, 2)
    if key in {"krl", "fanuc"}:
        return round(speed, 2), round(acceleration, 2)
    return float(speed), float(acceleration)


def program(key: str, seed: int) -> WaypointMotion:
    """Return the plan of a random program.

    Raises
    ------
    ExcitationError
        when the arm cannot run it.
    """
    rng = np.random.default_rng(seed)
    name = ("ur5e", "crs_a465")[seed % 2]
    robot, start = load_robot(name), WORKING_POSES[name]
    pose = forward_kinematics(robot, start, frame="tool")
    lines = rng.random(int(rng.integers(3, 6))) < 0.5
    moves: list[JointMove | LineMove] = []
    for line, line_next in zip(lines, [*lines[1:], False], strict=True):
        speed, acceleration = overrides(key, rng)
        found = zone(key, rng, line=bool(line), line_next=bool(line_next))
        dwell = round(float(rng.uniform(0.05, 0.3)), 2) if found is None and rng.random() < 0.5 else 0.0
        if line and key == "fanuc":
            speed = round(speed * 500.0) / 500.0
        rest = {"speed": speed, "acceleration": acceleration, "zone": found, "dwell": dwell}
        if line:
            turn = Rotation.from_rotvec(rng.normal(size=3) * 0.1).as_matrix()
            place = pose.translation + rng.uniform(-0.1, 0.1, 3)
            moves.append(LineMove(target=Pose(rotation=pose.rotation @ turn, translation=place), **rest))
        else:
            moves.append(JointMove(target=start + rng.uniform(-0.3, 0.3, 6), **rest))
    ending = "return" if seed % 3 else "stay"
    return waypoint_motion(robot, start, moves, settings=WaypointSettings(tool=TOOL, ending=ending))


def programs(key: str, count: int) -> Iterator[tuple[int, WaypointMotion]]:
    """Yield plans with their seeds, leaving out what the arm cannot run."""
    seed = 0
    while count:
        seed += 1
        try:
            motion = program(key, seed)
        except ExcitationError:
            continue
        count -= 1
        yield seed, motion


def controller(seed: int) -> ProgramSettings:
    """Return a controller that counts joints and places otherwise than the robot, and repeats what comes back."""
    rng = np.random.default_rng(seed)
    turned = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    return ProgramSettings(
        repeats=3 if seed % 3 else 1,
        joints=signed_joints(rng.choice([-1.0, 1.0], 6), rng.uniform(-2.0, 2.0, 6)),
        base=Pose(rotation=turned, translation=rng.normal(size=3)),
        tool=int(rng.integers(0, 9)),
    )
