"""What the checks of the logs found."""

from __future__ import annotations

from typing import NamedTuple

from tauhat.recordings.findings import SEVERITIES, Finding
from tauhat.report.case import Case, Section
from tauhat.report.rendering import rendered

_STYLES = {"ok": "good", "note": "note", "warning": "fair", "error": "poor"}


class Check(NamedTuple):
    """The findings on one log: what is to be looked at, gravest first, and what was found in order."""

    log: str
    doubtful: list[Finding]
    passed: list[Finding]


def health(case: Case) -> Section:
    """Return the findings log by log."""
    checks = [_check(log, found) for log, found in case.findings or ()]
    html = rendered("health.html.j2", checked=case.findings is not None, checks=checks, styles=_STYLES)
    return Section(key="health", title="Health of the logs", html=html)


def _check(log: str, findings: tuple[Finding, ...]) -> Check:
    gravest_first = sorted(findings, key=lambda finding: -SEVERITIES.index(finding.severity))
    return Check(
        log=log,
        doubtful=[finding for finding in gravest_first if finding.severity != "ok"],
        passed=[finding for finding in gravest_first if finding.severity == "ok"],
    )
