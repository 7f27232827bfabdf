"""What only a model can say about a log: torque sign, delay, motion too weak, units that cannot be right.

Each check returns findings in the words of `recordings.checks`; none of them changes the log.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.rigid_body import inverse_dynamics
from tauhat.errors import TauhatWarning
from tauhat.estimation.delay import position_delay
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import DOUBTFUL_CONDITION, identify
from tauhat.estimation.rows import check_joints
from tauhat.recordings.filters import filtered, low_pass
from tauhat.recordings.findings import Finding, Severity
from tauhat.recordings.processing import Processing, clock_step, stretches
from tauhat.recordings.recording import Recording
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot

LEAST_COHERENCE = 0.05  # of power: below minus this a joint seems to drive its own friction
WEAK_PARAMETER = 0.5  # relative standard error above which a parameter is not seen by the motion
_LARGEST_RATIO = 20.0  # measured over nominal torque beyond which units cannot be right
_LEAST_CORRELATION = 0.8  # with the nominal torque, for its size to say something about units
_WEAK_CONDITION = 100.0
_COMPENSATED = "`identify` compensates it by itself; to fix it, set `delay_samples` in the map's [position] section"
_LEFT_ALONE = "a filter in the drive does that; `identify` leaves it alone, `delay_samples` in the map shifts it"
_AXIS_TERMS = ("rotor", "viscous", "coulomb", "offset")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Look:
    """What the checks share: filtered motion and torque (n, n_v), and a fit of the model."""

    recording: Recording
    model: TorqueModel
    base: BaseParameters
    estimate: Estimate
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray


@single_threaded
def check_recording(model: TorqueModel, recording: Recording, *, cutoff: float | None = None) -> tuple[Finding, ...]:
    """Return what a torque model says about a log: sign, delay, excitation, units.

    Parameters
    ----------
    cutoff : low-pass [Hz]; chosen from the spectrum by default

    Raises
    ------
    RecordingError
        when the log does not fit the robot or has no torque.
    """
    look = _look(model, recording, cutoff)
    return (*_sign_findings(look), *_delay_findings(look), *_excitation_findings(look), *_unit_findings(look))


@single_threaded
def check_axes(recording: Recording, *, cutoff: float | None = None) -> tuple[Finding, ...]:
    """Return what can be said without a robot: torque sign by the power balance, delay where axes move by themselves.

    Every joint is taken for an axis of its own with inertia, friction and offset. That is the whole truth for a single
    drive; on an arm it still tells the sign, and a delay only where the other joints hardly matter.

    Raises
    ------
    RecordingError
        when the log has no torque.
    """
    look = _look(torque_model(_axes(recording), _AXIS_TERMS), recording, cutoff)
    signs = _sign_findings(look)
    if recording.n_v > 1:  # one joint alone may be driven by gravity, which these axes do not know
        signs = tuple(finding for finding in signs if finding.joint is None)
    return (*signs, *_delay_findings(look))


def _axes(recording: Recording) -> Robot:
    """Return slides side by side, one a joint, that gravity does not load."""
    still = np.zeros(3)
    joints = tuple(
        Joint(
            name=name,
            kind="prismatic",
            parent=-1,
            rotation=np.eye(3),
            translation=still,
            axis=np.array([1.0, 0.0, 0.0]),
        )
        for name in recording.joint_names
    )
    return Robot(name="axes", joints=joints)


def _look(model: TorqueModel, recording: Recording, cutoff: float | None) -> _Look:
    check_joints(model, recording)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        estimate = identify(model, [recording], cutoff=cutoff)
    pieces = list(stretches(recording, estimate.processing))
    low = low_pass(estimate.processing.cutoff, 1.0 / clock_step(recording))
    tau = filtered(np.concatenate([piece.tau for piece in pieces], axis=1), low)
    q, dq, ddq = (np.concatenate([getattr(piece, name) for piece in pieces], axis=1).T for name in ("q", "dq", "ddq"))
    return _Look(
        recording=recording, model=estimate.model, base=estimate.base, estimate=estimate, q=q, dq=dq, ddq=ddq, tau=tau.T
    )


def power_coherence(tau: FloatArray, dq: FloatArray) -> FloatArray:
    """Return `sum(tau dq) / sum(|tau dq|)` of each joint: the share of its power that friction eats, (n_v,).

    Over a motion that ends where it began, rigid dynamics give back what they took; what remains is friction, and
    positive. A clearly negative value means that the torque, or the position, is logged with the sign reversed.
    """
    power = tau * dq
    size = np.abs(power).sum(axis=0)
    return np.asarray(power.sum(axis=0) / np.where(size > 0, size, np.inf))


def _sign_findings(look: _Look) -> tuple[Finding, ...]:
    coherence = power_coherence(look.tau, look.dq)
    agreement = _nominal_agreement(look)
    driven = (coherence < -LEAST_COHERENCE) & (_friction_power(look) < 0) & (agreement < _LEAST_CORRELATION)
    reversed_joints = driven | (agreement < -_LEAST_CORRELATION)
    names = look.model.robot.joint_names
    if reversed_joints.all() or reversed_joints.sum() > max(1, len(names) // 2):
        listed = ", ".join(name for name, bad in zip(names, reversed_joints, strict=True) if bad)
        return (
            Finding(
                code="torque_sign",
                severity="error",
                number=float(coherence.mean()),
                message=f"the torque is logged with the sign reversed: friction seems to drive the motors on "
                f"{int(reversed_joints.sum())} of {len(names)} joints ({listed}; balance {coherence.mean():+.2f})",
                advice="set `sign = -1` in the map's [torque] section",
            ),
        )
    doubtful = tuple(
        Finding(
            code="torque_sign",
            severity="warning",
            joint=names[joint],
            number=float(coherence[joint]),
            message=f"{names[joint]}: {_sign_reason(coherence[joint], agreement[joint])}: torque or position of this "
            "joint may have the sign reversed",
            advice="compare with the sign of gravity at a held pose; `sign` in the map takes one value a joint",
        )
        for joint in np.flatnonzero(reversed_joints)
    )
    good = Finding(
        code="torque_sign",
        severity="ok",
        number=float(coherence.mean()),
        message=f"torque and motion have consistent signs (power balance {coherence.mean():+.2f})",
    )
    return doubtful or (good,)


def _sign_reason(coherence: float, agreement: float) -> str:
    if agreement < -_LEAST_CORRELATION:
        return f"torque runs against the nominal model's (correlation {agreement:+.2f})"
    return f"friction comes out negative (power balance {coherence:+.2f})"


def _nominal_torque(look: _Look) -> FloatArray | None:
    """Return the torque of the robot's nominal masses along the log, (n, n_v); None where they are unknown."""
    robot = look.model.robot
    if not robot.has_inertia or np.ptp(robot.inertia[:, 0]) == 0.0:
        return None
    return inverse_dynamics(robot, look.q, look.dq, look.ddq)


