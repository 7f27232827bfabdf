"""`tauhat excite --task`: programs in the region for every controller, and refusals before the search."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat, made

from tauhat.errors import ExportError
from tauhat.excitation import GeneticSettings, JointMove, WaypointSettings, motion_limits, waypoint_motion
from tauhat.excitation.task_design import TaskSettings, TaskStage, design_task, parse_task
from tauhat.export.programs import DIALECTS, language_of, program_named, sayable, task_program
from tauhat.recordings import read_recording
from tauhat.robots import forward_kinematics, load_robot

UR5E = load_robot("ur5e")
TASK = """home = [0.3, -1.3, 1.6, -1.87, -1.57, 0]
[region]
kind = "box"
lower = [-0.65, -0.45, 0.2]
upper = [-0.4, -0.2, 0.4]
tilt = 0.4
spin = 1.0
[[stages]]
name = "fast"
columns = ["inertial"]
points = 5
speed = [0.4, 1.0]
acceleration = [0.4, 1.0]
[[stages]]
name = "slow"
columns = ["gravity", "friction"]
points = 5
speed = [0.1, 0.4]
acceleration = [0.2, 0.5]
dwell = 0.1
[search]
population = 8
generations = 2
islands = 1
"""
ONE = """[[stages]]
name = "end"
columns = ["inertial"]
points = 4
"""
PLAN = WaypointSettings(limits=motion_limits(UR5E, margin=0.05), ending="return")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a task, and what the command makes of it for languages of one kind of zone each."""
    place = tmp_path_factory.mktemp("task")
    (place / "task.toml").write_text(TASK)
    for name, endings in (("radii", ("script", "mod", "toml")), ("parts", ("src", "ls", "csv"))):
        programs = [word for ending in endings for word in ("--program", place / f"{name}.{ending}")]
        words = ("excite", "ur5e", "--task", place / "task.toml", "-o", place / f"{name}.parquet", *programs, "--json")
        (place / f"{name}.json").write_text(made(*words).stdout)
    return place


def document(folder: Path, name: str) -> dict:
    return json.loads((folder / f"{name}.json").read_text())


def test_there_is_a_motion_a_stage_that_repeats_within_its_seconds(folder: Path):
    found = document(folder, "parts")
    assert [Path(motion["motion"]).name for motion in found["motions"]] == ["parts-fast.parquet", "parts-slow.parquet"]
    assert found["motion"] == found["motions"][0]["motion"]
    for stage, motion in zip(found["stages"], found["motions"], strict=True):
        assert motion["seconds"] == pytest.approx(stage["repeats"] * stage["duration"])
        assert 30.0 - stage["duration"] < motion["seconds"] <= 30.0
        recording = read_recording(motion["motion"])
        assert recording.t[-1] == pytest.approx(motion["seconds"], abs=0.011)
        for end in (0, -1):
            assert np.allclose(recording.q[end], [0.3, -1.3, 1.6, -1.87, -1.57, 0], atol=1e-3)
    assert found["together"]["parameters"] == 58
    assert 0.0 < found["reached"] <= 1.0


@pytest.mark.parametrize(("name", "key"), [("radii", "urscript"), ("radii", "rapid"), ("radii", "toml"),
                                           ("parts", "krl"), ("parts", "fanuc"), ("parts", "csv")])  # fmt: skip
def test_a_program_that_is_read_back_moves_as_the_motion_that_is_written(folder: Path, name: str, key: str):
    language = program_named(key)
    for stage in document(folder, name)["stages"]:
        path = folder / f"{name}-{stage['name']}{language.ending}"
        program = language.read(path.read_text(), UR5E, planned=PLAN)
        assert program.repeats == stage["repeats"]
        assert any(move.zone is not None for move in program.moves)
        again = waypoint_motion(UR5E, program.start, program.moves, settings=PLAN)
        assert again.duration == pytest.approx(stage["duration"], abs=1e-6)
        written = read_recording(folder / f"{name}-{stage['name']}.parquet")
        inside = written.t < stage["repeats"] * stage["duration"] - 1e-3
        assert np.abs(again.sample(written.t[inside]).q - written.q[inside]).max() < 1e-5


