"""`tauhat export` writes what is asked for, says what it could not tell, and refuses in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import mujoco
import numpy as np
import pytest
from export_samples import SOLID_URDF, estimate_of, some_parameters
from typer.testing import CliRunner, Result

from sample_arms import planar_truth
from tauhat.cli.app import app
from tauhat.dynamics import torque_model
from tauhat.estimation import identify
from tauhat.estimation.estimate import load_estimate
from tauhat.export import new_urdf, plain_parameters, standard_parameters
from tauhat.recordings.processing import Processing
from tauhat.robots import load_robot, robot_from_urdf


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["export", *(str(word) for word in words)], env={"COLUMNS": "200"})


@pytest.fixture(scope="module")
def base_estimate(tmp_path_factory) -> Path:
    truth, settings = planar_truth(), Processing(cutoff=10.0, motion_cutoff=30.0)
    path = tmp_path_factory.mktemp("export") / "planar.json"
    identify(truth.model, [truth.recording(seconds=5.0)], processing=settings).save(path)
    return path


@pytest.fixture(scope="module")
def full_estimate(tmp_path_factory) -> Path:
    """An estimate with all standard parameters, of the textbook's model."""
    truth, path = planar_truth(), tmp_path_factory.mktemp("export") / "full.json"
    estimate_of(truth.model, truth.standard).save(path)
    return path


@pytest.fixture(scope="module")
def newcomers(tmp_path_factory) -> Path:
    """A folder with arm.urdf and estimate.json, of the default model, made by the commands that a newcomer runs."""
    folder = tmp_path_factory.mktemp("newcomer")
    robot = load_robot("two_link")
    new_urdf(robot, plain_parameters(robot.inertia)).save(folder / "arm.urdf")
    log, estimate = folder / "run.parquet", folder / "estimate.json"
    tauhat("simulate", folder / "arm.urdf", "-o", log, "--seconds", 8, "--rate", 250, "--spread", 0)
    tauhat("identify", folder / "arm.urdf", log, "--physical", "-o", estimate)
    return folder


def tauhat(*words: object) -> None:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.stderr


def test_the_default_model_is_exported_with_nothing_but_an_output(newcomers, tmp_path):
    estimate = newcomers / "estimate.json"
    done = run(estimate, "--urdf", tmp_path / "a.urdf", "--mjcf", tmp_path / "a.xml", "--c", tmp_path / "a.h")
    assert done.exit_code == 0, done.stderr
    assert "links without shapes; --source arm.urdf writes into the robot's own file instead" in done.stdout
    assert "friction with a memory (dahl, load-dahl) is exact in the functions that end in _step" in done.stdout
    assert "Friction as simulators have it" in done.stdout
    loaded = load_estimate(estimate)
    assert {"dahl", "load-dahl", "stribeck"} < {term.key for term in loaded.model.terms}
    plain = standard_parameters(loaded).plain_friction
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "a.xml"))
    np.testing.assert_array_equal(model.dof_damping, plain.damping)
    np.testing.assert_array_equal(model.dof_frictionloss, plain.dry_friction)
    again = robot_from_urdf(tmp_path / "a.urdf")
    np.testing.assert_allclose([joint.viscous for joint in again.joints], plain.damping)
    np.testing.assert_allclose([joint.coulomb for joint in again.joints], plain.dry_friction)
    np.testing.assert_allclose(again.inertia.ravel(), loaded.standard[:20], atol=1e-9)


def test_approximations_are_told_joint_by_joint_where_a_simulator_is_told_them(newcomers, tmp_path):
    estimate = newcomers / "estimate.json"
    simulator = json.loads(run(estimate, "--mjcf", tmp_path / "a.xml", "--json").stdout)
    told = standard_parameters(load_estimate(estimate)).plain_friction.approximations
    assert simulator["approximations"] == [asdict(one) for one in told]
    assert [one["joint"] for one in simulator["approximations"]] == list(load_robot("two_link").joint_names)
    controller = json.loads(run(estimate, "--c", tmp_path / "a.h", "--json").stdout)
    assert controller["approximations"] == []
    assert controller["c"]["memory"] == ["dahl", "load-dahl"]


