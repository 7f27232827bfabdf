"""Slotine and Li's adaptive tracking: its regressor, its Lyapunov function in simulation, dead zone and bounds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sample_arms import PLANAR, planar_arm, random_tree, smooth_motion
from tauhat.control import AdaptiveTracking, ControlSample, learning_along, model_torque, tracking_regressor
from tauhat.dynamics import TorqueModel, base_parameters, inverse_dynamics, rotor_mass_matrix, torque_model
from tauhat.dynamics.forward import nominal_masses
from tauhat.dynamics.terms import Coulomb, CouplingDahl, GasSpring, Inertia, RotorInertia, Viscous
from tauhat.errors import ArrayError, ModelError
from tauhat.robots import pinocchio_model

ARM = planar_arm()
MODEL = torque_model(ARM, "inertia,rotor,viscous,coulomb").with_term(Coulomb(widths=(0.05, 0.05)))
BASE = base_parameters(MODEL)
VISCOUS, COULOMB = np.array([0.6, 0.3]), np.array([0.8, 0.4])
TRUE = BASE.projection @ np.concatenate([ARM.inertia.ravel(), [0.0, 0.0], VISCOUS, COULOMB])
GAIN, STIFFNESS = np.array([6.0, 2.0]), np.array([4.0, 4.0])
PERIOD, SECONDS = 5e-4, 2.0


def controller_from(values, **changes):
    regressor = tracking_regressor(MODEL, BASE)
    settings = {"gain": GAIN, "stiffness": STIFFNESS, "learning": learning()} | changes
    return AdaptiveTracking(regressor=regressor, values=values, **settings)


@cache
def learning():
    t = np.arange(0.0, SECONDS, 0.01)
    motion = smooth_motion(2, t, seed=2)
    return learning_along(tracking_regressor(MODEL, BASE), motion, gain=GAIN, time=0.5)


def run(controller, *, friction=True):
    """Return s, speed errors of friction, and parameters at every step of Pinocchio's planar arm, (n, ...)."""
    model = pinocchio_model(ARM)
    data = model.createData()
    t = np.arange(0.0, SECONDS, PERIOD)
    references = np.array(smooth_motion(2, t, seed=2)).transpose(1, 0, 2)
    q, dq = references[0, 0] + [0.05, -0.05], references[0, 1].copy()
    memory, history = None, []
    for now, (q_ref, dq_ref, ddq_ref) in zip(t, references, strict=True):
        still = np.zeros(2)
        shown = ControlSample(now, PERIOD, q, dq, q_ref, dq_ref, ddq_ref, still, still)
        memory = controller.start(shown) if memory is None else memory
        s = dq - dq_ref + STIFFNESS * (q - q_ref)
        history.append((q, dq, s, memory.values))
        memory, tau = controller.step(memory, shown)
        for _ in range(5):  # the plant's own, finer steps
            taken = VISCOUS * dq + COULOMB * np.tanh(dq / 0.05) if friction else 0.0
            dq = dq + PERIOD / 5 * pinocchio.aba(model, data, q, dq, tau - taken)
            q = q + PERIOD / 5 * dq
    q, dq, s, values = (np.array(column) for column in zip(*history, strict=True))
    return q, dq, s, values


def lyapunov(q, s, values):
    masses = rotor_mass_matrix(ARM, q, masses=nominal_masses(ARM))
    kinetic = 0.5 * np.einsum("ti,tij,tj->t", s, masses, s)
    wrong = values - TRUE
    return kinetic + 0.5 * np.einsum("ti,ij,tj->t", wrong, np.linalg.inv(learning()), wrong)


