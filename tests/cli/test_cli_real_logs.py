"""`tauhat study real-logs`: its options, its page, and what is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_workshop import Tauhat, Workshop

CASES = """
[[case]]
name = "first -> third"
robot = "two_link"
cutoff = 15
fit = [{ log = "first.parquet" }]
judge = [{ log = "third.csv" }]
"""
WORDS = ("--estimators", "wls, ols", "--models", "plain", "--workers", "1")


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    (tmp_path / "cases.toml").write_text(CASES, encoding="utf-8")
    return tmp_path / "cases.toml"


def test_real_logs_leaves_a_page_and_the_figures_of_compare(
    tauhat: Tauhat, workshop: Workshop, cases: Path, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    result = tauhat("study", "real-logs", "--cases", cases, "--data", workshop.folder, *WORDS, "-o", page, "--json")
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    assert said["settings"]["estimators"] == ["wls", "ols"]
    assert said["summary"] in page.read_text(encoding="utf-8")
    assert "1 of 1: first -> third, plain" in result.stderr
    (table,) = said["chapters"][-1]["tables"]
    logs = (workshop.log, "--unseen", workshop.text_log, "--model", "plain", "--estimator", "wls", "--estimator", "ols")
    beside = json.loads(tauhat("compare", "two_link", *logs, "--cutoff", 15, "--json").stdout)
    assert [row[2] / 100.0 for row in table["rows"]] == pytest.approx([row["unseen"][0] for row in beside["outcomes"]])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("real-logs",), "study real-logs: a setting is missing; expected --cases"),
        (("real-logs", "--cases", "CASES", "--seeds", 3), "study real-logs: not a setting of it; expected --cases"),
        (("crs-a465", "--models", "plain"), "study crs-a465: not a setting of it; expected --seeds, got --models"),
        (("real-logs", "--cases", "CASES"), "first.parquet: no such file"),
        (("real-logs", "--cases", "nowhere.toml"), "nowhere.toml: no such file"),
        (("real-logs", "--cases", "CASES", "--estimators", "magic"), "unknown estimator"),
        (("real-logs", "--cases", "CASES", "-o", "nowhere/page.html"), "nowhere/page.html: cannot be written"),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_line(
    tauhat: Tauhat, cases: Path, words: tuple[object, ...], message: str
) -> None:
    result = tauhat("study", *(cases if word == "CASES" else word for word in words))
    assert result.exit_code == 1
    (line,) = result.stderr.strip().splitlines()
    assert message in line


def test_a_list_with_a_hole_is_an_error_of_usage(tauhat: Tauhat, cases: Path) -> None:
    result = tauhat("study", "real-logs", "--cases", cases, "--models", "plain,,auto")
    assert result.exit_code == 2
    assert "not names with commas between" in result.stderr
