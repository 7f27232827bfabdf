"""The report: one HTML file that carries everything it shows."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from tauhat.errors import MissingExtraError
from tauhat.estimation.estimate import Estimate
from tauhat.excitation.information import Information, information, with_exact_sign
from tauhat.excitation.limits import MotionLimits
from tauhat.excitation.trajectory import Trajectory
from tauhat.files import write_text
from tauhat.recordings.findings import Finding
from tauhat.robots.robot import Robot
from tauhat.studies.comparison import Comparison
from tauhat.verification.prediction import Verification

if TYPE_CHECKING:
    from tauhat.report.case import Section

Findings: TypeAlias = Sequence[Finding] | Mapping[str, Sequence[Finding]]


def write_report(
    path: str | Path,
    estimate: Estimate,
    *,
    verification: Verification | None = None,
    findings: Findings | None = None,
    motion: Trajectory | None = None,
    title: str | None = None,
) -> Path:
    """Write a self-contained HTML report about an estimate and return its path; the file appears whole or not at all.

    Parameters
    ----------
    verification : predictions to draw, and effects that residuals hold where they were searched; without them the
        report shows the fit's figures alone
    findings : what checks of the logs said, all together or by the name of the log; None when none was made
    motion : that the logs were made with; adds chapters on its limits and on what it identifies
    title : heading; the robot's name by default

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    ExcitationError
        when the motion leaves a parameter without excitation.
    OutputError
        when the file cannot be written.
    """
    require_libraries()
    from tauhat.report.case import Case
    from tauhat.report.motion_case import motion_case
    from tauhat.report.sections import MOTION_SECTIONS, SECTIONS, missing

    case = Case(estimate=estimate, verification=verification, findings=_by_log(findings))
    sections = [section(case) for section in SECTIONS if section is not missing or case.residuals]
    if motion is not None:
        moved = motion_case(estimate.robot, motion, counted=information(with_exact_sign(estimate.model)))
        sections += [section(moved) for section in MOTION_SECTIONS]
    heading = title or f"{estimate.robot.name}: identified torque model"
    return write_page(path, sections, title=heading, version=estimate.version)


def write_motion_report(
    path: str | Path,
    robot: Robot,
    trajectory: Trajectory,
    *,
    counted: Information | None = None,
    limits: MotionLimits | None = None,
    margins: Mapping[str, float] | None = None,
) -> Path:
    """Write a self-contained HTML page about a motion and return its path: its limits, and what it identifies.

    Parameters
    ----------
    counted : columns that are judged; those of the plain terms by default
    limits : of the joints; the robot's own by default
    margins : unused parts of all limits, further ones too, as `Design.margins` has them

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    require_libraries()
    from tauhat.report.motion_case import motion_case
    from tauhat.report.sections import MOTION_SECTIONS

    case = motion_case(robot, trajectory, counted=counted, limits=limits, margins=margins)
    sections = [section(case) for section in MOTION_SECTIONS]
    return write_page(path, sections, title=f"{robot.name}: designed motion")


def write_comparison(path: str | Path, comparison: Comparison, *, title: str) -> Path:
    """Write a self-contained HTML page that shows models and estimators beside each other, and return its path.

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    require_libraries()
    from tauhat.report.sections.comparison import comparison as section

    return write_page(path, [section(comparison)], title=title)


def _by_log(findings: Findings | None) -> tuple[tuple[str, tuple[Finding, ...]], ...] | None:
    if findings is None:
        return None
    if isinstance(findings, Mapping):
        return tuple((log, tuple(found)) for log, found in findings.items())
    return (("", tuple(findings)),)


def require_libraries() -> None:
    """Refuse to go on without what pages are made with."""
    for library in ("plotly", "jinja2"):
        try:
            importlib.import_module(library)
        except ImportError as error:
            raise MissingExtraError(library, "report") from error


def write_page(path: str | Path, sections: Sequence[Section], *, title: str, version: str | None = None) -> Path:
    """Write a page of sections, their drawings' data, styles and scripts, whole or not at all; return its path.

    Parameters
    ----------
    version : of the library that made what is shown; this one by default

    Raises
    ------
    OutputError
        when the file cannot be written.
    """
    from tauhat import __version__

    write_text(path, _page(sections, title=title, version=version or __version__))
    return Path(path)


def _page(sections: Sequence[Section], *, title: str, version: str) -> str:
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    from tauhat.report.rendering import rendered, script_json

    plots = [plot for section in sections for plot in section.plots]
    return rendered(
        "report.html.j2",
        title=title,
        sections=sections,
        data=[(plot.key, script_json(plot.json)) for plot in plots],
        plotly=Markup(get_plotlyjs()),  # noqa: S704 - the library's own source
        version=version,
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )
