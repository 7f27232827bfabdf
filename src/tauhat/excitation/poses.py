"""Poses inside all limits at rest: where motions start to grow, or the reason why there is none."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.errors import ExcitationError
from tauhat.excitation.guard import INSIDE, Guard, pose_rooms
from tauhat.excitation.limits import DistanceLimit, LimitSet, MotionLimit, MotionLimits
from tauhat.excitation.space import FourierSpace

_TRIALS = 2000  # random poses
_KEPT = 6  # poses that motions are grown from
_ROOMY = 0.1  # margin at which a pose needs no better one
_WANTED = 0.05  # margin that a pose is moved to where no random one is inside
_MOVED = 12  # poses that are moved
_REACH = 0.98  # of the joints' ranges


def motion_space(limits: LimitSet, *, margin: float, period: float, harmonics: int) -> FourierSpace:
    """Return the space of motions inside the joint limits, which start at the start pose where one is stated.

    Parameters
    ----------
    margin : part of every limit that is left unused
    period : [s]

    Raises
    ------
    ExcitationError
        when the start pose is not strictly inside: names the joint.
    """
    of_joints = limits.of_joints(margin=margin)
    if limits.start is not None:
        _check_inside(limits.start, of_joints, limits, "start pose outside joint limits", margin)
    return FourierSpace(limits=of_joints, period=period, harmonics=harmonics, start=limits.start)


def guard_of(space: FourierSpace, limits: LimitSet, *, margin: float, samples: int, rng: np.random.Generator) -> Guard:
    """Return the guard of the limits of several joints at once, with poses inside them.

    Raises
    ------
    ExcitationError
        when no pose keeps a limit, or the start or home pose does not.
    """
    poses = feasible_poses(space, limits, margin=margin, rng=rng)
    return Guard(
        space=space,
        limits=limits.others,
        margin=margin,
        poses=poses,
        samples=samples,
        tightening=(0.0,) * len(limits.others),
    )


def feasible_poses(space: FourierSpace, limits: LimitSet, *, margin: float, rng: np.random.Generator) -> FloatArray:
    """Return poses at rest inside all limits, (n, n_v): the middle of the ranges if it is one, and roomy random ones.

    Raises
    ------
    ExcitationError
        when there is none, or the stated one is none: names the limit and by how much it is missed.
    """
    if limits.start is not None:
        return _kept_start(limits, limits.start, margin)
    if limits.home is not None:
        return _home(space, limits, limits.home, margin)
    trials = space.middle + _REACH * space.reach * rng.uniform(-1.0, 1.0, (_TRIALS, space.n_v))
    trials[0] = space.middle
    rooms = pose_rooms(limits.others, trials.T, margin=margin)
    least = rooms.min(axis=0)
    order = np.argsort(-np.minimum(least, _ROOMY * 10), kind="stable")
    if least[order[0]] <= INSIDE:
        short = np.minimum(rooms, 0.0).sum(axis=0)
        trials = _moved(space, limits.others, trials[np.argsort(-short)[:_MOVED]], margin)
        least = pose_rooms(limits.others, trials.T, margin=margin).min(axis=0)
        order = np.argsort(-least, kind="stable")
        if least[order[0]] <= INSIDE:
            raise _reason(space, limits.others, trials, margin)
    first = [0] if least[0] > _ROOMY else []
    chosen = [*first, *(index for index in order if index not in first)][:_KEPT]
    return np.asarray(trials[[index for index in chosen if least[index] > INSIDE]])


def _check_inside(pose: FloatArray, room: MotionLimits, limits: LimitSet, what: str, margin: float) -> None:
    outside = np.flatnonzero((pose <= room.lower) | (pose >= room.upper))
    if outside.size:
        joint = int(outside[0])
        raise ExcitationError(
            what,
            where=f"joint {limits.robot.joint_names[joint]}",
            expected=f"inside ({room.lower[joint]:g}, {room.upper[joint]:g})",
            got=f"{pose[joint]:g}",
            remedy=f"{100 * margin:g} % of the range are to be left unused" if margin > 0.0 else "",
        )


def _kept_start(limits: LimitSet, start: FloatArray, margin: float) -> FloatArray:
    rooms = pose_rooms(limits.others, start[:, None], margin=margin)[:, 0]
    if rooms.min() > 0.0:
        return start[None, :]
    limit = limits.others[int(rooms.argmin())]
    what, got = "the start pose does not keep the limit", _worst(limit, start)
    if isinstance(limit, DistanceLimit):
        row, margin_there = _worst_row(limit, start)
        depth = -limit.gap(margin_there)
        what = "start pose in collision" if depth > 0.0 else "start pose nearer than the clearance"
        got = f"{limit.parts[row]}: {1e3 * depth:.4g} mm deep" if depth > 0.0 else got
    raise ExcitationError(what, where=limit.name, got=got, remedy=_reserve(limit, margin))


def _home(space: FourierSpace, limits: LimitSet, home: FloatArray, margin: float) -> FloatArray:
    _check_inside(home, space.limits, limits, "the home pose is not inside the position limits", margin)
    rooms = pose_rooms(limits.others, home[:, None], margin=margin)[:, 0]
    if rooms.min() <= 0.0:
        limit = limits.others[int(rooms.argmin())]
        raise ExcitationError(
            "the home pose does not keep the limit",
            where=limit.name,
            got=_worst(limit, home),
            remedy=_reserve(limit, margin),
        )
    return home[None, :]


def _moved(space: FourierSpace, limits: tuple[MotionLimit, ...], poses: FloatArray, margin: float) -> FloatArray:
    """Return the poses moved towards all limits: least squares of what they miss, by L-BFGS inside the ranges."""
    from scipy.optimize import minimize

    edge = _REACH * space.reach
    bounds = list(zip(space.middle - edge, space.middle + edge, strict=True))

    def missed(pose: FloatArray) -> tuple[float, FloatArray]:
        still = np.zeros((space.n_v, 1))
        motion = Motion(q=pose[:, None], dq=still, ddq=still)
        value, slope = 0.0, np.zeros(space.n_v)
        for limit in limits:
            margins, pull = limit.evaluate(motion)
            wanted = _WANTED + (margin if limit.relative else 0.0)
            short = np.maximum(wanted - margins, 0.0)
            value += float((short**2).sum())
            slope += pull(-2.0 * short).q[:, 0]
        return value, slope

    return np.array([minimize(missed, pose, jac=True, method="L-BFGS-B", bounds=bounds).x for pose in poses])


def _reason(space: FourierSpace, limits: tuple[MotionLimit, ...], poses: FloatArray, margin: float) -> ExcitationError:
    """Return the error that names the limit that no pose keeps by itself, or those that contradict each other."""
    for limit in limits:
        alone = _moved(space, (limit,), poses, margin)
        rooms = pose_rooms((limit,), alone.T, margin=margin)[0]
        if rooms.max() <= INSIDE:
            return ExcitationError(
                "no pose keeps the limit",
                where=limit.name,
                got=_worst(limit, alone[rooms.argmax()]),
                remedy="; ".join(filter(None, (limit.at_rest(), _reserve(limit, margin)))),
            )
    rooms = pose_rooms(limits, poses.T, margin=margin)
    best = int(np.minimum(rooms, 0.0).sum(axis=0).argmax())
    hardest = limits[int(rooms[:, best].argmin())]
    return ExcitationError(
        "no pose was found that keeps all limits at once",
        where=hardest.name,
        got=f"at best {_worst(hardest, poses[best])}",
        remedy="relax this limit or another, or state a home pose",
    )


def _reserve(limit: MotionLimit, margin: float) -> str:
    return f"{100 * margin:g} % of it are to be left unused" if limit.relative and margin > 0.0 else ""


def _worst(limit: MotionLimit, pose: FloatArray) -> str:
    row, margin = _worst_row(limit, pose)
    return f"{limit.parts[row]}: {limit.missing(row, margin)}"


def _worst_row(limit: MotionLimit, pose: FloatArray) -> tuple[int, float]:
    still = np.zeros((pose.size, 1))
    margins = limit.margins(Motion(q=pose[:, None], dq=still, ddq=still))[:, 0]
    row = int(margins.argmin())
    return row, float(margins[row])
