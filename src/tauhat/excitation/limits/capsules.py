"""What stands for the body of the robot: its solids where it states them, else capsules from joint to joint."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError, TauhatWarning
from tauhat.excitation.limits.link_poses import LinkPoses, link_poses
from tauhat.excitation.limits.solids import LinkSolid, capsule_solid, link_solid
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Frame, Robot

BASE = "base"
RADIUS_PART = 0.05  # default radius, in parts of the arm's length: 66 mm on arms of 1.3 m
_SHORT = 1e-3  # [m] a link shorter than this has no capsule of its own: its neighbours cover it
_STILL = 1e-9  # [m] a point that moves less than this stands still
POSES = 500  # random poses that tell which parts can move and which always touch
_SEED = 20261121


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Capsule:
    """All points within a radius of a segment that is fixed to a link.

    link : index of the joint that moves it, -1 for the base
    start, end : (3,) in the link frame [m]
    radius : [m]
    """

    link: int
    start: FloatArray
    end: FloatArray
    radius: float

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (3,), where="capsule"))
        if not 0.0 < self.radius < np.inf:
            raise ExcitationError("not a radius", where="capsule", expected="> 0 m", got=self.radius)

    @property
    def length(self) -> float:
        """Length of the segment [m]."""
        return float(np.linalg.norm(self.end - self.start))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A robot with the parts that stand for it: capsules first, then solids.

    capsules, solids : in any order, several a link where it branches
    parts : all of them as solids
    """

    robot: Robot
    capsules: tuple[Capsule, ...]
    solids: tuple[LinkSolid, ...] = ()
    parts: tuple[LinkSolid, ...] = field(init=False)

    def __post_init__(self) -> None:
        round_ones = [
            capsule_solid(
                link=capsule.link,
                label=link_name(self.robot, capsule.link),
                ends=(capsule.start, capsule.end),
                radius=capsule.radius,
            )
            for capsule in self.capsules
        ]
        object.__setattr__(self, "parts", (*round_ones, *self.solids))

    def label(self, index: int) -> str:
        """Return how messages call a part."""
        return self.parts[index].label

    @property
    def links(self) -> tuple[int, ...]:
        """The link of each part."""
        return tuple(part.link for part in self.parts)

    @property
    def radii(self) -> FloatArray:
        """Radius of each capsule, (n,) [m]."""
        return np.array([capsule.radius for capsule in self.capsules])

    def ends(self, poses: LinkPoses) -> tuple[FloatArray, FloatArray]:
        """Return both ends of all capsules, (n, n_t, 3) each."""
        starts = [poses.point(capsule.link, capsule.start) for capsule in self.capsules]
        ends = [poses.point(capsule.link, capsule.end) for capsule in self.capsules]
        return np.array(starts), np.array(ends)

    def moving_ends(self) -> tuple[tuple[int, FloatArray], ...]:
        """Return the capsules and places of all ends that the joints can move; what stands still can hit nothing."""
        found = []
        for poses_of_end, side in zip(self.ends(self.random_poses()), ("start", "end"), strict=True):
            for index, path in enumerate(poses_of_end):
                if np.ptp(path, axis=0).max() > _STILL:
                    found.append((index, getattr(self.capsules[index], side)))
        return tuple(found)

    def moving_parts(self) -> tuple[int, ...]:
        """Return the parts that the joints can move; one that only turns about its own axis stands still."""
        poses = self.random_poses()
        return tuple(
            index for index, part in enumerate(self.parts) if np.ptp(part.placed_corners(poses), axis=1).max() > _STILL
        )

    def random_poses(self) -> LinkPoses:
        """Return always the same random poses, all over the joints' ranges."""
        rng = np.random.default_rng(_SEED)
        lower = np.where(np.isfinite(self.robot.lower), self.robot.lower, -np.pi)
        upper = np.where(np.isfinite(self.robot.upper), self.robot.upper, np.pi)
        return link_poses(self.robot, rng.uniform(lower, np.maximum(lower, upper), (POSES, self.robot.n_v)).T)