def test_the_newcomers_own_urdf_is_filled_and_never_overwritten(newcomers, tmp_path):
    estimate, own = newcomers / "estimate.json", newcomers / "arm.urdf"
    before = own.read_bytes()
    for words in (("--urdf", own), ("--urdf", own, "--source", own)):
        done = run(estimate, *words)
        assert done.exit_code == 1
        assert done.stderr.count("\n") == 1
        assert "would overwrite" in done.stderr
    assert own.read_bytes() == before
    filled = json.loads(run(estimate, "--urdf", tmp_path / "arm.urdf", "--source", own, "--json").stdout)
    assert len(filled["urdf"]["filled"]) == 2
    assert filled["urdf"]["set_to_zero"] == {}


def test_a_negative_rotor_inertia_is_set_to_zero_in_output_json_and_a_warning(tmp_path):
    truth, path = planar_truth(), tmp_path / "e.json"
    standard = truth.standard.copy()
    standard[20] = -0.01
    estimate_of(truth.model, standard).save(path)
    done = run(path, "--mjcf", tmp_path / "a.xml", "--c", tmp_path / "a.h")
    assert "negative, and set to zero: rotor of j1 (-0.01)" in done.stdout
    assert "warning: negative, which simulators refuse, and set to zero: rotor of j1 (-0.01)" in done.stderr
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "a.xml")).dof_armature.tolist() == [0.0, 0.02]
    assert "ddq[0] * 0.01" in (tmp_path / "a.h").read_text()
    told = json.loads(run(path, "--mjcf", tmp_path / "a.xml", "--json").stdout)
    assert told["mjcf"]["set_to_zero"] == {"rotor of j1": -0.01}


def test_all_three_formats_are_written_and_listed(full_estimate, tmp_path):
    out = {"urdf": tmp_path / "a.urdf", "mjcf": tmp_path / "a.xml", "c": tmp_path / "a.h"}
    done = run(full_estimate, *(word for name, path in out.items() for word in (f"--{name}", path)), "--json")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["robot"] == "planar"
    for name, path in out.items():
        assert document[name]["path"] == str(path)
    assert document["urdf"]["left_out"] == document["mjcf"]["left_out"] == {"offset": 0.3}
    assert document["c"]["left_out"] == {}
    assert document["c"]["memory"] == document["approximations"] == []
    assert robot_from_urdf(out["urdf"]).joint_names == ("j1", "j2")
    assert mujoco.MjModel.from_xml_path(str(out["mjcf"])).nv == 2
    assert planar_truth().model.fingerprint in out["c"].read_text()


def test_the_robots_own_urdf_is_filled_and_its_links_are_named(tmp_path):
    source = tmp_path / "made.urdf"
    source.write_text(SOLID_URDF, encoding="utf-8")
    robot = robot_from_urdf(source, locked={"grip": 0.0})
    inertia = some_parameters(robot).inertia
    estimate = tmp_path / "estimate.json"
    estimate_of(torque_model(robot, "inertia"), inertia.ravel()).save(estimate)
    done = run(estimate, "--urdf", tmp_path / "filled.urdf", "--source", source)
    assert done.exit_code == 0, done.stderr
    assert "which holds their inertia now: camera" in done.stdout
    assert "behind locked joints, kept as they were: finger, nail" in done.stdout
    again = robot_from_urdf(tmp_path / "filled.urdf", locked={"grip": 0.0})
    np.testing.assert_allclose(again.inertia, inertia, atol=1e-12)


def test_the_c_header_has_the_prefix_asked_for_and_leaves_out_what_is_named(full_estimate, tmp_path):
    done = run(full_estimate, "--c", tmp_path / "a.h", "--prefix", "left_arm", "--without", "offset,coulomb", "--json")
    assert json.loads(done.stdout)["without"] == ["coulomb", "offset"]
    text = (tmp_path / "a.h").read_text()
    assert "left_arm_inverse_dynamics(" in text
    assert "not in here: coulomb, offset" in text
    assert "tanh" not in text


def test_an_estimate_without_standard_parameters_is_refused_and_nothing_is_written(base_estimate, tmp_path):
    done = run(base_estimate, "--c", tmp_path / "a.h")
    assert done.exit_code == 1
    assert "identify with --physical" in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "message"), [((), "nothing to write"), (("--c", "a.h", "--source", "b"), "--source is")]
)
def test_a_wrong_command_line_says_so(base_estimate, words, message):
    done = run(base_estimate, *words)
    assert done.exit_code == 2
    assert message in done.stderr


def test_the_command_runs_as_a_program(base_estimate, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "tauhat", "export", str(base_estimate), "--mjcf", str(tmp_path / "a.xml")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.count("\n") <= 2
