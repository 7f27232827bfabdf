"""Simulation in closed loop: against SciPy, against MuJoCo, against the terms' own columns, and its own order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim, lti

from sample_arms import planar_arm, planar_truth
from tauhat.dynamics import Coulomb, Motion, TorqueModel, Viscous, torque_model
from tauhat.dynamics.simulated_arm import Followed, Gains, Stepping, follow, simulated_arm
from tauhat.dynamics.terms import (
    Asymmetric,
    Coupling,
    CouplingDahl,
    CubeRoot,
    Dahl,
    GasSpring,
    Inertia,
    LoadCoulomb,
    LoadDahl,
    Offset,
    PolynomialFriction,
    RotorInertia,
    Spring,
    Stribeck,
    Thermal,
    ViscousAsymmetry,
)
from tauhat.errors import ModelError, SimulationError
from tauhat.robots import Joint, Robot

MASS, FRICTION = 2.0, 3.0
METHODS = ("leapfrog", "runge-kutta")


def slider() -> TorqueModel:
    """Return one sliding joint without gravity."""
    inertia = np.array([MASS, *np.zeros(9)])
    joint = Joint(name="s", kind="prismatic", parent=-1, rotation=np.eye(3), translation=np.zeros(3),
                  axis=np.array([1.0, 0.0, 0.0]), inertia=inertia)  # fmt: skip
    robot = Robot(name="slider", joints=(joint,), gravity=np.zeros(3))
    return TorqueModel(robot=robot, terms=(Inertia(), Viscous()))


def gains(kp, kd, ki=0.0, limit=np.inf, n_v=1):
    return Gains(*(np.full(n_v, float(value)) for value in (kp, kd, ki, limit)))


def sines(t, n_v=1):
    w = 2.0 * np.pi * np.array([0.5, 0.8])[:n_v]
    return np.sin(t[:, None] * w), w * np.cos(t[:, None] * w)


def slid(*, method="leapfrog", substeps=1, law=None, hold=0, t=None):
    t = np.arange(0.0, 3.0, 1e-3) if t is None else t
    q, dq = sines(t)
    model = slider()
    standard = np.zeros(model.n_p)
    standard[0], standard[10] = MASS, FRICTION
    return follow(
        simulated_arm(model), standard, Followed(q, dq, np.zeros_like(q)), gains=law or gains(200.0, 20.0),
        start=np.zeros((2, 1)), stepping=Stepping(t[1], substeps, hold, method),
    )  # fmt: skip


def planar(*, method="leapfrog", substeps=1, widths=(0.5, 0.5), law=None):
    truth = planar_truth()
    model = truth.model.with_term(Coulomb(widths=widths))
    t = np.arange(0.0, 2.0, 1e-3)
    q, dq = sines(t, 2)
    arm = simulated_arm(model)
    return model, truth.standard, follow(
        arm, truth.standard, Followed(q, dq, np.zeros_like(q)), gains=law or gains(300.0, 20.0, n_v=2),
        start=np.array([q[0], dq[0]]), stepping=Stepping(1e-3, substeps, 0, method),
    )  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("ki", [0.0, 300.0])
def test_a_sliding_mass_under_pid_moves_as_the_linear_system_it_is(method, ki):
    t = np.arange(0.0, 3.0, 1e-3)
    q = slid(method=method, law=gains(200.0, 20.0, ki), t=t).q[0]
    # m s^3 + (f + kd) s^2 + kp s + ki over kd s^2 + kp s + ki
    system = lti([20.0, 200.0, ki], [MASS, FRICTION + 20.0, 200.0, ki])
    _, oracle, _ = lsim(system, sines(t)[0][:, 0], t)
    assert np.abs(q - oracle).max() < 3e-5


@pytest.mark.parametrize("method", METHODS)
def test_the_simulated_motion_obeys_the_torque_model(method):
    model, standard, moved = planar(method=method, substeps=4)
    layout = model.layout()
    columns, _ = model.columns(Motion(q=moved.q, dq=moved.dq, ddq=moved.ddq), layout)
    rows = [layout.of_joint(joint) for joint in range(2)]
    torque = np.array([standard[layout.parameters[part]] @ columns[part] for part in rows])
    assert np.abs(torque - moved.tau).max() < {"leapfrog": 3e-4, "runge-kutta": 1e-12}[method]


def test_a_held_torque_is_logged_as_the_motor_begins_to_deliver_it():
    coarse, fine = (slid(method=method, substeps=20, hold=20) for method in METHODS)
    late = slice(50, None)
    assert np.abs(coarse.tau - fine.tau)[:, late].max() < 1e-3 * np.abs(fine.tau).max()
    moved = MASS * coarse.ddq + FRICTION * coarse.dq
    assert np.abs(moved - coarse.tau)[:, late].max() < 1e-3 * np.abs(coarse.tau).max()


def test_leapfrog_is_of_second_order_and_runge_kutta_of_fourth():
    fine = planar(method="runge-kutta", substeps=32)[2].q
    for method, order in (("leapfrog", 2), ("runge-kutta", 4)):
        errors = [np.abs(planar(method=method, substeps=n)[2].q - fine).max() for n in (4, 8)]
        assert errors[0] / errors[1] == pytest.approx(2**order, rel=0.1)


def test_sharp_friction_neither_overshoots_nor_changes_with_the_step():
    coarse, fine = (planar(substeps=n, widths=(1e-4, 1e-4))[2] for n in (1, 20))
    assert np.sqrt(np.mean((coarse.tau - fine.tau) ** 2)) < 5e-3 * np.sqrt(np.mean(fine.tau**2))
    assert np.abs(coarse.q - fine.q).max() < 2e-4


@pytest.mark.parametrize("method", METHODS)
def test_a_coarse_reference_is_followed_as_the_curve_it_samples(method):
    stiff, fine = gains(40_000.0, 600.0), np.arange(0.0, 3.0, 1e-3)
    exact = slid(method=method, law=stiff, substeps=4, t=fine)
    coarse = slid(method=method, law=stiff, substeps=40, t=fine[::10])
    # Straight lines between the samples would make 16 % of it.
    error = np.abs(coarse.ddq - exact.ddq[:, ::10])[:, 50:].max()
    assert error < 0.02 * np.abs(exact.ddq[:, 500:]).max()


def test_torque_stays_at_its_limit():
    tau = planar(law=gains(300.0, 20.0, limit=5.0, n_v=2))[2].tau
    assert np.abs(tau).max() == 5.0
    assert (np.abs(tau) == 5.0).mean() > 0.05


def test_a_held_torque_is_a_delay_of_half_its_period():
    free, late = (slid(substeps=10, hold=hold, law=gains(200.0, 20.0)) for hold in (0, 100))
    # Held for ten samples the law acts 5 ms late: (kp + kd s) (1 - 5 ms s) instead of kp + kd s.
    lag = 5e-3
    system = lti([-20.0 * lag, 20.0 - 200.0 * lag, 200.0], [MASS - 20.0 * lag, FRICTION + 20.0 - 200.0 * lag, 200.0])
    t = np.arange(0.0, 3.0, 1e-3)
    _, oracle, _ = lsim(system, sines(t)[0][:, 0], t)
    settled = slice(1500, None)  # the first-order delay is another system at the start
    error, effect = np.abs(late.q[0] - oracle)[settled], np.abs(late.q[0] - free.q[0])[settled]
    assert error.max() < 0.1 * effect.max()


@pytest.mark.parametrize("method", METHODS)
def test_an_unstable_controller_is_reported_with_joint_and_time_and_leaves_no_nan(method):
    with pytest.raises(SimulationError, match=r"joint s, t = .* s: the simulated robot went unstable"):
        slid(method=method, law=gains(200.0, 0.0, 2e5), t=np.arange(0.0, 6.0, 1e-3))


@pytest.mark.parametrize("method", METHODS)
def test_a_body_of_negative_mass_is_reported(method):
    model = slider()
    standard = np.zeros(model.n_p)
    standard[0] = -1.0
    q = np.zeros((20, 1))
    with pytest.raises(ModelError, match=r"joint s, t = 0 s: the mass matrix is not positive definite"):
        follow(
            simulated_arm(model), standard, Followed(q, q, q), gains=gains(1.0, 1.0), start=np.zeros((2, 1)),
            stepping=Stepping(1e-3, 1, 0, method),
        )  # fmt: skip


ELEMENTS = (
    Viscous(), Coulomb(widths=(0.3, 0.2)), CubeRoot(), ViscousAsymmetry(), Asymmetric(widths=(0.3, 0.2)),
    Stribeck(speeds=(0.5, 0.7)), PolynomialFriction(speeds=(0.5, 0.7)), Offset(), Spring(), Dahl(scales=(300.0, 200.0)),
    RotorInertia(), LoadCoulomb(widths=(0.3, 0.2)), LoadDahl(), Coulomb(widths=(0.3, 0.2), joints=(False, True)),
    GasSpring(joint=1, distance=0.8, lever=0.2, angle=0.1, area=0.005, volume=0.01),
    Coupling(motors=((1, 0, -0.7),), widths=(0.3,)), CouplingDahl(motors=((1, 0, 1.3),), scales=(300.0,)),
)  # fmt: skip


@pytest.mark.parametrize("term", ELEMENTS, ids=lambda term: f"{term.key}{sum(getattr(term, 'joints', ())) or ''}")
@settings(max_examples=10)
@given(seed=st.integers(0, 1000))
def test_the_torque_a_term_takes_is_that_of_its_columns(term, seed):
    robot = planar_arm()
    model = TorqueModel(robot=robot, terms=(Inertia(), term))
    rng = np.random.default_rng(seed)
    # Of a shared motor's inertia and viscous friction only the part between the joints is here: little, or no body.
    size = 0.01 if isinstance(term, Coupling) else 0.3
    own = size * rng.uniform(0.5, 1.0, len(term.parameters(robot)))
    standard = np.concatenate([robot.inertia.ravel(), own])
    t = np.arange(0.0, 0.3, 1e-3)
    q, dq = sines(t, 2)
    followed = Followed(q, dq, np.zeros_like(q))
    moved = follow(
        simulated_arm(model), standard, followed, gains=gains(300.0, 20.0, n_v=2), start=np.array([q[0], dq[0]]),
        stepping=Stepping(1e-3, 1, 0, "runge-kutta"),
    )  # fmt: skip
    layout = model.layout()
    columns, _ = model.columns(Motion(q=moved.q, dq=moved.dq, ddq=moved.ddq, step=1e-3), layout)
    parts = [layout.of_joint(joint) for joint in range(2)]
    torque = np.array([standard[layout.parameters[part]] @ columns[part] for part in parts])
    # The load is that of the step before: unknown at the start, where the arm is thrown into motion.
    begin, allowed = (50, 1e-2) if term.iterated else (0, 1e-9)
    assert np.abs(torque - moved.tau)[:, begin:].max() < allowed * np.abs(moved.tau).max()


def test_a_term_without_forward_dynamics_is_refused_by_name():
    model = TorqueModel(robot=planar_arm(), terms=(Inertia(), Thermal()))
    with pytest.raises(ModelError, match=r"term thermal cannot be simulated; expected inertia, rotor, coupling"):
        simulated_arm(model)


@pytest.mark.parametrize(
    "term", [Coupling(motors=((1, 0, 1.0),), widths=(0.1, 0.1)), CouplingDahl(motors=((1, 0, 1.0),), scales=(1.0, 2.0))]
)
def test_a_shared_motor_with_the_shapes_of_two_is_refused(term):
    with pytest.raises(ModelError, match="shapes; expected 1 values, got 2"):
        simulated_arm(TorqueModel(robot=planar_arm(), terms=(Inertia(), term)))


def wrist(term, *, substeps=1, method="leapfrog"):
    """Return the planar arm on the way of its law, its second motor turning with the first joint too."""
    model = TorqueModel(robot=planar_arm(), terms=(Inertia(), RotorInertia(), Viscous(), term))
    dry = [2.0] if isinstance(term, CouplingDahl) else []
    standard = np.concatenate([planar_arm().inertia.ravel(), [0.3, 0.3, 0.9, 0.5, 0.2, 0.4, 2.0], dry])
    t = np.arange(0.0, 2.0, 1e-3)
    q, dq = sines(t, 2)
    return follow(
        simulated_arm(model), standard, Followed(q, dq, np.zeros_like(q)), gains=gains(300.0, 20.0, n_v=2),
        start=np.array([q[0], dq[0]]), stepping=Stepping(1e-3, substeps, 0, method),
    )  # fmt: skip


@pytest.mark.parametrize(
    "term", [Coupling(motors=((1, 0, -1.5),), widths=(0.5,)), CouplingDahl(motors=((1, 0, -1.5),), scales=(300.0,))]
)
def test_leapfrog_is_of_second_order_with_a_shared_motor_too(term):
    fine = wrist(term, method="runge-kutta", substeps=32).q
    errors = [np.abs(wrist(term, substeps=n).q - fine).max() for n in (4, 8)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize(
    "term", [Coupling(motors=((1, 0, -1.5),), widths=(1e-4,)), CouplingDahl(motors=((1, 0, -1.5),), scales=(1.0,))]
)
def test_sharp_friction_of_a_shared_motor_neither_overshoots_nor_changes_with_the_step(term):
    coarse, fine = (wrist(term, substeps=n) for n in (1, 20))
    assert np.sqrt(np.mean((coarse.tau - fine.tau) ** 2)) < 5e-3 * np.sqrt(np.mean(fine.tau**2))
    assert np.abs(coarse.q - fine.q).max() < 2e-4


def test_the_arm_moves_as_mujocos_does():
    from tauhat.control import PDGravity
    from tauhat.dynamics import gravity_torque
    from tauhat.excitation import random_fourier
    from tauhat.robots import load_robot
    from tauhat.simulation import ExperimentSettings, nominal_parameters, simulate

    robot = load_robot("ur5e")
    law = PDGravity(kp=np.full(6, 4000.0), kd=np.full(6, 200.0))
    plant = nominal_parameters(robot)
    without = type(plant)(inertia=plant.inertia, rotor=np.full(6, 0.3), viscous=plant.viscous,
                          coulomb=np.zeros(6), offset=np.zeros(6))  # fmt: skip
    motion = random_fourier(robot, period=3.0, harmonics=3, rng=np.random.default_rng(4))
    experiment = ExperimentSettings(timestep=1e-4, control_rate=10_000.0, controller=law, settle=0.1)
    truth = simulate(robot, motion, rng=np.random.default_rng(0), parameters=without, settings=experiment).truth
    model = torque_model(robot, "inertia,rotor,viscous")
    standard = np.concatenate([without.inertia.ravel(), without.rotor, without.viscous])
    asked = truth.reference
    followed = Followed(asked.q, asked.dq, gravity_torque(robot, asked.q))
    law_gains = Gains(law.kp, law.kd, law.integral_gain, law.torque_limit)
    moved = follow(
        simulated_arm(model), standard, followed, gains=law_gains, start=np.array([truth.q[0], truth.dq[0]]),
        stepping=Stepping(1e-3, 2),
    )  # fmt: skip
    error = np.abs(moved.q.T - truth.q).max()
    tracking = np.abs(asked.q - truth.q).max()
    assert error < 0.03 * tracking
    assert np.abs(moved.tau.T - truth.tau).max() < 0.01 * np.abs(truth.tau).max()
