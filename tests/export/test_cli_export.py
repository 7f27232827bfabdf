"""`tauhat export` writes what is asked for, says what it could not tell, and refuses in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from export_samples import URDF, some_parameters
from typer.testing import CliRunner, Result

from sample_arms import planar_truth
from tauhat.cli.app import app
from tauhat.dynamics import torque_model
from tauhat.estimation import identify
from tauhat.recordings.processing import Processing
from tauhat.robots import robot_from_urdf


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["export", *(str(word) for word in words)], env={"COLUMNS": "200"})


@pytest.fixture(scope="module")
def base_estimate(tmp_path_factory) -> Path:
    truth, settings = planar_truth(), Processing(cutoff=10.0, motion_cutoff=30.0)
    path = tmp_path_factory.mktemp("export") / "planar.json"
    identify(truth.model, [truth.recording(seconds=5.0)], processing=settings).save(path)
    return path


@pytest.fixture
def full_estimate(base_estimate, monkeypatch) -> Path:
    """An estimate file that is read as one with full standard parameters."""
    truth = planar_truth()
    full = SimpleNamespace(model=truth.model, robot=truth.model.robot, standard=truth.standard)
    monkeypatch.setattr("tauhat.estimation.estimate.load_estimate", lambda _: full)
    return base_estimate


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
    assert robot_from_urdf(out["urdf"]).joint_names == ("j1", "j2")
    assert mujoco.MjModel.from_xml_path(str(out["mjcf"])).nv == 2
    assert planar_truth().model.fingerprint in out["c"].read_text()


def test_the_robots_own_urdf_is_filled_and_its_links_are_named(base_estimate, tmp_path, monkeypatch):
    source = tmp_path / "made.urdf"
    solid = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    source.write_text(URDF.replace('<link name="fore" />', f'<link name="fore">{solid}</link>'), encoding="utf-8")
    robot = robot_from_urdf(source, locked={"grip": 0.0})
    inertia = some_parameters(robot).inertia
    full = SimpleNamespace(model=torque_model(robot, "inertia"), robot=robot, standard=inertia.ravel())
    monkeypatch.setattr("tauhat.estimation.estimate.load_estimate", lambda _: full)
    done = run(base_estimate, "--urdf", tmp_path / "filled.urdf", "--source", source)
    assert done.exit_code == 0, done.stderr
    assert "which holds their inertia now: camera" in done.stdout
    assert "behind locked joints, kept as they were: finger, nail" in done.stdout
    again = robot_from_urdf(tmp_path / "filled.urdf", locked={"grip": 0.0})
    np.testing.assert_allclose(again.inertia, inertia, atol=1e-12)
    refused = run(base_estimate, "--urdf", tmp_path / "filled.urdf")
    assert "made.urdf: the robot has a URDF of its own; give it by --source" in refused.stderr
    lost = run(base_estimate, "--urdf", source, "--source", source)
    assert "would overwrite a file it is made from" in lost.stderr


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
