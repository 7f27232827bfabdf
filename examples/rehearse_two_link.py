"""Rehearse an experiment before it is run, to see whether motion, noise and rate would identify the robot.

    python examples/rehearse_two_link.py

A truth near the robot's description is drawn, a log is simulated in MuJoCo and identified, and the estimate is held
against the truth, which only a simulation knows.
"""

from __future__ import annotations

import numpy as np

from tauhat.dynamics import torque_model
from tauhat.estimation import identify
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings, SensorErrors, perturbed, simulate
from tauhat.verification import compare_with_truth

robot = load_robot("two_link")
rng = np.random.default_rng(7)
truth = perturbed(robot, rng, spread=0.2)
settings = ExperimentSettings(sample_rate=500.0, sensors=SensorErrors(encoder_step=1e-4, relative_torque_noise=0.03))
motions = [random_fourier(robot, period=15.0, harmonics=5, rng=rng) for _ in range(2)]
fitted, unseen = (simulate(robot, motion, rng=rng, parameters=truth, settings=settings) for motion in motions)

estimate = identify(torque_model(robot), [fitted.recording])
compared = compare_with_truth(estimate, unseen.truth)
print(f"condition number of the motion: {estimate.condition:.1f}")
print(f"error on another motion, against the noise-free torque: {100 * compared.relative_rms:.2f} %")
print(f"true values inside their 95 % intervals: {compared.inside.sum()} of {compared.inside.size}")
assert estimate.condition < 100
assert compared.relative_rms < 0.02
assert compared.share_inside >= 0.75
