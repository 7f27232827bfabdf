"""Elastic joints: the simulation is right, springs are found, and what the recording cannot tell is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sample_arms import planar_arm
from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.elastic import ElasticSettings, identify_elastic
from tauhat.estimation.elastic_arm import ElasticArm, elastic_arm, simulate_elastic
from tauhat.recordings.recording import Recording
from tauhat.robots import Robot

STEP, SECONDS = 2e-3, 1.5
STIFFNESS, DAMPING = np.array([900.0, 300.0]), np.array([1.0, 0.4])
POSE = np.array([0.3, 0.6])
NOISE = 2e-5


def geared(robot: Robot, *motors: float) -> Robot:
    joints = tuple(replace(joint, rotor_inertia=own) for joint, own in zip(robot.joints, motors, strict=True))
    return replace(robot, joints=joints)


def arm() -> ElasticArm:
    return replace(elastic_arm(geared(planar_arm(), 0.3, 0.1), POSE), viscous=[0.9, 0.5], coulomb=[0.2, 0.1])


def single() -> ElasticArm:
    """Return one joint without gravity, friction: motor 0.04, link as it comes."""
    robot = planar_arm(gravity=(0.0, 0.0, 0.0))
    return elastic_arm(geared(replace(robot, joints=robot.joints[:1]), 0.04), np.zeros(1))


def sweeps(sizes: tuple[float, ...]) -> FloatArray:
    t = np.arange(0.0, SECONDS, STEP)
    phase = t + (35.0 - 1.0) / (2.0 * SECONDS) * t**2
    return np.array([size * np.sin(2 * np.pi * phase * (1.0 - 0.1 * k)) for k, size in enumerate(sizes)]).T


def recorded(moved: FloatArray, tau: FloatArray, seed: int = 0) -> Recording:
    noise = NOISE * np.random.default_rng(seed).normal(size=moved.shape)
    return Recording(t=np.arange(tau.shape[0]) * STEP, q=moved + noise, tau=tau)


def test_the_simulation_agrees_with_an_integrator_of_the_equations():
    own = arm()
    tau = own.gravity + sweeps((8.0, 3.0))[:200]
    motor, link = simulate_elastic(own, tau, step=STEP, stiffness=STIFFNESS, damping=DAMPING)

    def rates(_, x, torque):
        theta, dtheta, q, dq = x.reshape(4, 2)
        spring = STIFFNESS * (theta - q) + DAMPING * (dtheta - dq)
        friction = own.viscous * dtheta + own.coulomb * np.tanh(dtheta / own.widths)
        turning = (torque - own.gravity - friction - spring) / own.motor_inertia
        return np.concatenate([dtheta, turning, dq, np.linalg.solve(own.mass, spring - own.gravity_slope @ q)])

    x = np.zeros(8)
    for k in range(199):
        x = solve_ivp(rates, (0.0, STEP), x, args=(tau[k],), rtol=1e-8, atol=1e-12).y[:, -1]
        assert np.allclose(motor[k + 1], x[:2], atol=2e-4 * np.abs(motor).max() + 1e-7)
        assert np.allclose(link[k + 1], x[4:6], atol=2e-4 * np.abs(link).max() + 1e-7)


@pytest.mark.parametrize("side", ["motor", "link"])
def test_stiffness_and_damping_of_both_joints_are_found_and_are_the_only_optimum(side):
    own, tau = arm(), arm().gravity + sweeps((8.0, 3.0))
    moved = simulate_elastic(own, tau, step=STEP, stiffness=STIFFNESS, damping=DAMPING)[side == "link"]
    settings = ElasticSettings(side=side, starts=6, band=(3.0, 30.0))
    fit = identify_elastic(own, recorded(moved, tau), rng=np.random.default_rng(1), settings=settings)
    best = fit.best
    error = np.log(np.concatenate([best.stiffness / STIFFNESS, best.damping / DAMPING]))
    assert (np.abs(error) < 4.5 * best.relative_errors).all()
    assert np.allclose(best.stiffness, STIFFNESS, rtol=2e-3)
    assert np.allclose(best.damping, DAMPING, rtol=0.02)
    assert not fit.ambiguous
    assert np.isclose(best.rms, NOISE, rtol=0.1)


def test_masses_that_can_change_places_are_two_optima_of_the_same_residual():
    """From the link's side alone motor and link are interchangeable: the transfer function is symmetric in both."""
    own, tau = single(), sweeps((4.0,))
    link_inertia = own.mass[0, 0]
    _, moved = simulate_elastic(own, tau, step=STEP, stiffness=np.array([200.0]), damping=np.array([0.1]))
    guess = replace(own, motor_inertia=[0.05], stiffness=[200.0])
    settings = ElasticSettings(side="link", unknowns=("damping", "motor_inertia", "link_inertia"), starts=12)
    fit = identify_elastic(guess, recorded(moved, tau), rng=np.random.default_rng(2), settings=settings)
    assert fit.ambiguous
    pairs = sorted((float(o.motor_inertia[0]), float(o.link_inertia[0] * link_inertia)) for o in fit.equal)
    assert len(pairs) == 2
    assert np.allclose(pairs, [(0.04, link_inertia), (link_inertia, 0.04)], rtol=0.01)
    assert np.isclose(fit.equal[0].rms, fit.equal[1].rms, rtol=1e-3)
    low, high = fit.span("motor_inertia")
    assert np.allclose([low[0], high[0]], [0.04, link_inertia], rtol=0.01)


