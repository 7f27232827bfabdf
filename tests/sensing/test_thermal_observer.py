"""The thermal observer: theta is found, contact does not teach it, error bars hold, others stay as they are."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from sensed_arms import frictionless, motion

from tauhat.dynamics.passive_kernel import ELEMENT, VISCOUS
from tauhat.dynamics.terms import Thermal
from tauhat.errors import SensingError
from tauhat.sensing.observers import OBSERVERS, ThermalObserver, observer_named
from tauhat.sensing.sensed_model import sensed_model
from tauhat.sensing.sensor import ForceSensor, force_sensor
from tauhat.sensing.sensor_kernel import split
from tauhat.sensing.stamp_kernel import LATE, RESTARTED
from tauhat.sensing.thermal import SensedHeat
from tauhat.sensing.thermal_kernel import VARIANCE, WARMTH
from tauhat.sensing.torque_observer import SensedTorque, SensedWarmth, TorqueObserver
from warm_arms import WarmedUp, warm_log, warmed_up

RATE, SECONDS = 250.0, 150.0
TOUCHED = slice(int(80 * RATE), int(120 * RATE))  # a constant push
BEFORE, DURING, AFTER = slice(int(40 * RATE), TOUCHED.start), slice(int(82 * RATE), TOUCHED.stop), slice(-7000, None)
PUSH = np.array([15.0, 6.0])


class Felt:
    """A log of the arm at some warmth with a push in it."""

    def __init__(self, found: WarmedUp, kelvins: np.ndarray, seed: int) -> None:
        log = warm_log(found.arm, SECONDS / 60.0, rate=RATE, warmer=kelvins, seed=seed)
        self.external = np.zeros_like(log.q)
        self.external[TOUCHED] = PUSH
        self.q, self.tau = log.q, log.tau - self.external
        self.theta = (log.temperature - 25.0) / found.kelvins


@cache
def felt(name: str) -> Felt:
    found = warmed_up()
    return Felt(found, found.hot if name == "warm" else np.zeros(2), 7)


def observer(name: str = "thermal", *, thermal: bool = True, **changes: float) -> TorqueObserver:
    found = warmed_up()
    model = sensed_model(found.thermal if thermal else found.plain)
    kind = OBSERVERS[name](**changes)
    return TorqueObserver(model=model, step=1.0 / RATE, observer=kind)


@cache
def sensed(state: str) -> SensedTorque:
    return observer().along(felt(state).q, felt(state).tau)


def rms(found: SensedTorque, log: Felt, window: slice) -> np.ndarray:
    return np.sqrt(np.mean((found.tau - log.external)[window] ** 2, axis=0))


def kept(samples: int) -> np.ndarray:
    """Return what is left of the variance of the warmth, without correction."""
    return np.exp(-2.0 * samples / RATE / np.array(warmed_up().term.times))


@pytest.mark.parametrize("state", ["cold", "warm"])
def test_the_warmth_is_found_from_any_start_within_its_error(state):
    log = felt(state)
    for start in (0.0, 1.2):
        found = observer(start=start).warmth_along(log.q, log.tau)
        soon, late = int(5 * RATE), slice(int(20 * RATE), TOUCHED.start)
        assert np.abs(found.theta - log.theta)[soon].max() < 0.05  # the filter's delay makes no correction twice
        assert np.abs(found.theta - log.theta)[late].max() < 0.06
        assert np.sqrt(found.variance[late]).max() < 0.05
        assert np.sqrt(found.variance[0]) == pytest.approx(0.7, abs=0.01)


@pytest.mark.parametrize("state", ["cold", "warm"])
def test_the_external_torque_is_right_before_in_and_after_contact(state):
    log, plain = felt(state), observer("momentum", thermal=False).along(felt(state).q, felt(state).tau)
    for window in (BEFORE, DURING, AFTER):
        error = rms(sensed(state), log, window)
        assert (error < 0.35).all()
        assert error.sum() < 0.5 * rms(plain, log, window).sum()


def test_the_drift_from_cold_to_warm_is_less_than_half():
    plain = {
        state: observer("momentum", thermal=False).along(felt(state).q, felt(state).tau) for state in ("cold", "warm")
    }
    for joint in range(2):
        drift = [
            abs(rms(found["cold"], felt("cold"), BEFORE) - rms(found["warm"], felt("warm"), BEFORE))[joint]
            for found in ({state: sensed(state) for state in ("cold", "warm")}, plain)
        ]
        assert drift[0] < 0.5 * drift[1]


@pytest.mark.parametrize("state", ["cold", "warm"])
def test_error_bars_contain_the_truth(state):
    found, log = sensed(state), felt(state)
    for window in (BEFORE, DURING, AFTER):
        inside = np.abs(found.tau - log.external)[window] < 1.96 * np.sqrt(found.variance[window])
        assert inside.mean() > 0.93


def test_contact_teaches_nothing_and_widens_the_error():
    log = felt("cold")
    touched = observer().warmth_along(log.q, log.tau)
    free = observer().warmth_along(log.q, log.tau + log.external)
    inside = TOUCHED.stop - 1
    assert np.abs(touched.theta - free.theta)[inside].max() < 0.05
    assert (touched.variance[inside] > 4.0 * free.variance[inside]).all()
    open_loop = kept(inside - DURING.start)
    expected = open_loop * touched.variance[DURING.start] + (1.0 - open_loop) * ThermalObserver().wander ** 2
    assert touched.variance[inside] == pytest.approx(expected, rel=1e-6)


def test_the_caller_may_say_what_is_free():
    log = felt("cold")
    never = observer().warmth_along(log.q, log.tau, free=np.zeros(len(log.q), dtype=np.bool_))
    open_loop = kept(len(log.q))
    assert never.variance[-1] == pytest.approx(open_loop * 0.7**2 + (1.0 - open_loop) * 0.15**2, rel=1e-6)
    always = observer().warmth_along(log.q, log.tau, free=np.ones(len(log.q), dtype=np.bool_))
    assert (always.variance[TOUCHED.stop - 1] < 0.25 * never.variance[TOUCHED.stop - 1]).all()


def test_standing_still_the_warmth_cools_and_the_error_stays_wide():
    log = felt("warm")
    held, tau = np.tile(log.q[0], (5000, 1)), np.tile(log.tau[0], (5000, 1))
    found = observer(start=0.5).warmth_along(held, tau)
    known = observer().model.heat
    assert known is not None
    expected = 0.5 * np.exp(-5000 / RATE / np.array(known.term.times))
    assert found.theta[-1] == pytest.approx(expected, rel=1e-3)
    assert (np.sqrt(found.variance[-1]) > 0.6).all()


def test_steps_are_what_a_recording_gives_and_leave_their_memory_alone():
    log, seer = felt("warm"), observer()
    free = np.arange(300) % 3 == 0
    whole, warmth = (
        seer.along(log.q[:300], log.tau[:300], free=free),
        seer.warmth_along(log.q[:300], log.tau[:300], free=free),
    )
    memory = seer.start()
    for k in range(300):
        before = memory.rows.tobytes()
        after, found = seer.advance(memory, log.q[k], log.tau[k], free=bool(free[k]))
        assert memory.rows.tobytes() == before
        for part, row in zip(found, whole, strict=True):
            assert (part == row[k]).all()
        assert (seer.warmth(after).theta == warmth.theta[k]).all()
        memory = after


def test_without_slopes_it_is_the_momentum_observer():
    model = observer().model
    assert model.heat is not None
    steady = replace(model, heat=replace(model.heat, slopes=np.zeros((2, 2))))
    log = felt("cold")
    found, usual = (
        TorqueObserver(model=steady, step=1.0 / RATE, observer=observer_named(name)).along(log.q[:3000], log.tau[:3000])
        for name in ("thermal", "momentum")
    )
    for part, other in zip(found, usual, strict=True):
        assert (part == other).all()


def test_viscous_friction_that_is_warm_is_taken_off_at_the_velocity_of_the_filtered_position():
    cold, rate = frictionless(), 50.0
    q, tau = motion(cold.robot, 4.0, rate)
    sticky = np.zeros(7, dtype=ELEMENT)
    sticky["kind"], sticky["joint"], sticky["weight"] = VISCOUS, np.arange(7), 20.0
    steady = TorqueObserver(model=replace(cold, sliding=sticky), step=1.0 / rate).along(q, tau)
    heat = SensedHeat(term=Thermal(times=(1e9,) * 7), slopes=np.tile([0.0, 20.0], (7, 1)))  # warm, and stays it
    seer = TorqueObserver(
        model=replace(cold, heat=heat), step=1.0 / rate, observer=ThermalObserver(start=1.0, spread=1e-6, wander=1e-6)
    )
    assert seer.along(q, tau, free=np.zeros(len(q), dtype=np.bool_)).tau == pytest.approx(steady.tau, abs=1e-4)


def test_the_force_sensor_takes_it():
    found = warmed_up()
    log = warm_log(found.arm, 0.5, rate=RATE, warmer=found.hot, seed=7)
    sensor = force_sensor(found.thermal, rate=RATE, observer=ThermalObserver())
    tau = sensor.along(log).tau
    assert tau == pytest.approx(observer().along(log.q, log.tau).tau, abs=1e-9)


def behind_gap(gap: float) -> tuple[SensedWarmth, SensedWarmth, WarmedUp]:
    """Return the warmth before a gap in a log and at the first sample behind it."""
    found = warmed_up()
    log = warm_log(found.arm, 0.5, rate=RATE, warmer=found.hot, seed=7)
    sensor = force_sensor(found.thermal, rate=RATE, observer=ThermalObserver())
    memory, told = sensor.start(), []
    for k in range(log.n_t // 2):
        memory, _, _ = sensor.take(memory, log.t[k], log.q[k], log.tau[k])
    told.append(warmth_of(sensor, memory))
    memory, _, code = sensor.take(memory, log.t[k] + gap, log.q[k], log.tau[k])
    assert code == RESTARTED
    return told[0], warmth_of(sensor, memory), found


def warmth_of(sensor: ForceSensor, memory: np.ndarray) -> SensedWarmth:
    rows = split(memory.copy(), sensor.n_v, sensor.model.bristles.size)[2]
    return SensedWarmth(rows[WARMTH].copy(), rows[VARIANCE].copy())


@pytest.mark.parametrize("gap", [0.5, 20.0, 200.0])
def test_a_gap_keeps_the_warmth_and_makes_it_less_sure(gap):
    before, after, found = behind_gap(gap)
    kept, settings = np.exp(-gap / np.array(found.term.times)), ThermalObserver()
    middle = kept * before.theta + (1.0 - kept) * settings.start
    assert after.theta == pytest.approx(middle, abs=2e-3)  # less what one sample does
    assert (after.variance > before.variance).all()
    error = 1.96 * np.sqrt(after.variance)
    idle, running = (
        kept * before.theta,
        kept * before.theta + (1.0 - kept),
    )  # the arm stood, or ran at the typical speed
    assert (np.abs(after.theta - idle) < error).all()
    assert (np.abs(after.theta - running) < error).all()


def test_behind_a_very_long_gap_or_another_clock_the_warmth_is_as_at_a_start():
    _, long_after, _ = behind_gap(1e6)
    _, set_back, _ = behind_gap_of_another_clock()
    settings = ThermalObserver()
    for found in (long_after, set_back):
        assert found.theta == pytest.approx(settings.start, abs=5e-3)
        assert np.sqrt(found.variance) == pytest.approx(settings.spread, rel=0.05)


def behind_gap_of_another_clock() -> tuple[SensedWarmth, SensedWarmth, WarmedUp]:
    found = warmed_up()
    log = warm_log(found.arm, 0.5, rate=RATE, warmer=found.hot, seed=7)
    sensor = force_sensor(found.thermal, rate=RATE, observer=ThermalObserver())
    memory = sensor.start()
    for k in range(log.n_t // 2):
        memory, _, _ = sensor.take(memory, log.t[k], log.q[k], log.tau[k])
    before, code = warmth_of(sensor, memory), LATE
    for late in range(50):
        assert code == LATE
        memory, _, code = sensor.take(memory, log.t[k] - 100.0 + late / RATE, log.q[k], log.tau[k])
    assert code == RESTARTED
    return before, warmth_of(sensor, memory), found


def test_estimates_without_the_term_are_refused():
    with pytest.raises(SensingError, match="does not know how friction warms up"):
        observer("thermal", thermal=False)


def test_other_observers_follow_no_warmth():
    seer = observer("momentum")
    with pytest.raises(SensingError, match="follows no warmth"):
        seer.warmth_along(felt("cold").q[:10], felt("cold").tau[:10])
    assert np.isnan(seer.warmth(seer.start()).theta).all()


@pytest.mark.parametrize("name", ["spread", "wander", "correlation", "limit", "hold"])
def test_settings_that_mean_nothing_are_refused(name):
    with pytest.raises(SensingError, match=f"{name} of an observer"):
        ThermalObserver(**{name: 0.0})
    with pytest.raises(SensingError, match="start of an observer"):
        ThermalObserver(start=np.nan)


def test_what_is_free_is_checked():
    log = felt("cold")
    with pytest.raises(SensingError, match="samples that are free"):
        observer().along(log.q[:10], log.tau[:10], free=np.ones(9, dtype=np.bool_))


def test_heat_of_another_robot_is_refused():
    model = observer().model
    assert model.heat is not None
    with pytest.raises(SensingError, match="heat of a sensed model"):
        replace(model, heat=replace(model.heat, slopes=np.zeros((3, 2))))
