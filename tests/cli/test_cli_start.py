"""Starting: help is there for every command and imports nothing heavy."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest
from cli_workshop import Tauhat

import tauhat as package

COMMANDS = ("demo", "robots", "inspect", "check", "simulate", "identify", "verify", "report")
HEAVY = ("numpy", "scipy", "numba", "polars", "pinocchio", "mujoco", "plotly", "jinja2")


def test_help_names_every_command(tauhat: Tauhat) -> None:
    for words in (("--help",), ("-h",)):
        result = tauhat(*words)
        assert result.exit_code == 0
        assert all(command in result.stdout for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_and_takes_json(tauhat: Tauhat, command: str) -> None:
    result = tauhat(command, "--help")
    assert result.exit_code == 0
    assert "--json" in result.stdout


def test_the_version_is_that_of_the_package(tauhat: Tauhat) -> None:
    assert tauhat("--version").stdout == f"tauhat {package.__version__}\n"


def test_help_loads_no_heavy_library() -> None:
    code = (
        "import sys\nfrom typer.testing import CliRunner\nfrom tauhat.cli.app import app\n"
        "assert CliRunner().invoke(app, ['identify', '--help']).exit_code == 0\n"
        f"print(sorted(set({HEAVY!r}) & set(sys.modules)))"
    )
    begin = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    sys.stdout.write(f"help took {time.monotonic() - begin:.2f} s\n")
    assert done.stdout == "[]\n"
