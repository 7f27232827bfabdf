"""The report: one HTML file that carries everything it shows."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from tauhat.errors import MissingExtraError
from tauhat.estimation.estimate import Estimate
from tauhat.files import write_text
from tauhat.recordings.findings import Finding
from tauhat.verification.prediction import Verification

if TYPE_CHECKING:
    from tauhat.report.case import Case

Findings: TypeAlias = Sequence[Finding] | Mapping[str, Sequence[Finding]]


def write_report(
    path: str | Path,
    estimate: Estimate,
    *,
    verification: Verification | None = None,
    findings: Findings | None = None,
    title: str | None = None,
) -> Path:
    """Write a self-contained HTML report about an estimate and return its path; the file appears whole or not at all.

    Parameters
    ----------
    verification : predictions to draw; without them the report shows the fit's figures alone
    findings : what checks of the logs said, all together or by the name of the log; None when none was made
    title : heading; the robot's name by default

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    for library in ("plotly", "jinja2"):
        _require(library)
    from tauhat.report.case import Case

    case = Case(estimate=estimate, verification=verification, findings=_by_log(findings))
    write_text(path, _page(case, title or f"{estimate.robot.name}: identified torque model"))
    return Path(path)


def _by_log(findings: Findings | None) -> tuple[tuple[str, tuple[Finding, ...]], ...] | None:
    if findings is None:
        return None
    if isinstance(findings, Mapping):
        return tuple((log, tuple(found)) for log, found in findings.items())
    return (("", tuple(findings)),)


def _require(library: str) -> None:
    try:
        importlib.import_module(library)
    except ImportError as error:
        raise MissingExtraError(library, "report") from error


def _page(case: Case, title: str) -> str:
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    from tauhat.report.rendering import rendered, script_json
    from tauhat.report.sections import SECTIONS

    sections = [section(case) for section in SECTIONS]
    plots = [plot for section in sections for plot in section.plots]
    return rendered(
        "report.html.j2",
        title=title,
        sections=sections,
        data=[(plot.key, script_json(plot.json)) for plot in plots],
        plotly=Markup(get_plotlyjs()),  # noqa: S704 - the library's own source
        version=case.estimate.version,
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )
