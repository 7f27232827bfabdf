"""`tauhat verify` with its further checks, and the chapter of the report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_workshop import Tauhat, Workshop, made


@pytest.fixture(scope="module")
def long_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    log = tmp_path_factory.mktemp("verify") / "long.parquet"
    made("simulate", "two_link", "-o", log, "--seconds", 12, "--rate", 250, "--seed", 7, "--spread", 0)
    return log


def test_every_check_adds_its_part_to_the_document(tauhat: Tauhat, workshop: Workshop, long_log: Path) -> None:
    plain = json.loads(tauhat("verify", workshop.estimate, long_log, "--json").stdout)
    assert set(plain) == {"logs", "processing"}
    assert set(plain["logs"][0]["joints"][0]["band"]) == {"parameters", "residual", "covered_by_parameters", "covered"}
    seen = tauhat("verify", workshop.estimate, long_log, "--residuals", "--gear", "joint_1=30", "--static", "--json")
    document = json.loads(seen.stdout)
    assert set(document) == {"logs", "processing", "residuals", "static"}
    assert document["logs"] == plain["logs"]
    assert len(document["residuals"][0]["joints"]) == 2
    assert document["static"]["findings"][0]["code"] == "static_none"


def test_people_get_tables(tauhat: Tauhat, workshop: Workshop, long_log: Path) -> None:
    shown = tauhat("verify", workshop.estimate, long_log, "--residuals", "--static").stdout
    assert "0 of colour is white noise" in shown
    assert "from both sides" in shown


@pytest.mark.parametrize(
    "options",
    [
        ("--known-payload", "2"),
        ("--known-payload", "heavy", "--payload-log", "x.csv"),
        ("--known-payload", "2:1,2", "--payload-log", "x.csv"),
        ("--residuals", "--gear", "joint_1"),
    ],
)
def test_options_that_cannot_be_read_are_refused(
    tauhat: Tauhat, workshop: Workshop, long_log: Path, options: tuple[str, ...]
) -> None:
    refused = tauhat("verify", workshop.estimate, long_log, *options)
    assert refused.exit_code == 2
    assert "Traceback" not in refused.stderr


def test_the_report_has_a_chapter_on_what_residuals_hold(
    tauhat: Tauhat, workshop: Workshop, long_log: Path, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    assert tauhat("report", workshop.estimate, long_log, "--residuals", "-o", page).exit_code == 0
    assert "What the residuals still hold" in page.read_text(encoding="utf-8")
    assert tauhat("report", workshop.estimate, long_log, "-o", page).exit_code == 0
    assert "What the residuals still hold" not in page.read_text(encoding="utf-8")
