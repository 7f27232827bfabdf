"""Gravity and friction without motion: the torque in poses that were reached from both sides.

Friction holds back against the way a joint came, so that
    half the sum of both torques        = gravity (and offset, springs),
    half the difference of both torques = friction at low speed,
joint by joint, without any dynamics or filter. Both are compared with the model's, with the error bars of both.
In a pose that is held friction may have anything between the two signs of its value, as a controller comes to rest:
half the difference is then a lower bound of friction, and only a model that has less is contradicted. Poses that are
passed slowly show friction itself. Half the sum is gravity only as far as both sides relax alike. Of friction that
differs between the directions half the difference is in it: all where a pose is passed, and where it is held as much of
it, from nothing to all, as brings the model nearest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.blas import single_threaded
from tauhat.dynamics.motion import Motion
from tauhat.errors import ModelError, RecordingError
from tauhat.estimation.confidence import student_quantile
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.friction import braking_parameters
from tauhat.estimation.rows import check_joints
from tauhat.recordings.findings import Finding
from tauhat.recordings.recording import Recording
from tauhat.robots.joint import Joint
from tauhat.verification.prediction import predict_recording
from tauhat.verification.stands import SAME, Stand, holds, passes

_RUN = 0.5  # [rad or m] on which the model's friction builds up before the pose
_SAMPLES = 200
_ERRORS = 2.0  # combined standard errors from which a difference is told
_NOTICEABLE = 0.05  # of the torque, from which it is told


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticPair:
    """One joint in one pose, reached from both sides.

    gravity, gravity_error, model_gravity, model_gravity_error : half the sum, with standard errors [Nm or N]
    friction, friction_error, model_friction, model_friction_error : half the difference, likewise
    position : of the joint [rad or m]
    speed : of the approaches [rad/s or m/s]
    held : whether the pose was held, and not only passed slowly
    """

    joint: int
    position: float
    speed: float
    held: bool
    gravity: float
    gravity_error: float
    model_gravity: float
    model_gravity_error: float
    friction: float
    friction_error: float
    model_friction: float
    model_friction_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticJoint:
    """Means over the poses of one joint, and the differences from the model with half of their 95 % intervals.

    gravity_rms : of the measured gravity [Nm or N]
    gravity_difference, gravity_half : measured less model [Nm or N]
    held : whether the poses were held: `friction` is then a lower bound
    friction, model_friction, friction_half : means [Nm or N]
    """

    name: str
    unit: str
    poses: int
    held: bool = True
    gravity_rms: float = 0.0
    gravity_difference: float = 0.0
    gravity_half: float = 0.0
    friction: float = 0.0
    model_friction: float = 0.0
    friction_half: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticCheck:
    """What poses reached from both sides say about gravity and friction of a model."""

    joints: tuple[StaticJoint, ...]
    pairs: tuple[StaticPair, ...]
    findings: tuple[Finding, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {name: [asdict(item) for item in getattr(self, name)] for name in ("joints", "pairs", "findings")}


@single_threaded
def static_check(estimate: Estimate, recordings: Sequence[Recording]) -> StaticCheck:
    """Return how gravity and friction of the model compare with the torque in poses reached from both sides.

    Poses that were held count, and those that one joint passed slowly both ways while the others stood.

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when there is no recording.
    """
    if not recordings:
        raise ModelError("no recording to look for held poses in")
    pairs: list[StaticPair] = []
    for recording in recordings:
        check_joints(estimate.model, recording)
        if recording.tau is None:
            raise RecordingError("no torque in the log", where=recording.name, got=", ".join(recording.channels()))
        held = list(_pairs(estimate, list(holds(recording, recording.tau)), held=True))
        log = predict_recording(estimate, recording, processing=estimate.processing)
        pairs += held or _pairs(estimate, list(passes(log)), held=False)
    quantile = student_quantile(estimate.degrees)
    joints = [
        _joint(joint, [pair for pair in pairs if pair.joint == index], quantile)
        for index, joint in enumerate(estimate.robot.joints)
    ]
    return StaticCheck(joints=tuple(joints), pairs=tuple(pairs), findings=tuple(_findings(joints)))


def _pairs(estimate: Estimate, stands: Sequence[Stand], *, held: bool) -> Iterator[StaticPair]:
    for group in _groups(stands):
        for joint in range(estimate.robot.n_v):
            sides = [[stand for stand in group if stand.side[joint] == sign] for sign in (1.0, -1.0)]
            if all(sides):
                yield _pair(estimate, (sides[0], sides[1]), joint, held=held)


def _groups(stands: Sequence[Stand]) -> list[list[Stand]]:
    """Return the stands by pose: each joins the first group whose first pose is the same."""
    groups: list[list[Stand]] = []
    for stand in stands:
        near = (group for group in groups if np.abs(group[0].q - stand.q).max() < SAME)
        group: list[Stand] = next(near, [])
        if not group:
            groups.append(group)
        group.append(stand)
    return groups


def _pair(estimate: Estimate, sides: tuple[list[Stand], list[Stand]], joint: int, *, held: bool) -> StaticPair:
    both = [*sides[0], *sides[1]]
    pose = np.mean([stand.q for stand in both], axis=0)
    speed = float(np.mean([stand.speed[joint] for stand in both]))
    up, down = (float(np.mean([stand.tau[joint] for stand in side])) for side in sides)
    spreads = [float(np.linalg.norm([stand.error[joint] for stand in side])) / len(side) for side in sides]
    error = 0.5 * float(np.linalg.norm(spreads))
    gravity, leaning, friction = _model_rows(estimate, pose, joint, speed)
    left = (
        _left(0.5 * (up + down) - float(gravity @ estimate.values), float(leaning @ estimate.values)) if held else 1.0
    )
    gravity = gravity + left * leaning
    return StaticPair(
        joint=joint, position=float(pose[joint]), speed=speed, held=held,
        gravity=0.5 * (up + down), gravity_error=error,
        model_gravity=float(gravity @ estimate.values), model_gravity_error=_deviation(estimate, gravity),
        friction=0.5 * (up - down), friction_error=error,
        model_friction=float(friction @ estimate.values), model_friction_error=_deviation(estimate, friction),
    )  # fmt: skip


def _deviation(estimate: Estimate, row: FloatArray) -> float:
    return float(np.sqrt(max(float(row @ estimate.covariance @ row), 0.0)))


def _left(difference: float, leaning: float) -> float:
    """Return which part of friction's half sum, 0 to 1, brings the model nearest to a pose that is held."""
    return float(np.clip(difference / leaning, 0.0, 1.0)) if leaning else 0.0


