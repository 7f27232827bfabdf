"""The demonstration in a small setting: a two-link arm, a few seconds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat, run_tauhat
from typer.testing import Result

from tauhat.estimation.estimate import load_estimate
from tauhat.excitation import sampled_motion
from tauhat.recordings.reading import read_recording


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ...]:
    folder = tmp_path_factory.mktemp("demo") / "new" / "folder"
    return ("demo", "--robot", "two_link", "--seconds", "6", "--seed", "3", "-o", str(folder))


@pytest.fixture(scope="module")
def shown(small: tuple[str, ...]) -> Result:
    result = run_tauhat(*small, "--json")
    assert result.exit_code == 0, result.stderr
    return result


def test_the_demo_finds_the_truth_and_writes_every_file(shown: Result) -> None:
    demo = json.loads(shown.stdout)
    assert all(Path(path).is_file() for path in demo["files"].values())
    roles = {"motion", "identification_log", "verification_log", "truth", "estimate", "report"}
    assert set(demo["files"]) == roles
    assert load_estimate(demo["files"]["estimate"]).robot.name == "two_link"
    assert demo["logs"][0]["log"] == "verification"
    assert demo["logs"][0]["relative_rms"] < 0.03
    assert demo["truth"]["relative_rms"] < 0.03
    assert demo["truth"]["base_parameters"] == 13
    assert demo["truth"]["share_inside_95"] > 0.6
    assert "6/6" in shown.stderr


def test_the_demo_identifies_from_a_designed_motion_and_verifies_on_a_random_one(shown: Result) -> None:
    demo = json.loads(shown.stdout)
    assert demo["motion"]["condition"] < 0.7 * demo["motion"]["random_condition"]
    assert min(demo["motion"]["limits"].values()) >= 0.05 - 1e-9
    motion, fitted, unseen = (
        read_recording(demo["files"][role]) for role in ("motion", "identification_log", "verification_log")
    )
    designed = sampled_motion(motion).sample(fitted.t).q
    assert np.abs(fitted.q - designed).max() < 0.1  # the controller's lag
    assert np.abs(unseen.q - designed).max() > 0.5
    page = Path(demo["files"]["report"]).read_text(encoding="utf-8")
    assert "Which parameters it sees well" in page


def test_the_demo_says_where_the_report_is_and_what_to_try_next(tauhat: Tauhat, small: tuple[str, ...]) -> None:
    text = tauhat(*small).stdout
    assert "report.html" in text
    assert "Against the truth" in text
    assert "good: below 10" in " ".join(text.split())
    assert "tauhat identify my_robot.urdf my_log.csv" in text
