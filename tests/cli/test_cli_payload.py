"""`tauhat payload` and `tauhat calibrate-drives`: from files to numbers, files and one-line refusals."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat, made

from tauhat.cli.experiment import Plan, run_experiment
from tauhat.excitation.fourier import random_fourier
from tauhat.recordings import load_map, write_recording
from tauhat.robots import inertia_at_origin, load_robot
from tauhat.simulation.parameters import nominal_parameters

MASS = 1.5
WRONG = np.array([0.8, 1.25])  # true over measured torque
MAP = """# of the test arm
[time]
column = "t"

[position]
columns = "q_{1..2}"

[torque]
columns = "tau_{1..2}"
unit = "A"
gain = [2.0,  # one line
        3.0]  # each
sign = 1

[joints]
names = ["joint_1", "joint_2"]
"""


@dataclass(frozen=True)
class Bench:
    folder: Path
    empty: Path
    loaded: Path
    map: Path
    estimate: Path
    common: tuple[object, ...]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Return runs of an arm without and with a payload, logged in amperes, and a map whose gains are wrong."""
    folder, robot = tmp_path_factory.mktemp("bench"), load_robot("two_link")
    plan = Plan(seconds=8.0, rate=250.0)
    motion = random_fourier(robot, period=8.0, harmonics=5, rng=np.random.default_rng(0))
    truth = nominal_parameters(robot)
    inertia = truth.inertia.copy()
    inertia[1] += inertia_at_origin(mass=MASS, com=np.array([0.05, 0.02, 0.0]), inertia_at_com=np.eye(3) * 0.02)
    for name, plant in (("empty", truth), ("loaded", replace(truth, inertia=inertia))):
        run = run_experiment(robot, plan, truth=plant, rng=np.random.default_rng(1), motion=motion).recording
        logged = replace(run, tau=run.tau / WRONG / np.array([2.0, 3.0]))
        write_recording(logged, folder / f"{name}.parquet")
    made_map = folder / "arm.toml"
    made_map.write_text(MAP, encoding="utf-8")
    made("identify", "two_link", folder / "empty.parquet", "-o", folder / "empty.json", "--map", made_map)
    paths = [folder / name for name in ("empty.parquet", "loaded.parquet", "arm.toml", "empty.json")]
    return Bench(folder, *paths, common=(paths[3], paths[1], "--map", made_map))


def test_the_arm_with_its_payload_predicts_what_the_arm_alone_does_not(bench: Bench, tmp_path: Path) -> None:
    loaded = tmp_path / "loaded.json"
    data = json.loads(made("payload", *bench.common, "-o", loaded, "--json").stdout)
    assert data["estimate"] == str(loaded)
    assert data["link"] == "joint_2"
    verify = ("verify", bench.loaded, "--map", bench.map, "--json")
    errors = [
        json.loads(made(verify[0], estimate, *verify[1:]).stdout)["logs"][0]["relative_rms"]
        for estimate in (bench.estimate, loaded)
    ]
    assert errors[0] > 0.15
    assert errors[1] < 0.05


def test_with_unloaded_runs_too_both_are_fitted_together(bench: Bench) -> None:
    alone = json.loads(made("payload", *bench.common, "--json").stdout)
    both = json.loads(made("payload", *bench.common, "--unloaded", bench.empty, "--json").stdout)
    assert both["mass"] == pytest.approx(alone["mass"], rel=0.05)
    assert both["mass"] != alone["mass"]
    cut = made("payload", *bench.common, "--unloaded", bench.empty, "--unloaded-rows", "0:1000", "--json")
    assert json.loads(cut.stdout)["mass"] not in {alone["mass"], both["mass"]}


def test_what_is_printed_names_what_the_motion_does_not_show(bench: Bench) -> None:
    text = made("payload", *bench.common).stdout
    assert "mass" in text
    assert "not visible" in text


def test_drives_are_calibrated_and_the_new_map_weighs_the_payload(bench: Bench, tmp_path: Path) -> None:
    new = tmp_path / "new.toml"
    pair = ("--unloaded", bench.empty, "--mass", MASS)
    data = json.loads(made("calibrate-drives", *bench.common, *pair, "-o", new, "--json").stdout)
    factors = [joint["factor"] for joint in data["joints"]]
    assert np.allclose(factors, WRONG, rtol=0.03)
    assert load_map(new).torque.scale == pytest.approx(np.array([2.0, 3.0]) * factors, rel=1e-5)
    text = new.read_text(encoding="utf-8")
    assert text.startswith("# of the test arm\n")
    assert text.endswith(MAP[MAP.index("sign = 1") :])
    estimate = tmp_path / "again.json"
    made("identify", "two_link", bench.empty, "-o", estimate, "--map", new)
    weighed = json.loads(made("payload", estimate, bench.loaded, "--map", new, "--json").stdout)
    assert weighed["mass"] == pytest.approx(MASS, rel=0.02)
    assert abs(data["found_mass"] - MASS) > 0.1
    assert "least squares" in made("calibrate-drives", *bench.common, *pair).stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--limit", 0.5), "heavier than the limit"),
        (("--mass", 2, "--limit", 1), "heavier than the limit"),
        (("--mass", 0), "must be positive"),
        (("--link", "joint_7"), "no such link"),
    ],
)
def test_payloads_that_cannot_be_are_refused_in_one_line(bench, tauhat: Tauhat, tmp_path, words, message) -> None:
    result = tauhat("payload", *bench.common, "-o", tmp_path / "loaded.json", *words)
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "loaded.json").exists()


def test_a_gain_of_wrong_sign_is_refused_in_one_line_that_names_the_joint(bench, tauhat: Tauhat, tmp_path) -> None:
    turned, estimate = tmp_path / "turned.toml", tmp_path / "turned.json"
    turned.write_text(MAP.replace("sign = 1", "sign = [1, -1]"), encoding="utf-8")
    made("identify", "two_link", bench.empty, "-o", estimate, "--map", turned)
    words = (estimate, bench.loaded, "--map", turned, "--unloaded", bench.empty, "--mass", MASS)
    result = tauhat("calibrate-drives", *words, "-o", tmp_path / "new.toml")
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1].startswith("error: joint joint_2: the torque has the wrong sign")
    assert not (tmp_path / "new.toml").exists()


def test_a_map_cannot_be_corrected_where_logs_have_none(bench, tauhat: Tauhat, tmp_path) -> None:
    words = (bench.estimate, bench.loaded, "--unloaded", bench.empty, "--mass", MASS)
    result = tauhat("calibrate-drives", *words, "-o", tmp_path / "new.toml")
    assert result.exit_code == 1
    assert "do not share a map" in result.stderr


def test_the_map_itself_is_never_overwritten(bench, tauhat: Tauhat) -> None:
    pair = ("--unloaded", bench.empty, "--mass", MASS)
    result = tauhat("calibrate-drives", *bench.common, *pair, "-o", bench.map)
    assert result.exit_code == 1
    assert "overwrite" in result.stderr
    assert bench.map.read_text(encoding="utf-8") == MAP


@pytest.mark.parametrize("text", ["1,2", "a,b,c", "1,2,inf"])
def test_a_centre_that_is_no_point_is_an_error_of_usage(bench, tauhat: Tauhat, text) -> None:
    words = ("--unloaded", bench.empty, "--mass", MASS, "--centre", text)
    assert tauhat("calibrate-drives", *bench.common, *words).exit_code == 2
