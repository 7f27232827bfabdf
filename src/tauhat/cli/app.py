"""The `tauhat` command: one sub-command per step of the work."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import tauhat
from tauhat.cli.adapter import as_command
from tauhat.cli.commands import check, demo, identify, inspect, report, robots, simulate, verify
from tauhat.cli.reporting import ReportingGroup

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
app.command("robots")(as_command(robots.run, robots.Options))
app.command("inspect")(as_command(inspect.run, inspect.Options))
app.command("check")(as_command(check.run, check.Options))
app.command("simulate")(as_command(simulate.run, simulate.Options))
app.command("identify")(as_command(identify.run, identify.Options))
app.command("verify")(as_command(verify.run, verify.Options))
app.command("report")(as_command(report.run, report.Options))


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
    """From a robot description and joint logs to a verified torque model."""


def main() -> None:
    """Run the command line; characters that the terminal cannot show are replaced."""
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    app()
