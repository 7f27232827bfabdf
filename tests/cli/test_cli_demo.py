"""The demonstration in a small setting: a two-link arm, a few seconds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_workshop import Tauhat

from tauhat.estimation.estimate import load_estimate


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ...]:
    folder = tmp_path_factory.mktemp("demo") / "new" / "folder"
    return ("demo", "--robot", "two_link", "--seconds", "6", "--seed", "3", "-o", str(folder))


def test_the_demo_finds_the_truth_and_writes_every_file(tauhat: Tauhat, small: tuple[str, ...]) -> None:
    result = tauhat(*small, "--json")
    assert result.exit_code == 0, result.stderr
    demo = json.loads(result.stdout)
    assert all(Path(path).is_file() for path in demo["files"].values())
    assert set(demo["files"]) == {"identification_log", "verification_log", "truth", "estimate", "report"}
    assert load_estimate(demo["files"]["estimate"]).robot.name == "two_link"
    assert demo["logs"][0]["log"] == "verification"
    assert demo["logs"][0]["relative_rms"] < 0.03
    assert demo["truth"]["relative_rms"] < 0.03
    assert demo["truth"]["base_parameters"] == 13
    assert demo["truth"]["share_inside_95"] > 0.6
    assert "5/5" in result.stderr


def test_the_demo_says_where_the_report_is_and_what_to_try_next(tauhat: Tauhat, small: tuple[str, ...]) -> None:
    text = tauhat(*small).stdout
    assert "report.html" in text
    assert "Against the truth" in text
    assert "tauhat identify my_robot.urdf my_log.csv" in text