@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 5))
def test_with_the_robots_own_motion_the_regressor_gives_its_torque(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    model = torque_model(robot, "inertia")
    base = base_parameters(model)
    q, dq, ddq = rng.normal(size=(3, n_v))
    columns = tracking_regressor(model, base).columns((q, dq), dq, ddq, bent=np.zeros(0))
    torque = inverse_dynamics(robot, q[None], dq[None], ddq[None])[0]
    ours = columns @ (base.projection @ robot.inertia.ravel())
    np.testing.assert_allclose(ours, torque, atol=1e-7 * max(1.0, np.abs(torque).max()))


def test_springs_and_shared_motors_are_columns_of_the_regressor_too():
    spring = GasSpring(joint=1, distance=0.8, lever=0.2, angle=0.1, area=1e-3, volume=1e-3)
    shared = CouplingDahl(motors=((1, 0, -1.7),), scales=(30.0,))
    model = TorqueModel(robot=ARM, terms=(Inertia(), RotorInertia(), Viscous(), spring, shared))
    base = base_parameters(model)
    standard = np.random.default_rng(6).uniform(0.2, 1.0, model.n_p)
    q, dq, ddq = smooth_motion(2, np.arange(0.0, 1.0, 0.01), seed=5)
    regressor = tracking_regressor(model, base)
    bent, found = np.zeros(regressor.elements.size), np.empty_like(q)
    for k in range(len(q)):
        bent = regressor.bent(bent, q[k] - q[max(0, k - 1)])
        columns = regressor.columns((q[k], dq[k]), dq[k], ddq[k], bent=bent)
        found[k] = columns @ (base.projection @ standard)
    np.testing.assert_allclose(found, model_torque(model, standard).along(q, dq, ddq), atol=1e-9)


def test_the_regressor_has_the_coriolis_matrix_of_the_textbooks():
    """Planar arm: C = h [[-dq2, -dq1 - dq2], [dq1, 0]], h = m2 l1 r2 sin q2 (Slotine, Li 1991, example 9.1)."""
    robot = planar_arm(gravity=(0.0, 0.0, 0.0))
    model = torque_model(robot, "inertia")
    base = base_parameters(model)
    q, dq, v = np.random.default_rng(1).normal(size=(3, 2))
    columns = tracking_regressor(model, base).columns((q, dq), v, np.zeros(2), bent=np.zeros(0))
    (_, l1, _, _), (m2, _, r2, _) = PLANAR
    h = m2 * l1 * r2 * np.sin(q[1])
    coriolis = h * np.array([[-dq[1], -dq[0] - dq[1]], [dq[0], 0.0]])
    np.testing.assert_allclose(columns @ (base.projection @ robot.inertia.ravel()), coriolis @ v, atol=1e-12)


def test_the_lyapunov_function_falls_at_every_step_by_at_least_what_the_gain_takes():
    q, _, s, values = run(controller_from(0.5 * TRUE))
    energy = lyapunov(q, s, values)
    taken = np.einsum("ti,i,ti->t", s, GAIN, s)
    assert np.diff(energy).max() < 1e-6 * energy[0]
    spent = energy[0] - energy
    least = np.concatenate([[0.0], np.cumsum(taken[:-1]) * PERIOD])
    assert (spent > 0.99 * least - 1e-6 * energy[0]).all()
    assert energy[-1] < 0.2 * energy[0]


def test_without_friction_the_lyapunov_function_falls_by_exactly_what_the_gain_takes():
    regressor = tracking_regressor(torque_model(ARM, "inertia"), base_parameters(torque_model(ARM, "inertia")))
    base = base_parameters(torque_model(ARM, "inertia"))
    true = base.projection @ ARM.inertia.ravel()
    still = np.eye(base.n_b) * 0.05
    controller = AdaptiveTracking(
        regressor=regressor, values=0.3 * true, gain=GAIN, stiffness=STIFFNESS, learning=still
    )
    q, _, s, values = run(controller, friction=False)
    masses = rotor_mass_matrix(ARM, q, masses=nominal_masses(ARM))
    wrong = values - true
    energy = 0.5 * np.einsum("ti,tij,tj->t", s, masses, s) + 0.5 / 0.05 * (wrong**2).sum(axis=1)
    taken = np.einsum("ti,i,ti->t", s, GAIN, s)
    spent = energy[0] - energy[-1]
    assert spent == pytest.approx(PERIOD * taken[:-1].sum(), rel=0.02)
    assert spent > 0.1 * energy[0]


def test_tracking_becomes_better_than_with_the_parameters_it_began_with():
    _, _, learning_s, _ = run(controller_from(0.5 * TRUE))
    _, _, fixed_s, _ = run(controller_from(0.5 * TRUE, learning=np.zeros((BASE.n_b, BASE.n_b))))
    late = slice(int(1.0 / PERIOD), None)
    assert np.linalg.norm(learning_s[late]) < 0.5 * np.linalg.norm(fixed_s[late])


def step_once(controller, *, t=0.0, error=0.1):
    q = np.array([0.3, -0.4])
    still = np.zeros(2)
    shown = ControlSample(t, PERIOD, q + error, still, q, still, still, still, still)
    memory = controller.start(shown)
    return controller.step(memory, shown)


def test_inside_the_dead_zone_and_before_the_motion_nothing_is_learnt():
    start = 0.5 * TRUE
    assert not np.array_equal(step_once(controller_from(start))[0].values, start)
    wide = controller_from(start, dead_zone=0.41)  # |s| = L e = 0.4
    np.testing.assert_array_equal(step_once(wide)[0].values, start)
    np.testing.assert_array_equal(step_once(controller_from(start), t=-0.1)[0].values, start)
    narrow = step_once(controller_from(start, dead_zone=0.3))[0].values - start
    np.testing.assert_allclose(narrow, 0.25 * (step_once(controller_from(start))[0].values - start), rtol=1e-9)


def test_at_the_torque_limit_nothing_is_learnt():
    start = 0.5 * TRUE
    memory, torque = step_once(controller_from(start, torque_limit=1e-3))
    assert (np.abs(torque) == 1e-3).all()
    np.testing.assert_array_equal(memory.values, start)


def test_parameters_stay_within_their_bounds():
    start = 0.5 * TRUE
    diagonal = np.diag(np.full(BASE.n_b, 1e3))
    free = step_once(controller_from(start, learning=diagonal))[0].values
    lower, upper = start - 0.01, start + 0.01
    kept = step_once(controller_from(start, learning=diagonal, lower=lower, upper=upper))[0].values
    assert np.abs(free - start).max() > 0.02
    np.testing.assert_allclose(kept, np.clip(free, lower, upper))


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"gain": [1.0, -1.0]}, ArrayError, "gain is negative"),
        ({"learning": -np.eye(BASE.n_b)}, ModelError, "learning is not symmetric and positive semi-definite"),
        ({"lower": np.full(BASE.n_b, 1e3)}, ModelError, "a parameter begins outside its bounds"),
        ({"lower": np.full(BASE.n_b, -1e3)}, ModelError, "bounds need a diagonal matrix of learning"),
    ],
)
def test_impossible_settings_are_refused(changes, error, message):
    with pytest.raises(error, match=message):
        controller_from(TRUE, **changes)


def test_a_model_that_is_not_linear_and_learning_without_end_are_refused():
    loaded = torque_model(ARM, "inertia,viscous,load-coulomb")
    with pytest.raises(ModelError, match="term load-coulomb is not linear in the parameters"):
        tracking_regressor(loaded, base_parameters(loaded))
    regressor = tracking_regressor(MODEL, BASE)
    motion = smooth_motion(2, np.arange(0.0, 1.0, 0.01))
    with pytest.raises(ModelError, match="time of learning; expected a positive number, got 0"):
        learning_along(regressor, motion, gain=GAIN, time=0.0)
    with pytest.raises(ModelError, match="gain of adaptive tracking; expected positive on every joint, got 0"):
        learning_along(regressor, motion, gain=np.zeros(2), time=1.0)
    still = tuple(np.zeros((10, 2)) for _ in range(3))
    with pytest.raises(ModelError, match="the motion does not move every parameter"):
        learning_along(regressor, still, gain=GAIN, time=1.0)


def test_a_controller_keeps_its_own_copies():
    values = TRUE.copy()
    controller = controller_from(values)
    values[0] = 99.0
    assert controller.values[0] != 99.0
    assert replace(controller, dead_zone=0.1).dead_zone.tolist() == [0.1, 0.1]
