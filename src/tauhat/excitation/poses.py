"""Poses inside all limits at rest: where motions start to grow, or the reason why there is none."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.errors import ExcitationError
from tauhat.excitation.guard import INSIDE, Guard, pose_rooms
from tauhat.excitation.limits import LimitSet, MotionLimit
from tauhat.excitation.space import FourierSpace

_TRIALS = 2000  # random poses
_KEPT = 6  # poses that motions are grown from
_ROOMY = 0.1  # margin at which a pose needs no better one
_WANTED = 0.05  # margin that a pose is moved to where no random one is inside
_MOVED = 12  # poses that are moved
_REACH = 0.98  # of the joints' ranges


def guard_of(space: FourierSpace, limits: LimitSet, *, margin: float, samples: int, rng: np.random.Generator) -> Guard:
    """Return the guard of the limits of several joints at once, with poses inside them.

    Raises
    ------
    ExcitationError
        when no pose keeps a limit, or the home pose does not.
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
        when there is none: names the limit that no pose keeps, and by how much it is missed.
    """
    if limits.home is not None:
        return _home(space, limits, margin)
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


def _home(space: FourierSpace, limits: LimitSet, margin: float) -> FloatArray:
    home = np.asarray(limits.home)
    outside = np.flatnonzero((home <= space.limits.lower) | (home >= space.limits.upper))
    if outside.size:
        joint = int(outside[0])
        bounds = f"[{space.limits.lower[joint]:g}, {space.limits.upper[joint]:g}]"
        raise ExcitationError(
            "the home pose is not inside the position limits",
            where=f"joint {limits.robot.joint_names[joint]}",
            expected=bounds,
            got=f"{home[joint]:g}",
        )
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
                remedy=_reserve(limit, margin),
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
    still = np.zeros((pose.size, 1))
    margins = limit.margins(Motion(q=pose[:, None], dq=still, ddq=still))[:, 0]
    row = int(margins.argmin())
    return f"{limit.parts[row]}: {limit.missing(row, float(margins[row]))}"
