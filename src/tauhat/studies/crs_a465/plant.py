"""The CRS A465 on a MuJoCo plant: the same question where a controller moves the arm and its friction is sharp.

Here nothing of the model is given: filters, delay and the widths of friction are chosen from each log as `tauhat
identify` does, and the plant's Coulomb friction is a true sign that the model's smooth one only comes near to.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.dynamics.model import torque_model
from tauhat.errors import TauhatWarning
from tauhat.estimation import identify
from tauhat.excitation import random_fourier
from tauhat.recordings import Recording
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings, SensorErrors, Simulation, simulate
from tauhat.studies.crs_a465.experiment import ROBOT, TERMS, Experiment, gross_errors, true_arm
from tauhat.studies.crs_a465.fits import METHODS, Case
from tauhat.verification import compare_with_truth

PLANT_CONDITIONS = ("unequal", "outliers")
_HARMONICS = 5
_SEED = 20261125


class PlantFit(NamedTuple):
    """Error of the torque on an unseen motion over that torque, all joints, and joint by joint, (n_v,)."""

    torque: float
    joints: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantPiece:
    """The work on one arm that a controller moves.

    seconds : of each of its two motions
    methods : names of those that are compared
    """

    experiment: Experiment
    seed: int
    seconds: float
    methods: tuple[str, ...] = tuple(METHODS)

    def done(self) -> Mapping[Case, PlantFit]:
        """Return what became of every fit."""
        rng = np.random.default_rng([_SEED, self.seed])
        truth = true_arm(self.experiment, rng)
        robot = load_robot(ROBOT)
        sensors = SensorErrors(
            encoder_step=self.experiment.position_noise, torque_noise=self.experiment.levels("unequal")
        )
        settings = ExperimentSettings(sample_rate=self.experiment.rate, sensors=sensors)
        motions = [random_fourier(robot, period=self.seconds, harmonics=_HARMONICS, rng=rng) for _ in range(2)]
        fitted, unseen = (simulate(robot, motion, rng=rng, parameters=truth, settings=settings) for motion in motions)
        fits: dict[Case, PlantFit] = {}
        for condition in PLANT_CONDITIONS:
            log = self._log(fitted, condition, rng)
            cases = [Case(condition, name, method) for name in TERMS for method in self.methods]
            fits |= {case: _fit(log, unseen, case) for case in cases}
        return fits

    def _log(self, fitted: Simulation, condition: str, rng: np.random.Generator) -> Recording:
        """Return the log as the sensors show it, with gross errors where the condition asks for them."""
        if condition != "outliers":
            return fitted.recording
        shown = np.asarray(fitted.recording.tau)
        return replace(fitted.recording, tau=shown + gross_errors(fitted.truth.tau, self.experiment, rng))


def _fit(log: Recording, unseen: Simulation, case: Case) -> PlantFit:
    """Return what a model identified from a log predicts of the true torque on another motion."""
    model = torque_model(load_robot(ROBOT), TERMS[case.model])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # a spoiled log is what the study is about
        estimate = identify(model, [log], estimator=METHODS[case.method])
    compared = compare_with_truth(estimate, unseen.truth)
    return PlantFit(compared.relative_rms, compared.joints)
