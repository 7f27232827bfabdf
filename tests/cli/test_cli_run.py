"""`tauhat run`: a new project, what would be made and why, and logs that are not there yet."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_workshop import Tauhat, made

TEXT = """
[robot]
source = "two_link"

[motion]
seconds = 3.0
periods = 1
harmonics = 2
starts = 1

[record]
rate = 100.0

[identify]
model = "plain"

[verify]
seconds = 4.0
"""
LOGS = '[robot]\nsource = "two_link"\n[record]\nkind = "logs"\nlogs = ["run.csv"]\n'


@pytest.fixture
def project(tmp_path: Path) -> Path:
    path = tmp_path / "project.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_a_new_project_is_written_and_never_over_another(tauhat: Tauhat, tmp_path: Path):
    folder = tmp_path / "arm"
    said = json.loads(made("run", folder, "--new", "two_link", "--json").stdout)
    assert said == {"project": str(folder / "project.toml")}
    assert 'source = "two_link"' in (folder / "project.toml").read_text("utf-8")
    again = tauhat("run", folder, "--new", "two_link")
    assert again.exit_code == 1
    assert "there is a project already" in again.stderr


def test_a_run_tells_its_steps_and_the_error_on_unseen_motion(tauhat: Tauhat, project: Path):
    planned = json.loads(made("run", project, "--dry-run", "--json").stdout)
    assert {step["state"] for step in planned["steps"]} == {"to make"}
    assert planned["logs"] == []
    result = made("run", project, "--json")
    said = json.loads(result.stdout)
    assert (said["finished"], said["awaited"], said["folder"]) == (True, [], str(project.parent))
    assert [step["state"] for step in said["steps"]] == ["made"] * 8
    assert [log["log"] for log in said["logs"]] == ["verification"]
    assert said["logs"][0]["relative_rms"] < 0.1
    assert "run: 1/8 robot: it was not made yet" in result.stderr
    shown = made("run", project.parent).stdout
    assert "kept" in shown
    assert "of the torque is not predicted" in shown
    project.write_text(TEXT.replace("4.0", "5.0"), encoding="utf-8")
    assert "[verify] seconds changed" in made("run", project, "--dry-run").stdout
    forced = json.loads(made("run", project, "--until", "check", "--force", "check", "--json").stdout)
    assert [step["state"] for step in forced["steps"]] == ["kept", "kept", "kept", "made", "made"]


def test_a_run_that_waits_for_logs_says_so_and_ends_with_status_1(tauhat: Tauhat, tmp_path: Path):
    (tmp_path / "project.toml").write_text(LOGS, encoding="utf-8")
    assert tauhat("run", tmp_path, "--dry-run").exit_code == 0
    result = tauhat("run", tmp_path, "--json")
    assert result.exit_code == 1
    said = json.loads(result.stdout)
    assert (said["finished"], said["awaited"]) == (False, [str(tmp_path / "run.csv")])
    assert [step["state"] for step in said["steps"]][:3] == ["made", "made", "waits"]
    assert "waiting: not there yet:" in result.stderr
    assert "RECORD.md says how to record" in result.stderr


def test_a_project_that_is_not_there_is_an_error_of_one_line(tauhat: Tauhat, tmp_path: Path):
    for given, folder in (
        (tmp_path / "nowhere.toml", tmp_path / "nowhere"),
        (tmp_path / "arm", tmp_path / "arm"),
        (tmp_path, tmp_path),
    ):
        result = tauhat("run", given)
        assert result.exit_code == 1
        assert f"no such project; tauhat run --new ROBOT {folder} makes one" in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1