def _model_rows(
    estimate: Estimate, pose: FloatArray, joint: int, speed: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rows (n_b,) for the parameters: gravity in the pose, half of friction's sum and half of its difference."""
    brakes = braking_parameters(estimate.model)[estimate.base.independent]
    up, down = (_arriving(estimate, pose, joint, sign * speed) for sign in (1.0, -1.0))
    mean, friction = 0.5 * (up + down), np.where(brakes, 0.5 * (up - down), 0.0)
    return np.where(brakes, 0.0, mean), np.where(brakes, mean, 0.0), friction


def _arriving(estimate: Estimate, pose: FloatArray, joint: int, speed: float) -> FloatArray:
    """Return the joint's regressor row (n_b,) at the end of a steady way to the pose."""
    model, base = estimate.model, estimate.base
    q = np.tile(pose[:, None], (1, _SAMPLES))
    q[joint] += np.sign(speed) * np.linspace(-_RUN, 0.0, _SAMPLES)
    dq = np.zeros_like(q)
    dq[joint] = speed
    layout = model.layout(base.independent)
    columns, _ = model.columns(Motion(q=q, dq=dq, ddq=np.zeros_like(q)), layout)
    part = layout.of_joint(joint)
    row = np.zeros(base.n_b)
    row[_places(base.independent, layout.parameters[part])] = columns[part, -1]
    return row


def _places(independent: IntArray, parameters: IntArray) -> IntArray:
    return np.asarray(np.searchsorted(independent, parameters), dtype=np.intp)


def _joint(joint: Joint, pairs: Sequence[StaticPair], quantile: float) -> StaticJoint:
    if not pairs:
        return StaticJoint(name=joint.name, unit=joint.effort_unit, poses=0)
    gravity = np.array([(pair.gravity, pair.model_gravity) for pair in pairs])
    friction = np.array([(pair.friction, pair.model_friction) for pair in pairs])
    return StaticJoint(
        name=joint.name, unit=joint.effort_unit, poses=len(pairs), held=any(pair.held for pair in pairs),
        gravity_rms=float(np.sqrt(np.mean(gravity[:, 0] ** 2))),
        gravity_difference=float(np.mean(gravity[:, 0] - gravity[:, 1])),
        gravity_half=quantile * _mean_deviation([(p.gravity_error, p.model_gravity_error) for p in pairs]),
        friction=float(friction[:, 0].mean()), model_friction=float(friction[:, 1].mean()),
        friction_half=quantile * _mean_deviation([(p.friction_error, p.model_friction_error) for p in pairs]),
    )  # fmt: skip


def _mean_deviation(errors: Sequence[tuple[float, float]]) -> float:
    """Return the standard error of a mean difference: measured errors are independent, the model's are the same."""
    measured, model = np.array(errors).T
    return float(np.hypot(np.sqrt(np.sum(measured**2)) / len(errors), model.mean()))


def _findings(joints: Sequence[StaticJoint]) -> Iterator[Finding]:
    if not any(joint.poses for joint in joints):
        yield Finding(
            code="static_none", severity="note", message="no pose was held or slowly passed from both sides",
            advice="record poses reached from below and from above; static_motion in Python makes such a motion",
        )  # fmt: skip
    for joint in joints:
        if not joint.poses:
            continue
        level = max(joint.gravity_rms, abs(joint.friction))
        gravity = abs(joint.gravity_difference)
        if gravity > joint.gravity_half and gravity > _NOTICEABLE * level:
            yield Finding(
                code="static_gravity", severity="warning", joint=joint.name, number=joint.gravity_difference,
                message=f"{joint.name}: measured gravity less the model's is {joint.gravity_difference:.3g} ± "
                f"{joint.gravity_half:.2g} {joint.unit}",
                advice="masses and centres of the links beyond, a payload, or the zero of the torque",
            )  # fmt: skip
        lacking = joint.friction - joint.model_friction
        size = max(lacking, 0.0) if joint.held else abs(lacking)
        if size > joint.friction_half and size > _NOTICEABLE * level:
            at_least = "at least " if joint.held else ""
            yield Finding(
                code="static_friction", severity="warning", joint=joint.name, number=lacking,
                message=f"{joint.name}: friction at low speed is {at_least}{joint.friction:.3g} {joint.unit}, "
                f"the model's {joint.model_friction:.3g} ± {joint.friction_half:.2g}",
                advice="fit on recordings with slow motion and reversals too; terms dahl and stribeck",
            )  # fmt: skip