def link_name(robot: Robot, link: int) -> str:
    """Return how messages call a link: by the joint that moves it."""
    return BASE if link < 0 else f"link of {robot.joint_names[link]}"


def link_capsules(
    robot: Robot,
    tool: Frame,
    *,
    radius: float | Mapping[str, float] | None = None,
    given: Sequence[Capsule] = (),
) -> Body:
    """Return capsules from each joint's origin to those of the joints it carries, and to the tool.

    A coarse stand-in: links of real arms run beside the line between joint origins, so state radii that cover them, or
    the capsules themselves. Links shorter than a millimetre have none.

    Parameters
    ----------
    tool : where the last link ends
    radius : of all links, or by joint name (base: `base`) [m]; where not stated 5 % of the arm's length
    given : capsules that replace those of their links
    """
    lines = [(joint.parent, np.zeros(3), joint.translation) for joint in robot.joints]
    lines.append((tool.joint, np.zeros(3), tool.translation))
    lines = [line for line in lines if np.linalg.norm(line[2]) > _SHORT]
    radii = _radii(robot, radius, default=RADIUS_PART * float(sum(np.linalg.norm(line[2]) for line in lines)))
    replaced = {capsule.link for capsule in given}
    derived = [
        Capsule(link=link, start=start, end=end, radius=radii[link])
        for link, start, end in lines
        if link not in replaced
    ]
    if not (derived or given):
        raise ExcitationError("no link is long enough to hit anything", where=robot.name, remedy="state capsules")
    return Body(robot=robot, capsules=(*derived, *given))


def robot_body(
    robot: Robot,
    tool: Frame,
    *,
    radius: float | Mapping[str, float] | None = None,
    given: Sequence[Capsule] = (),
) -> Body:
    """Return the solids that the robot's description states, and capsules for the other links.

    Links with stated capsules, or a radius under their name, are capsules. Where the geometry of a link cannot be had,
    its capsules stand beside what there is, and a warning names it.

    Parameters
    ----------
    tool, radius, given : as for `link_capsules`
    """
    body = link_capsules(robot, tool, radius=radius, given=given)
    named = radius if isinstance(radius, Mapping) else {}
    stated = {capsule.link for capsule in given} | {
        link for link in range(-1, robot.n_v) if (BASE if link < 0 else robot.joint_names[link]) in named
    }
    solids, lacking = _solids_of(robot, stated)
    covered = {solid.link for solid in solids} - lacking
    return Body(
        robot=robot,
        capsules=tuple(capsule for capsule in body.capsules if capsule.link not in covered),
        solids=solids,
    )


def _solids_of(robot: Robot, stated: set[int]) -> tuple[tuple[LinkSolid, ...], set[int]]:
    """Return the solids of all links but the stated ones, and the links of which some could not be had."""
    carriers = {frame.name: frame.joint for frame in robot.frames}
    solids, lacking, reasons = [], set(), {}
    for solid in robot.solids:
        if carriers[solid.frame] in stated:
            continue
        try:
            solids.append(link_solid(robot, solid))
        except ExcitationError as error:
            lacking.add(carriers[solid.frame])
            reasons[solid.frame] = f"{error.what}{f' ({error.got})' if error.got else ''}"
    for link, reason in reasons.items():
        warnings.warn(
            f"link {link}: a capsule stands for its collision geometry: {reason}", TauhatWarning, stacklevel=2
        )
    return tuple(solids), lacking


def _radii(robot: Robot, radius: float | Mapping[str, float] | None, *, default: float) -> dict[int, float]:
    links = {BASE: -1} | {name: index for index, name in enumerate(robot.joint_names)}
    if radius is None or not isinstance(radius, Mapping):
        return dict.fromkeys(links.values(), max(default, _SHORT) if radius is None else radius)
    radii = dict.fromkeys(links.values(), max(default, _SHORT))
    for name, value in radius.items():
        if name not in links:
            raise ExcitationError("unknown joint", where="radius", got=name[:60], remedy=advice_on_name(name, links))
        radii[links[name]] = value
    return radii
