"""How the tests run the command line, and what a workshop holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from typer.testing import CliRunner, Result

from tauhat.cli.app import app

Tauhat = Callable[..., Result]


@dataclass(frozen=True)
class Workshop:
    """Two Parquet logs and a CSV log of a two-link arm, and an estimate from the first."""

    folder: Path
    log: Path
    other_log: Path
    text_log: Path
    estimate: Path


def run_tauhat(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "80"})


def made(*words: object) -> Result:
    result = run_tauhat(*words)
    assert result.exit_code == 0, result.stderr
    return result
