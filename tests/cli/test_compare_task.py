"""`tauhat compare --task`: the same models fitted to global logs, to logs of the task, and to both."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat, Workshop, made

from tauhat.dynamics.model import torque_model
from tauhat.estimation import DirectInverse, identify
from tauhat.recordings import LogSource, read_recording
from tauhat.robots import load_robot
from tauhat.simulation.controller_file import load_closed_loop
from tauhat.verification import verify

SETS = {"global": (0,), "task": (1,), "both": (0, 1)}
TERMS = "inertia,rotor,viscous,offset"
CONTROLLER = """kind = "pd-gravity"
kp = [600, 200]
kd = [100, 30]
torque_limit = 1e4
rate = 1000.0
[reference]
position = { columns = "q_{1..2}" }
"""


@pytest.fixture(scope="module")
def unseen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    log = tmp_path_factory.mktemp("task") / "unseen.parquet"
    made("simulate", "two_link", "-o", log, "--seconds", 4, "--rate", 250, "--seed", 7, "--spread", 0)
    return log


def words(workshop: Workshop, unseen: Path, *more: object) -> tuple[object, ...]:
    given = ("--task", workshop.other_log, "--unseen", unseen, "--model", TERMS, "--cutoff", 10)
    return ("compare", "two_link", workshop.log, *given, *more)


def test_each_row_is_the_model_that_these_logs_give(tauhat: Tauhat, workshop: Workshop, unseen: Path) -> None:
    result = tauhat(*words(workshop, unseen, "--json"))
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    assert [row["fitted_to"] for row in said["outcomes"]] == list(SETS)
    assert said["fitted"] == [workshop.log.stem, workshop.other_log.stem]
    logs = [read_recording(path) for path in (workshop.log, workshop.other_log)]
    model = torque_model(load_robot("two_link"), TERMS)
    errors = []
    for row, places in zip(said["outcomes"], SETS.values(), strict=True):
        estimate = identify(model, [logs[place] for place in places], cutoff=10.0)
        judged = verify(estimate, [read_recording(unseen)]).logs[0]
        assert row["unseen"] == pytest.approx([judged.relative_rms])
        errors.append(row["unseen"][0])
    assert len(set(errors)) == len(SETS)
    assert said["best"]["fitted_to"] == list(SETS)[int(np.argmin(errors))]


def test_table_and_page_say_what_was_fitted(tauhat: Tauhat, workshop: Workshop, unseen: Path, tmp_path: Path) -> None:
    page = tmp_path / "task.html"
    result = tauhat(*words(workshop, unseen, "-o", page))
    assert result.exit_code == 0, result.stderr
    for text in (result.stdout, page.read_text(encoding="utf-8")):
        assert "fitted to" in text
        assert all(name in text for name in SETS)


def test_without_logs_of_a_task_nothing_is_said_of_sets(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    page = tmp_path / "plain.html"
    given = ("compare", "two_link", workshop.log, "--unseen", workshop.other_log, "--model", TERMS)
    assert "fitted to" not in tauhat(*given, "-o", page).stdout
    assert "<th>fitted to</th>" not in page.read_text(encoding="utf-8")
    assert [row["fitted_to"] for row in json.loads(tauhat(*given, "--json").stdout)["outcomes"]] == [""]


def test_every_set_that_simulates_gets_the_references_of_its_own_logs(
    tauhat: Tauhat, workshop: Workshop, unseen: Path, tmp_path: Path
) -> None:
    controller = tmp_path / "controller.toml"
    controller.write_text(CONTROLLER)
    result = tauhat(*words(workshop, unseen, "--estimator", "didim", "--controller", controller, "--json"))
    assert result.exit_code == 0, result.stderr
    rows = {row["fitted_to"]: row for row in json.loads(result.stdout)["outcomes"]}
    robot = load_robot("two_link")
    logs = (workshop.log, workshop.other_log)
    for name, places in SETS.items():
        own = [logs[place] for place in places]
        loop = load_closed_loop(controller, robot, [LogSource(path=log) for log in own])
        recordings = [read_recording(log) for log in own]
        estimate = identify(torque_model(robot, TERMS), recordings, estimator=DirectInverse(loop=loop), cutoff=10.0)
        assert rows[name]["unseen"] == pytest.approx([verify(estimate, [read_recording(unseen)]).logs[0].relative_rms])
