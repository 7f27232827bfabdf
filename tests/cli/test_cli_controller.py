"""`--controller`: estimators that simulate are told how the robot was driven, or say in one line what is missing."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from cli_workshop import Tauhat, made

from tauhat.control import PDGravity
from tauhat.dynamics import torque_model
from tauhat.estimation import ClosedLoop, DirectInverse, identify, load_estimate
from tauhat.excitation import random_fourier
from tauhat.excitation.motion_file import motion_for
from tauhat.recordings import LogSource, Recording, average_periods, read_recording, write_recording
from tauhat.robots import load_robot
from tauhat.simulation import load_true_parameters
from tauhat.simulation.controller_file import load_closed_loop

CONTROLLER = """kind = "pd-gravity"
kp = [600, 200]
kd = [100, 30]
torque_limit = 1e4
rate = 1000.0
delay = 0.002
"""
EXPERIMENT = """robot = "two_link"
[motion]
file = "motion.parquet"
[controller]
{controller}
[sensors]
encoder_step = 1e-5
torque_noise = 0.2
[log]
file = "{log}"
rate = 500.0
"""


class Driven(NamedTuple):
    """A simulated log whose controller is known, and the file of the latter."""

    log: Path
    controller: Path

    def words(self, command: str, *more: object) -> tuple[object, ...]:
        return (command, "two_link", self.log, "--controller", self.controller, "--model", "plain", *more)


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driven]:
    folder, robot = tmp_path_factory.mktemp("driven"), load_robot("two_link")
    motion = random_fourier(robot, period=6.0, harmonics=4, rng=np.random.default_rng(1))
    t = np.arange(0.0, 6.0, 2e-3)
    samples = motion.sample(t)
    written = Recording(t=t, q=samples.q, dq=samples.dq, ddq=samples.ddq, joint_names=robot.joint_names)
    write_recording(written, folder / "motion.parquet")
    experiment, controller = folder / "experiment.toml", folder / "controller.toml"
    experiment.write_text(EXPERIMENT.format(controller=CONTROLLER, log="run.parquet"), encoding="utf-8")
    controller.write_text(f'{CONTROLLER}[reference]\nfile = "motion.parquet"\n', encoding="utf-8")
    made("simulate", experiment)
    return Driven(folder / "run.parquet", controller)


def error_of(estimate: Path, log: Path) -> float:
    """Return the distance of the base parameters from the true ones, relative."""
    found, truth = load_estimate(estimate), load_true_parameters(log.with_suffix(".truth.json"))
    true = found.base.projection @ [truth.value(own.symbol, own.joint) for own in found.model.parameters]
    return float(np.linalg.norm(found.values - true) / np.linalg.norm(true))


def test_the_truth_is_recovered_and_the_estimate_is_that_of_the_python_interface(driven: Driven, tmp_path: Path):
    path = tmp_path / "estimate.json"
    result = made(*driven.words("identify", "--estimator", "didim", "-o", path))
    assert "controller.toml" in result.stdout
    robot, recording = load_robot("two_link"), read_recording(driven.log)
    loop = ClosedLoop(
        law=PDGravity(kp=[600.0, 200.0], kd=[100.0, 30.0], torque_limit=[1e4, 1e4]),
        references=(motion_for(robot, driven.log.with_name("motion.parquet")),),
        control_rate=1000.0,
        delay=2,
    )
    same = identify(torque_model(robot), [recording], estimator=DirectInverse(loop=loop))
    found = load_estimate(path)
    np.testing.assert_array_equal(found.values, same.values)
    assert found.estimator["loop"]["file"]["name"] == "controller.toml"
    assert found.relative_rms < 0.02
    assert error_of(path, driven.log) < 0.01


def test_a_position_error_is_fitted_with_the_controllers_delay_and_not_without(driven: Driven, tmp_path: Path):
    punctual = tmp_path / "punctual.toml"
    motion = driven.log.with_name("motion.parquet")
    text = CONTROLLER.replace("delay = 0.002\n", "")
    punctual.write_text(f'{text}[reference]\nfile = "{motion}"\n', encoding="utf-8")
    made(*driven.words("identify", "--estimator", "cloe", "-o", tmp_path / "late.json"))
    made(
        *driven._replace(controller=punctual).words("identify", "--estimator", "cloe", "-o", tmp_path / "punctual.json")
    )
    late, early = (error_of(tmp_path / name, driven.log) for name in ("late.json", "punctual.json"))
    assert late < 0.015
    assert late < 0.5 * early


def test_compare_gives_the_controller_to_those_that_simulate(driven: Driven, tauhat: Tauhat):
    estimators = ("--estimator", "wls", "--estimator", "cloe", "--unseen", driven.log, "--json")
    said = json.loads(tauhat(*driven.words("compare", *estimators)).stdout)
    assert [row["estimator"] for row in said["outcomes"]] == ["wls", "cloe"]
    assert [row["failure"] for row in said["outcomes"]] == ["", ""]
    without = json.loads(tauhat("compare", "two_link", driven.log, "--model", "plain", *estimators).stdout)
    assert without["outcomes"][0]["fit"] == said["outcomes"][0]["fit"]
    assert "--controller" in without["outcomes"][1]["failure"]


def refused(result, word: str) -> None:
    assert result.exit_code == 1
    (line,) = [line for line in result.stderr.splitlines() if line.startswith("error:")]
    assert word in line


def test_a_controller_for_an_estimator_that_does_not_simulate_is_refused_before_anything_is_read(
    tauhat: Tauhat, tmp_path: Path
):
    words = ("two_link", tmp_path / "no.csv", "--controller", tmp_path / "no.toml")
    expected = "a controller is for estimators that simulate the robot; expected idim-iv, didim, cloe, clie, got wls"
    refused(tauhat("identify", *words, "-o", tmp_path / "e.json"), expected)
    refused(tauhat("compare", *words, "--unseen", tmp_path / "no.csv"), expected)


def test_a_missing_file_and_one_that_would_be_overwritten_are_refused(driven: Driven, tauhat: Tauhat, tmp_path: Path):
    words = ("--estimator", "didim", "-o")
    missing = driven._replace(controller=tmp_path / "no.toml")
    refused(tauhat(*missing.words("identify", *words, tmp_path / "e.json")), "no.toml")
    refused(tauhat(*driven.words("identify", *words, driven.controller)), "overwrite")
    assert driven.controller.read_text(encoding="utf-8").startswith("kind")


def test_workers_refuse_an_estimator_that_simulates(driven: Driven, tauhat: Tauhat, tmp_path: Path):
    words = driven.words("identify", "--estimator", "didim", "--workers", 1, "-o", tmp_path / "e.json")
    refused(tauhat(*words), "didim reads every row")


def test_periods_of_a_log_and_of_its_reference_are_averaged_alike(tmp_path: Path):
    robot = load_robot("two_link")
    motion = random_fourier(robot, period=4.0, harmonics=3, rng=np.random.default_rng(2))
    t = np.arange(0.0, 12.0, 4e-3)
    asked = motion.sample(np.mod(t, 4.0))
    log = tmp_path / "run.parquet"
    write_recording(Recording(t=t, q=asked.q, tau=np.sin(asked.q) + asked.dq, joint_names=robot.joint_names), log)
    controller = tmp_path / "controller.toml"
    columns = 'position = { columns = "q_{1..2}" }'
    controller.write_text(f"{CONTROLLER}[reference]\n{columns}\n", encoding="utf-8")
    (reference,) = load_closed_loop(controller, robot, [LogSource(path=log, period=4.0)]).references
    averaged = average_periods(read_recording(log), period=4.0).recording
    np.testing.assert_allclose(reference.sample(averaged.t).q, averaged.q, atol=1e-12)
    assert math.isclose(averaged.duration, 4.0, abs_tol=0.01)
