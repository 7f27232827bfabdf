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
    assert "colour 0 is white noise" in shown
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


def test_residuals_without_a_log_are_refused_in_one_line(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    result = tauhat("report", workshop.estimate, "--residuals", "-o", tmp_path / "r.html")
    assert result.exit_code == 2
    assert "needs a LOG that was not fitted" in result.stderr
    assert not (tmp_path / "r.html").exists()


def test_a_robot_in_the_place_of_its_estimate_is_told_what_to_do(tauhat: Tauhat, workshop: Workshop) -> None:
    result = tauhat("verify", "two_link", workshop.log)
    assert result.exit_code == 1
    assert result.stderr == "error: two_link: a robot, not an estimate; identify it first: tauhat identify\n"


def test_an_estimate_in_the_place_of_a_robot_is_told_what_it_is(tauhat: Tauhat, workshop: Workshop) -> None:
    result = tauhat("inspect", workshop.estimate)
    assert result.exit_code == 1
    assert "JSON holds an estimate, not a robot; give the robot that it was identified from" in result.stderr


@pytest.mark.parametrize(
    "words",
    [("report", "{estimate}", "-o", "{page}"), ("study", "crs-a465", "--seeds", "1", "-o", "{page}")],
)
def test_a_page_that_is_not_named_as_html_is_refused_before_any_work(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path, words: tuple[str, ...]
) -> None:
    page = tmp_path / "page.pdf"
    result = tauhat(*(word.format(estimate=workshop.estimate, page=page) for word in words))
    assert result.exit_code == 2
    assert "a page is HTML" in result.stderr
    assert not page.exists()
