"""The experiment of the CRS A465 study: what the arms are, what is logged of them, and how it is spoiled.

A true arm is the description with every parameter changed at random, and with a part on each link that the description
knows nothing of: a point of `eccentric` times the link's mass, `reach` radii of gyration away from its centre, in a
random direction. It gives the products of inertia that a simplified model leaves out, and stays a physical body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.motion import motion_from_rows
from tauhat.dynamics.terms import Coulomb
from tauhat.errors import ModelError
from tauhat.excitation import MotionSamples, random_fourier
from tauhat.recordings import Processing, Recording
from tauhat.robots import Robot, central_inertia, inertia_at_origin, load_robot
from tauhat.simulation import TrueParameters, perturbed
from tauhat.verification import standard_parameters

ROBOT = "crs_a465"
TERMS: Mapping[str, str] = {
    "full": "inertia,rotor,viscous,coulomb,offset",
    "simplified": "inertia-simple,rotor,viscous,coulomb,offset",
}
CONDITIONS = ("equal", "unequal", "outliers")
PROCESSING = Processing(cutoff=10.0, motion_cutoff=30.0)
_WIDTH = 0.02  # of the smooth sign of Coulomb friction, in parts of the speed limit
_HARMONICS = 5
_UNSEEN_RATE = 100.0  # [Hz] of the samples that predictions are judged on


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """How the arms and their logs are made.

    seconds : of the motion that is fitted
    unseen_seconds : of the one that predictions are judged on
    rate : samples per second
    noise : of each joint's torque, where it is unequal [Nm]; where it is equal, their root mean square on all joints
    position_noise : [rad]
    spikes : share of the torque samples that are off
    pushes : share of the time in which something leans on a joint, `push_seconds` at a time
    gross : by how many times the joint's RMS torque a spike is off; a push is one RMS torque
    spread : of the true parameters around the description
    eccentric, reach : of the part on each link that the description does not know, see the head of this file
    """

    seconds: float = 20.0
    unseen_seconds: float = 10.0
    rate: float = 200.0
    noise: tuple[float, ...] = (1.0, 0.75, 0.5, 0.1, 0.1, 0.05)
    position_noise: float = 2e-5
    spikes: float = 0.02
    pushes: float = 0.04
    push_seconds: float = 0.3
    gross: float = 10.0
    spread: float = 0.2
    eccentric: float = 0.3
    reach: float = 2.0

    def __post_init__(self) -> None:
        joints = load_robot(ROBOT).n_v
        if len(self.noise) != joints:
            raise ModelError("noise of the joints", where=ROBOT, expected=joints, got=len(self.noise))
        for item in fields(self):
            values = np.atleast_1d(getattr(self, item.name))
            if not (np.isfinite(values) & (values >= 0.0)).all():
                raise ModelError(f"setting {item.name}", expected="no negative number", got=getattr(self, item.name))

    def levels(self, condition: str) -> FloatArray:
        """Return the deviation of each joint's torque noise, (n_v,) [Nm]."""
        unequal = np.array(self.noise)
        return np.full_like(unequal, np.sqrt(np.mean(unequal**2))) if condition == "equal" else unequal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Identifiable:
    """A model with its shapes fixed, and its base parameters."""

    model: TorqueModel
    base: BaseParameters

    def true_values(self, truth: TrueParameters) -> FloatArray:
        """Return the base parameters of a true arm, (n_b,); of a model that leaves terms out, those of what it has."""
        return np.asarray(self.base.projection @ standard_parameters(self.model, truth))

    def regressor(self, samples: MotionSamples) -> FloatArray:
        """Return the regressor along exact samples of a motion, (n_t, n_v, n_b)."""
        layout = self.model.layout(self.base.independent)
        columns, _ = self.model.columns(motion_from_rows(samples.q, samples.dq, samples.ddq), layout)
        place = np.zeros(self.model.n_p, dtype=np.intp)
        place[self.base.independent] = np.arange(self.base.n_b)
        whole = np.zeros((samples.n_t, self.model.robot.n_v, self.base.n_b))
        for joint in range(self.model.robot.n_v):
            part = layout.of_joint(joint)
            whole[:, joint, place[layout.parameters[part]]] = columns[part].T
        return whole


