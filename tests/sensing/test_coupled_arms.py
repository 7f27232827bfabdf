"""Gas springs and motors that turn with two joints are no external torque: by regressors, by MuJoCo, and pushed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tauhat.arrays import FloatArray
from tauhat.control.model_torque import model_torque
from tauhat.dynamics import TorqueModel, motion_from_rows
from tauhat.dynamics.passive_kernel import DAHL
from tauhat.dynamics.terms import Coupling, CouplingDahl, GasSpring, Inertia, RotorInertia, Spring, Thermal, Viscous
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.sensing import OBSERVERS, SensedModel, TorqueObserver, observer_named
from tauhat.sensing.thermal import SensedHeat
from tauhat.sensing.torque_observer import BristleDoubt
from tauhat.simulation import ExperimentSettings, TrueParameters, nominal_parameters, simulate
from tauhat.simulation.laws import BalancingSpring, Bristles, GasCylinder, SharedDrive, SmoothCoulomb

ARM = load_robot("ur5e")
RATE = 1000.0
CYLINDER = {"joint": 1, "distance": 0.5, "lever": 0.1, "angle": np.pi / 2, "area": 2e-3, "volume": 1e-3}
RATIO = -1.4
LATER = slice(1500, None)  # behind the start of observer and filter; the disturbance observer forgets it late
COUPLINGS = {
    "coupling": Coupling(motors=((5, 4, RATIO),), widths=(0.3,)),
    "coupling-dahl": CouplingDahl(motors=((5, 4, RATIO),), scales=(10.0,)),
}
DRY = {
    "coupling": SmoothCoulomb(torque=np.array([2.0]), width=np.array([0.3])),
    "coupling-dahl": Bristles(
        fine=np.array([2.0]), coarse=np.array([1.0]), fine_length=np.array([1e-3]), coarse_length=np.array([3e-2])
    ),
}


def seen(model: TorqueModel, standard: FloatArray) -> SensedModel:
    torque = model_torque(model, standard)
    remembered = torque.elements["kind"] == DAHL
    return SensedModel(
        robot=model.robot, inertia=torque.inertia, rotor=torque.rotor, sliding=torque.elements[~remembered],
        bristles=torque.elements[remembered], rms=np.full(model.robot.n_v, 0.1), slow=np.full(model.robot.n_v, 0.02),
        heat=SensedHeat(term=Thermal(), slopes=np.zeros((model.robot.n_v, 2))),
    )  # fmt: skip


def modelled(name: str) -> tuple[TorqueModel, FloatArray]:
    """Return a model with springs and a shared motor, and standard parameters that are not small beside the links'."""
    terms = (Inertia(), RotorInertia(), Viscous(), Spring(), GasSpring(**CYLINDER), COUPLINGS[name])
    model = TorqueModel(robot=ARM, terms=terms)
    shared = {"Iam": 0.2, "Fvm": 1.5, "Fsm": 4.0, "Fdm": 4.0, "Fem": 2.0, "Ia": 0.8, "Fv": 4.0, "Ks": 5.0, "Gs": 90.0}
    values = [shared[parameter.symbol] for parameter in model.parameters[60:]]
    return model, np.concatenate([ARM.inertia.ravel(), values])


@cache
def along(name: str) -> tuple[FloatArray, FloatArray]:
    """Return a smooth motion and the torque that the regressor gives, (n_t, n_v) each."""
    model, standard = modelled(name)
    t, phase = np.arange(3000) / RATE, np.arange(6)
    swing = 2.0 * t[:, None] + phase
    rows = motion_from_rows(0.5 * np.sin(swing), np.cos(swing), -2.0 * np.sin(swing))
    columns, layout = model.columns(rows, model.layout())[0], model.layout()
    parts = [layout.of_joint(joint) for joint in range(6)]
    return 0.5 * np.sin(swing), np.array([standard[layout.parameters[part]] @ columns[part] for part in parts]).T


def sensed(model: SensedModel, observer: str, q: FloatArray, tau: FloatArray, rate: float = RATE) -> FloatArray:
    return TorqueObserver(model=model, step=1.0 / rate, observer=observer_named(observer)).along(q, tau).tau


