"""One identified and verified planar arm, with names that try to break out of the page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hostile_names import HOSTILE_JOINT, HOSTILE_LOG

from sample_arms import planar_truth
from tauhat.dynamics import TorqueModel
from tauhat.estimation import Estimate, identify
from tauhat.recordings.processing import Processing
from tauhat.robots import Robot
from tauhat.verification import Verification, verify


def hostile(robot: Robot) -> Robot:
    first, second = robot.joints
    return replace(robot, name="<i>arm</i>", joints=(first, replace(second, name=HOSTILE_JOINT)))


@pytest.fixture(scope="session")
def verified() -> tuple[Estimate, Verification]:
    truth = planar_truth()
    rng = np.random.default_rng(5)
    runs = [truth.recording(seed=k, noise=0.05 * rng.normal(size=(4000, 2))) for k in range(3)]
    runs[1] = replace(runs[1], name=HOSTILE_LOG)
    model = TorqueModel(robot=hostile(truth.model.robot), terms=truth.model.terms)
    estimate = identify(model, runs[:1], processing=Processing(cutoff=8.0, motion_cutoff=30.0))
    return estimate, verify(estimate, runs[1:])


@pytest.fixture(scope="session")
def estimate(verified: tuple[Estimate, Verification]) -> Estimate:
    return verified[0]


@pytest.fixture(scope="session")
def verification(verified: tuple[Estimate, Verification]) -> Verification:
    return verified[1]
