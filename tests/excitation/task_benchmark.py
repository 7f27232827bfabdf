"""The random tasks of `benchmarks/task_designs.py`, for tests."""

from __future__ import annotations

import sys
from pathlib import Path

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
if BENCHMARKS not in sys.path:
    sys.path.append(BENCHMARKS)

from task_designs import NO_EXCESS, Outcome, outcome, summary  # noqa: E402

__all__ = ["NO_EXCESS", "Outcome", "outcome", "summary"]
