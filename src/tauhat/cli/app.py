"""The `tauhat` command: one sub-command per step of the work."""

from __future__ import annotations

import signal
import sys
from typing import Annotated

import typer

import tauhat
from tauhat.cli.adapter import as_command
from tauhat.cli.commands import (
    budget,
    calibrate_drives,
    check,
    compare,
    demo,
    excite,
    export,
    identify,
    inspect,
    payload,
    record,
    rehearse,
    report,
    robots,
    run,
    sense,
    serve,
    simulate,
    study,
    verify,
    view,
)
from tauhat.cli.reporting import ReportingGroup
from tauhat.cli.standard_streams import usable

app = typer.Typer(
    name="tauhat",
    cls=ReportingGroup,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo")(as_command(demo.run, demo.Options))
app.command("run")(as_command(run.run, run.Options))
app.command("robots")(as_command(robots.run, robots.Options))
app.command("inspect")(as_command(inspect.run, inspect.Options))
app.command("check")(as_command(check.run, check.Options))
app.command("excite")(as_command(excite.run, excite.Options))
app.command("record")(as_command(record.run, record.Options))
app.command("simulate")(as_command(simulate.run, simulate.Options))
app.command("rehearse")(as_command(rehearse.run, rehearse.Options))
app.command("budget")(as_command(budget.run, budget.Options))
app.command("identify")(as_command(identify.run, identify.Options))
app.command("verify")(as_command(verify.run, verify.Options))
app.command("payload")(as_command(payload.run, payload.Options))
app.command("calibrate-drives")(as_command(calibrate_drives.run, calibrate_drives.Options))
app.command("sense")(as_command(sense.run, sense.Options))
app.command("serve")(as_command(serve.run, serve.Options))
app.command("compare")(as_command(compare.run, compare.Options))
app.command("study")(as_command(study.run, study.Options))
app.command("report")(as_command(report.run, report.Options))
app.command("export")(as_command(export.run, export.Options))
app.command("view")(as_command(view.run, view.Options))


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tauhat {tauhat.__version__}")
        raise typer.Exit


@app.callback()
def tauhat_command(
    *,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """From a robot description and joint logs to a verified torque model.

    New here? `tauhat demo` goes the whole way on a simulated arm in under a minute. With a log of your own:
    `tauhat check LOG`, then `identify ROBOT LOG -o ESTIMATE.json`, then `verify` and `report` on another log.
    """


def _leave(number: int, _: object) -> None:
    raise SystemExit(128 + number)  # unwinds, so that a file half-written is removed


def main() -> None:
    """Run the command line; characters that the terminal cannot show are replaced."""
    signal.signal(signal.SIGTERM, _leave)
    sys.stdout, sys.stderr = usable(sys.stdout), usable(sys.stderr)
    app()
