"""Random programs of moves: each gives a motion that keeps all limits, or an error that names the move.

    python benchmarks/waypoints.py [--json] [--count 200] [--first 0]

Programs of 2 to 6 joint and line moves with random overrides, zones and dwells, for a UR5e, a CRS A465 (a DH table) and
a Panda with seven joints; every second one with bounded jerk. Every motion is looked at on a grid ten times finer than
the one on which the planner slows it: limits of the joints, the tool's distance from its lines (forward kinematics that
the planner does not use), the distance of every zone, and dq and ddq against the integral of the next derivative.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from random_cases import options_parser, show
from scipy.spatial.transform import Rotation

from tauhat.errors import ExcitationError
from tauhat.excitation.limits import motion_limits
from tauhat.excitation.waypoints import (
    AccelerationLimited,
    JerkLimited,
    JointMove,
    LineMove,
    ToolLimits,
    WaypointMotion,
    WaypointSettings,
    Zone,
    waypoint_motion,
)
from tauhat.excitation.waypoints.curves import LineWay
from tauhat.robots import Pose, Robot, forward_kinematics, load_robot

FINER = 160  # samples a phase of constant jerk; the planner looks at 16
NO_EXCESS = 1e-7  # parts of a limit
JERK = 25.0  # limit of jerk, in acceleration limits a second
STARTS = {
    "ur5e": [0.0, -1.3, 1.6, -1.8, -1.4, 0.0],
    "crs_a465": [0.2, 0.3, 1.2, 0.1, 1.0, 0.0],
    "panda": [0.0, -0.4, 0.2, -1.9, 0.1, 1.7, 0.7],
}


@dataclass(frozen=True)
class Outcome:
    """What came of one program: the reason of a refusal, or what was measured."""

    seed: int
    robot: str
    reason: str = ""
    named: bool = True
    measured: dict[str, float] = field(default_factory=dict)
    slowed: int = 0
    pieces: int = 0
    planning: float = 0.0  # [s]
    duration: float = 0.0  # [s]


def program(seed: int) -> tuple[Robot, np.ndarray, list[JointMove | LineMove], WaypointSettings]:
    rng = np.random.default_rng(seed)
    name = ("ur5e", "crs_a465", "ur5e", "crs_a465", "panda")[seed % 5]
    robot, start = load_robot(name), np.array(STARTS[name])
    limits = motion_limits(robot)
    pose = forward_kinematics(robot, start, frame="tool" if name != "panda" else robot.frames[-1].name)
    moves: list[JointMove | LineMove] = []
    count = int(rng.integers(2, 7))
    for _ in range(count):
        zone, dwell = None, 0.0
        choice = rng.random()
        if choice < 0.35:
            zone = Zone(radius=float(10.0 ** rng.uniform(-2.5, -0.8)))
        elif choice < 0.65:
            zone = Zone(part=float(rng.uniform(0.02, 0.4)))
        elif choice < 0.75:
            dwell = float(rng.uniform(0.05, 0.5))
        common = {
            "speed": float(rng.uniform(0.2, 1.0)), "acceleration": float(rng.uniform(0.2, 1.0)), "zone": zone,
            "dwell": dwell,
        }  # fmt: skip
        if rng.random() < 0.6:
            turn = Rotation.from_rotvec(rng.normal(size=3) * 0.2).as_matrix()
            target = Pose(rotation=pose.rotation @ turn, translation=pose.translation + rng.uniform(-0.15, 0.15, 3))
            moves.append(LineMove(target=target, **common))
        else:
            near = start + rng.uniform(-0.4, 0.4, robot.n_v)
            moves.append(JointMove(target=np.clip(near, limits.lower, limits.upper), **common))
    fast = float(10.0 ** rng.uniform(-0.8, 0.5))
    tool = ToolLimits(
        speed=fast, acceleration=8.0 * fast, jerk=200.0 * fast, turn_speed=4.0 * fast, turn_acceleration=40.0 * fast,
        turn_jerk=900.0 * fast,
    )  # fmt: skip
    if seed % 2:
        jerk = motion_limits(robot, jerk=JERK * limits.acceleration)
        settings = WaypointSettings(limits=jerk, tool=tool, ramps=JerkLimited())
    else:
        settings = WaypointSettings(tool=tool, ramps=AccelerationLimited())
    return robot, start, moves, settings


def outcome(seed: int) -> Outcome:
    robot, start, moves, settings = program(seed)
    began = time.perf_counter()
    try:
        motion = waypoint_motion(robot, start, moves, settings=settings)
    except ExcitationError as error:
        named = bool(re.search(r"\bmove \d", str(error))) and "\n" not in str(error)
        return Outcome(
            seed=seed, robot=robot.name, reason=str(error), named=named, planning=time.perf_counter() - began
        )
    planning = time.perf_counter() - began
    return Outcome(
        seed=seed, robot=robot.name, measured=measure(motion), slowed=len(motion.slowed), pieces=len(motion.pieces),
        planning=planning, duration=motion.duration,
    )  # fmt: skip


def measure(motion: WaypointMotion) -> dict[str, float]:
    """Return the largest use of each limit and the largest errors, over all pieces on the fine grid."""
    limits = motion.settings.joint_limits(motion.robot)
    worst: Counter[str] = Counter()
    for begin, piece in zip(motion.begins, motion.pieces, strict=True):
        ends = np.append(piece.law.begin, piece.law.duration)
        for first, last in pairwise(ends):
            found = _phase(motion, limits, begin + first, begin + last)
            found["backward [1/s]"] = -float(piece.law.course(np.linspace(first, last, 50)).ds.min())
            if isinstance(piece.curve, LineWay):
                found["off the line [m]"] = _off_line(motion, piece.curve, begin + first, begin + last)
            for name, value in found.items():
                worst[name] = max(worst[name], value)
    return {**dict(worst), **_jumps(motion), "out of the zone [m]": _out_of_zone(motion)}


def _phase(motion: WaypointMotion, limits: Any, first: float, last: float) -> dict[str, float]:
    inside = np.linspace(first, last, FINER + 1)[1:-1]
    samples = motion.sample(inside)
    step = inside[1] - inside[0]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    middle = inside[:-1, None] + 0.5 * step * (1.0 + nodes)
    coarse = slice(None, None, 16)
    at = motion.sample(middle[coarse].ravel())
    area = {
        name: 0.5 * step * np.einsum("k,tkj->tj", weights, getattr(at, name).reshape(-1, 5, motion.n_v))
        for name in ("dq", "ddq")
    }
    found = {
        "speed": float((np.abs(samples.dq) / limits.velocity).max()),
        "acceleration": float((np.abs(samples.ddq) / limits.acceleration).max()),
        "range": float(np.maximum(samples.q - limits.upper, limits.lower - samples.q).max()),
        "dq is not the integral of ddq [1/s]": float(np.abs(np.diff(samples.dq, axis=0)[coarse] - area["ddq"]).max()),
        "q is not the integral of dq": float(np.abs(np.diff(samples.q, axis=0)[coarse] - area["dq"]).max()),
    }
    if limits.jerk is not None:
        # the difference of two rounded accelerations says nothing about jerk where the step is very short
        rounding = 1e-9 * limits.acceleration / step
        slopes = np.abs(np.diff(samples.ddq, axis=0)) / step
        found["jerk"] = float(((slopes - rounding) / limits.jerk).max())
    return found


def _off_line(motion: WaypointMotion, way: LineWay, first: float, last: float) -> float:
    inside = np.linspace(first, last, 22)[1:-1]
    frame = motion.settings.tool_frame(motion.robot)
    place = forward_kinematics(motion.robot, motion.sample(inside).q, frame=frame).translation - way.line.translation
    if way.line.length == 0.0:
        return float(np.linalg.norm(place, axis=1).max())
    along = way.line.step / way.line.length
    return float(np.linalg.norm(place - np.outer(place @ along, along), axis=1).max())


def _jumps(motion: WaypointMotion) -> dict[str, float]:
    """Return how much positions, speeds and, with bounded jerk, accelerations jump where pieces meet."""
    before = [piece.curve.state(piece.law.within(piece.law.begin.size - 1, np.ones(1))[1]) for piece in motion.pieces]
    after = [piece.curve.state(piece.law.within(0, np.zeros(1))[1]) for piece in motion.pieces]
    found = {"jump of q": 0.0, "jump of dq": 0.0}
    pairs = list(zip(before[:-1], after[1:], strict=True))
    found["jump of q"] = max(float(np.abs(one.q - two.q).max()) for one, two in pairs) if pairs else 0.0
    found["jump of dq"] = max(float(np.abs(one.dq - two.dq).max()) for one, two in pairs) if pairs else 0.0
    if isinstance(motion.settings.ramps, JerkLimited):
        found["jump of ddq"] = max(float(np.abs(one.ddq - two.ddq).max()) for one, two in pairs) if pairs else 0.0
    return found


def _out_of_zone(motion: WaypointMotion) -> float:
    """Return how far a corner with a radius leaves the ball around its target [m]."""
    frame, worst = motion.settings.tool_frame(motion.robot), -np.inf
    for begin, piece in zip(motion.begins, motion.pieces, strict=True):
        zone = motion.moves[piece.move].zone
        if piece.place != "corner" or zone is None or zone.radius is None:
            continue
        target = motion.moves[piece.move].target
        if not isinstance(target, Pose):
            target = forward_kinematics(motion.robot, target, frame=frame)
        q = motion.sample(begin + np.linspace(0.0, 0.999999, 200) * piece.law.duration).q
        place = forward_kinematics(motion.robot, q, frame=frame).translation
        worst = max(worst, float(np.linalg.norm(place - target.translation, axis=1).max()) - zone.radius)
    return worst


def summary(outcomes: list[Outcome]) -> dict[str, Any]:
    made = [found for found in outcomes if not found.reason]
    names = sorted({name for found in made for name in found.measured})
    reasons = Counter(
        re.sub(r"\d[\d.e-]*%?", "#", found.reason.split(";")[0].split(": ")[-1]) for found in outcomes if found.reason
    )
    return {
        "programs": len(outcomes),
        "motions": len(made),
        "refused with the move's name": sum(bool(found.reason) and found.named for found in outcomes),
        "refused without it": [found.seed for found in outcomes if not found.named],
        "reasons": dict(reasons.most_common()),
        "motions that were slowed somewhere": sum(found.slowed > 0 for found in made),
        "pieces": sum(found.pieces for found in made),
        "worst": {name: max(found.measured.get(name, -np.inf) for found in made) for name in names},
        "planning, median [s]": float(np.median([found.planning for found in made])),
        "planning, largest [s]": max(found.planning for found in made),
        "length, median [s]": float(np.median([found.duration for found in made])),
    }


def main() -> None:
    options = options_parser(__doc__, case="program").parse_args()
    rows = summary([outcome(seed) for seed in range(options.first, options.first + options.count)])
    show(rows, as_json=options.json, digits=9)


if __name__ == "__main__":
    main()
