"""From currents with wrong torque constants to a force: calibrate with a weighed payload, identify again, and sense."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from cli_workshop import made

from tauhat.arrays import FloatArray
from tauhat.cli.experiment import Plan
from tauhat.excitation.fourier import random_fourier
from tauhat.recordings import Recording, write_recording
from tauhat.robots import inertia_at_origin, load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.simulation import nominal_parameters, simulate

ARM = load_robot("ur5e")
MASS = 4.0
AMPERES = np.array([12.0, 12.0, 12.0, 9.0, 9.0, 9.0])  # [Nm/A], the motors' own
WRONG = np.array([1.15, 0.85, 1.15, 0.85, 1.15, 0.85])  # of the map, in parts of the motors' own
FORCE = np.array([0.0, 25.0, -40.0])  # on the flange, axes of the base [N]
MAP = """[time]
column = "t"

[position]
columns = "q_{{1..6}}"

[torque]
columns = "tau_{{1..6}}"
unit = "A"
gain = {gain}
sign = 1
"""


@dataclass(frozen=True)
class SteadyPush:
    """A force on the flange, and nothing else."""

    model: pin.Model
    data: pin.Data

    def torque(self, t: float, q: FloatArray, dq: FloatArray) -> FloatArray:  # noqa: ARG002
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        frame = self.model.getFrameId(ARM.frames[-1].name)
        return pin.computeFrameJacobian(self.model, self.data, q, frame, axes)[:3].T @ FORCE


def logged(folder: Path, name: str, *, seed: int, payload: bool = False, push: bool = False) -> Path:
    """Write a run of the arm in amperes."""
    truth = nominal_parameters(ARM)
    if payload:
        inertia = truth.inertia.copy()
        inertia[-1] += inertia_at_origin(mass=MASS, com=np.array([0.02, 0.03, 0.05]), inertia_at_com=np.eye(3) * 0.01)
        truth = replace(truth, inertia=inertia)
    model = pinocchio_model(ARM)
    pushing = SteadyPush(model, model.createData()) if push else None
    motion = random_fourier(ARM, period=8.0, harmonics=5, rng=np.random.default_rng(seed))
    run: Recording = simulate(
        ARM, motion, rng=np.random.default_rng(seed), parameters=truth, settings=Plan(rate=250.0).settings,
        environment=pushing,
    ).recording  # fmt: skip
    path = folder / f"{name}.parquet"
    write_recording(replace(run, tau=run.tau / AMPERES), path)
    return path


def force_error(estimate: Path, log: Path, map_file: Path) -> float:
    """Return the rms error of the sensed force, while no direction is hidden by a singular position [N]."""
    out = estimate.with_suffix(".csv")
    made("sense", estimate, log, "--map", map_file, "--directions", "force", "-o", out)
    table = np.genfromtxt(out, delimiter=",", names=True)
    found, errors = (np.stack([table[f"{axis}{end}"] for axis in ("fx", "fy", "fz")], axis=1) for end in ("", "_std"))
    told = (errors < 10.0).all(axis=1)
    assert told.mean() > 0.5
    return float(np.sqrt(np.mean(np.sum((found[told] - FORCE) ** 2, axis=1))))


@pytest.fixture(scope="module")
def errors(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float, float]:
    """Return the force's error with wrong, with calibrated and with true torque constants."""
    folder = tmp_path_factory.mktemp("constants")
    empty, loaded = logged(folder, "empty", seed=0), logged(folder, "loaded", seed=0, payload=True)
    pushed = logged(folder, "pushed", seed=1, push=True)
    maps = {name: folder / f"{name}.toml" for name in ("wrong", "calibrated", "true")}
    for name, gains in (("wrong", WRONG * AMPERES), ("true", AMPERES)):
        maps[name].write_text(MAP.format(gain=gains.round(4).tolist()), encoding="utf-8")
    found = {}
    for name, path in maps.items():
        estimate = folder / f"{name}.json"
        made("identify", "ur5e", empty, "--model", "plain", "-o", estimate, "--map", path)
        found[name] = force_error(estimate, pushed, path)
        if name == "wrong":
            pair = ("--unloaded", empty, "--mass", MASS, "--map", path, "-o", maps["calibrated"], "--json")
            said = json.loads(made("calibrate-drives", estimate, loaded, *pair).stdout)
            factors = [joint["factor"] for joint in said["joints"]]
            assert factors == pytest.approx(1.0 / WRONG, rel=0.03)
    return found["wrong"], found["calibrated"], found["true"]


def test_calibrated_torque_constants_take_most_of_the_error_off_the_force(errors) -> None:
    wrong, calibrated, true = errors
    assert wrong > 0.1 * np.linalg.norm(FORCE)
    assert calibrated < 0.2 * wrong
    assert calibrated < 1.3 * true
