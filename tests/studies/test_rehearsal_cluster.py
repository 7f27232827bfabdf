"""A rehearsal on a Dask cluster tells what it tells in one process."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

from typer.testing import CliRunner

from tauhat.cli.app import app
from two_workers import cluster_of

WORDS = ("rehearse", "two_link", "--seconds", "2", "--seeds", "2", "--model", "plain", "--json")


def test_a_cluster_rehearses_the_robots_that_one_process_rehearses(tmp_path: Path) -> None:
    with cluster_of(2) as address:
        spread = CliRunner().invoke(app, [*WORDS, "--cluster", address])
    alone = CliRunner().invoke(app, [*WORDS, "--workers", "1"])
    assert (spread.exit_code, alone.exit_code) == (0, 0), spread.stderr
    found, wanted = json.loads(spread.stdout), json.loads(alone.stdout)
    assert len(wanted["chapters"]) > 1
    for document in (found, wanted):
        document.pop("seconds")
        designed = document["chapters"][-1]["tables"][0]
        assert designed["title"] == "Designed motions"
        designed["rows"] = [row[:2] for row in designed["rows"]]  # without the seconds that the design took
    assert found == wanted
