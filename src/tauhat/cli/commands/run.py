"""`tauhat run`: the whole way of one robot in one folder; what is up to date is not made again."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import JsonOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import FAILED, say, working

if TYPE_CHECKING:
    from tauhat.project import ProjectRun


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat run` takes."""

    project: Annotated[Path, typer.Argument(metavar="PROJECT", help="Project file, or its folder.", readable=False)] = (
        Path("project.toml")
    )
    new: Annotated[
        str | None,
        typer.Option("--new", metavar="ROBOT", help="Write a new project file for this robot.", show_default=False),
    ] = None
    until: Annotated[
        str | None, typer.Option("--until", metavar="STEP", help="Last step to make.", show_default="all")
    ] = None
    force: Annotated[
        list[str] | None,
        typer.Option("--force", metavar="STEP", help="Make this step anyway; may be repeated.", show_default=False),
    ] = None
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Tell what would be made, and why; make nothing.")] = False
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Go the whole way of one robot in one folder, from motion to report; run again, it goes on where it was."""
    if options.new is not None:
        _write_new(options, options.new)
        return
    from tauhat.project import load_project, plan_project, run_project

    project = load_project(options.project)
    forced = tuple(options.force or ())
    if options.dry_run:
        done = plan_project(project, until=options.until, forced=forced)
    else:
        with working(f"making {project.file}"):
            done = run_project(project, until=options.until, forced=forced, tell=lambda step: say("run", step))
    document = {"project": str(project.file), **done.to_dict(), "logs": _errors(done)}
    _show(document, done, options)
    if done.awaited and not options.dry_run:
        raise typer.Exit(FAILED)


def _write_new(options: Options, robot: str) -> None:
    from tauhat.project import write_new_project

    path = write_new_project(options.project, robot)
    text = f"Written: {path}\nNext: tauhat run {path}"
    show({"project": str(path)}, lambda: [unbroken(text)], as_json=options.as_json)


def _show(document: dict[str, Any], done: ProjectRun, options: Options) -> None:
    from tauhat.cli.views.project import project_view

    show(document, lambda: project_view(document), as_json=options.as_json)
    if done.awaited:
        files = ", ".join(str(path) for path in done.awaited)
        say("waiting", f"not there yet: {files}; {_advice(done)}, and run again")


def _advice(done: ProjectRun) -> str:
    written = next((name for step in done.steps for name in step.outputs if name.endswith("RECORD.md")), None)
    return f"{done.folder / written} says how to record" if written else "bring the logs"


def _errors(done: ProjectRun) -> list[dict[str, Any]]:
    """Return the prediction errors, where they are up to date."""
    report = next((step for step in done.steps if step.name == "verify"), None)
    if report is None or report.state not in {"kept", "made"}:
        return []
    verified = json.loads((done.folder / report.outputs[0]).read_text(encoding="utf-8"))
    return [{key: log[key] for key in ("log", "relative_rms", "rms", "r2")} for log in verified["logs"]]
