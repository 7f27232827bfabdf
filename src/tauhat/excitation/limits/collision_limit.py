"""The links stay clear of each other and of half spaces: in closed form between capsules, by coal between solids."""

from __future__ import annotations

import warnings
from abc import abstractmethod
from dataclasses import dataclass, field
from itertools import combinations
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray, frozen, read_only
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.errors import ExcitationError, TauhatWarning
from tauhat.excitation.limits.capsules import Body
from tauhat.excitation.limits.distances import Separation, placed, separation
from tauhat.excitation.limits.link_poses import (
    LinkPoses,
    Wrenches,
    ancestors,
    dot,
    joint_forces,
    link_poses,
    no_wrenches,
)
from tauhat.excitation.limits.motion_limit import MotionLimit, Pull
from tauhat.excitation.limits.solids import LinkSolid
from tauhat.robots.robot import Robot

FAR = 0.1
"""Distance beyond the clearance at which nothing is near any more, a margin of one [m]."""
_ALWAYS = 0.95  # part of random poses in which links touch that cannot be kept apart
_SAME = 1e-9  # [m] heights nearer than this are one
_TOUCHING = 1e-9  # [m] nearer segments than this cross
_PARALLEL = 1e-12


class DistanceLimit(MotionLimit):
    """A limit whose margins are distances beyond a clearance, in units of `FAR`."""

    __slots__ = ()
    relative: ClassVar[bool] = False

    @property
    @abstractmethod
    def kept(self) -> float:
        """The clearance [m]."""

    def gap(self, margin: float) -> float:
        """Return the distance that a margin means [m], negative where solids overlap."""
        return self.kept + FAR * margin

    def missing(self, row: int, margin: float) -> str:  # noqa: ARG002 - the same for every link
        """Return how much nearer than the clearance."""
        return f"{-1e3 * margin * FAR:.4g} mm nearer than {1e3 * self.kept:.4g} mm"


def check_clearance(clearance: float, where: str) -> None:
    """Check that a clearance is a length.

    Raises
    ------
    ExcitationError
        when it is negative or not finite.
    """
    if not 0.0 <= clearance < np.inf:
        raise ExcitationError("not a clearance", where=where, expected=">= 0 m", got=clearance)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SelfCollision(DistanceLimit):
    """Links that are no neighbours stay clear of each other.

    body : what stands for the robot
    clearance : [m]
    pairs : (n_c, 2) indices of the body's parts; links that touch in nearly every pose are left out
    """

    body: Body
    clearance: float
    pairs: IntArray = field(init=False)

    def __post_init__(self) -> None:
        check_clearance(self.clearance, self.name)
        object.__setattr__(self, "pairs", read_only(_separable_pairs(self.body, self.clearance)))

    @property
    def kept(self) -> float:
        """The clearance [m]."""
        return self.clearance

    @property
    def name(self) -> str:
        """The word self-collision."""
        return "self-collision"

    @property
    def parts(self) -> tuple[str, ...]:
        """The pairs of links."""
        return tuple(f"{self.body.label(a)} and {self.body.label(b)}" for a, b in self.pairs)

    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return the distances beyond the clearance, (n_c, n_t), and the pullback through the nearest points."""
        poses, links = link_poses(self.body.robot, motion.q), self.body.links
        found = separations(self.body, poses, self.pairs, within=self.clearance + FAR)
        margins = (np.array([apart.gap for apart in found]).reshape(-1, motion.n_t) - self.clearance) / FAR

        def pull(bars: FloatArray) -> MotionGradient:
            wrenches = no_wrenches(self.body.robot, motion.n_t)
            for (a, b), apart, margin, bar in zip(self.pairs, found, margins, bars, strict=True):
                force = np.where(margin < 1.0, bar / FAR, 0.0)[:, None] * apart.away
                wrenches.add(links[a], apart.first, force)
                wrenches.add(links[b], apart.second, -force)
            return pulled(self.body.robot, poses, wrenches)

        return np.minimum(margins, 1.0), pull


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfSpace(DistanceLimit):
    """The links stay on one side of a plane, `normal . p >= offset`: a floor, a table, a wall.

    label : how messages call it
    normal : (3,) towards the robot, of any length
    offset : distance of the plane from the base along the normal [m]
    clearance : [m]
    points : ends of capsules that the joints can move, capsule and place
    solids : solids whose height the joints can change
    """

    body: Body
    label: str
    normal: FloatArray
    offset: float
    clearance: float
    points: tuple[tuple[int, FloatArray], ...] = field(init=False)
    solids: tuple[LinkSolid, ...] = field(init=False)

    def __post_init__(self) -> None:
        check_clearance(self.clearance, self.label)
        normal = frozen("normal", self.normal, (3,), where=self.label)
        size = float(np.linalg.norm(normal))
        if not 1e-9 < size < 1e9:
            raise ExcitationError("a normal of no direction", where=self.label, got=normal.tolist())
        object.__setattr__(self, "normal", read_only(normal / size))
        object.__setattr__(self, "points", self.body.moving_ends())
        object.__setattr__(self, "solids", _rising(self.body, self.normal))

    @property
    def kept(self) -> float:
        """The clearance [m]."""
        return self.clearance

    @property
    def name(self) -> str:
        """The plane's label."""
        return self.label

    @property
    def parts(self) -> tuple[str, ...]:
        """The links of the points and solids."""
        points = (self.body.label(index) for index, _ in self.points)
        return (*points, *(solid.label for solid in self.solids))

    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return the heights beyond the clearance, (n_c, n_t), and their pullback."""
        poses = link_poses(self.body.robot, motion.q)
        links = [self.body.capsules[index].link for index, _ in self.points]
        places = [poses.point(link, place) for link, (_, place) in zip(links, self.points, strict=True)]
        places += [solid.lowest(poses, self.normal) for solid in self.solids]
        links += [solid.link for solid in self.solids]
        radii = np.array([self.body.radii[index] for index, _ in self.points] + [0.0] * len(self.solids))[:, None]

        def pull(bars: FloatArray) -> MotionGradient:
            wrenches = no_wrenches(self.body.robot, motion.n_t)
            for link, place, bar in zip(links, places, bars, strict=True):
                wrenches.add(link, place, (bar / FAR)[:, None] * self.normal)
            return pulled(self.body.robot, poses, wrenches)

        return (np.array(places) @ self.normal - self.offset - radii - self.clearance) / FAR, pull


def _rising(body: Body, normal: FloatArray) -> tuple[LinkSolid, ...]:
    """Return the solids whose height over a plane depends on the pose: no motion lifts the others."""
    poses = body.random_poses()
    return tuple(solid for solid in body.solids if np.ptp(solid.lowest(poses, normal) @ normal) > _SAME)


def pulled(robot: Robot, poses: LinkPoses, wrenches: Wrenches) -> MotionGradient:
    """Return wrenches on the links as the gradient with respect to a motion."""
    q = joint_forces(robot, poses, wrenches)
    return MotionGradient(q, np.zeros_like(q), np.zeros_like(q))


def separations(body: Body, poses: LinkPoses, pairs: IntArray, *, within: float) -> list[Separation]:
    """Return how far the parts of each pair are apart; pairs of solids only where they are nearer than `within`."""
    round_ones = (pairs < len(body.capsules)).all(axis=1)
    found: dict[int, Separation] = {}
    if round_ones.any():
        first, second = nearest_points(body, poses, pairs[round_ones])
        gap, away = _between(first, second)
        gap -= body.radii[pairs[round_ones]].sum(axis=1)[:, None]
        for row, parts in zip(np.flatnonzero(round_ones), zip(gap, away, first, second, strict=True), strict=True):
            found[int(row)] = Separation(*parts)
    others = np.flatnonzero(~round_ones)
    places = {int(index): placed(body.parts[index], poses) for index in np.unique(pairs[others])}
    for row in others:
        a, b = (places[int(index)] for index in pairs[row])
        found[int(row)] = separation(a, b, within=within)
    return [found[row] for row in range(len(pairs))]


def nearest_points(body: Body, poses: LinkPoses, pairs: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the points of both segments of each pair that are nearest to each other, (n_pairs, n_t, 3) each."""
    starts, ends = body.ends(poses)
    a, b = pairs[:, 0], pairs[:, 1]
    along, other = ends[a] - starts[a], ends[b] - starts[b]
    s, t = _nearest_parts(along, other, starts[a] - starts[b])
    return starts[a] + s[..., None] * along, starts[b] + t[..., None] * other


