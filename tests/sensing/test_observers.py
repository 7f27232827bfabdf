"""Observers: free motion is free, a step comes through when it should, and steps are what a recording gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim
from sensed_arms import RATE, frictionless, motion

from tauhat.dynamics import base_parameters, torque_model
from tauhat.dynamics.passive_kernel import DAHL, LOAD_DAHL, VISCOUS, joint_elements
from tauhat.errors import ModelError, SensingError
from tauhat.sensing.causal_filter import CausalFilter
from tauhat.sensing.observers import OBSERVERS, observer_named
from tauhat.sensing.torque_observer import BristleDoubt, SensedTorque, TorqueObserver

MODEL = frictionless()
Q, TAU = motion(MODEL.robot)
STEP = 1.0 / RATE
LATER = slice(600, None)  # behind the start of observer and filter


def sensed(name: str, external: np.ndarray, **changes: object) -> SensedTorque:
    observer = TorqueObserver(model=MODEL, step=STEP, observer=observer_named(name), **changes)
    return observer.along(Q, TAU - external)


def elements(*rows: tuple[int, int, float, float]) -> np.ndarray:
    return joint_elements(rows)


def first_time(response: np.ndarray, level: float) -> float:
    return float(np.argmax(response >= level)) * STEP


def test_the_filter_is_the_butterworth_filter_of_a_straight_input():
    low = CausalFilter(cutoff=8.0, step=0.004)
    f00, f01, f10, f11, a0, a1, b0, b1, stiffness, damping = low.numbers
    rng = np.random.default_rng(1)
    u = np.cumsum(rng.normal(size=60))
    t = 0.004 * np.arange(60)
    system = StateSpace([[0.0, 1.0], [-stiffness, -damping]], [[0.0], [stiffness]], np.eye(2), np.zeros((2, 1)))
    _, expected, _ = lsim(system, u, t, X0=[u[0], 0.0], interp=True)
    state = np.array([u[0], 0.0])
    for k in range(1, 60):
        state = np.array([[f00, f01], [f10, f11]]) @ state + np.array([a0, a1]) * u[k - 1] + np.array([b0, b1]) * u[k]
        assert state == pytest.approx(expected[k], abs=1e-9 * np.abs(expected).max())
    gain = np.abs(stiffness / (stiffness - (16.0 * np.pi) ** 2 + 1j * damping * 16.0 * np.pi))
    assert gain == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize("name", OBSERVERS)
def test_free_motion_has_no_external_torque(name):
    found = sensed(name, np.zeros_like(TAU))
    slow = name == "disturbance"  # a direction that answers seven times more slowly forgets its start as late
    assert np.abs(found.tau[2000:] if slow else found.tau[LATER]).max() < 2e-3 * np.abs(TAU).max()


@pytest.mark.parametrize("name", OBSERVERS)
def test_a_constant_external_torque_is_found_in_size_sign_and_joint(name):
    external = np.zeros_like(TAU)
    external[:] = [0.0, 0.0, 5.0, 0.0, -2.0, 0.0, 0.0]
    found = sensed(name, external)
    assert found.tau[2000:] == pytest.approx(external[2000:], abs=0.03)


@pytest.mark.parametrize("name", OBSERVERS)
def test_half_of_a_step_comes_through_as_soon_by_every_observer(name):
    external = np.zeros_like(TAU)
    external[1500:, 2] = 5.0
    found = sensed(name, external).tau[1500:, 2]
    # The disturbance observer answers by the mass matrix of the moment; a Butterworth pair overshoots by 4 %.
    assert first_time(found, 2.5) == pytest.approx(0.060, abs=0.035 if name == "disturbance" else 0.003)
    assert first_time(found, 4.5) <= (0.21 if name == "disturbance" else 0.15)
    assert found.max() < 5.0 * 1.06


@pytest.mark.parametrize("gain", [10.0, 20.0, 40.0])
def test_the_momentum_observer_is_a_first_order_filter_of_the_external_torque(gain):
    # Without the filter in front (its cut-off far above) the answer to a step is 1 - exp(-K t), exactly at the samples.
    external = np.zeros_like(TAU)
    external[1500:, 1] = 4.0
    observer = TorqueObserver(model=MODEL, step=STEP, observer=observer_named("momentum", gain=gain), cutoff=400.0)
    found = observer.along(Q, TAU - external).tau[1500:, 1]
    t = STEP * np.arange(found.size)
    assert found == pytest.approx(4.0 * (1.0 - np.exp(-gain * t)), abs=0.05)


@pytest.mark.parametrize("name", OBSERVERS)
def test_no_sample_is_changed_by_those_after_it(name):
    external = np.zeros_like(TAU)
    whole = sensed(name, external)
    observer = TorqueObserver(model=MODEL, step=STEP, observer=observer_named(name))
    cut = observer.along(Q[:700], TAU[:700])
    for part, all_of_it in zip(cut, whole, strict=True):
        assert (part == all_of_it[:700]).all()


@pytest.mark.parametrize("name", OBSERVERS)
def test_steps_are_what_a_recording_gives_and_leave_their_memory_alone(name):
    observer = TorqueObserver(model=MODEL, step=STEP, observer=observer_named(name))
    whole = observer.along(Q[:50], TAU[:50])
    memory = observer.start()
    for k in range(50):
        before = memory.rows.copy()
        after, found = observer.advance(memory, Q[k], TAU[k])
        assert memory.rows.tobytes() == before.tobytes()
        for part, row in zip(found, whole, strict=True):
            assert (part == row[k]).all()
        memory = after


def test_other_rates_have_the_same_response_in_seconds():
    for name in set(OBSERVERS) - {"disturbance"}:
        external = np.zeros_like(TAU)
        external[1500:, 2] = 5.0
        slow = TorqueObserver(model=MODEL, step=8 * STEP, observer=observer_named(name))
        found = slow.along(Q[::8], (TAU - external)[::8]).tau[1504 // 8 :, 2]
        assert 8 * first_time(found, 2.5) == pytest.approx(0.060, abs=0.009)


def test_base_parameters_do_as_well_as_standard_ones():
    model = torque_model(MODEL.robot, "inertia")
    base = base_parameters(model)
    regrouped = np.zeros(model.n_p)
    regrouped[base.independent] = base.projection @ MODEL.robot.inertia.ravel()
    other = replace(MODEL, inertia=regrouped.reshape(-1, 10))
    for name in ("momentum", "inverse-dynamics", "kalman"):
        found = TorqueObserver(model=other, step=STEP, observer=observer_named(name)).along(Q[:500], TAU[:500])
        usual = TorqueObserver(model=MODEL, step=STEP, observer=observer_named(name)).along(Q[:500], TAU[:500])
        assert found.tau == pytest.approx(usual.tau, abs=1e-8)


def test_friction_and_rotors_of_the_model_are_no_external_torque():
    rotor = np.linspace(0.2, 0.8, 7)
    sliding = elements(*((VISCOUS, j, 1.0, 0.5 + j) for j in range(7)))
    other = replace(MODEL, rotor=rotor, sliding=sliding)
    t, phase = np.arange(len(Q)) / RATE, np.arange(7)
    dq, ddq = np.cos(2.0 * t[:, None] + phase), -2.0 * np.sin(2.0 * t[:, None] + phase)
    tau = TAU + rotor * ddq + (0.5 + phase) * dq
    for name in OBSERVERS:
        found = TorqueObserver(model=other, step=STEP, observer=observer_named(name)).along(Q, tau)
        assert np.abs(found.tau[2000:]).max() < 3e-3 * np.abs(tau).max()


def dahl(q: np.ndarray, length: float) -> np.ndarray:
    z, states = 0.0, [0.0]
    for moved in np.diff(q):
        way = np.sign(moved)
        z = way + (z - way) * np.exp(-abs(moved) / length) if moved else z
        states.append(z)
    return np.array(states)


def test_friction_that_remembers_is_taken_off_and_doubted_behind_reversals_and_at_the_start():
    length, size = 0.02, 8.0
    other = replace(MODEL, bristles=elements((DAHL, 3, length, size)))
    tau = TAU.copy()
    tau[:, 3] += size * dahl(Q[:, 3], length)
    doubt = BristleDoubt(start=0.3, turned=0.09, slid=0.0025)
    found = TorqueObserver(model=other, step=STEP, doubt=doubt).along(Q, tau)
    assert np.abs(found.tau[LATER]).max() < 3e-3 * np.abs(tau).max()
    variance = found.variance[:, 3] - MODEL.rms[3] ** 2
    assert variance[0] == pytest.approx(size**2 * 0.3)
    turn = 1 + int(np.flatnonzero(np.diff(np.sign(np.diff(Q[:, 3]))))[0]) + 1
    assert variance[turn] >= size**2 * 0.09 * 0.99
    assert variance[turn - 5] < size**2 * 0.01
    assert variance[turn + 300] < size**2 * 0.01
    assert (found.variance[:, 2] == MODEL.rms[2] ** 2).all()


def test_load_dependent_bristles_count_with_their_load():
    other = replace(MODEL, bristles=elements((LOAD_DAHL, 1, 0.02, 0.1)))
    tau = TAU.copy()
    tau[:, 1] += 0.1 * np.abs(TAU[:, 1]) * dahl(Q[:, 1], 0.02)
    found = TorqueObserver(model=other, step=STEP).along(Q, tau)
    ignored = TorqueObserver(model=MODEL, step=STEP).along(Q, tau)
    assert np.abs(found.tau[LATER, 1]).max() < 0.1 * np.abs(ignored.tau[LATER, 1]).max()


def test_at_standstill_nothing_is_felt_and_the_doubt_stays():
    other = replace(MODEL, bristles=elements((DAHL, 1, 0.02, 8.0)))
    held = np.tile(Q[0], (2000, 1))
    found = TorqueObserver(model=other, step=STEP).along(held, np.tile(TAU[0], (2000, 1)))
    still = TorqueObserver(model=MODEL, step=STEP).along(held, np.tile(TAU[0], (2000, 1)))
    assert found.tau == pytest.approx(still.tau, abs=1e-9)
    assert found.variance[-1, 1] == pytest.approx(MODEL.rms[1] ** 2 + 64.0 / 3.0)


@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan])
def test_gains_that_mean_nothing_are_refused(value):
    with pytest.raises(SensingError, match="gain of an observer"):
        observer_named("momentum", gain=value)


def test_other_settings_that_mean_nothing_are_refused():
    with pytest.raises(SensingError, match="unknown observer"):
        observer_named("momentums")
    with pytest.raises(SensingError, match="cut-off of the filter"):
        TorqueObserver(model=MODEL, step=STEP, cutoff=480.0)
    with pytest.raises(SensingError, match="time between samples"):
        TorqueObserver(model=MODEL, step=0.0)
    with pytest.raises(SensingError, match="doubt of bristles"):
        BristleDoubt(start=2.0)
    with pytest.raises(ModelError, match="elements of friction"):
        replace(MODEL, sliding=np.zeros(3))
    with pytest.raises(SensingError, match="above zero"):
        replace(MODEL, rms=np.zeros(7))


def test_a_mass_matrix_of_no_body_is_refused_by_the_observer_that_needs_one():
    wrong = replace(MODEL, inertia=-np.array(MODEL.inertia), rotor=np.full(7, 1e-3))
    observer = TorqueObserver(model=wrong, step=STEP, observer=observer_named("disturbance"))
    with pytest.raises(SensingError, match="that of no body"):
        observer.along(Q, TAU)