@pytest.mark.parametrize("name", COUPLINGS)
@pytest.mark.parametrize("observer", OBSERVERS)
def test_what_regressor_and_parameters_give_is_no_external_torque(observer: str, name: str) -> None:
    q, tau = along(name)
    found = sensed(seen(*modelled(name)), observer, q, tau)
    assert np.abs(found[LATER]).max() < 3e-3 * np.abs(tau).max()


@pytest.mark.parametrize("name", COUPLINGS)
def test_every_part_of_the_springs_and_the_shared_motor_counts(name: str) -> None:
    q, tau = along(name)
    model, standard = modelled(name)
    for symbol in {parameter.symbol for parameter in model.parameters[66:]}:
        without = [0.0 if p.symbol == symbol else value for p, value in zip(model.parameters, standard, strict=True)]
        found = sensed(seen(model, np.array(without)), "momentum", q, tau)
        assert np.abs(found[LATER]).max() > 0.01 * np.abs(tau).max(), symbol


def plant(name: str) -> TrueParameters:
    """Return a UR5e with springs and a shared motor whose other friction is viscous."""
    nominal = nominal_parameters(ARM)
    drive = SharedDrive(own=5, other=4, ratio=RATIO, inertia=0.05, viscous=0.6, dry=DRY[name])
    laws = (drive, GasCylinder(energy=90.0, **CYLINDER), BalancingSpring(rate=np.full(6, 5.0)))
    return TrueParameters(
        inertia=nominal.inertia, rotor=np.full(6, 0.1), viscous=np.full(6, 1.0), coulomb=np.zeros(6),
        offset=np.zeros(6), laws=laws,
    )  # fmt: skip


@cache
def simulated(name: str, seed: int) -> tuple[FloatArray, FloatArray]:
    motion = random_fourier(ARM, period=8.0, harmonics=3, rng=np.random.default_rng(seed))
    settings = ExperimentSettings(timestep=2.5e-4, control_rate=4000.0, sample_rate=4000.0)
    done = simulate(ARM, motion, rng=np.random.default_rng(0), parameters=plant(name), settings=settings)
    return done.truth.q, done.truth.tau


def true_values(name: str) -> tuple[TorqueModel, FloatArray]:
    model, truth = modelled(name)[0], plant(name)
    return model, np.array([truth.value(parameter.symbol, parameter.joint) for parameter in model.parameters])


@pytest.mark.parametrize("name", COUPLINGS)
@pytest.mark.parametrize("observer", OBSERVERS)
def test_mujocos_free_arm_has_no_external_torque(observer: str, name: str) -> None:
    q, tau = simulated(name, 4)
    found = sensed(seen(*true_values(name)), observer, q, tau, 4000.0)
    assert np.abs(found[6000:]).max() < 3e-3 * np.abs(tau).max()


@pytest.mark.parametrize("observer", OBSERVERS)
def test_a_push_on_a_coupled_wrist_is_found_in_size_sign_and_joint(observer: str) -> None:
    q, tau = along("coupling-dahl")
    push = np.array([0.0, 0.0, 5.0, 0.0, -2.0, 3.0])
    found = sensed(seen(*modelled("coupling-dahl")), observer, q, tau - push)
    assert found[2500:] == pytest.approx(np.tile(push, (500, 1)), abs=0.05)


def test_what_is_not_known_of_a_shared_motors_bristles_is_in_the_error_of_both_joints() -> None:
    model = seen(*modelled("coupling-dahl"))
    doubt = BristleDoubt(start=0.3, turned=0.09, slid=0.0025)
    q = np.zeros((900, 6))
    q[200:500, 4], q[500:, 4] = np.linspace(0.0, 0.6, 300), 0.6
    q[500:, 5] = np.linspace(0.0, 0.2, 400)
    q[700:, 5] = q[699, 5] - np.linspace(0.0, 0.1, 200)
    variance = TorqueObserver(model=model, step=1.0 / RATE, doubt=doubt).along(q, np.zeros_like(q)).variance - 0.01
    assert variance[0, 5] == pytest.approx((4.0**2 + 2.0**2) * 0.3)
    assert variance[:, 4] == pytest.approx(RATIO**2 * variance[:, 5], abs=1e-12)
    assert (np.abs(variance[:, :4]) < 1e-12).all()
    # The motor runs backwards with joint 5, turns round with joint 6 and once more with it.
    for turn in (501, 701):
        assert variance[turn, 5] > 0.9 * (4.0**2 + 2.0**2) * 0.09 > 2.0 * variance[turn - 2, 5]
