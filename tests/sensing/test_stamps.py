"""Time stamps: believed where positions follow them, counted where they only jitter, else left alone."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from sensed_arms import frictionless

from tauhat.errors import SensingError
from tauhat.recordings.log import Log
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing import ForceSensor, SensedLog, SensorStream

MODEL = frictionless("ur5e")
STEP = 0.011  # [s] of a controller that answers every 10 or 12 ms
SECONDS = 6.0


def log(taken: np.ndarray, stamped: np.ndarray, *, speed: float = 2.0) -> Log:
    """Return samples of a motion at the times at which they were taken, with other stamps; torque by Pinocchio."""
    n_v = MODEL.robot.n_v
    swing = speed * taken[:, None] + np.arange(n_v)
    q, dq, ddq = 0.5 * np.sin(swing), 0.5 * speed * np.cos(swing), -0.5 * speed**2 * np.sin(swing)
    model = pinocchio_model(MODEL.robot)
    data = model.createData()
    tau = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    return Log(t=stamped, q=q, tau=tau, joint_names=MODEL.robot.joint_names, units=("rad",) * n_v)


def uneven(seed: int = 1, n_t: int = int(SECONDS / STEP)) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).choice([0.010, 0.012], n_t))


def even(n_t: int = int(SECONDS / STEP)) -> np.ndarray:
    return STEP * np.arange(n_t)


def sensor(stamps: str) -> ForceSensor:
    return ForceSensor(model=MODEL, rate=1.0 / STEP, stamps=stamps)


def rms(found: SensedLog) -> float:
    """Return the size of the external torque that is none, behind the first two seconds."""
    return float(np.sqrt(np.mean(np.square(found.tau[found.t > found.t[0] + 2.0]))))


def test_right_stamps_that_are_uneven_are_believed_and_free_motion_has_no_force():
    uneven_log = log(uneven(), uneven())
    found = {stamps: sensor(stamps).along(uneven_log) for stamps in ("exact", "jittered", "auto")}
    reference = rms(sensor("auto").along(log(even(), even())))
    assert rms(found["exact"]) < 2.0 * reference + 0.05
    assert rms(found["jittered"]) > 10.0 * rms(found["exact"])
    assert rms(found["auto"]) == pytest.approx(rms(found["exact"]), abs=0.002)
    assert found["exact"].believed == found["exact"].n_t
    assert found["jittered"].believed == 0
    assert found["auto"].n_t - found["auto"].believed < 1.0 / STEP  # decided within a second of motion


def test_stamps_that_jitter_beside_an_even_clock_are_counted():
    jitter = np.random.default_rng(2).uniform(-0.25, 0.25, even().size) * STEP
    jittered_log = log(even(), even() + jitter)
    found = {stamps: sensor(stamps).along(jittered_log) for stamps in ("exact", "jittered", "auto")}
    assert found["auto"].believed == 0
    assert (found["auto"].tau == found["jittered"].tau).all()
    assert rms(found["exact"]) > 10.0 * rms(found["auto"])


def test_arrival_times_that_are_only_ever_late_are_counted():
    late = even() + np.random.default_rng(3).uniform(0.0, 0.4, even().size) ** 2 * STEP
    found = sensor("auto").along(log(even(), late))
    assert found.believed == 0
    assert rms(found) < 0.1 * rms(sensor("exact").along(log(even(), late)))


@pytest.mark.parametrize("noise", [0.0, 2e-5])
def test_an_arm_that_stands_decides_nothing(noise):
    stamped = uneven()
    standing = log(stamped, stamped, speed=0.0)
    q = standing.q + noise * np.random.default_rng(4).normal(size=standing.q.shape)
    still = Log(t=standing.t, q=q, tau=standing.tau, joint_names=standing.joint_names, units=standing.units)
    assert sensor("auto").along(still).believed == 0


def test_one_joint_with_noise_is_enough_to_decide():
    stamped = uneven()
    moving = log(stamped, stamped, speed=1.0)
    q = np.tile(moving.q[0], (moving.n_t, 1))
    q[:, 2] = moving.q[:, 2]
    q = q + 2e-5 * np.random.default_rng(5).normal(size=q.shape)
    one = Log(t=moving.t, q=q, tau=moving.tau, joint_names=moving.joint_names, units=moving.units)
    found = sensor("auto").along(one)
    assert found.believed > 0.6 * found.n_t


def test_on_an_even_clock_all_ways_are_the_same():
    even_log = log(even(), even())
    counted, exact, auto = (sensor(stamps).along(even_log) for stamps in ("jittered", "exact", "auto"))
    assert auto.believed == 0
    assert (auto.tau == counted.tau).all()
    assert exact.tau == pytest.approx(counted.tau, abs=1e-6)


def test_a_log_of_the_other_kind_behind_the_first_changes_the_decision():
    first, second = uneven(), even() + np.random.default_rng(6).uniform(-0.25, 0.25, even().size) * STEP
    taken = np.concatenate([first, first[-1] + STEP + even()])
    found = sensor("auto").along(log(taken, np.concatenate([first, first[-1] + STEP + second])))
    changed = int(np.searchsorted(found.t, first[-1]))
    assert 0.8 * changed < found.believed < changed + 2.0 / STEP
    assert rms(found) < 0.5


def test_what_is_told_is_less_than_a_period_old():
    stamped = uneven()
    found = sensor("exact").along(log(stamped, stamped))
    ages = []
    ticks = stamped[0] + STEP * np.arange(2 * stamped.size)
    for k in range(1, 400):
        tick = ticks[np.searchsorted(ticks, stamped[k] + 1e-7) - 1]
        ages.append(stamped[k] - tick)
        again = (found.tau[k] == found.tau[k - 1]).all()
        assert again == (tick <= stamped[k - 1] + 1e-7)  # no tick between two samples: the same is told again
    assert max(ages) < STEP


@pytest.mark.parametrize("stamps", ["auto", "exact"])
def test_a_stream_gives_what_the_log_gives(stamps):
    stamped = uneven()
    whole = log(stamped, stamped)
    found = sensor(stamps).along(whole)
    stream = SensorStream(sensor=sensor(stamps))
    memory = stream.start()
    for k in range(300):
        memory, sensed = stream.take(memory, stamped[k], whole.q[k], whole.tau[k])
        assert (sensed.tau == found.tau[k]).all()
        assert (sensed.wrench == found.wrench[k]).all()
        assert sensed.settled == found.settled[k]


def test_lost_samples_and_gaps_are_bridged_by_stamps_too():
    kept = np.delete(np.arange(even().size), [200, 201, 300, 400, 401, 402])
    stamped = uneven()
    found = sensor("exact").along(log(stamped[kept], stamped[kept]))
    assert found.counts.restarts == 0
    assert rms(found) < 4.0 * rms(sensor("exact").along(log(stamped, stamped)))


def test_a_word_that_means_nothing_is_refused():
    with pytest.raises(SensingError, match="time stamps; expected auto, exact, jittered"):
        sensor("right")
