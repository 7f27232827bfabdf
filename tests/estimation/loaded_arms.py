"""The planar arm with and without a payload, its torque sensors right or wrong by a factor a joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sample_arms import Truth, autocorrelated_noise, planar_truth
from tauhat.arrays import FloatArray
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots import inertia_at_origin

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
RATE, SECONDS = 200.0, 20.0
EMPTY = planar_truth()
MASS, CENTRE, ABOUT = 0.9, np.array([0.5, 0.08, 0.0]), 0.03
PAYLOAD = inertia_at_origin(mass=MASS, com=CENTRE, inertia_at_com=np.diag([0.02, 0.02, ABOUT]))
RIGHT = np.ones(2)


def carrying(truth: Truth, payload: FloatArray = PAYLOAD) -> Truth:
    """Return the arm with the payload on its last link."""
    standard = truth.standard.copy()
    last = 10 * truth.model.robot.n_v
    standard[last - 10 : last] += payload
    inertia = standard[:last].reshape(-1, 10)
    terms = tuple(term.after(inertia) if term.iterated else term for term in truth.model.terms)
    return Truth(replace(truth.model, terms=terms), standard)


def noise(seed: int, size: float) -> FloatArray:
    shape = (round(SECONDS * RATE), 2)
    rng = np.random.default_rng(seed)
    return size * autocorrelated_noise(rng, shape, time_constant=0.1, rate=RATE) * [1.0, 0.5]


def measured(truth: Truth, *, seed: int, size: float = 0.0, gains: FloatArray = RIGHT) -> Recording:
    """Return a run whose true torque is `gains` times the measured one; `size` of the noise is that of the true one."""
    clean = truth.recording(seed=1, seconds=SECONDS, rate=RATE, noise=noise(seed, size))
    return replace(clean, tau=clean.tau / gains)
