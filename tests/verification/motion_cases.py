"""A UR5e that is not its data sheet, identified from one log; a second motion that the fit never saw."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from tauhat.control import PDGravity
from tauhat.dynamics import torque_model
from tauhat.estimation import Estimate, identify
from tauhat.excitation import FourierSeries, random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings, Simulation, TrueParameters, perturbed, simulate, tracking_gains
from tauhat.verification import standard_parameters

ARM = load_robot("ur5e")
SETTINGS = ExperimentSettings(timestep=1e-3, control_rate=1000.0, sample_rate=500.0, settle=0.1, bandwidth=5.0)


@dataclass(frozen=True)
class Rehearsed:
    truth: TrueParameters
    estimate: Estimate
    unseen: FourierSeries
    law: PDGravity
    log: Simulation

    @property
    def exact(self) -> Estimate:
        """The estimate with the plant's own values."""
        model, base = self.estimate.model, self.estimate.base
        return replace(self.estimate, values=base.projection @ standard_parameters(model, self.truth))


@cache
def rehearsed() -> Rehearsed:
    rng = np.random.default_rng(3)
    truth = perturbed(ARM, rng, spread=0.2)
    seen, unseen = (random_fourier(ARM, period=p, harmonics=4, rng=rng, margin=0.3) for p in (8.0, 3.0))
    fitted = simulate(ARM, seen, rng=rng, parameters=truth, settings=SETTINGS).recording
    law = tracking_gains(ARM, unseen.sample(np.linspace(0.0, 3.0, 50)).q, bandwidth=5.0, control_rate=1000.0)
    driven = replace(SETTINGS, controller=law)
    log = simulate(ARM, unseen, rng=rng, parameters=truth, settings=driven)
    return Rehearsed(truth, identify(torque_model(ARM), [fitted]), unseen, law, log)
