"""`tauhat report`: one HTML file about an estimate and the recordings it was verified on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import CutoffOption, EstimateArgument, JsonOption, MapOption, MotionOption, RowsOption, page
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from tauhat.estimation.estimate import Estimate
    from tauhat.recordings.findings import Finding
    from tauhat.verification.prediction import Verification
    from tauhat.verification.residual_tests import LogResiduals


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat report` takes."""

    estimate: EstimateArgument
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="REPORT.html", parser=page, help="File to write.", show_default=False),
    ]
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="LOG", help="Recordings to verify on and to draw.", show_default=False, readable=False),
    ] = None
    map_file: MapOption = None
    cutoff: CutoffOption = None
    rows: RowsOption = None
    motion: MotionOption = None
    residuals: Annotated[
        bool, typer.Option("--residuals", help="Search the residuals for effects that the model does not have.")
    ] = False
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Write a self-contained HTML report: health of the logs, prediction, parameters with error bars."""
    from tauhat.cli.motions import motion_for
    from tauhat.estimation.estimate import load_estimate
    from tauhat.files import check_output
    from tauhat.report.page import write_report

    if options.residuals and not options.logs:
        raise typer.BadParameter("needs a LOG that was not fitted", param_hint="'--residuals'")
    estimate = load_estimate(options.estimate)
    given = [options.estimate, *(options.logs or ()), *([options.motion] if options.motion else ())]
    check_output(options.output, inputs=given)
    motion = None if options.motion is None else motion_for(estimate.robot, options.motion)
    with working("checking and predicting"):
        verification, findings = _verified(estimate, options) if options.logs else (None, None)
        if verification is not None and options.residuals:
            verification = replace(verification, residuals=_missing(estimate, options))
    with working("drawing"):
        write_report(options.output, estimate, verification=verification, findings=findings, motion=motion)
    document = {
        "report": str(options.output),
        "robot": estimate.robot.name,
        "logs": verification.to_dict()["logs"] if verification else [],
    }
    show(document, lambda: [unbroken(f"Written: {options.output}")], as_json=options.as_json)


def _verified(estimate: Estimate, options: Options) -> tuple[Verification, tuple[Finding, ...]]:
    """Return the prediction of the logs and what checks say about them."""
    from tauhat.cli.health import checked_log
    from tauhat.cli.inputs import processing_of
    from tauhat.recordings.reading import read_log
    from tauhat.verification.prediction import verify

    logs = [read_log(path, map=options.map_file, rows=options.rows) for path in options.logs or ()]
    terms = [term.key for term in estimate.model.terms]
    checked = [checked_log(log, robot=estimate.robot, terms=terms) for log in logs]
    findings = [
        _named(finding, item.log.name if len(logs) > 1 else "") for item in checked for finding in item.findings
    ]
    processing = processing_of(estimate, cutoff=options.cutoff)
    verification = verify(estimate, [log.recording() for log in logs], processing=processing)
    return verification, tuple(findings)


def _missing(estimate: Estimate, options: Options) -> tuple[LogResiduals, ...]:
    """Return which effects the residuals of the logs still hold."""
    from tauhat.cli.inputs import processing_of, read_recordings
    from tauhat.verification.residual_tests import residual_tests

    recordings = read_recordings(options.logs or (), map_file=options.map_file, rows=options.rows)
    return residual_tests(estimate, recordings, processing=processing_of(estimate, cutoff=options.cutoff))


def _named(finding: Finding, log: str) -> Finding:
    """Return the finding with the name of its log, where there are several."""
    return replace(finding, message=f"{log}: {finding.message}") if log else finding