def test_zones_become_radii_for_a_language_that_knows_no_parts_and_it_is_told(folder: Path):
    assert document(folder, "radii")["radii"] == {"fast": 0.05, "slow": 0.05}
    assert document(folder, "parts")["radii"] == {}
    moves = program_named("toml").read((folder / "radii-fast.toml").read_text(), UR5E, planned=PLAN).moves
    radii = [move.zone.radius for move in moves if move.zone is not None]
    assert radii
    assert max(radii) <= 0.05
    places = forward_kinematics(UR5E, np.array([move.target for move in moves]), frame="tool").translation
    for move, before, here, after in zip(moves[1:], places, places[1:], [*places[2:], places[0]], strict=False):
        if move.zone is not None:
            nearest = min(np.linalg.norm(here - before), np.linalg.norm(after - here))
            assert move.zone.radius <= 0.4 * nearest + 1e-9


def test_the_way_home_is_no_faster_than_the_stage(folder: Path):
    moves = program_named("csv").read((folder / "parts-slow.csv").read_text(), UR5E, planned=PLAN).moves
    assert (moves[-1].speed, moves[-1].acceleration) == (0.4, 0.5)
    assert all(round(100 * move.speed, 9).is_integer() for move in moves)


def test_people_read_tables_and_one_stage_has_the_plain_name(tauhat: Tauhat, tmp_path: Path):
    head, _, rest = TASK.partition("[[stages]]")
    (tmp_path / "task.toml").write_text(head + ONE + rest[rest.index("[search]") :])
    words = ("--task", tmp_path / "task.toml", "-o", tmp_path / "work.csv", "--program", tmp_path / "work.script")
    result = made("excite", "ur5e", *words, "--report", tmp_path / "work.html")
    assert {path.name for path in tmp_path.iterdir()} == {"task.toml", "work.csv", "work.script", "work.html"}
    for text in ("Condition of each block", "The arm reaches", "end makes visible", "at most 50 mm", "runs"):
        assert text in result.stdout
    assert "What the programs leave to the controller" in result.stdout
    assert (tmp_path / "work.script").read_text().startswith("def task_end():")  # `end` alone is a word of URScript
    page = (tmp_path / "work.html").read_text()
    for text in ("Farthest outside", "from above", "Columns of the block gravity", "Visible since"):
        assert text in page


USAGE = {
    "harmonics": (("--harmonics", 5), "with --task leave it out"),
    "margin": (("--margin", 0.05), "state it in [search]"),
    "seconds": (("--seconds", 10), "state seconds of its stages"),
    "periods": (("--periods", 2), "a program repeats"),
    "motions": (("--motions", 1), "state its stages"),
    "criterion": (("--criterion", "mixed"), "state it in [search]"),
    "method": (("--method", "both"), "leave it out"),
    "starts": (("--starts", 3), "leave it out"),
    "after": (("--after", "estimate.json"), "leave it out"),
    "payload": (("--payload",), "leave it out"),
}


@pytest.mark.parametrize(("words", "message"), USAGE.values(), ids=USAGE.keys())
def test_options_of_periodic_motions_are_refused(tauhat: Tauhat, tmp_path: Path, words: tuple, message: str):
    task = tmp_path / "task.toml"
    task.write_text(TASK)
    result = tauhat("excite", "ur5e", "--task", task, "-o", tmp_path / "work.csv", *words)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == [task]


def test_a_program_without_a_task_is_refused(tauhat: Tauhat, tmp_path: Path):
    result = tauhat("excite", "two_link", "-o", tmp_path / "m.csv", "--program", tmp_path / "m.src")
    assert result.exit_code == 2
    assert "needs --task" in result.stderr


EARLY = {
    "ending": ("ur5e", "work.csv", ("work.txt",), "no language has this ending"),
    "motion as a program": ("ur5e", "work.script", (), "a program goes to --program"),
    "no folder": ("ur5e", "work.csv", ("no/work.src",), "cannot be written"),
    "one name twice": ("ur5e", "work.csv", ("work.csv",), "two outputs have one name"),
    "zones of two kinds": ("ur5e", "work.csv", ("a.script", "a.src"), "the languages share no kind of zone"),
}


