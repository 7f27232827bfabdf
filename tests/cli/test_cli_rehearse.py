"""`tauhat rehearse`, and `tauhat simulate` with an experiment's file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat

from tauhat.recordings import read_recording
from tauhat.simulation import load_true_parameters

EXPERIMENT = """
robot = "two_link"
seed = 3
robot_seed = 4
[truth]
spread = 0.2
[[truth.attached]]
mass = 0.5
centre = [0.1, 0, 0]
[motion]
kind = "random"
seconds = 3
[sensors]
preset = "low-cost"
stamp_jitter = 0.0003
[log]
file = "run.csv"
rate = 200
settle = 0.2
"""


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    path = tmp_path / "experiment.toml"
    path.write_text(EXPERIMENT, encoding="utf-8")
    return path


def test_an_experiment_is_simulated_with_its_truth_beside_it(tauhat: Tauhat, experiment: Path) -> None:
    result = tauhat("simulate", experiment, "--json")
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    log = experiment.parent / "run.csv"
    assert (said["log"], said["seed"], said["robot_seed"]) == (str(log), 3, 4)
    recording = read_recording(log)
    assert recording.n_t == said["samples"] == 601 - said["lost"]
    assert said["lost"] > 0
    assert np.ptp(np.diff(recording.t)) > 5e-4
    truth = json.loads(Path(said["truth"]).read_text(encoding="utf-8"))
    assert truth["experiment"] == EXPERIMENT
    assert load_true_parameters(said["truth"]).attached[0].mass == 0.5


def test_check_names_lost_samples_and_jitter_of_a_simulated_log(tauhat: Tauhat, experiment: Path) -> None:
    text = EXPERIMENT.replace("stamp_jitter = 0.0003", "stamp_jitter = 0.0006\nlost_samples = 0.03")
    experiment.write_text(text, encoding="utf-8")
    log = experiment.parent / "other.parquet"
    assert tauhat("simulate", experiment, "-o", log).exit_code == 0
    result = tauhat("check", log, "--json")
    found = {finding["code"]: finding for finding in json.loads(result.stdout)["logs"][0]["findings"]}
    assert {"time_gaps", "time_jitter"} <= set(found)
    steps = np.diff(read_recording(log).t)
    assert found["time_gaps"]["number"] == pytest.approx(steps.max())
    assert found["time_jitter"]["number"] == pytest.approx(steps.std() / steps.mean())


def test_a_simulated_log_with_gaps_and_jitter_is_identified(tauhat: Tauhat, experiment: Path) -> None:
    assert tauhat("simulate", experiment).exit_code == 0
    estimate = experiment.parent / "estimate.json"
    result = tauhat("identify", "two_link", experiment.parent / "run.csv", "-o", estimate, "--model", "plain", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["fit"]["relative_rms"] < 0.2


def test_options_beside_an_experiment_and_a_log_without_a_name_are_refused(tauhat: Tauhat, experiment: Path) -> None:
    result = tauhat("simulate", experiment, "--rate", 100)
    assert result.exit_code == 2
    assert "leave out --rate" in result.stderr
    result = tauhat("simulate", "two_link", "--seconds", 1)
    assert result.exit_code == 2
    assert "give one with -o LOG" in result.stderr


def test_a_fault_of_an_experiment_is_one_line(tauhat: Tauhat, experiment: Path) -> None:
    experiment.write_text(EXPERIMENT.replace("spread", "spraed"), encoding="utf-8")
    for command in ("simulate", "rehearse"):
        result = tauhat(command, experiment)
        assert result.exit_code == 1
        assert "unknown key; got spraed; did you mean spread?" in " ".join(result.stderr.split())


def test_a_rehearsal_of_an_experiment_answers_with_json_and_a_page(tauhat: Tauhat, experiment: Path) -> None:
    page = experiment.parent / "page.html"
    words = ("rehearse", experiment, "--target", 50, "--seconds", "2,4", "--scale", "1,0.1", "--seeds", 1)
    result = tauhat(*words, "--workers", 1, "--model", "plain", "-o", page, "--json")
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    table = said["chapters"][0]["tables"][0]
    assert [row[:2] for row in table["rows"]] == [
        ["low-cost, changed", 2.0],
        ["low-cost, changed", 4.0],
        ["low-cost, changed x 0.1", 2.0],
        ["low-cost, changed x 0.1", 4.0],
    ]
    assert [row[-1] for row in table["rows"]].count("cheapest") == 1
    assert said["settings"]["target"] == 50.0
    assert said["settings"]["robot_seed"] == 4
    assert said["summary"].split(":")[0] in page.read_text(encoding="utf-8")
    assert "1 of 1 robots" in result.stderr


def test_a_rehearsal_of_a_robot_takes_typical_sensors_and_tells_the_joints(tauhat: Tauhat) -> None:
    words = ("rehearse", "two_link", "--seconds", 2, "--seeds", 1, "--workers", 1, "--model", "plain", "--seed", 2)
    result = tauhat(*words)
    assert result.exit_code == 0, result.stderr
    assert "from 2 s of motion with industrial-arm sensors" in " ".join(result.stdout.split())
    assert "joint_2" in result.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--seconds", "1,x"), "not numbers with commas between"),
        (("--scale", "0"), "not positive numbers"),
        (("--sensors", "best"), "unknown sensors"),
        (("--model", "auto"), "auto"),
        (("--estimator", "magic"), "unknown estimator"),
        (("--cluster", "tcp://127.0.0.1:1", "--workers", "2"), "a cluster has the workers it has"),
    ],
)
def test_what_cannot_be_rehearsed_is_refused(tauhat: Tauhat, words: tuple[str, ...], message: str) -> None:
    result = tauhat("rehearse", "two_link", "--seeds", 1, *words)
    assert result.exit_code in {1, 2}
    assert message in " ".join(result.stderr.replace("│", " ").split())