def _nearest_parts(along: FloatArray, other: FloatArray, apart: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where on each of two segments the nearest point lies, in [0, 1].

    The squared distance is a convex quadratic of (s, t) on the unit square: its minimum over s for the best t without
    bounds, t for this s, and s again for the t brought into bounds.

    Source: Lumelsky, "On fast computation of distance between line segments", 1985.
    """
    a, b, c = dot(along, along), dot(along, other), dot(other, other)
    d, e = dot(along, apart), dot(other, apart)
    spread = a * c - b * b
    crossing = spread > _PARALLEL * a * c
    s = np.where(crossing, (b * e - c * d) / np.where(crossing, spread, 1.0), 0.0)
    s = np.clip(s, 0.0, 1.0)
    t = np.clip((b * s + e) / c, 0.0, 1.0)
    return np.clip((b * t - d) / a, 0.0, 1.0), t


def _between(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the distance of points (...) and the unit vector from the second to the first, (..., 3)."""
    apart = first - second
    gap = np.sqrt(dot(apart, apart))
    return gap, apart / np.maximum(gap, _TOUCHING)[..., None]


def _separable_pairs(body: Body, clearance: float) -> IntArray:
    """Return the pairs of parts on links that are no neighbours and that some motion can keep apart."""
    parents = (*body.robot.parents, -1)  # the base is its own parent
    links = body.links
    pairs = np.array(
        [
            (a, b)
            for a, b in combinations(range(len(links)), 2)
            if links[a] != links[b] and links[a] != parents[links[b]] and links[b] != parents[links[a]]
        ],
        dtype=np.intp,
    ).reshape(-1, 2)
    if not len(pairs):
        return pairs
    found = separations(body, body.random_poses(), pairs, within=clearance)
    touching = np.array([(apart.gap < clearance).mean() for apart in found]) > _ALWAYS
    _warn_of_touching(body, pairs[touching])
    return np.asarray(pairs[~touching])


def _warn_of_touching(body: Body, pairs: IntArray) -> None:
    """Tell of links further apart than the next but one that touch in nearly every pose."""
    for a, b in pairs:
        if abs(_rank(body, body.links[a]) - _rank(body, body.links[b])) > 2:
            warnings.warn(
                f"self-collision: {body.label(a)} and {body.label(b)} touch in nearly every pose as they stand: the "
                "pair is not looked at",
                TauhatWarning,
                stacklevel=2,
            )


def _rank(body: Body, link: int) -> int:
    """Return how many links with a body there are from the base to this one."""
    bodily = set(body.links)
    return len(bodily & {-1, *ancestors(body.robot, link)})
