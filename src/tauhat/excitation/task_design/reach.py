"""Joint positions for poses of a region, all on the branch of one position, found once and then near by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError, RobotError
from tauhat.excitation.limits.joint_limits import MotionLimits
from tauhat.excitation.task_design.regions import TaskRegion
from tauhat.robots.inverse_kinematics import PoseSolver
from tauhat.robots.kinematics import Pose, forward_kinematics
from tauhat.robots.robot import Robot

_TRIALS = 256  # poses of the region that are looked for at the beginning, a power of two
_FEWEST = 8  # of them that must be reached
_LARGEST_STEP = 1.0  # [rad or m] of a joint between neighbours; more is another branch of the arm
_TURN_LENGTH = 0.3  # [m] that a turn by one radian counts for when poses are compared


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reach:
    """What of a region an arm reaches without changing its configuration.

    home : (n_v,) a position in or near the region, whose configuration counts [rad or m]
    frame : the tool's
    limits : of the joints
    q : (n, n_v) positions in the region that are reached [rad or m]
    rotation, translation : their poses, (n, 3, 3) and (n, 3) [m]
    share : part of the region that is reached
    """

    robot: Robot
    region: TaskRegion
    home: FloatArray
    frame: str
    limits: MotionLimits
    q: FloatArray
    rotation: FloatArray
    translation: FloatArray
    share: float

    def positions(self, genes: FloatArray) -> FloatArray:
        """Return the joint positions for the poses that genes pick, (n, n_v) [rad or m].

        For a pose that is not reached, those of the nearest pose known to be.

        Parameters
        ----------
        genes : (n, n_genes) from 0 to 1
        """
        solver = PoseSolver(self.robot, self.frame)
        found = []
        for row in genes:
            pose = self.region.pose(row)
            near = self.q[_distances(pose, self.rotation, self.translation).argmin()]
            reached = _near(solver, pose, near, self.limits)
            found.append(near if reached is None else reached)
        return np.array(found)


def reach_of(robot: Robot, region: TaskRegion, *, home: FloatArray, frame: str, limits: MotionLimits) -> Reach:
    """Return what the arm reaches of the region from `home` on.

    Poses spread evenly over the region are looked for in the order of their distance from home, each from the nearest
    position that is known already.

    Raises
    ------
    ExcitationError
        when hardly anything of the region is reached, or home is outside the limits.
    """
    start = frozen("home", home, (robot.n_v,), where="task")
    if robot.n_v < 6:
        raise ExcitationError("a region of tool poses needs an arm of six joints or more", got=f"{robot.n_v} joints")
    if not ((start >= limits.lower) & (start <= limits.upper)).all():
        worst = int(np.maximum(limits.lower - start, start - limits.upper).argmax())
        raise ExcitationError(
            "home is outside the joint limits", where=robot.joint_names[worst],
            expected=f"{limits.lower[worst]:.4g} to {limits.upper[worst]:.4g}", got=f"{start[worst]:.4g}",
        )  # fmt: skip
    here = forward_kinematics(robot, start, frame=frame)
    genes = qmc.Sobol(region.n_genes, scramble=False).random(_TRIALS)
    poses = [region.pose(row) for row in genes]
    rotation = np.array([pose.rotation for pose in poses])
    translation = np.array([pose.translation for pose in poses])
    order = np.argsort(_distances(here, rotation, translation), kind="stable")
    solver = PoseSolver(robot, frame)
    known, places = [start], [here]
    for index in order:
        turns, steps = (np.array([getattr(place, part) for place in places]) for part in ("rotation", "translation"))
        nearest = int(_distances(poses[index], turns, steps).argmin())
        found = _near(solver, poses[index], known[nearest], limits)
        if found is not None:
            known.append(found)
            places.append(poses[index])
    if len(known) - 1 < _FEWEST:
        raise ExcitationError(
            "the region is not reached", where=f"{robot.name}, frame {frame}",
            got=f"{len(known) - 1} of {_TRIALS} poses from home at {np.round(here.translation, 3).tolist()} m",
            remedy="a home in the region, a smaller region, or less tilt and spin",
        )  # fmt: skip
    return Reach(
        robot=robot, region=region, home=start, frame=frame, limits=limits, q=np.array(known[1:]),
        rotation=np.array([place.rotation for place in places[1:]]),
        translation=np.array([place.translation for place in places[1:]]),
        share=(len(known) - 1) / _TRIALS,
    )  # fmt: skip


def _near(solver: PoseSolver, pose: Pose, seed: FloatArray, limits: MotionLimits) -> FloatArray | None:
    """Return positions that reach a pose on the branch of the seed inside the limits; None where there are none."""
    try:
        found = solver.position(pose, seed)
    except RobotError:
        return None
    inside = (found >= limits.lower).all() and (found <= limits.upper).all()
    return found if inside and np.abs(found - seed).max() <= _LARGEST_STEP else None


def _distances(pose: Pose, rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Return how far poses (n) are from one, (n,) [m]."""
    cosine = 0.5 * (np.einsum("nij,ij->n", rotation, pose.rotation) - 1.0)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    return np.asarray(np.linalg.norm(translation - pose.translation, axis=1) + _TURN_LENGTH * angle)
