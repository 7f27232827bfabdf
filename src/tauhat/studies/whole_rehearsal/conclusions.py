"""What a whole rehearsal comes to, in sentences that are computed from its figures."""

from __future__ import annotations

import numpy as np

from tauhat.studies.study import Chapter, Table
from tauhat.studies.whole_rehearsal.findings import JUDGED, Findings
from tauhat.studies.whole_rehearsal.scene import UNSEEN

_BETTER = 0.95  # of another error, below which one is called smaller


def summary_of(found: Findings) -> str:
    """Return the answer in a few sentences."""
    robot, fitted = found.scene.robot.name, found.scene.motions["designed"]
    identified, nominal = (found.tracked(f"feedforward, {name}") for name in ("identified", "nominal"))
    first = found.budget.shares[0]
    return (
        f"{robot}, identified from {fitted.duration:.3g} s of motion: its torque on unseen motions of other kinds is "
        f"off by {100 * found.pooled.final:.3g} %, its tracking error with the identified feedforward is "
        f"{100 * identified / nominal:.3g} % of that with the description's, and a payload of "
        f"{found.scene.payload.mass:g} kg is found as {found.payload.numbers[0].found:.4g} kg. With joints "
        f"{found.budget_settings.warmer:g} K warmer, the largest cause of error is {first.title} "
        f"({100 * first.share:.0f} %)."
    )


def conclusions(found: Findings) -> Chapter:
    """Return one line for every proof, with its number and what it means."""
    rows = (_torque(found), _terms(found), _bands(found), _motion(found), _gains(found), _rest(found), _weight(found))
    table = Table(title="Every proof in a line", header=("question", "figure", "so"), rows=(*rows, _cause(found)))
    text = ("Every sentence and number on this page is computed from this one run; the chapters show where from.",)
    return Chapter(title="Conclusions", text=text, tables=(table,))


def _torque(found: Findings) -> tuple[str, str, str]:
    errors = [found.models.log(name).relative_rms for name in UNSEEN]
    truths = [truth.relative_rms for truth in found.models.final_truth]
    figure = f"{_range(errors)} % against the logs, {_range(truths)} % against the true torque"
    hidden = np.median(truths) > np.median(errors) / _BETTER
    so = "part of the error is one that no log of this robot shows" if hidden else "the logs show what there is"
    return "Does it predict the torque of unseen motions?", figure, so


def _terms(found: Findings) -> tuple[str, str, str]:
    question, both, models = "Do the residuals name what is missing?", found.pooled, found.models
    if not models.added:
        figure = ", ".join(models.named) or "no missing term named"
        so = f"not taken: {models.failure}" if models.failure else "the terms stay as they were"
        return question, figure, so
    figure = (
        f"{', '.join(models.added)}: error on {' and '.join(JUDGED)} {_percent(both.first)} to {_percent(both.final)} %"
    )
    if both.final < _BETTER * both.first:
        return question, figure, "worth it, also where it was not searched"
    return question, figure, "not worth it" if both.final <= both.first / _BETTER else "made it worse: leave it out"


def _bands(found: Findings) -> tuple[str, str, str]:
    covered = [joint.band.covered for name in UNSEEN for joint in found.models.log(name).joints]
    low = sum(share < 0.9 for share in covered)
    figure = f"median {100 * float(np.median(covered)):.0f} %, least {100 * min(covered):.0f} % of the samples"
    so = f"too narrow in {low} of {len(covered)} cases" if low else "they hold on every joint and motion"
    return "Do the 95 % bands hold?", figure, so


def _motion(found: Findings) -> tuple[str, str, str]:
    none, nominal, identified = (
        1e3 * found.tracked(name) for name in ("PD", "feedforward, nominal", "feedforward, identified")
    )
    bend = 1e3 * float(np.linalg.norm(found.bend))
    figure = f"{none:.3g} without a model, {nominal:.3g} nominal, {identified:.3g} identified (1e-3 rad or m)"
    if not identified < _BETTER * nominal:
        return "Does it make the robot follow better?", figure, "no better than the description"
    so = f"yes; the bending of the joints, {bend:.3g}, is seen by no controller here" if bend > 0.0 else "yes"
    return "Does it make the robot follow better?", figure, so


def _gains(found: Findings) -> tuple[str, str, str]:
    gone, trials = found.tuning.improvement, found.tuning.costs.size
    figure = f"{100 * gone:.3g} % of the error gone after {trials} trials, on an unseen motion"
    return "Are tuned gains better than those set by hand?", figure, "yes" if gone > 1.0 - _BETTER else "not in so few"


def _rest(found: Findings) -> tuple[str, str, str]:
    joints = [joint for joint in found.static.joints if joint.poses]
    question = "Does it agree with the robot at rest?"
    if not joints:
        return question, "no pose was held from both sides", "not answered"
    worst = max(abs(joint.gravity_difference) / max(joint.gravity_rms, abs(joint.friction)) for joint in joints)
    inside = sum(abs(joint.gravity_difference) <= joint.gravity_half for joint in joints)
    figure = f"gravity inside its interval on {inside} of {len(joints)} joints, at most {100 * worst:.2g} % off"
    told = [finding for finding in found.static.findings if finding.severity == "warning"]
    return (
        question,
        figure,
        f"worth looking at: {len(told)}, see chapter 8" if told else "no difference worth looking at",
    )


def _weight(found: Findings) -> tuple[str, str, str]:
    mass = found.payload.numbers[0]
    figure = f"{mass.found:.4g} ± {mass.half:.2g} kg of {mass.known:g} kg"
    so = "yes" if mass.inside else "outside its interval, which knows no wrong torque constant: calibrate the drives"
    return "Does it weigh what was weighed?", figure, so


def _cause(found: Findings) -> tuple[str, str, str]:
    first, budget = found.budget.shares[0], found.budget
    errors = f"{_percent(budget.error)} % with it, {_percent(first.error_without)} % without"
    figure = f"{first.title}: {100 * first.share:.0f} %; {errors}"
    return "What makes most of the error?", figure, first.advice


def _range(errors: list[float]) -> str:
    return f"{_percent(min(errors))} to {_percent(max(errors))}"


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.3g}"
