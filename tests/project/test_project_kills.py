"""A run that is killed, again and again, at moments that chance chooses."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

from small_project import left_in, new_folder

from tauhat.project import load_project, run_project


def run_and_kill(folder: Path, after: str, delay: float) -> bool:
    """Start a run, kill it `delay` seconds after it said that a step begins; return whether it was still running."""
    command = [sys.executable, "-m", "tauhat", "run", str(folder), "--json"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as run:
        found = next((line for line in run.stderr if f" {after}:" in line), "")
        time.sleep(delay)
        alive = bool(found) and run.poll() is None
        run.kill()
    return alive


def test_a_run_that_is_killed_three_times_ends_with_the_result_of_an_undisturbed_one(tmp_path: Path, finished: Path):
    chance = random.Random(1)
    folder = new_folder(tmp_path / "killed")
    killed = [run_and_kill(folder, step, 0.05 * chance.random()) for step in ("motion", "identify", "report")]
    assert killed == [True, True, True]
    assert run_project(load_project(folder)).finished
    assert left_in(folder) == left_in(finished)
