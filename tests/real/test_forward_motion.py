"""A measured log done again in simulation: its torque drives the identified robot along the measured motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tauhat.dynamics import torque_model
from tauhat.estimation import identify
from tauhat.recordings import read_recording
from tauhat.robots import load_robot
from tauhat.verification import forward_motion

pytestmark = pytest.mark.real


def test_the_torque_of_a_ur10e_drives_its_identified_model_and_not_its_description(
    real_data: Path, real_maps: Path
) -> None:
    folder, log_map = real_data / "ur10e", real_maps / "ur10e.toml"
    fitted = read_recording(folder / "ur-20_02_19_14harm50sec.csv.gz", map=log_map, rows=(194, 4966))
    unseen = read_recording(folder / "ur-20_02_10-30sec_12harm.csv.gz", map=log_map, rows=(634, 3510))
    estimate = identify(torque_model(load_robot(folder / "ur10e.urdf")), [fitted], cutoff=8.0)
    result = forward_motion(estimate, unseen)
    identified, nominal = result.run("identified", "driven"), result.run("nominal", "driven")
    assert (identified.rms < 0.005 * result.span).all()
    assert np.linalg.norm(identified.rms) < 0.1 * np.linalg.norm(nominal.rms)
