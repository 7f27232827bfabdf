"""Random tasks: each gives programs inside all limits on a fine grid, or an error that names the reason.

    python benchmarks/task_designs.py [--json] [--count 200] [--first 0]

Boxes, taught poses and paths of random place, size, tilt and spin, in reach and out of it, with one or two stages of
random points, times, speeds, zones and kinds of move, for a UR5e, a Staubli TX40 and a Panda; every third with a table
to stay above, every fourth with bounded jerk. Searches are tiny: what is looked at is whether a design is what it says,
not how good it is.
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from random_cases import options_parser, show
from scipy.spatial.transform import Rotation

from tauhat.blas import single_threaded
from tauhat.errors import ExcitationError
from tauhat.excitation import GeneticSettings, LimitSet, parse_limits
from tauhat.excitation.task_design import (
    BLOCKS,
    BoxRegion,
    Freedom,
    PathRegion,
    PosesRegion,
    TaskRegion,
    TaskSettings,
    TaskStage,
    design_task,
)
from tauhat.excitation.task_design.search import sampled
from tauhat.robots import Pose, Robot, forward_kinematics, load_robot
from tauhat.workers import LocalWorkers

FINE = 20_000  # samples of a program
NO_EXCESS = 1e-6  # parts of a limit
HOMES = {
    "ur5e": [0.0, -1.3, 1.6, -1.8, -1.4, 0.0],
    "staubli_tx40": [0.1, 0.4, 1.2, 0.2, 0.8, 0.0],
    "panda": [0.0, -0.4, 0.2, -1.9, 0.1, 1.7, 0.7],
}


@dataclass(frozen=True)
class Outcome:
    """What came of one task: the reason of a refusal, or the largest use of a limit and the distance of its points."""

    seed: int
    robot: str
    reason: str = ""
    used: float = 0.0  # largest part of a limit of position, speed or acceleration
    outside: float = 0.0  # [m] farthest via-point from the region
    late: float = 0.0  # [s] longest time over that of a stage
    seconds: float = 0.0


def region_of(here: Pose, rng: np.random.Generator) -> TaskRegion:
    freedom = Freedom(tilt=float(rng.choice([0.0, 0.2, 0.6])), spin=float(rng.choice([0.0, 0.5, 2.0])))
    centre = here.translation + rng.normal(size=3) * rng.choice([0.02, 0.1, 0.4])

    def pose() -> Pose:
        turn = Rotation.from_rotvec(0.2 * rng.normal(size=3)).as_matrix()
        return Pose(rotation=here.rotation @ turn, translation=centre + rng.uniform(-0.12, 0.12, 3))

    kind = rng.choice(["box", "poses", "path"])
    if kind == "box":
        half = 10.0 ** rng.uniform(-2.0, -0.5, 3)
        return BoxRegion(lower=centre - half, upper=centre + half, rotation=here.rotation, freedom=freedom)
    poses = tuple(pose() for _ in range(int(rng.integers(2, 6))))
    clearance = float(rng.choice([0.0, 0.02, 0.1]))
    made = PosesRegion if kind == "poses" else PathRegion
    return made(poses=poses, clearance=clearance, freedom=freedom)


def stages_of(rng: np.random.Generator) -> tuple[TaskStage, ...]:
    stages = []
    for number in range(int(rng.integers(1, 3))):
        low, high = np.sort(10.0 ** rng.uniform(-1.7, 0.0, 2))
        counted = tuple(rng.permutation(BLOCKS)[: int(rng.integers(1, 4))])
        stages.append(
            TaskStage(
                name=f"s{number}", counted=counted, points=int(rng.integers(1, 6)), seconds=float(10.0 ** rng.uniform(0.5, 2.0)),
                speed=(float(low), float(high)), acceleration=(0.1, 1.0), zone=float(rng.choice([0.0, 0.2, 0.4])),
                dwell=float(rng.choice([0.0, 0.3])), moves=str(rng.choice(["joint", "joint", "line"])),
            )
        )  # fmt: skip
    return tuple(stages)


def limits_of(robot: Robot, seed: int, here: Pose) -> LimitSet:
    text = "[joints]\njerk = 80.0\n" if seed % 4 == 0 else ""
    if seed % 3 == 0:
        text += f"[[planes]]\nname = 'table'\nnormal = [0, 0, 1]\noffset = {here.translation[2] - 0.35}\n"
    return parse_limits(text, robot)


@single_threaded
def outcome(seed: int) -> Outcome:
    rng = np.random.default_rng(seed)
    name = tuple(HOMES)[seed % 3]
    robot, home = load_robot(name), np.array(HOMES[name])
    frame = robot.frames[-1].name
    here = forward_kinematics(robot, home, frame=frame)
    began = time.perf_counter()
    try:
        region, limits = region_of(here, rng), limits_of(robot, seed, here)
        settings = TaskSettings(
            region=region, home=home, stages=stages_of(rng), limits=limits, islands=1,
            genetic=GeneticSettings(population=4, generations=2),
        )  # fmt: skip
        design = design_task(robot, settings, rng=rng, workers=LocalWorkers(count=1))
    except ExcitationError as error:
        return Outcome(seed=seed, robot=name, reason=str(error), seconds=time.perf_counter() - began)
    seconds = time.perf_counter() - began
    joints, used, outside, late = limits.of_joints(), 0.0, 0.0, 0.0
    for stage in design.stages:
        fine = sampled(stage.motion, FINE)
        middle, reach = 0.5 * (joints.upper + joints.lower), 0.5 * (joints.upper - joints.lower)
        used = max(
            used,
            float((np.abs(fine.q - middle[:, None]) / reach[:, None]).max()),
            float((np.abs(fine.dq) / joints.velocity[:, None]).max()),
            float((np.abs(fine.ddq) / joints.acceleration[:, None]).max()),
            *(1.0 - float(limit.margins(fine).min()) for limit in limits.others),
        )
        targets = np.array([move.target for move in stage.motion.moves if np.abs(move.target - home).max() > 0.0])
        outside = max(outside, float(region.outside(forward_kinematics(robot, targets, frame=frame).translation).max()))
        late = max(late, stage.motion.duration - stage.stage.seconds)
    return Outcome(seed=seed, robot=name, used=used, outside=outside, late=late, seconds=seconds)


def summary(outcomes: list[Outcome]) -> dict[str, Any]:
    """Figures of many tasks; raises SystemExit where one is not what it says."""
    good = [one for one in outcomes if not one.reason]
    for one in outcomes:
        if "\n" in one.reason or (one.reason and ":" not in one.reason):
            raise SystemExit(f"task {one.seed}: a reason that names no place: {one.reason}")
    for one in good:
        if one.used > 1.0 + NO_EXCESS or one.outside > 1e-9 or one.late > 1e-9:
            raise SystemExit(f"task {one.seed}: {one}")
    reasons = Counter(one.reason.split(": ", 1)[1].split(";")[0] for one in outcomes if one.reason)
    return {
        "tasks": len(outcomes),
        "designed": len(good),
        "refused": dict(reasons.most_common()),
        "largest use of a limit": max((one.used for one in good), default=0.0),
        "farthest via-point outside [m]": max((one.outside for one in good), default=0.0),
        "seconds, median": float(np.median([one.seconds for one in outcomes])),
    }


def main() -> None:
    options = options_parser(__doc__, case="task").parse_args()
    seeds = range(options.first, options.first + options.count)
    show(summary(list(LocalWorkers().map(outcome, seeds))), as_json=options.json)


if __name__ == "__main__":
    main()
