"""Two short logs identify what one leaves uncertain: recordings of the same robot add up.

    python examples/identify_two_logs.py

The logs come from the simulated two-link arm, so that the error against the truth can be told.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from tauhat.dynamics import torque_model
from tauhat.estimation import identify
from tauhat.excitation import random_fourier
from tauhat.recordings import read_recording, write_recording
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings, SensorErrors, simulate
from tauhat.verification import verify

robot = load_robot("two_link")
rng = np.random.default_rng(1)
settings = ExperimentSettings(sensors=SensorErrors(encoder_step=2e-5, relative_torque_noise=0.05))
with tempfile.TemporaryDirectory() as folder:
    logs = [Path(folder) / f"run_{number}.csv" for number in range(3)]
    for log in logs:
        motion = random_fourier(robot, period=8.0, harmonics=5, rng=rng)
        write_recording(simulate(robot, motion, rng=rng, settings=settings).recording, log)

    recordings = [read_recording(log) for log in logs]
    one = identify(torque_model(robot), recordings[:1])
    two = identify(torque_model(robot), recordings[:2])
    unseen = verify(two, recordings[2:]).logs[0]

narrower = float(np.median(two.standard_errors / one.standard_errors))
print(f"standard errors with two logs: {narrower:.2f} of those with one (median)")
print(f"error on the third log: {100 * unseen.relative_rms:.2f} % of its torque")
assert narrower < 0.9
assert unseen.relative_rms < 0.02
