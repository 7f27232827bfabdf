"""First chapter: how good the model is, in one line, one table and what to try next."""

from __future__ import annotations

from typing import NamedTuple

from tauhat.estimation.identify import DOUBTFUL_CONDITION
from tauhat.report.advice import next_steps, worst_joint
from tauhat.report.case import Case, Section, pooled_relative_rms
from tauhat.report.grading import GOOD_CONDITION, GRADES, Grade, condition_grade, grade_of
from tauhat.report.rendering import rendered


class Cell(NamedTuple):
    """One relative error of the table with its grade and the rms behind it."""

    relative: float
    rms: float
    unit: str
    grade: Grade


def verdict(case: Case) -> Section:
    """Return the verdict: headline, relative rms per joint and log, condition number, advice."""
    estimate = case.estimate
    shown = case.unseen or case.logs
    relative = pooled_relative_rms(shown) if shown else estimate.relative_rms
    html = rendered(
        "verdict.html.j2",
        grade=grade_of(relative),
        relative=relative,
        proof="unseen" if case.unseen else "seen" if case.logs else "fit",
        count=len(shown),
        worst=_worst(case),
        logs=[(log.log, case.was_fitted(log)) for log in case.logs],
        rows=_rows(case),
        overall=[grade_cell(estimate.relative_rms), *(grade_cell(log.relative_rms) for log in case.logs)],
        grades=GRADES,
        condition=estimate.condition,
        condition_grade=condition_grade(estimate.condition, full_rank=estimate.rank >= estimate.n_fitted),
        good_condition=GOOD_CONDITION,
        doubtful_condition=DOUBTFUL_CONDITION,
        rank=estimate.rank,
        n_b=estimate.base.n_b,
        steps=next_steps(case),
    )
    return Section(key="verdict", title="Verdict", html=html)


def grade_cell(relative: float, *, rms: float = float("nan"), unit: str = "") -> Cell:
    """Return a graded cell of the table."""
    return Cell(relative, rms, unit, grade_of(relative))


def _rows(case: Case) -> list[tuple[str, list[Cell]]]:
    estimate = case.estimate
    rows = []
    for k, joint in enumerate(estimate.robot.joints):
        rms, torque = float(estimate.joint_rms[k]), float(estimate.torque_rms[k])
        cells = [grade_cell(rms / torque if torque > 0 else float("inf"), rms=rms, unit=joint.effort_unit)]
        facts = [log.joints[k] for log in case.logs]
        cells += [grade_cell(fact.relative_rms, rms=fact.rms, unit=fact.unit) for fact in facts]
        rows.append((joint.name, cells))
    return rows


def _worst(case: Case) -> tuple[str, str, Cell] | None:
    worst = worst_joint(case.unseen or case.logs)
    if worst is None or case.estimate.robot.n_v == 1:
        return None
    log, joint = worst
    facts = log.joints[joint]
    return facts.name, log.log, grade_cell(facts.relative_rms, rms=facts.rms, unit=facts.unit)
