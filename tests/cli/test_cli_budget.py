"""`tauhat budget`: a robot rehearsed, an estimate held against a log, and options that belong to the other."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_workshop import Tauhat, Workshop

QUICK = ("--seeds", 1, "--seconds", 3, "--model", "plain", "--workers", 1)


def test_a_rehearsed_experiment_leaves_json_and_a_page(tauhat: Tauhat, tmp_path: Path) -> None:
    plan, page = tmp_path / "plan.toml", tmp_path / "page.html"
    plan.write_text('robot = "two_link"\n[motion]\nkind = "random"\n[sensors]\ntorque_factor = 1.1\n')
    result = tauhat("budget", plan, *QUICK, "-o", page, "--json")
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    budget = said["budget"]
    shares = {share["key"]: share["share"] for share in budget["shares"]}
    assert set(shares) == {"gains", "differentiation", "conditioning"}
    assert list(shares.values()) == sorted(shares.values(), reverse=True)
    assert sum(shares.values()) + budget["floor"] + budget["rest"] == pytest.approx(1.0)
    assert shares["gains"] > 0.9
    assert (said["settings"]["seconds"], said["settings"]["warmer"]) == (3.0, 10.0)
    assert said["page"] == str(page)
    assert budget["shares"][0]["advice"].split(":")[0] in page.read_text(encoding="utf-8")
    assert "1 of 1 robots" in result.stderr


def test_an_estimate_is_held_against_a_log(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    result = tauhat("budget", workshop.estimate, workshop.other_log, "--cutoff", 20, "-o", page)
    assert result.exit_code == 0, result.stderr
    assert "white noise of the torque" in result.stdout
    assert "What to do about second" in result.stdout
    assert page.is_file()


@pytest.mark.parametrize("words", [("--map", "m.toml"), ("--rows", "0:9"), ("--cutoff", 5), ("--period", 2)])
def test_options_of_logs_are_refused_without_one(tauhat: Tauhat, words: tuple[object, ...]) -> None:
    result = tauhat("budget", "two_link", *words)
    assert result.exit_code == 2
    assert "there is no log" in result.stderr


@pytest.mark.parametrize("words", [("--seconds", 5), ("--model", "plain"), ("--seeds", 2), ("--warmer", 1)])
def test_options_of_rehearsals_are_refused_with_a_log(
    tauhat: Tauhat, workshop: Workshop, words: tuple[object, ...]
) -> None:
    result = tauhat("budget", workshop.estimate, workshop.other_log, *words)
    assert result.exit_code == 2
    assert "logs are not rehearsed" in result.stderr
