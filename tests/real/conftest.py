"""Where the measured logs are: `TAUHAT_REAL_DATA`, else `shared/data` beside the checkout."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of measured logs; tests that ask for it are skipped where it is absent."""
    folder = Path(os.environ.get("TAUHAT_REAL_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured logs at {folder} (set TAUHAT_REAL_DATA)")
    return folder


@pytest.fixture(scope="session")
def real_maps() -> Path:
    """The folder of maps, one or more per robot."""
    return ROOT / "examples" / "real"
