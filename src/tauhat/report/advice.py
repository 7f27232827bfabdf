"""What to try next, read off the errors: each rule looks at one thing and says nothing when it is fine."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.estimation.identify import DOUBTFUL_CONDITION
from tauhat.report.case import Case, pooled_relative_rms
from tauhat.report.formatting import percent
from tauhat.report.grading import GRADES
from tauhat.report.uncertainty import relative_halves
from tauhat.verification.prediction import JointError, LogPrediction

_NOTICEABLE = GRADES[1].below  # joints better than this need no advice
_OVERFITTED = 2.0  # unseen error over fit error
_CONCENTRATED = 1.6  # error in some part of the motion over the error elsewhere
_MODERATE = 0.1  # of the top speed, where friction is looked at
_STANDARD_ERRORS = 3.0  # by which it must be negative
_MOSTLY_CONSTANT = 0.7  # mean error over rms error


def next_steps(case: Case) -> tuple[str, ...]:
    """Return advice in the order in which it should be followed; at least one sentence."""
    rules = (_sign, _motion, _proof, _transfer, _worst_joint, _uncertain)
    steps = tuple(step for step in (rule(case) for rule in rules) if step)
    return steps or ("Nothing stands out. Verify once more on a motion of the task the model is for.",)


def worst_joint(logs: tuple[LogPrediction, ...]) -> tuple[LogPrediction, int] | None:
    """Return the log and the index of the joint with the largest relative error, None without logs."""
    pairs = [
        (log, joint) for log in logs for joint in range(len(log.joints)) if np.isfinite(log.joints[joint].relative_rms)
    ]
    return max(pairs, key=lambda pair: pair[0].joints[pair[1]].relative_rms, default=None)


def _sign(case: Case) -> str:
    estimate = case.estimate
    limits = estimate.robot.velocity_limit
    friction = estimate.friction(_MODERATE * np.where(np.isfinite(limits) & (limits > 0.0), limits, 1.0))
    surely_negative = friction.torque < -_STANDARD_ERRORS * friction.standard_errors
    if not surely_negative.any():
        return ""
    names = ", ".join(estimate.robot.joint_names[joint] for joint in np.flatnonzero(surely_negative))
    return f"Check the sign of the torque of {names}: friction comes out negative, which no gear does."


def _motion(case: Case) -> str:
    estimate = case.estimate
    if estimate.rank < estimate.n_fitted:
        return (
            f"Record a richer motion: this one determines only {estimate.rank} of {estimate.base.n_b} parameters. "
            "Move all joints at once, over more of their range, at different speeds."
        )
    if estimate.condition > DOUBTFUL_CONDITION:
        return (
            f"Record a richer motion, or add recordings: a condition number of {estimate.condition:.3g} means that "
            "the model may be far off on other motions."
        )
    return ""


def _proof(case: Case) -> str:
    if not case.logs:
        return "Verify the model on a recording that it was not fitted to (tauhat verify): the fit alone proves little."
    if not case.unseen:
        return (
            "Verify on a recording of another motion: the ones shown here bear the names of the ones that were fitted."
        )
    return ""


def _transfer(case: Case) -> str:
    if not case.unseen:
        return ""
    fit, unseen = case.estimate.relative_rms, pooled_relative_rms(case.unseen)
    if not unseen > max(_OVERFITTED * fit, GRADES[0].below):
        return ""
    return (
        f"The error on unseen motion ({percent(unseen)}) is {unseen / fit:.1f} times that of the fit ({percent(fit)}): "
        "fit on more than one kind of motion, and check that payload, mounting and temperature were the same."
    )


def _worst_joint(case: Case) -> str:
    """Say where to look; where the motion is too weak, the pattern of the error means nothing."""
    worst = worst_joint(case.unseen or case.logs)
    if _motion(case) or worst is None or worst[0].joints[worst[1]].relative_rms < _NOTICEABLE:
        return ""
    log, joint = worst
    facts = log.joints[joint]
    error = log.tau[:, joint] - log.predicted[:, joint]
    cause = _constant(facts, error) or _at_low_speed(facts) or _at_high_speed(facts) or _drifting(facts)
    return f"Look at {facts.name} in {log.log} first. {cause}" if cause else f"Look at {facts.name} in {log.log} first."


def _constant(facts: JointError, error: FloatArray) -> str:
    mean = float(error.mean())
    if abs(mean) < _MOSTLY_CONSTANT * facts.rms:
        return ""
    return (
        f"Its error is nearly constant ({mean:+.3g} {facts.unit}): the zero of the torque or current has moved, "
        "or the load is not the same as in the fit."
    )


def _at_low_speed(facts: JointError) -> str:
    rms = np.array(facts.by_speed)
    rest = rms[1:][np.isfinite(rms[1:])]
    if not (rest.size and rms[0] > _CONCENTRATED * np.median(rest)):
        return ""
    return "Its error is largest near standstill: this friction model does not capture what happens around a reversal."


def _at_high_speed(facts: JointError) -> str:
    rms = np.array(facts.by_speed)
    rms = rms[np.isfinite(rms)]
    if not (rms.size > 4 and rms[-2:].mean() > _CONCENTRATED * np.median(rms[:-2])):
        return ""
    return (
        "Its error grows with speed: suspect a delay between torque and motion, or friction that is curved over speed."
    )


def _drifting(facts: JointError) -> str:
    rms = np.array(facts.by_time)
    if not (rms.size > 5 and rms[-3:].mean() > _CONCENTRATED * rms[:3].mean()):
        return ""
    return "Its error grows over the recording: friction changes as the gear warms up, or the torque sensor drifts."


def _uncertain(case: Case) -> str:
    n_b = case.estimate.base.n_b
    unknown = int((relative_halves(case.estimate) >= 1).sum())
    if 2 * unknown <= n_b:
        return ""
    return (
        f"{unknown} of {n_b} parameters are not told apart from zero. Torque prediction can still be "
        "right; do not read these values as properties of the robot. Where they are needed, record a motion that is "
        "designed to excite them."
    )