@cache
def identifiable(name: str) -> Identifiable:
    """Return the full or the simplified model of the arm."""
    robot = load_robot(ROBOT)
    sharp = Coulomb(widths=tuple((_WIDTH * robot.velocity_limit).tolist()))
    model = torque_model(robot, TERMS[name]).with_term(sharp)
    return Identifiable(model=model, base=base_parameters(model))


def true_arm(settings: Experiment, rng: np.random.Generator) -> TrueParameters:
    """Return a random true arm whose products of inertia are not zero."""
    robot = load_robot(ROBOT)
    truth = perturbed(robot, rng, spread=settings.spread)
    links = [_with_part(link, settings, rng) for link in truth.inertia]
    return replace(truth, inertia=np.array(links))


def _with_part(link: FloatArray, settings: Experiment, rng: np.random.Generator) -> FloatArray:
    """Return the ten inertial parameters of a link with a point of mass beside it."""
    mass, centre, central = central_inertia(link)
    direction = rng.standard_normal(3)
    gyration = np.sqrt(0.5 * np.trace(central) / mass)
    place = centre + settings.reach * gyration * direction / np.linalg.norm(direction)
    part = inertia_at_origin(mass=settings.eccentric * mass, com=place, inertia_at_com=np.zeros((3, 3)))
    return np.asarray(link + part)


def fitted_motion(settings: Experiment, rng: np.random.Generator, *, seconds: float) -> MotionSamples:
    """Return a random motion of `settings.seconds` inside the limits, run on, or cut off, to last `seconds`."""
    motion = random_fourier(load_robot(ROBOT), period=settings.seconds, harmonics=_HARMONICS, rng=rng)
    return motion.sample(np.arange(0.0, seconds, 1.0 / settings.rate))


def unseen_motion(settings: Experiment, rng: np.random.Generator) -> MotionSamples:
    """Return another random motion."""
    motion = random_fourier(load_robot(ROBOT), period=settings.unseen_seconds, harmonics=_HARMONICS, rng=rng)
    return motion.sample(np.arange(0.0, settings.unseen_seconds, 1.0 / _UNSEEN_RATE))


def recorded(samples: MotionSamples, tau: FloatArray, *, robot: Robot, name: str) -> Recording:
    """Return the motion and a torque (n_t, n_v) as a log without noise."""
    return Recording(t=samples.t, q=samples.q, tau=tau, joint_names=robot.joint_names, name=name)


def spoiled(recording: Recording, condition: str, settings: Experiment, rng: np.random.Generator) -> Recording:
    """Return a log as sensors would show it under one of `CONDITIONS`."""
    tau = np.asarray(recording.tau)
    noisy = tau + settings.levels(condition) * rng.standard_normal(tau.shape)
    if condition == "outliers":
        noisy = noisy + gross_errors(tau, settings, rng)
    return replace(recording, q=recording.q + settings.position_noise * rng.standard_normal(tau.shape), tau=noisy)


def gross_errors(tau: FloatArray, settings: Experiment, rng: np.random.Generator) -> FloatArray:
    """Return the spikes and pushes that spoil a torque, (n_t, n_v) [Nm]."""
    size = np.sqrt(np.mean(tau**2, axis=0))
    struck = rng.random(tau.shape) < settings.spikes
    added = settings.gross * size * struck * rng.choice([-1.0, 1.0], tau.shape)
    long = max(1, min(len(tau), round(settings.push_seconds * settings.rate)))
    for joint in range(tau.shape[1]):
        for start in rng.integers(0, len(tau) - long + 1, round(settings.pushes * len(tau) / long)):
            added[start : start + long, joint] += size[joint] * rng.choice([-1.0, 1.0])
    return np.asarray(added)