def test_a_valley_of_optima_is_told_by_its_span_and_its_errors():
    """Stiffness and both masses together are one too many from the link's side."""
    own, tau = single(), sweeps((4.0,))
    _, moved = simulate_elastic(own, tau, step=STEP, stiffness=np.array([200.0]), damping=np.array([0.1]))
    unknowns = ("stiffness", "damping", "motor_inertia", "link_inertia")
    settings = ElasticSettings(side="link", unknowns=unknowns, starts=8)
    fit = identify_elastic(own, recorded(moved, tau), rng=np.random.default_rng(3), settings=settings)
    low, high = fit.span("stiffness")
    assert fit.ambiguous
    assert high[0] > 1.05 * low[0]
    assert max(optimum.relative_errors.max() for optimum in fit.equal) > 0.1


def test_the_description_gives_mass_gravity_and_its_slope():
    own = elastic_arm(geared(planar_arm(), 0.1, 0.2), POSE)
    reach = 0.8 * 0.17 * 9.81
    assert np.isclose(own.gravity[1], reach * np.cos(POSE.sum()))
    assert np.isclose(own.gravity_slope[1, 0], -reach * np.sin(POSE.sum()), rtol=1e-6)
    assert np.isclose(own.mass[1, 1], 0.019 + 0.8 * 0.17**2)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: ElasticSettings(unknowns=("mass",)), "unknowns"),
        (lambda: ElasticSettings(side="tool"), "side"),
        (lambda: ElasticSettings(band=(5.0, 2.0)), "search box"),
        (lambda: elastic_arm(planar_arm(), POSE), "positive inertias"),
        (lambda: replace(arm(), coulomb=[-1.0, 0.0]), "friction"),
        (lambda: fitted(ElasticSettings(unknowns=("stiffness",))), "damping is neither sought nor known"),
        (lambda: fitted(ElasticSettings(band=(1.0, 400.0))), "too slow for the band"),
        (lambda: fitted(ElasticSettings(), moved=np.zeros((750, 2))), "nothing moves"),
        (lambda: fitted(ElasticSettings(), moved=np.ones((750, 1))), "does not fit"),
    ],
)
def test_bad_input_is_refused(act, words):
    with pytest.raises(ModelError, match=words):
        act()


def fitted(settings: ElasticSettings, moved: FloatArray | None = None) -> object:
    moved = sweeps((1.0, 1.0)) if moved is None else moved
    recording = Recording(t=np.arange(moved.shape[0]) * STEP, q=moved, tau=np.ones(moved.shape))
    return identify_elastic(arm(), recording, rng=np.random.default_rng(0), settings=settings)
