"""The project of `benchmarks/project_kills.py`, which is quick to go through, and what a test asks of a folder."""

from __future__ import annotations

import sys
from pathlib import Path

import tauhat

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
if BENCHMARKS not in sys.path:
    sys.path.append(BENCHMARKS)

from project_kills import PROJECT, left_in, new_folder  # noqa: E402

__all__ = ["ROBOT_FILE", "STEPS", "TEXT", "changed", "left_in", "new_folder"]

TEXT = PROJECT
ROBOT_FILE = Path(tauhat.__file__).parent / "robots" / "data" / "two_link.toml"
STEPS = ["robot", "motion", "record", "unseen", "check", "identify", "export", "verify", "report"]


def changed(folder: Path, before: str, after: str) -> None:
    """Change the project's file."""
    path = folder / "project.toml"
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")
