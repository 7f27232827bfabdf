"""The project's file: what it says is what is done, and what it cannot mean is an error."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_project import TEXT, new_folder

from tauhat.errors import OutputError, ProjectError, RobotError
from tauhat.project import (
    DesignedMotion,
    GivenLogs,
    GivenMotion,
    SimulatedLogs,
    UnseenMotion,
    load_project,
    plan_project,
    write_new_project,
)

ROBOT = '[robot]\nsource = "two_link"\n'
LOGS = '[record]\nkind = "logs"\nlogs = ["a.csv"]\n'


def loaded(folder: Path, text: str):
    return load_project(new_folder(folder / "p", text))


def test_a_robot_alone_is_a_project(tmp_path: Path):
    project = loaded(tmp_path, ROBOT)
    assert (project.motion, project.record, project.verify) == (DesignedMotion(), SimulatedLogs(), UnseenMotion())
    assert (project.export, project.folder) == (None, tmp_path / "p")


def test_settings_are_read_section_by_section(tmp_path: Path):
    project = loaded(tmp_path, TEXT)
    assert project.motion == DesignedMotion(seconds=4.0, periods=1, harmonics=3, starts=1)
    assert project.identify.model == "plain"
    assert project.export.formats == ("urdf", "mjcf", "c")


def test_given_logs_need_no_motion_and_nothing_to_verify_on(tmp_path: Path):
    project = loaded(tmp_path, ROBOT + LOGS)
    assert (project.motion, project.record, project.verify) == (None, GivenLogs(logs=("a.csv",)), None)
    assert [step.name for step in plan_project(project).steps] == [
        "robot",
        "instructions",
        "record",
        "check",
        "identify",
        "report",
    ]


def test_a_motion_may_be_given(tmp_path: Path):
    assert loaded(tmp_path, ROBOT + '[motion]\nfile = ["a.csv", "b.csv"]').motion == GivenMotion(
        files=("a.csv", "b.csv")
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"\[robot\]: a key is missing; expected source"),
        ("[robot", "not valid TOML"),
        (ROBOT + "[records]", "unknown key; got records; did you mean record"),
        (ROBOT + "[motion]\nsecond = 3", r"\[motion\]: unknown key; got second; did you mean seconds"),
        (ROBOT + "[motion]\nseconds = 0.1", r"\[motion\]: seconds is out of bounds; expected 0.5 to 600, got 0.1"),
        (ROBOT + "[motion]\nstarts = 1.5", "starts is not a whole number"),
        (ROBOT + "[motion]\nseed = -1", "seed is not a whole number >= 0"),
        (ROBOT + '[motion]\nmethod = "best"', "unknown method of design"),
        (ROBOT + '[motion]\ncriterion = "best"', "unknown criterion"),
        (ROBOT + '[motion]\nfile = "a.csv"\nseconds = 3', "has its own length"),
        (ROBOT + "[motion]\nfile = 3", "file is not a list of texts"),
        (ROBOT + '[record]\nkind = "guess"', "unknown kind"),
        (ROBOT + '[record]\nexperiment = "e.toml"\nrate = 100', "the experiment's file says that; got rate"),
        (ROBOT + '[record]\nkind = "logs"\nlogs = ["a", "a"]', "names something twice"),
        (ROBOT + '[identify]\nmodel = "plan"', "unknown term"),
        (ROBOT + '[identify]\nestimator = "best"', r"\[identify\]: unknown estimator"),
        (ROBOT + '[identify]\nconstraints = "some"', "unknown constraints"),
        (ROBOT + "[identify]\nessential = 1", "essential is neither true nor false"),
        (ROBOT + "[identify]\ncutoff = 0", "cutoff is out of bounds"),
        (ROBOT + '[verify]\nlogs = ["a.csv"]', r"\[verify\]: unknown key; got logs"),
        (ROBOT + '[identify]\nconstraints = "physical"\n[export]\nformats = ["pdf"]', "unknown format"),
        (ROBOT + '[export]\nformats = ["c"]', "an export needs all parameters"),
    ],
)
def test_what_a_project_cannot_mean_is_an_error_that_names_the_place(tmp_path: Path, text: str, message: str):
    with pytest.raises(ProjectError, match=message) as caught:
        loaded(tmp_path, text)
    assert caught.value.where.startswith(str(tmp_path / "p" / "project.toml"))


def test_files_are_looked_for_before_work_begins(tmp_path: Path):
    project = loaded(tmp_path, ROBOT + '[motion]\nlimits = "limits.toml"')
    with pytest.raises(ProjectError, match=r"limits\.toml: no such file; it is named in project\.toml"):
        plan_project(project)


def test_a_file_of_the_projects_own_cannot_be_its_input(tmp_path: Path):
    project = loaded(tmp_path, ROBOT + '[motion]\nfile = "motion/motion.parquet"')
    (project.folder / "motion").mkdir()
    (project.folder / "motion" / "motion.parquet").write_bytes(b"")
    with pytest.raises(ProjectError, match="would be overwritten"):
        plan_project(project)


def test_a_new_project_is_one_that_can_be_loaded(tmp_path: Path):
    path = write_new_project(tmp_path / "deep" / "arm", "two_link")
    project = load_project(path)
    assert path == tmp_path / "deep" / "arm" / "project.toml"
    assert project.export.formats == ("urdf", "mjcf", "c")
    assert plan_project(project).steps[0].state == "to make"
    with pytest.raises(OutputError, match="there is a project already"):
        write_new_project(path, "two_link")
    with pytest.raises(RobotError, match="no such robot"):
        write_new_project(tmp_path / "other", "two_lnk")
    assert not (tmp_path / "other").exists()


def test_a_new_project_names_the_robots_file_from_its_folder(tmp_path: Path):
    source = tmp_path / 'my "arm".toml'
    source.write_text((Path(__file__).parents[2] / "src/tauhat/robots/data/two_link.toml").read_text("utf-8"), "utf-8")
    project = load_project(write_new_project(tmp_path / "arm", str(source)))
    assert project.robot.source == '../my "arm".toml'
    assert plan_project(project).steps[0].outputs == ("robot/robot.json", "robot/description.toml")
