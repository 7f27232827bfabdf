"""The whole way of a small arm: what is made, what is kept, and runs that were killed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from small_project import ROBOT_FILE, STEPS, changed, left_in, new_folder

from tauhat.errors import ProjectError, TauhatWarning
from tauhat.estimation import load_estimate
from tauhat.project import load_project, plan_project, run_project
from tauhat.recordings import read_recording, write_columns
from tauhat.recordings.writing import recording_columns
from tauhat.robots import Robot, load_robot


def to_make(folder: Path) -> list[str]:
    return [step.name for step in plan_project(load_project(folder)).steps if step.state == "to make"]


def test_the_whole_way_leaves_everything_in_the_folder(finished: Path):
    assert [step.name for step in plan_project(load_project(finished)).steps] == STEPS
    assert set(left_in(finished)) == {
        "project.toml", "robot/robot.json", "motion/motion.parquet", "motion/design.json",
        "recordings/identification.parquet", "recordings/identification.truth.json",
        "recordings/verification.parquet", "recordings/verification.truth.json",
        "checks.json", "estimate.json", "verification.json", "report.html", "export/robot.urdf", "export/robot.xml",
        "export/robot.h",
    }  # fmt: skip
    assert load_estimate(finished / "estimate.json").relative_rms < 0.05
    (log,) = json.loads((finished / "verification.json").read_text("utf-8"))["logs"]
    assert log["relative_rms"] < 0.05
    assert [
        found["severity"] for found in json.loads((finished / "checks.json").read_text("utf-8"))["logs"][0]["findings"]
    ]
    assert load_robot(finished / "export" / "robot.urdf").n_v == 2


def test_the_robot_in_the_folder_is_the_one_that_was_read(finished: Path):
    data = json.loads((finished / "robot" / "robot.json").read_text("utf-8"))
    assert Robot.from_dict(data).fingerprint == data["fingerprint"] == load_robot("two_link").fingerprint


def test_a_second_run_makes_nothing(folder: Path):
    before = left_in(folder)
    assert [step.state for step in run_project(load_project(folder)).steps] == ["kept"] * len(STEPS)
    assert left_in(folder) == before


@pytest.mark.parametrize(
    ("before", "after", "made"),
    [
        ("seconds = 4.0\nperiods = 1", "seconds = 4.0\nperiods = 2", {"motion", "record", "check", "identify"}),
        ("rate = 200.0", "rate = 250.0", {"record", "unseen", "check", "identify"}),
        ('model = "plain"', 'model = "robust"', {"identify"}),
        ("[verify]\nseconds = 4.0", "[verify]\nseconds = 5.0", {"unseen"}),
        ('["urdf", "mjcf", "c"]', '["urdf"]', {"export"}),
        ("[export]", '[report]\ntitle = "Mine"\n[export]', {"report"}),
    ],
)
def test_a_setting_concerns_its_own_step_and_those_after_it(folder: Path, before: str, after: str, made: set[str]):
    changed(folder, before, after)
    after_them = {"identify": {"export", "verify", "report"}, "unseen": {"verify", "report"}}
    for name, others in after_them.items():
        made = made | (others if name in made else set())
    made = made | ({"report"} if "motion" in made else set())
    assert to_make(folder) == [name for name in STEPS if name in made]


def test_a_damaged_estimate_is_made_again_as_it_was_and_nothing_after_it(folder: Path):
    before = left_in(folder)
    path = folder / "estimate.json"
    path.write_bytes(path.read_bytes()[:1000])
    states = {step.name: step.state for step in run_project(load_project(folder)).steps}
    assert {name for name, state in states.items() if state == "made"} == {"identify"}
    assert left_in(folder) == before


def test_until_ends_there_and_a_step_can_be_forced(folder: Path):
    project = load_project(folder)
    (folder / "report.html").unlink()
    said: list[str] = []
    run = run_project(project, until="check", forced=["check"], tell=said.append)
    assert [step.name for step in run.steps] == STEPS[:5]
    assert said == ["5/5 check: it is asked for"]
    with pytest.raises(ProjectError, match="no such step of this project; got chek; did you mean check"):
        run_project(project, until="chek")
    assert not (folder / "report.html").exists()


def real_project(tmp_path: Path) -> Path:
    """Return a folder whose robot is a file and whose logs are still to be recorded."""
    text = (
        '[robot]\nsource = "arm.toml"\n[motion]\nseconds = 4\nstarts = 1\nharmonics = 3\nlimits = "limits.toml"\n'
        '[record]\nkind = "logs"\nlogs = ["recordings/run_1.parquet"]\n[identify]\nmodel = "plain"\n'
        '[verify]\nlogs = ["recordings/run_2.parquet"]\n'
    )
    folder = new_folder(tmp_path / "real", text)
    shutil.copyfile(ROBOT_FILE, folder / "arm.toml")
    (folder / "limits.toml").write_text("[torque]\nfraction = 0.9\n", encoding="utf-8")
    return folder


def test_a_real_robots_project_waits_for_logs_says_how_to_record_and_goes_on(tmp_path: Path, finished: Path):
    folder = real_project(tmp_path)
    run = run_project(load_project(folder))
    assert run.awaited == (folder / "recordings" / "run_1.parquet",)
    assert [step.state for step in run.steps[:4]] == ["made", "made", "made", "waits"]
    advice = (folder / "recordings" / "RECORD.md").read_text("utf-8")
    assert "motion/motion.parquet" in advice
    assert "recordings/run_2.parquet" in advice
    shutil.copyfile(finished / "recordings" / "identification.parquet", folder / "recordings" / "run_1.parquet")
    run = run_project(load_project(folder))
    assert [step.state for step in run.steps[:3]] == ["kept", "kept", "kept"]
    assert {step.name: step.state for step in run.steps}["verify"] == "waits"
    assert load_estimate(folder / "estimate.json").relative_rms < 0.05
    shutil.copyfile(finished / "recordings" / "verification.parquet", folder / "recordings" / "run_2.parquet")
    assert run_project(load_project(folder)).finished


def test_files_of_a_real_robots_project_are_inputs(tmp_path: Path, finished: Path):
    folder = real_project(tmp_path)
    for name, log in (("identification", "run_1"), ("verification", "run_2")):
        (folder / "recordings").mkdir(exist_ok=True)
        shutil.copyfile(finished / "recordings" / f"{name}.parquet", folder / "recordings" / f"{log}.parquet")
    run_project(load_project(folder))
    assert to_make(folder) == []
    for path, first in ((folder / "limits.toml", "motion"), (folder / "arm.toml", "robot")):
        path.write_text(f"{path.read_text('utf-8')}\n# changed\n", encoding="utf-8")
        assert to_make(folder)[0] == first
    shutil.copyfile(finished / "recordings" / "verification.parquet", folder / "recordings" / "run_1.parquet")
    with pytest.warns(TauhatWarning, match="is one of the logs the estimate was fitted on"):
        states = {step.name: step.state for step in run_project(load_project(folder)).steps}
    assert states["robot"] == states["motion"] == states["identify"] == states["verify"] == "made"
    assert states["instructions"] == "kept"  # the robot came out as it was


def test_a_log_that_cannot_be_used_ends_the_run_with_its_finding(tmp_path: Path, finished: Path):
    folder = real_project(tmp_path)
    (folder / "recordings").mkdir()
    columns = recording_columns(read_recording(finished / "recordings" / "identification.parquet"))
    backwards = {**columns, "t": np.roll(columns["t"], 100)}
    write_columns(backwards, folder / "recordings" / "run_1.parquet")
    with pytest.raises(ProjectError, match=r"run_1: the log cannot be used: .*time.*all findings are in checks\.json"):
        run_project(load_project(folder))
    assert not json.loads((folder / "checks.json").read_text("utf-8"))["logs"][0]["usable"]
    assert not (folder / "estimate.json").exists()


def test_a_motion_of_ones_own_and_an_experiments_file_are_taken(tmp_path: Path, finished: Path):
    text = (
        '[robot]\nsource = "two_link"\n[motion]\nfile = "mine.parquet"\n[record]\nexperiment = "experiment.toml"\n'
        '[identify]\nmodel = "plain"\n[verify]\nseconds = 4\n'
    )
    folder = new_folder(tmp_path / "own", text)
    shutil.copyfile(finished / "motion" / "motion.parquet", folder / "mine.parquet")
    experiment = folder / "experiment.toml"
    experiment.write_text('robot = "two_link"\nseed = 3\n[log]\nrate = 200\n[truth]\nspread = 0.0\n', encoding="utf-8")
    run_project(load_project(folder), until="unseen")
    truth = json.loads((folder / "recordings" / "identification.truth.json").read_text("utf-8"))
    assert truth["seed"] == 3
    assert to_make(folder) == ["check", "identify", "verify", "report"]
    experiment.write_text('robot = "ur5e"\n', encoding="utf-8")
    with pytest.raises(ProjectError, match="an experiment of another robot; expected two_link, got ur5e"):
        run_project(load_project(folder))


def test_several_motions_make_several_logs(tmp_path: Path):
    text = (
        '[robot]\nsource = "two_link"\n[motion]\nseconds = 3\nharmonics = 2\nstarts = 1\nperiods = 1\nmotions = 2\n'
        "[record]\nrate = 100\n"
    )
    folder = new_folder(tmp_path / "two", text)
    (folder / "recordings").mkdir()
    (folder / "recordings" / "map.toml").write_text("[time]\ncolumn = 'of other logs'\n", encoding="utf-8")
    run_project(load_project(folder), until="check")
    logs = {name for name in left_in(folder) if name.endswith("parquet")} - {"recordings/verification.parquet"}
    assert logs == {f"{stem}-{k}.parquet" for stem in ("motion/motion", "recordings/identification") for k in (1, 2)}
    assert len(json.loads((folder / "motion" / "design.json").read_text("utf-8"))["motions"]) == 2


def test_six_revolute_joints_get_a_program(tmp_path: Path):
    project = load_project(new_folder(tmp_path / "ur", '[robot]\nsource = "ur5e"\n'))
    assert "motion/motion.script" in plan_project(project).steps[1].outputs
