"""Random limit files: each gives a motion that keeps them, or an error that names the limit and the reason.

    python benchmarks/limit_files.py [--json] [--count 200] [--first 0] [--gradient]

Most files are for arms of two and three joints, one of them with <collision> geometry, one in eight is for a 6-joint
arm. Every motion is checked by Pinocchio and coal on a grid ten times finer than the one the design holds its limits
on (`limit_oracle.py`). The design is a genetic one of 4 motions, or a gradient one from a single start.
"""

from __future__ import annotations

import re
import time
import warnings
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from limit_oracle import Oracle, joint_margins
from random_cases import options_parser, show

from tauhat.errors import ExcitationError, TauhatWarning
from tauhat.excitation import DesignSettings, GeneticSettings, LimitSet, design, parse_limits
from tauhat.robots import Robot, load_robot, robot_from_urdf

MARGIN = 0.05
NO_EXCESS = -1e-9  # parts of a limit or metres: rounding and coal's tolerance

THREE_JOINTS = """<robot name="three">
<link name="stand"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
 <collision><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.07" length="0.2"/></geometry></collision></link>
<link name="shoulder"><inertial><origin xyz="0 0 0.05"/><mass value="3"/><inertia ixx="0.02" iyy="0.02" izz="0.01"/>
 </inertial><collision><origin xyz="0 0 0.05"/><geometry><sphere radius="0.08"/></geometry></collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="4"/><inertia ixx="0.08" iyy="0.08" izz="0.01"/>
 </inertial><collision><origin xyz="0 0 0.2"/><geometry><box size="0.1 0.08 0.4"/></geometry></collision></link>
<link name="fore"><inertial><origin xyz="0.15 0 0"/><mass value="2"/><inertia ixx="0.005" iyy="0.03" izz="0.03"/>
 </inertial>
 <collision><origin xyz="0.17 0 0" rpy="0 1.5708 0"/><geometry><capsule radius="0.05" length="0.25"/></geometry></collision>
 <collision><origin xyz="0.38 0 0" rpy="0 1.2 0.1"/><geometry><cylinder radius="0.04" length="0.1"/></geometry></collision>
</link>
<joint name="turn" type="revolute"><parent link="stand"/><child link="shoulder"/><origin xyz="0 0 0.25"/><axis xyz="0 0 1"/>
 <limit lower="-2.9" upper="2.9" velocity="2" effort="100" acceleration="8"/><dynamics damping="1" friction="1"/></joint>
<joint name="lift" type="revolute"><parent link="shoulder"/><child link="upper"/><origin xyz="0 0.1 0.05"/><axis xyz="0 1 0"/>
 <limit lower="-2.2" upper="2.2" velocity="2" effort="90" acceleration="8"/><dynamics damping="1" friction="1"/></joint>
<joint name="bend" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 -0.09 0.4"/><axis xyz="0 1 0"/>
 <limit lower="-2.7" upper="2.7" velocity="3" effort="40" acceleration="12"/><dynamics damping="0.5" friction="0.5"/></joint>
</robot>"""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one file came to."""

    seed: int
    robot: str
    reason: str = ""  # of the refusal
    named: bool = True  # whether the refusal names a limit or a joint
    left: dict[str, float] = field(default_factory=dict)  # least left of each limit beyond its reserve
    seconds: float = 0.0

    @property
    def feasible(self) -> bool:
        """Whether there is a motion, and it keeps every limit."""
        return not self.reason and min(self.left.values()) >= NO_EXCESS


def arm(seed: int) -> Robot:
    if seed % 8 == 7:
        return load_robot("ur5e")
    return load_robot("two_link") if seed % 2 else robot_from_urdf(THREE_JOINTS)


def random_file(rng: np.random.Generator, robot: Robot) -> str:
    """A limits file that is hard, now and then impossible: some parts of it, at random."""

    def row(low: float, high: float, size: int = 3) -> list[float]:
        return [round(float(value), 3) for value in rng.uniform(low, high, size)]

    parts = []
    if rng.random() < 0.25:
        parts.append(f"[start]\nunit = 'deg'\nq = {row(-100, 100, robot.n_v)}")
    if rng.random() < 0.5:
        parts.append(f"[joints]\nlower = {rng.uniform(-3, 0.5):.3f}\nvelocity = {rng.uniform(0.1, 2):.3f}")
        parts.append(
            f"upper = {rng.uniform(0.2, 2.1):.3f}" if rng.random() < 0.5 else f"jerk = {rng.uniform(2, 60):.2f}"
        )
    if rng.random() < 0.5:
        parts.append(f"[torque]\nfraction = {rng.uniform(0.1, 1):.3f}")
    if rng.random() < 0.4:
        low = np.array(row(-0.6, 0.4))
        parts.append(f"[tool]\nlower = {low.tolist()}\nupper = {np.round(low + row(0.05, 1.2), 3).tolist()}")
        parts.append(f"speed = {rng.uniform(0.02, 1):.3f}")
    if rng.random() < 0.5:
        parts.append(f"[collision]\nclearance = {rng.uniform(0, 0.03):.3f}\nradius = {rng.uniform(0.02, 0.1):.3f}")
    if rng.random() < 0.5:
        parts.append(f"[[planes]]\nname = 'wall'\nnormal = {row(-1, 1)}\noffset = {rng.uniform(-0.8, 0.0):.3f}")
    parts.extend(
        f"[[boxes]]\nname = 'box {number}'\nsize = {row(0.05, 0.5)}\nxyz = {row(-0.8, 0.8)}\nrpy = {row(-3, 3)}"
        for number in range(int(rng.integers(0, 3)))
    )
    return "\n".join(parts)


def outcome(seed: int, *, method: str = "genetic") -> Outcome:
    """Design with a small budget for one random file, and check what comes out."""
    rng, robot, began = np.random.default_rng(seed), arm(seed), time.perf_counter()
    limits: LimitSet | None = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)
            limits = parse_limits(random_file(rng, robot), robot)
        settings = DesignSettings(
            harmonics=3,
            period=5.0,
            margin=MARGIN,
            method=method,  # type: ignore[arg-type]
            genetic=GeneticSettings(population=4, generations=1),
            limits=limits,
        )
        found = design(robot, rng=rng, settings=settings)
    except ExcitationError as error:
        names = [*(limit.name for limit in limits.others), "joint "] if limits else ["limits"]
        named = any(str(error).startswith(name) for name in names) and "\n" not in str(error)
        seconds = time.perf_counter() - began
        return Outcome(seed=seed, robot=robot.name, reason=str(error), named=named, seconds=seconds)
    seconds = time.perf_counter() - began
    left = joint_margins(found.trajectory, limits.robot, margin=MARGIN, jerk=limits.jerk)
    if limits.start is not None:
        ends = found.trajectory.sample(np.array([0.0, found.trajectory.period])).q
        left["start"] = -float(np.abs(ends - limits.start).max())
    left |= Oracle(limits, margin=MARGIN).worst(found.trajectory)
    return Outcome(seed=seed, robot=robot.name, left=left, seconds=seconds)


def summary(outcomes: list[Outcome]) -> dict[str, Any]:
    made = [found for found in outcomes if not found.reason]
    reasons = Counter(re.sub(r"^.*?: ", "", found.reason).split(";")[0] for found in outcomes if found.reason)
    least: dict[str, float] = {}
    for found in made:
        for name, left in found.left.items():
            key = "boxes" if name.startswith("box ") else name
            least[key] = min(least.get(key, np.inf), left)
    return {
        "files": len(outcomes),
        "feasible": sum(found.feasible for found in made),
        "infeasible": [found.seed for found in made if not found.feasible],
        "refused with a named reason": sum(bool(found.reason) and found.named for found in outcomes),
        "refused without one": [found.seed for found in outcomes if found.reason and not found.named],
        "reasons": dict(reasons.most_common()),
        "least left": least,
        "seconds": sum(found.seconds for found in outcomes),
        "slowest": max(found.seconds for found in outcomes),
    }


def main() -> None:
    parser = options_parser(__doc__, case="file")
    parser.add_argument("--gradient", action="store_true", help="gradient design from one start instead")
    options = parser.parse_args()
    method = "gradient" if options.gradient else "genetic"
    outcomes = [outcome(seed, method=method) for seed in range(options.first, options.first + options.count)]
    show(summary(outcomes), as_json=options.json)


if __name__ == "__main__":
    main()