def _nominal_agreement(look: _Look) -> FloatArray:
    """Return each joint's correlation of measured with nominal torque, (n_v,); zero where nothing is known.

    A joint that gravity rules hides a reversed sign from the power balance, but not from this.
    """
    nominal = _nominal_torque(look)
    if nominal is None:
        return np.zeros(look.model.robot.n_v)
    spread = nominal.std(axis=0) * look.tau.std(axis=0)
    together = np.mean((nominal - nominal.mean(axis=0)) * (look.tau - look.tau.mean(axis=0)), axis=0)
    return np.asarray(together / np.where(spread > 0, spread, np.inf))


def _friction_power(look: _Look) -> FloatArray:
    """Return each joint's identified friction torque at its root mean square speed, (n_v,)."""
    speed = np.sqrt(np.mean(look.dq**2, axis=0))
    return look.estimate.friction(speed).torque


def _delay_findings(look: _Look) -> tuple[Finding, ...]:
    settings = look.estimate.processing
    plain = Processing(cutoff=settings.cutoff, motion_cutoff=settings.motion_cutoff)
    delay = position_delay(look.model, look.base, [look.recording], plain)
    if not delay.agreed:
        return (
            Finding(code="torque_delay", severity="ok", message="no delay between torque and position can be told"),
        )
    finding = Finding(
        code="torque_delay",
        severity="warning" if delay.certain else "note",
        number=delay.samples,
        message=f"{delay.words}: the residual falls by {100 * delay.drop:.0f} % when it is shifted",
        advice=_COMPENSATED if delay.certain else _LEFT_ALONE,
    )
    return (finding,)


def _excitation_findings(look: _Look) -> tuple[Finding, ...]:
    estimate = look.estimate
    weak = [row for row in estimate.summary() if row.relative > WEAK_PARAMETER]
    names = ", ".join(row.name for row in sorted(weak, key=lambda row: -row.relative)[:6])
    unseen = estimate.n_fitted - estimate.rank
    number = estimate.condition
    if unseen > 0 or number > DOUBTFUL_CONDITION:
        lost = f"{unseen} of {estimate.base.n_b} base parameters cannot be seen at all; " if unseen else ""
        return (
            Finding(
                code="excitation",
                severity="warning",
                number=number,
                message=f"the motion is too weak for this model: {lost}scaled condition number {number:.3g} "
                f"(doubtful above {DOUBTFUL_CONDITION:g}); least certain: {names or 'none'}",
                advice="record a motion that moves all joints together and fast, or ask for a smaller model (--model)",
            ),
        )
    severity: Severity = "note" if number > _WEAK_CONDITION else "ok"
    return (
        Finding(
            code="excitation",
            severity=severity,
            number=number,
            message=f"the motion supports the model: scaled condition number {number:.3g}, {len(weak)} of "
            f"{estimate.base.n_b} base parameters with more than {100 * WEAK_PARAMETER:.0f} % standard error",
        ),
    )


def _unit_findings(look: _Look) -> tuple[Finding, ...]:
    nominal = _nominal_torque(look)
    if nominal is None:
        return ()
    agreement = _nominal_agreement(look)
    findings = []
    for joint, name in enumerate(look.model.robot.joint_names):
        measured, expected = look.tau[:, joint], nominal[:, joint]
        if np.std(expected) == 0 or np.std(measured) == 0:
            continue
        ratio = float(np.std(measured) / np.std(expected))
        if abs(agreement[joint]) > _LEAST_CORRELATION and not 1.0 / _LARGEST_RATIO < ratio < _LARGEST_RATIO:
            findings.append(
                Finding(
                    code="torque_scale",
                    severity="warning",
                    joint=name,
                    number=ratio,
                    message=f"{name}: torque has the shape of the nominal model's but {ratio:.3g} times its size",
                    advice="is it motor side, in amperes or in counts? set `gain` in the map's [torque] section",
                )
            )
    return tuple(findings)
