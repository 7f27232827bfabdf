"""The oracle and the random files of `benchmarks/limit_files.py`, for tests."""

from __future__ import annotations

import sys
from pathlib import Path

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
if BENCHMARKS not in sys.path:
    sys.path.append(BENCHMARKS)

from limit_files import NO_EXCESS, Outcome, arm, outcome, random_file, summary  # noqa: E402
from limit_oracle import Oracle  # noqa: E402

__all__ = ["NO_EXCESS", "Oracle", "Outcome", "arm", "outcome", "random_file", "summary"]
