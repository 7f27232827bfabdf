"""Every fenced block of every page runs, or says why no test can run it."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from documents import PAGES, ROOT, RUN, SHOWN, Workbench, blocks, commands, difference, made
from tauhat.arrays import FloatArray
from tauhat.estimation import load_estimate
from tauhat.export import new_urdf, plain_parameters
from tauhat.recordings import read_recording, write_columns
from tauhat.robots import load_robot

TUTORIAL = ROOT / "docs" / "tutorial.md"
README = ROOT / "README.md"
MOST_NOT_RUN = 8
CORNERS = ("0 0 0", "90 0 0", "0 90 0", "0 0 90")


def pages_to_run() -> list[Path]:
    return [page for page in PAGES if page not in {README, TUTORIAL} and any(block.runs for block in blocks(page))]


def tetrahedron() -> str:
    """Return the mesh of the limits page, in millimetres, as an STL file."""
    faces = ([corner for k, corner in enumerate(CORNERS) if k != left_out] for left_out in range(4))
    lines = ["solid fixture"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {corner}" for corner in face), "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid fixture", ""])


def table(log: Path, gain: FloatArray) -> dict[str, FloatArray]:
    """Return time, position, velocity and current of a simulated log, as other programs log them."""
    recording = read_recording(log)
    speed = np.gradient(recording.q, recording.t, axis=0)
    return {"t": recording.t, "q": recording.q, "dq": speed, "current": recording.tau / gain}


def write_for_the_readme(log: Path, path: Path) -> None:
    """Write a log with the columns that the README's map names: milliseconds, degrees, amperes."""
    found = table(log, np.array([10.0, 10.7, 8.5, 9.0, 9.5, 10.1]))
    columns = {"timestamp": 1e3 * found["t"]}
    columns |= {f"q{j + 1}": column for j, column in enumerate(np.rad2deg(found["q"]).T)}
    columns |= {f"current{j + 1}": column for j, column in enumerate(found["current"].T)}
    write_columns(columns, path)


def write_for_the_tutorial(log: Path, path: Path) -> None:
    """Write a log as those of the tutorial are: no header, current from column 13 on."""
    found = table(log, np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47]))
    rows = np.column_stack([found["t"], found["q"], found["dq"], found["current"], np.zeros((len(found["t"]), 12))])
    np.savetxt(path, rows, delimiter=",", fmt="%.9f")


@pytest.fixture(scope="session")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the pages' blocks name."""
    folder = tmp_path_factory.mktemp("stock")
    (folder / "tauhat-demo").mkdir()
    for seed, name in enumerate(("identification", "verification")):
        log = folder / "tauhat-demo" / f"{name}.parquet"
        made(folder, "simulate", "ur5e", "-o", log, "--seconds", 6, "--rate", 500, "--spread", 0, "--seed", seed)
        write_for_the_readme(log, folder / f"run_{seed + 1}.csv")
    made(folder, "simulate", "two_link", "-o", "run.csv", "--seconds", 4, "--rate", 250)
    made(folder, "identify", "two_link", "run.csv", "-o", "estimate.json")
    robot = load_robot("ur5e")
    new_urdf(robot, plain_parameters(robot.inertia)).save(folder / "my_robot.urdf")
    (readme_map,) = (block for block in blocks(README) if block.language == "toml")
    (folder / "my_map.toml").write_text(readme_map.text, encoding="utf-8")
    (folder / "fixture.stl").write_text(tetrahedron(), encoding="utf-8")
    return folder


@pytest.fixture
def bench(stock: Path, tmp_path: Path) -> Workbench:
    return Workbench(shutil.copytree(stock, tmp_path / "page"))


def test_every_block_says_what_it_is():
    unknown = {str(block): block.language for page in PAGES for block in blocks(page)}
    assert {place: language for place, language in unknown.items() if language not in {*RUN, *SHOWN}} == {}


def test_blocks_that_do_not_run_are_few_and_say_why():
    silent = [block for page in PAGES for block in blocks(page) if "not-run" in block.options]
    assert all(len(block.options.get("reason", "")) > 10 for block in silent), [str(block) for block in silent]
    assert len(silent) <= MOST_NOT_RUN, [f"{block}: {block.options['reason']}" for block in silent]
    assert {block.language for block in silent} <= {"bash", "console", "sh"}


@pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")  # capsules of the limits page lie on other links
@pytest.mark.parametrize("page", pages_to_run(), ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run_one_after_the_other(page: Path, bench: Workbench):
    for block in blocks(page):
        if block.runs and not block.snippet.endswith(".py"):  # examples run in test_examples.py
            list(bench.run(block))


def test_the_readme_runs_and_what_it_identifies_predicts_unseen_motion(bench: Workbench):
    run = [block.language for block in blocks(README) if block.runs and list(bench.run(block)) is not None]
    assert sorted(run) == ["bash", "python", "toml"]
    assert bench.names["unseen"].relative_rms < 0.05
    saved = load_estimate(bench.folder / "tauhat-demo" / "ur5e.json")
    assert saved.values.tolist() == bench.names["estimate"].values.tolist()
    assert load_estimate(bench.folder / "mine.json").relative_rms < 0.05


def test_the_base_parameters_shown_are_those_printed(bench: Workbench):
    (block,) = blocks(ROOT / "docs" / "methods" / "base-parameters.md")
    ((_, printed),) = bench.run(block)
    assert printed.strip() == block.text.rpartition("  # ")[2].strip()


@pytest.fixture(scope="session")
def simulated_arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with two logs like those of the tutorial, of a simulated arm."""
    folder = tmp_path_factory.mktemp("tutorial")
    for seed in (1, 2):
        made(folder, "simulate", "ur10e", "-o", "log.parquet", "--seconds", 12, "--rate", 400, "--seed", seed)
        write_for_the_tutorial(folder / "log.parquet", folder / f"run_{seed}.csv")
    return folder


def test_the_tutorial_runs_on_a_simulated_arm(simulated_arm: Path):
    bench = Workbench(simulated_arm)
    printed = "".join(text for block in blocks(TUTORIAL) if block.runs for _, text in bench.run(block))
    assert "The log cannot be used as it is." in printed
    assert "very good" in printed
    assert load_estimate(simulated_arm / "my_arm.json").relative_rms < 0.05
    assert {"my_arm.html", "my_arm.urdf", "my_arm.h"} <= {path.name for path in simulated_arm.iterdir()}
    assert load_robot(simulated_arm / "my_arm.urdf").joint_names[0] == "base"


def test_a_difference_of_outputs_is_found_and_only_then():
    shown = "error of joint 1: 3.58 % (± 0.2)\n...\nlast line 12"
    assert not difference(shown, "error of joint 1: 3.57 %\n(± 0.2) and\nmore\nlast line 12")
    assert "'3.58'" in difference(shown, "error of joint 1: 3.90 % (± 0.2) last line 12")
    assert "'last'" in difference("last line 12", "the last line 12")
    assert difference(shown, "error of joint 1: 3.58 % (± 0.2)") == "not printed: last line 12"
    assert difference("one", "one two") == "also printed: two"


def test_commands_of_a_block_are_told_from_what_they_print():
    console = next(block for block in blocks(TUTORIAL) if block.language == "console")
    first, *rest = commands(console)
    assert (first.line, rest) == ("tauhat inspect my_arm.toml", [])
    assert first.shown.startswith("my_arm: 6 joints")
