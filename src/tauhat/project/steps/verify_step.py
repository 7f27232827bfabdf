"""Steps `verify` and `report`: the error on logs that were not fitted, and the page about all of it."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial

from tauhat.excitation.motion_file import motion_for
from tauhat.project.settings import labelled
from tauhat.project.step import Step
from tauhat.project.steps.workplace import ESTIMATE, REPORT, VERIFICATION, Workplace
from tauhat.recordings.findings import Finding
from tauhat.recordings.log import Log
from tauhat.report.page import write_report
from tauhat.verification.checked_log import checked_log
from tauhat.verification.prediction import Verification, verify


def verify_step(place: Workplace) -> Step:
    """Return the step that leaves the prediction errors."""
    given = place.project.verify
    return Step(
        name="verify",
        settings=place.settings_of_logs("verify", given),
        files=place.files_of_logs(given),
        awaited=place.awaited(given),
        reads=(ESTIMATE, *place.unseen_log),
        outputs=(VERIFICATION,),
        make=partial(_verify, place),
    )


def report_step(place: Workplace) -> Step:
    """Return the step that leaves the page."""
    given = place.project.verify
    return Step(
        name="report",
        settings=labelled("report", place.project.report) | place.settings_of_logs("verify", given),
        files=place.files_of_logs(given),
        awaited=place.awaited(given),
        reads=(ESTIMATE, *place.motions, *(() if given is None else place.unseen_log)),
        outputs=(REPORT,),
        make=partial(_report, place),
    )


def _verify(place: Workplace) -> None:
    verification, findings = _verified(place)
    told = {log: [asdict(finding) for finding in found] for log, found in findings.items()}
    place.write(VERIFICATION, {**verification.to_dict(), "findings": told})


def _verified(place: Workplace) -> tuple[Verification, dict[str, tuple[Finding, ...]]]:
    """Return the prediction of the unseen logs, and what checks say about them."""
    estimate = place.estimate()
    logs = place.unseen_logs(estimate)
    terms = [term.key for term in estimate.model.terms]

    def found(log: Log) -> tuple[Finding, ...]:
        return checked_log(log, robot=estimate.robot, terms=terms).findings

    findings = {log.name: found(log) for log in logs}
    return verify(estimate, [log.recording() for log in logs], processing=estimate.processing), findings


def _report(place: Workplace) -> None:
    estimate, title = place.estimate(), place.project.report.title or None
    motion = motion_for(estimate.robot, place.path(place.motions[0])) if place.motions else None
    verification, findings = (None, None) if place.project.verify is None else _verified(place)
    write_report(place.path(REPORT), estimate, verification=verification, findings=findings, motion=motion, title=title)
