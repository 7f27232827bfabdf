"""`tauhat view` and `tauhat excite --report`: the robot is found or asked for, the address told, the page written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tauhat.cli.app import app
from tauhat.excitation import random_fourier
from tauhat.recordings.reading import read_recording
from tauhat.recordings.recording import Recording
from tauhat.recordings.writing import write_recording
from tauhat.robots import forward_kinematics, load_robot


def written(folder: Path, name: str) -> Path:
    robot = load_robot(name)
    samples = random_fourier(robot, period=2.0, harmonics=2, rng=np.random.default_rng(0)).sample(np.arange(200) / 100)
    path = folder / "motion.parquet"
    recording = Recording(
        t=samples.t, q=samples.q, dq=samples.dq, ddq=samples.ddq, joint_names=robot.joint_names, name="motion"
    )
    write_recording(recording, path)
    return path


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the addresses that a browser was sent to; the view ends at once."""
    pytest.importorskip("viser", reason="viser is not installed: the view was not started")
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("tauhat.report.view.Viewer.run", lambda viewer: viewer.stop())
    return opened


def test_the_robot_is_the_built_in_one_with_these_joints_and_the_browser_opens(tmp_path: Path, still: list[str]):
    result = CliRunner().invoke(app, ["view", str(written(tmp_path, "panda")), "--json", "--port", "18471"])
    assert result.exit_code == 0, result.stderr
    document = json.loads(result.stdout)
    assert document["robot"] == "panda"
    assert document["url"].startswith("http://127.0.0.1:18")
    assert still == [document["url"]]


def test_no_open_opens_nothing(tmp_path: Path, still: list[str]):
    motion = written(tmp_path, "ur5e")
    result = CliRunner().invoke(app, ["view", str(motion), "--robot", "ur5e", "--no-open", "--port", "18472"])
    assert result.exit_code == 0, result.stderr
    assert "this machine only" in result.stdout
    assert "http://127.0.0.1:18" in result.stdout
    assert still == []


def test_the_region_of_a_task_is_drawn_with_the_way_of_its_tool(
    tmp_path: Path, still: list[str], monkeypatch: pytest.MonkeyPatch
):
    drawn: list[np.ndarray] = []
    monkeypatch.setattr("tauhat.report.view._draw", lambda *words, **_: drawn.extend(words[2]))
    task = tmp_path / "task.toml"
    box = '[region]\nkind = "box"\nlower = [0, 0, 0]\nupper = [1, 1, 1]\n'
    task.write_text(f"home = [0.3, -1.3, 1.6, -1.8, -1.4, 0]\n{box}")
    words = ["view", str(written(tmp_path, "ur5e")), "--robot", "ur5e", "--no-open", "--port", "18473"]
    result = CliRunner().invoke(app, [*words, "--task", str(task)])
    assert result.exit_code == 0, result.stderr
    *edges, path = drawn
    assert len(edges) == 12
    q = read_recording(tmp_path / "motion.parquet").q
    assert np.allclose(path, forward_kinematics(load_robot("ur5e"), q, frame="tool").translation)
    task.write_text("[region]")
    result = CliRunner().invoke(app, [*words, "--task", str(task)])
    assert result.exit_code == 1
    assert "a key is missing" in result.stderr


def test_robots_that_share_joint_names_must_be_told_apart(tmp_path: Path):
    result = CliRunner().invoke(app, ["view", str(written(tmp_path, "ur5e"))])
    assert result.exit_code == 1
    assert "several robots have these joints" in result.stderr
    assert "--robot" in result.stderr


def test_excite_writes_the_page_about_its_motion(tmp_path: Path):
    page = tmp_path / "motion.html"
    words = ["excite", "two_link", "-o", str(tmp_path / "m.csv"), "--method", "gradient", "--starts", "1"]
    result = CliRunner().invoke(app, [*words, "--seconds", "5", "--harmonics", "3", "--report", str(page)])
    assert result.exit_code == 0, result.stderr
    text = page.read_text(encoding="utf-8")
    assert "Which parameters it sees well" in text
    assert "Singular values" in text
