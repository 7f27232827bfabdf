"""A simulated two-link arm: three logs and an estimate, made once through the command line itself."""

from __future__ import annotations

import pytest
from cli_workshop import Tauhat, Workshop, made, run_tauhat


@pytest.fixture(scope="session")
def tauhat() -> Tauhat:
    return run_tauhat


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    folder = tmp_path_factory.mktemp("workshop")
    shop = Workshop(
        folder, folder / "first.parquet", folder / "second.parquet", folder / "third.csv", folder / "estimate.json"
    )
    for seed, log in enumerate((shop.log, shop.other_log, shop.text_log)):
        made("simulate", "two_link", "-o", log, "--seconds", 4, "--rate", 250, "--seed", seed, "--spread", 0)
    made("identify", "two_link", shop.log, "-o", shop.estimate, "--model", "plain")  # what the plant has
    return shop