@pytest.mark.parametrize(("robot", "motion", "programs", "message"), EARLY.values(), ids=EARLY.keys())
def test_what_cannot_be_written_is_one_line_before_the_search(
    tauhat: Tauhat,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    robot: str,
    motion: str,
    programs: tuple,
    message: str,
):
    monkeypatch.setattr("tauhat.excitation.task_design.design_task", None)  # calling it would be another error
    (tmp_path / "task.toml").write_text(TASK)
    words = [word for program in programs for word in ("--program", tmp_path / program)]
    result = tauhat("excite", robot, "--task", tmp_path / "task.toml", "-o", tmp_path / motion, *words)
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert len(list(tmp_path.iterdir())) == 1


def settings_of(**fields: object) -> TaskSettings:
    task = parse_task(TASK, UR5E)
    stage = TaskStage(name="one", counted=("inertial",), **fields)  # type: ignore[arg-type]
    return TaskSettings(region=task.region, home=task.home, stages=(stage,))


UNSAID = {
    "long name": ({}, "krl", "", "name of a program"),
    "radius in KRL": ({"radius": 0.05}, "krl", "", "KRL knows no radius here; leave out the radius of the zones"),
    "slow in RAPID": ({"acceleration": (0.1, 1.0)}, "rapid", "", "RAPID knows no acceleration this low"),
    "slow line in RAPID": (
        {"acceleration": (0.04, 1.0), "moves": "line"}, "rapid", "", r"expected at least 0\.1 m/s\^2, got 0\.08",
    ),
    "line in FANUC": ({"moves": "line"}, "fanuc", "", "FANUC says speeds of lines in whole steps"),
    "dwell in FANUC": ({"dwell": 0.125}, "fanuc", "", "FANUC says dwells in whole steps"),
    "seven joints": ({}, "urscript", "panda", r"URScript programs; expected 6 revolute joints, got 7 revolute"),
}  # fmt: skip


@pytest.mark.parametrize(("fields", "key", "robot", "message"), UNSAID.values(), ids=UNSAID.keys())
def test_what_a_language_cannot_say_is_refused_by_stage(fields: dict, key: str, robot: str, message: str):
    settings = settings_of(**fields)
    if message == "name of a program":
        stage = TaskStage(name="a_name_that_is_far_too_long", counted=("inertial",))
        settings = TaskSettings(region=settings.region, home=settings.home, stages=(stage,))
    with pytest.raises(ExportError, match=message):
        sayable(settings, load_robot(robot) if robot else UR5E, [program_named(key)])


def test_what_a_language_can_say_is_left_as_it_is():
    settings = settings_of(zone=0.0)
    assert sayable(settings, UR5E, DIALECTS).stages == settings.stages  # stops everywhere: no zones at all
    lines = settings_of(moves="line", acceleration=(0.2, 1.0))
    assert sayable(lines, UR5E, [program_named("krl")]).stages[0].radius == 0.05
    assert sayable(lines, UR5E, [program_named("csv")]).stages == lines.stages


def test_a_stage_of_lines_is_said_by_every_language_of_radii():
    lines = settings_of(moves="line", points=3, acceleration=(0.2, 1.0), seconds=60.0)
    languages = [program_named(key) for key in ("krl", "urscript", "rapid", "toml")]
    settings = replace(sayable(lines, UR5E, languages), genetic=GeneticSettings(population=4, generations=1), islands=1)
    (stage,) = design_task(UR5E, settings, rng=np.random.default_rng(0)).stages
    *_, last, home = stage.motion.moves
    assert last.zone is None  # what follows is no line
    assert isinstance(home, JointMove)
    t = np.linspace(0.0, stage.motion.duration, 500)
    for language in languages:
        program = language.read(task_program(stage, language).text, UR5E, planned=PLAN)
        assert [type(move) for move in program.moves] == [type(move) for move in stage.motion.moves]
        again = waypoint_motion(UR5E, program.start, program.moves, settings=PLAN)
        assert np.abs(again.sample(t).q - stage.motion.sample(t).q).max() < 1e-6


def test_endings_name_languages():
    assert [language_of(f"WORK{dialect.ending.upper()}").key for dialect in DIALECTS] == [d.key for d in DIALECTS]
