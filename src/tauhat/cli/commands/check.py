"""`tauhat check`: what is wrong or doubtful in a log, and what to do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import TERM_NAMES, JsonOption, LockOption, LogArguments, MapOption, ModelOption, RowsOption
from tauhat.cli.output import show
from tauhat.cli.reporting import FAILED, working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.cli.health import CheckedLog


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat check` takes."""

    logs: LogArguments
    map_file: MapOption = None
    rows: RowsOption = None
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", metavar="ROBOT", help="Also check against this robot's limits and torque.", show_default=False
        ),
    ] = None
    model: ModelOption = TERM_NAMES
    lock: LockOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Say in plain words what is wrong or doubtful in logs; exit status 1 when one cannot be used."""
    from tauhat.cli.health import checked_log
    from tauhat.dynamics.model import known_terms
    from tauhat.recordings.reading import read_log
    from tauhat.robots.library import load_robot

    if options.lock and not options.robot:
        raise typer.BadParameter("needs --robot, whose joints it locks", param_hint="'--lock'")
    robot = load_robot(options.robot, locked=options.lock) if options.robot else None
    known_terms(options.model)
    with working("checking"):
        logs = [read_log(path, map=options.map_file, rows=options.rows) for path in options.logs]
        checked = [checked_log(log, robot=robot, terms=options.model) for log in logs]
    show({"logs": [_document(log) for log in checked]}, lambda: _view(checked), as_json=options.as_json)
    if not all(log.usable for log in checked):
        raise typer.Exit(FAILED)


def _document(checked: CheckedLog) -> dict[str, Any]:
    log = checked.log
    return {
        "log": log.name,
        "usable": checked.usable,
        "samples": log.n_t,
        "joints": list(log.joint_names),
        "signals": list(log.signals()),
        "findings": [asdict(finding) for finding in checked.findings],
    }


def _view(checked: Sequence[CheckedLog]) -> Iterator[RenderableType]:
    from rich.text import Text

    from tauhat.cli.views.findings import findings_view

    for item in checked:
        log = item.log
        signals = ", ".join(log.signals())
        joints = "one joint" if log.n_v == 1 else f"{log.n_v} joints"
        yield Text.assemble((log.path, "bold"), f": {log.n_t} samples, {joints}, {signals}")
        yield findings_view(item.findings)
        yield Text.assemble(_verdict(item), "\n")


def _verdict(checked: CheckedLog) -> tuple[str, str]:
    """Return words and style."""
    doubts = sum(finding.severity == "warning" for finding in checked.findings)
    if not checked.usable:
        return "The log cannot be used as it is.", "bold red"
    if doubts:
        return f"The log can be used; mind the {'warning' if doubts == 1 else f'{doubts} warnings'} above.", "yellow"
    return "The log can be used.", "green"
