"""How the tests run the command line, and what a workshop holds."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from typer.testing import CliRunner, Result

from tauhat.cli.app import app
from tauhat.recordings import Recording
from tauhat.robots import load_robot
from tauhat.sensing import WrenchSolver

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


def pushed(log: Recording, wrench: NDArray[np.float64], during: NDArray[np.bool_]) -> Recording:
    """Return a log of the two-link arm with a wrench [N, Nm] on its last frame in these samples."""
    solver = WrenchSolver(robot=load_robot("two_link"))
    external = np.array([solver.jacobian(q)[0].T @ wrench for q in log.q])
    return replace(log, tau=log.tau - np.where(during[:, None], external, 0.0))


def sample_lines(log: Recording) -> list[str]:
    """Return the samples of a log as lines of JSON."""
    rows = zip(log.t.tolist(), log.q.tolist(), log.tau.tolist(), strict=True)
    return [json.dumps({"t": t, "q": q, "tau": tau}) for t, q, tau in rows]


def piped(estimate: Path, lines: Sequence[str], *words: str) -> subprocess.CompletedProcess[bytes]:
    """Run `tauhat sense` on lines of standard input."""
    command = [sys.executable, "-m", "tauhat", "sense", str(estimate), "--input", "-", *words]
    return subprocess.run(command, input="\n".join(lines).encode(), capture_output=True, timeout=120, check=False)
