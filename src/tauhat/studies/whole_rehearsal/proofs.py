"""The proofs of an identified model that know nothing of each other: pieces of work for any process."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from tauhat.control.controller import Controller
from tauhat.control.laws import PDFeedforward, TrackingLaw
from tauhat.control.model_laws import ModelFeedforward
from tauhat.errors import TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identified_torque import identified_torque
from tauhat.excitation.fourier import random_fourier
from tauhat.simulation.closed_loop import Encoder
from tauhat.simulation.gains import tracking_gains
from tauhat.studies.gain_rehearsal import Rehearsal
from tauhat.studies.gain_tuning import GainSearch, TunedGains, tune_gains
from tauhat.studies.whole_rehearsal.scene import Scene
from tauhat.verification.known_payload import PayloadCheck, check_payload
from tauhat.verification.motion_tracking import TrackingComparison, compare_tracking, tracking_contenders
from tauhat.verification.static import StaticCheck, static_check

BANDWIDTH = 5.0  # [Hz] of the feedback that all controllers share
CONTENDERS = ("PD", "PD + gravity", "feedforward, nominal", "feedforward, identified", "computed torque, identified")
_TUNED_SECONDS = 3.0  # of the motions that gains are tuned and judged on
_TUNED_HARMONICS = 3
_TUNED_MARGIN = 0.3
_LOOKED_AT = 60  # samples of the motion from which gains are set by hand
_DELAY = 1e-3  # [s] from encoder to torque
_TUNE_SEED, _JUDGE_SEED = 1, 2

Proved = TrackingComparison | TunedGains | StaticCheck | PayloadCheck


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proof(ABC):
    """A question to a model."""

    scene: Scene
    estimate: Estimate

    @abstractmethod
    def done(self) -> Proved:
        """Return the answer."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tracked(Proof):
    """How closely the robot follows the task path with this model, with the description's, and with none."""

    def done(self) -> TrackingComparison:
        """Return the tracking errors of all controllers."""
        settings = replace(self.scene.experiment.settings, bandwidth=BANDWIDTH)
        motion = self.scene.motions["task path"]
        every = tracking_contenders(self.estimate, motion, settings=settings)
        chosen = [contender for contender in every if contender.name in CONTENDERS]
        return compare_tracking(self.estimate, motion, truth=self.scene.truth, settings=settings, contenders=chosen)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tuned(Proof):
    """Gains of the feedback beside the model's feedforward, tuned in a few trials."""

    trials: int

    def done(self) -> TunedGains:
        """Return the gains, judged on a motion and noise that the search did not see."""
        tuned_on, judged_on = self._place(_TUNE_SEED), self._place(_JUDGE_SEED)
        robot, rate = self.scene.robot, tuned_on.settings.control_rate
        samples = tuned_on.motion.sample(np.linspace(0.0, tuned_on.motion.duration, _LOOKED_AT))
        hand = tracking_gains(robot, samples.q, bandwidth=BANDWIDTH, control_rate=rate)
        law = PDFeedforward(kp=hand.kp, kd=hand.kd, torque_limit=hand.torque_limit)
        found = identified_torque(self.estimate)

        def equipped(tried: TrackingLaw) -> Controller:
            shaped = PDFeedforward(kp=tried.kp, kd=tried.kd, torque_limit=tried.torque_limit)
            return ModelFeedforward(torque=found, law=shaped)

        return tune_gains(
            tuned_on, law, unseen=judged_on, search=GainSearch(trials=self.trials), equipped=equipped
        )  # fmt: skip

    def _place(self, seed: int) -> Rehearsal:
        scene = self.scene
        rng = np.random.default_rng([scene.experiment.robot_seed, seed])
        motion = random_fourier(
            scene.robot, period=_TUNED_SECONDS, harmonics=_TUNED_HARMONICS, rng=rng, margin=_TUNED_MARGIN
        )
        side = scene.experiment.settings.encoder.side
        encoder = Encoder(side=side, step=2e-5, velocity="differenced")
        settings = replace(scene.experiment.settings, control_delay=_DELAY, encoder=encoder, settle=0.2)
        return Rehearsal(robot=scene.robot, motion=motion, truth=scene.truth, settings=settings, seed=seed)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Held(Proof):
    """Gravity and friction in poses that are reached from both sides."""

    def done(self) -> StaticCheck:
        """Return both beside the model's."""
        return static_check(self.estimate, [self.scene.run("static").recording])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Weighed(Proof):
    """A payload that is known, found by the model."""

    def done(self) -> PayloadCheck:
        """Return its mass and centre beside what is known."""
        payload = self.scene.payload
        loaded = self.scene.run("loaded").recording
        return check_payload(self.estimate, [loaded], mass=payload.mass, centre=payload.centre)


def proved(proof: Proof) -> Proved:
    """Return the answer to a question; torque at its limit is no news here, its cost is in the errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        return proof.done()
