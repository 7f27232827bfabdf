"""The tutorial on the logs that it was written on prints what it shows."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from documents import ROOT, Workbench, differences

pytestmark = pytest.mark.real

LOGS = {"run_1.csv": "ur-20_02_10-30sec_12harm.csv.gz", "run_2.csv": "ur-20_02_12-40sec_12harm.csv.gz"}


def test_the_tutorial_shows_what_it_prints(real_data: Path, tmp_path: Path) -> None:
    for name, log in LOGS.items():
        (tmp_path / name).write_bytes(gzip.decompress((real_data / "ur10e" / log).read_bytes()))
    compared = list(differences(ROOT / "docs" / "tutorial.md", Workbench(tmp_path)))
    assert len(compared) >= 12
    assert not any(compared), "\n".join(filter(None, compared))
