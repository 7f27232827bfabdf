"""Signed distances between convex solids along a motion, by coal, only where they may be near each other."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.excitation.limits.link_poses import LinkPoses
from tauhat.excitation.limits.solids import LinkSolid

_TOLERANCE = 1e-9  # of distances [m]
_DEPTH_TOLERANCE = 1e-6  # of depths [m]: a finer search fails on cylinders


class PlacedSolid(NamedTuple):
    """A convex solid along a motion.

    shape : coal geometry
    rotation, translation : (n_t, 3, 3), (n_t, 3) [m] its pose in the base frame
    lower, upper : (3,) corners of its bounding box in its own frame [m]
    """

    shape: Any
    rotation: FloatArray
    translation: FloatArray
    lower: FloatArray
    upper: FloatArray


class Separation(NamedTuple):
    """How far two solids are apart at each sample.

    gap : (n_t,) negative where they overlap, infinite where they are surely far apart [m]
    away : (n_t, 3) unit vectors from the second to the first
    first, second : (n_t, 3) their nearest points [m]
    """

    gap: FloatArray
    away: FloatArray
    first: FloatArray
    second: FloatArray


def placed(solid: LinkSolid, poses: LinkPoses) -> PlacedSolid:
    """Return a link's solid along a motion."""
    place = poses.point(solid.link, solid.translation)
    return PlacedSolid(solid.shape, solid.turned(poses), place, solid.lower, solid.upper)


def separation(first: PlacedSolid, second: PlacedSolid, *, within: float) -> Separation:
    """Return the distance of two solids, looked at only where their bounding boxes are nearer than `within` [m]."""
    n_t = len(first.translation)
    found = Separation(np.full(n_t, np.inf), np.zeros((n_t, 3)), np.zeros((n_t, 3)), np.zeros((n_t, 3)))
    near = _near(first, second, within)
    if near.size:
        _measure(first, second, near, found)
    return found


def _near(first: PlacedSolid, second: PlacedSolid, within: float) -> IntArray:
    """Return the samples (n,) at which no axis of either bounding box separates them by more than `within`."""
    between = np.swapaxes(second.rotation, 1, 2) @ first.rotation  # first's axes seen from second
    halves = [0.5 * (solid.upper - solid.lower) for solid in (first, second)]
    middles = [solid.translation + solid.rotation @ (0.5 * (solid.upper + solid.lower)) for solid in (first, second)]
    apart = middles[0] - middles[1]
    size = np.abs(between)
    from_first = np.abs(np.einsum("tji,tj->ti", first.rotation, apart))
    from_second = np.abs(np.einsum("tji,tj->ti", second.rotation, apart))
    reach_first = halves[0] + np.einsum("tji,j->ti", size, halves[1]) + within
    reach_second = halves[1] + size @ halves[0] + within
    return np.flatnonzero(((from_first < reach_first) & (from_second < reach_second)).all(axis=1))


def _measure(first: PlacedSolid, second: PlacedSolid, samples: IntArray, found: Separation) -> None:
    """Write what coal finds at some samples; it is asked in the second solid's axes, where only one of them moves."""
    import coal

    request, result, still = coal.DistanceRequest(True), coal.DistanceResult(), coal.Transform3s()
    request.enable_signed_distance = True
    request.gjk_tolerance, request.epa_tolerance = _TOLERANCE, _DEPTH_TOLERANCE
    back = second.rotation[samples]
    turns = np.swapaxes(back, 1, 2) @ first.rotation[samples]
    shifts = _turned(np.swapaxes(back, 1, 2), first.translation[samples] - second.translation[samples])
    away, points = np.empty_like(shifts), np.empty((2, *shifts.shape))
    for row, sample in enumerate(samples):
        result.clear()
        pose = coal.Transform3s(turns[row], shifts[row])
        found.gap[sample] = coal.distance(first.shape, pose, second.shape, still, request, result)
        away[row] = result.normal
        points[0, row], points[1, row] = result.getNearestPoint1(), result.getNearestPoint2()
    found.away[samples] = -_turned(back, away)
    found.first[samples] = second.translation[samples] + _turned(back, points[0])
    found.second[samples] = second.translation[samples] + _turned(back, points[1])


def _turned(rotations: FloatArray, rows: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("tij,tj->ti", rotations, rows))
