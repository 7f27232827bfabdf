"""From a real log to other programs: a UR10e identified, exported three times, loaded, compiled, compared."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from c_library import built, close, needs_compiler
from export_samples import largest_relative, mujoco_torque, pinocchio_torque, states, without_shapes
from typer.testing import CliRunner

from tauhat.arrays import FloatArray
from tauhat.cli.app import app
from tauhat.dynamics import inverse_dynamics
from tauhat.estimation import Estimate
from tauhat.estimation.estimate import load_estimate
from tauhat.export import standard_parameters
from tauhat.recordings.filters import with_context
from tauhat.recordings.processing import clock_step, stretches
from tauhat.recordings.reading import read_recording
from tauhat.recordings.recording import Recording
from tauhat.verification import verify
from tauhat.verification.prediction import LogPrediction

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("TAUHAT_REAL_DATA", ROOT.parent / "shared" / "data")) / "ur10e"
MAP = ROOT / "examples" / "real" / "ur10e.toml"

pytestmark = [
    pytest.mark.real,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"no measured logs at {DATA} (set TAUHAT_REAL_DATA)"),
]


@dataclass(frozen=True)
class Exported:
    """What the commands wrote, and what `export` printed."""

    estimate: Estimate
    folder: Path
    document: dict[str, object]


def tauhat(*words: object) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> Exported:
    folder = tmp_path_factory.mktemp("ur10e")
    estimate, source = folder / "estimate.json", DATA / "ur10e.urdf"
    log = DATA / "ur-20_02_10-30sec_12harm.csv.gz"
    window = ("--map", MAP, "--rows", "634:3510", "--cutoff", 8)
    tauhat("identify", source, log, *window, "--physical", "-o", estimate)
    outputs = ("--urdf", folder / "new.urdf", "--mjcf", folder / "arm.xml", "--c", folder / "arm.h")
    document = json.loads(tauhat("export", estimate, *outputs, "--json"))
    tauhat("export", estimate, "--urdf", folder / "filled.urdf", "--source", source)
    return Exported(load_estimate(estimate), folder, document)


@pytest.fixture(scope="module")
def unseen() -> Recording:
    return read_recording(DATA / "ur-20_02_12-40sec_12harm.csv.gz", map=MAP, rows=(499, 4460))


@pytest.mark.parametrize("name", ["new.urdf", "filled.urdf"])
def test_pinocchio_has_the_identified_inverse_dynamics_from_the_urdf(exported, name):
    robot, parameters = exported.estimate.robot, standard_parameters(exported.estimate)
    motion = states(robot)
    model = pin.buildModelFromXML(without_shapes((exported.folder / name).read_text(encoding="utf-8")))
    rigid = inverse_dynamics(robot, *motion, inertia=parameters.inertia)
    assert largest_relative(pinocchio_torque(model, robot, motion), rigid) < 1e-9
    indices = [model.joints[model.getJointId(joint)].idx_v for joint in robot.joint_names]
    np.testing.assert_allclose(model.damping[indices], parameters.plain_friction.damping, rtol=1e-12)
    np.testing.assert_allclose(model.friction[indices], parameters.plain_friction.dry_friction, rtol=1e-12)


def test_mujoco_has_the_identified_inverse_dynamics_with_rotors_and_the_fitted_damping(exported):
    robot, parameters = exported.estimate.robot, standard_parameters(exported.estimate)
    motion = states(robot)
    rigid = inverse_dynamics(robot, *motion, inertia=parameters.inertia) + parameters.rotor * motion[2]
    expected = rigid + parameters.plain_friction.damping * motion[1]
    text = (exported.folder / "arm.xml").read_text(encoding="utf-8")
    assert largest_relative(mujoco_torque(text, robot, motion), expected) < 1e-9


@needs_compiler
def test_the_c_code_predicts_an_unseen_log_as_verify_does(exported, unseen, tmp_path):
    estimate = exported.estimate
    call = built(tmp_path, estimate.robot, standard_parameters(estimate))
    log, motion = verify(estimate, [unseen]).logs[0], motion_of(estimate, unseen)
    torque = call("torque_step", *motion)
    close(torque, estimate.predict(*motion))
    close(as_verified(estimate, unseen, torque), log.predicted)
    assert log.relative_rms < 0.025
    steady = as_verified(estimate, unseen, call("torque", *motion))
    assert relative(steady, log) < 0.03


def test_damping_and_dry_friction_predict_an_unseen_log_as_well_as_a_textbook_model(exported, unseen):
    estimate, parameters = exported.estimate, standard_parameters(exported.estimate)
    log, (q, dq, ddq) = verify(estimate, [unseen]).logs[0], motion_of(estimate, unseen)
    rigid = inverse_dynamics(estimate.robot, q, dq, ddq, inertia=parameters.inertia) + parameters.rotor * ddq
    plain = parameters.plain_friction
    braked = rigid + plain.damping * dq + plain.dry_friction * np.sign(dq)
    assert relative(as_verified(estimate, unseen, braked), log) < 0.05


def motion_of(estimate: Estimate, recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return q, dq, ddq (n_t, n_v) of a recording as verification has them."""
    parts = list(stretches(recording, estimate.processing))
    q, dq, ddq = (np.concatenate([getattr(part, name) for part in parts], axis=1).T for name in ("q", "dq", "ddq"))
    return q, dq, ddq


def as_verified(estimate: Estimate, recording: Recording, torque: FloatArray) -> FloatArray:
    """Return a torque (n_t, n_v) filtered, decimated and cut as verification does it."""
    log, start = verify(estimate, [recording]).logs[0], next(stretches(recording, estimate.processing)).t[0]
    low_pass = estimate.processing.parallel_filter(1.0 / clock_step(recording))
    windows = with_context(iter([torque.T]), low_pass.half, multiple=low_pass.decimation)
    filtered = np.concatenate([low_pass.apply(window) for window in windows], axis=1).T
    first = round((log.t[0] - start) / (clock_step(recording) * low_pass.decimation))
    return filtered[first : first + len(log.t)]


def relative(torque: FloatArray, log: LogPrediction) -> float:
    return float(np.linalg.norm(torque - log.tau) / np.linalg.norm(log.tau))


def test_what_simulators_are_told_of_friction_is_said_joint_by_joint(exported):
    told = exported.document["approximations"]
    assert [one["joint"] for one in told] == list(exported.estimate.robot.joint_names)
    assert all(0.0 < one["share"] < 0.5 for one in told)
    assert exported.document["c"]["memory"] == ["dahl", "load-dahl"]
    assert set(exported.document["mjcf"]["left_out"]) == {"offset"}
