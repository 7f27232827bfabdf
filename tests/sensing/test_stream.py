"""Stamped samples: what is no sample is counted and changes nothing, gaps start again, other rates are refused."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from sensed_arms import frictionless, motion

from tauhat.errors import SensingError
from tauhat.recordings import Recording
from tauhat.recordings.log import Log
from tauhat.sensing import ForceSensor, SensedLog, SensorStream, StreamMemory
from tauhat.sensing.sample_lines import read_samples
from tauhat.sensing.sample_rate import check_rate, usual_step

RATE = 500.0
MODEL = frictionless("ur5e")
Q, TAU = motion(MODEL.robot, seconds=2.0, rate=RATE)
T = np.arange(len(Q)) / RATE
SENSOR = ForceSensor(model=MODEL, rate=RATE)
WHOLE = SENSOR.along(Recording(t=T, q=Q, tau=TAU))


def log(t: np.ndarray, q: np.ndarray = Q, tau: np.ndarray = TAU) -> Log:
    return Log(t=t, q=q, tau=tau, joint_names=MODEL.robot.joint_names, units=("rad",) * 6)


def streamed(t: np.ndarray, q: np.ndarray, tau: np.ndarray) -> tuple[StreamMemory, list[np.ndarray]]:
    stream = SensorStream(sensor=SENSOR)
    memory, found = stream.start(), []
    for sample in zip(t, q, tau, strict=True):
        memory, sensed = stream.take(memory, *sample)
        if sensed is not None:
            found.append(sensed.tau)
    return memory, found


def spoiled() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the samples with some more among them that are none."""
    t, q, tau = (np.repeat(values, np.where(np.arange(len(T)) % 250 == 100, 4, 1), axis=0) for values in (T, Q, TAU))
    wrong = np.flatnonzero(np.diff(t) == 0.0) + 1  # three each: a copy, a late one, one that is no number
    t[wrong[1::3]] -= 0.01
    q[wrong[2::3], 3] = np.nan
    return t, q, tau


def test_samples_that_are_none_are_counted_and_change_nothing():
    t, q, tau = spoiled()
    found = SENSOR.along(log(t, q, tau))
    assert found.counts == (len(T), 4, 4, 4, 0, 0, 0)
    assert found.counts.skipped == 12
    assert (found.tau == WHOLE.tau).all()
    assert (t[found.rows] == T).all()


def hung(rows: dict[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the samples, but for rows at which the controller goes on repeating what it said, so many times."""
    q, tau = Q.copy(), TAU.copy()
    for row, times in rows.items():
        q[row + 1 : row + 1 + times], tau[row + 1 : row + 1 + times] = q[row], tau[row]
    return T, q, tau


@pytest.mark.parametrize(("rows", "frozen"), [({50: 9}, 0), ({50: 10}, 10), ({50: 25, 100: 9, 120: 12}, 37)])
def test_samples_of_a_controller_that_hangs_are_taken_and_counted_from_ten_in_a_row_on(rows, frozen):
    t, q, tau = hung(rows)
    memory, found = streamed(t[:200], q[:200], tau[:200])
    along = SENSOR.along(log(t[:200], q[:200], tau[:200]))
    assert memory.counts == along.counts == (200, 0, 0, 0, 0, 0, frozen)
    assert len(found) == 200
    assert along.to_dict()["frozen"] == frozen
    assert np.ptp(np.array(found)[50:60], axis=0).max() > 1e-3  # what is filtered of them goes on changing


def test_a_position_or_a_torque_that_repeats_alone_is_not_frozen():
    t, q, tau = hung({50: 100})
    sixth = tau.copy()
    sixth[:, 5] = np.nextafter(tau[:, 5], np.where(np.arange(len(T)) % 2, 1e3, -1e3))  # the last bit of one joint
    for one, other in ((q, TAU), (Q, tau), (q, sixth)):
        assert streamed(t[:200], one[:200], other[:200])[0].counts.frozen == 0
        assert SENSOR.along(log(t, one, other)).counts.frozen == 0


def test_a_sample_that_is_told_twice_is_repeated_and_not_frozen():
    t, q, tau = (np.repeat(values[:20], 20, axis=0) for values in (T, Q, TAU))
    assert streamed(t, q, tau)[0].counts == (20, 0, 380, 0, 0, 0, 0)


def test_a_stream_gives_what_the_log_gives():
    t, q, tau = spoiled()
    memory, found = streamed(t[:400], q[:400], tau[:400])
    assert (np.array(found) == WHOLE.tau[: len(found)]).all()
    assert memory.counts == SENSOR.along(log(t[:400], q[:400], tau[:400])).counts


def test_infinite_and_absurd_numbers_are_no_samples():
    for value in (np.inf, -np.inf, np.nan, 1e12):
        tau = TAU.copy()
        tau[50, 2] = value
        found = SENSOR.along(log(T, Q, tau))
        assert found.counts.not_finite == 1
        assert np.isfinite(found.wrench).all()


def test_lost_samples_are_bridged_and_leave_no_force():
    kept = np.delete(np.arange(len(T)), [300, 301, 500, 700, 701, 702])
    found = SENSOR.along(log(T[kept], Q[kept], TAU[kept]))
    assert found.counts.restarts == 0
    assert np.abs(found.tau - WHOLE.tau[kept]).max() < 0.05


def test_stamps_that_jitter_come_in_bunches_or_are_coarse_change_nothing():
    rng = np.random.default_rng(5)
    jitter = T + rng.uniform(-0.25, 0.25, T.size) / RATE
    bunched = np.maximum.accumulate(np.where(np.arange(T.size) % 2 == 1, T - 0.7 / RATE, T)) + 1e-6 * np.arange(T.size)
    for t in (jitter, bunched):
        assert (np.diff(t) > 0.0).all()
        found = SENSOR.along(log(t))
        assert found.counts == (len(T), 0, 0, 0, 0, 0, 0)
        assert (found.tau == WHOLE.tau).all()
    coarse = np.round(np.arange(len(Q)) / 300.0, 3)
    assert usual_step(coarse) == pytest.approx(1.0 / 300.0, rel=2e-3)


def restarted(gap: float) -> SensedLog:
    t = T.copy()
    t[600:] += gap
    return SENSOR.along(log(t))


def test_behind_a_gap_everything_starts_again_with_wide_error_bars():
    found = restarted(0.5)
    assert found.counts.restarts == 1
    assert found.tau_std[600] == pytest.approx(MODEL.strength, rel=1e-3)
    assert (np.diff(found.tau_std[600:], axis=0) <= 1e-9).all()
    assert found.tau_std[-1] == pytest.approx(MODEL.rms, rel=0.2)
    assert (np.abs(found.tau) < 2.0 * found.tau_std).all()
    assert not found.settled[605]
    fresh = SENSOR.along(log(T[600:], Q[600:], TAU[600:]))
    assert (found.tau[600:] == fresh.tau).all()
    assert restarted(0.015).counts.restarts == 0


def test_a_clock_that_was_set_back_starts_again_after_fifty_samples():
    t = T.copy()
    t[400:] -= 100.0
    found = SENSOR.along(log(t))
    assert found.counts.late == 49
    assert found.counts.restarts == 1
    assert found.rows[400] == 449


def test_positions_that_jump_by_whole_turns_are_unwound():
    wound = Q.copy()
    wound[300:, 2] += 2.0 * np.pi
    wound[700:, 4] -= 4.0 * np.pi
    assert SENSOR.along(log(T, wound)).tau == pytest.approx(WHOLE.tau, abs=1e-6)


@pytest.mark.parametrize("factor", [0.5, 0.94, 1.06, 2.0])
def test_another_rate_is_refused(factor):
    with pytest.raises(SensingError, match="samples of another rate"):
        streamed(factor * T[:150], Q[:150], TAU[:150])
    with pytest.raises(SensingError, match="samples of another rate"):
        SENSOR.along(log(factor * T))


def test_a_rate_that_is_a_little_off_is_taken():
    assert streamed(1.04 * T[:250], Q[:250], TAU[:250])[0].counts == (250, 0, 0, 0, 0, 0, 0)
    assert streamed(0.96 * T[:250], Q[:250], TAU[:250])[0].counts == (250, 0, 0, 0, 0, 0, 0)


def kept(share: float, seed: int = 0) -> np.ndarray:
    """Return which of the samples are left when so many are lost, each by itself."""
    return np.random.default_rng(seed).random(T.size) >= share


@pytest.mark.parametrize("lost", [0.3, 0.5, 0.65])
@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_a_stream_that_loses_many_samples_is_not_of_another_rate(lost, jitter):
    left = kept(lost)
    t = (1.03 * T + jitter / RATE * np.random.default_rng(1).uniform(-1.0, 1.0, T.size))[left]
    memory, found = streamed(t, Q[left], TAU[left])
    assert memory.counts.taken == len(found) == np.count_nonzero(left)
    assert SENSOR.along(log(t, Q[left], TAU[left])).counts.taken == len(found)


def test_one_sample_of_three_lost_is_not_another_rate():
    """Steps of one and two periods in turn: pairs of them are all of one and a half."""
    left = np.arange(T.size) % 3 != 1
    assert usual_step(T[left]) == pytest.approx(1.5 / RATE)
    assert streamed(T[left], Q[left], TAU[left])[0].counts.taken == np.count_nonzero(left)


@pytest.mark.parametrize("factor", [0.25, 0.5, 2.0 / 3.0, 0.8, 1.25, 1.5, 2.0, 3.0, 4.0, 20.0])
@pytest.mark.parametrize(("lost", "jitter"), [(0.0, 0.0), (0.0, 0.2), (0.3, 0.0), (0.3, 0.2)])
def test_another_rate_is_refused_however_its_stamps_jitter_and_what_is_lost(factor, lost, jitter):
    left = kept(lost)
    t = (factor * (T + jitter / RATE * np.random.default_rng(1).uniform(-1.0, 1.0, T.size)))[left]
    with pytest.raises(SensingError, match="samples of another rate"):
        streamed(t, Q[left], TAU[left])


@pytest.mark.parametrize("rate", [450.0, 550.0])
def test_another_rate_in_whole_milliseconds_or_with_pauses_is_refused(rate):
    """Most stamps are then 2 ms apart, or whole periods; what lies between the others is not."""
    t = np.arange(T.size) / rate
    paused = t + 0.0011 * (np.arange(T.size) // 50) + 100.0 * (np.arange(T.size) // 50)
    jittered = t + 0.2 / rate * np.random.default_rng(1).uniform(-1.0, 1.0, T.size)
    for stamps in (np.round(t, 3), paused, jittered):
        with pytest.raises(SensingError, match="samples of another rate"):
            streamed(stamps[:101], Q[:101], TAU[:101])


@pytest.mark.parametrize("rate", [500.0, 240.0, 100.3])
@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_stamps_in_whole_milliseconds_are_of_their_rate_whatever_is_lost(rate, lost):
    t = np.round(np.arange(T.size) / rate, 3)[kept(lost)]
    check_rate(t[:101], rate, where="stream")


@pytest.mark.parametrize("rate", [600.0, 700.0, 800.0, 900.0])
def test_a_rate_whose_period_is_between_one_millisecond_and_two_is_told_by_whole_milliseconds(rate):
    t = np.round(np.arange(T.size) / rate, 3)
    check_rate(t[:101], rate, where="stream")
    for other in (0.5 * rate, 2.0 * rate):
        with pytest.raises(SensingError, match="samples of another rate"):
            check_rate(t[:101], other, where="stream")


def test_stamps_that_jitter_by_half_a_period_are_of_their_rate():
    for seed in range(100):
        t = T[:101] + np.random.default_rng(seed).uniform(-0.5, 0.5, 101) / RATE
        check_rate(t, SENSOR.rate, where="stream")


def test_gaps_and_a_clock_that_is_set_back_are_not_another_rate():
    t = T + 0.05 * (np.arange(T.size) // 7) - 100.0 * (np.arange(T.size) >= 500)
    counts = streamed(t, Q, TAU)[0].counts
    assert (counts.taken, counts.late) == (T.size - 49, 49)
    assert counts.restarts > 100


def test_a_log_without_one_usable_sample_is_refused():
    with pytest.raises(SensingError, match="no sample of the log can be used"):
        SENSOR.along(log(T, np.full_like(Q, np.nan)))


def lines(text: str) -> io.BytesIO:
    return io.BytesIO(text.encode())


def test_lines_of_json_and_csv_are_samples_and_anything_else_is_none():
    good = json.dumps({"t": 1, "q": [0.0] * 6, "tau": [1.5] * 6})
    bad = ["[1]", '{"t": 1}', '{"t": "1", "q": [], "tau": []}', "{", "\u00e9", '{"t": true, "q": [1], "tau": [1]}']
    bad += ['{"t": 1e999, "q": [' + "9" * 400 + '], "tau": [0]}', "[" * 5000]
    found = list(read_samples(lines("\n".join([good, "", *bad, good])), MODEL.robot))
    assert found[0] == found[-1] == (1.0, [0.0] * 6, [1.5] * 6)
    assert found[1:-1] == [None] * len(bad)
    header = ",".join(["tau_6", "t", *(f"q_{j}" for j in range(1, 7)), *(f"tau_{j}" for j in range(1, 6)), "note"])
    row = ",".join(["6", "0.5", "1", "2", "3", "4", "5", "6", "1", "2", "3", "4", "5", "x"])
    found = list(read_samples(lines(f"{header}\n{row}\n1,2\n{row.replace('0.5', 'a')}\n"), MODEL.robot))
    assert found == [(0.5, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), None, None]


def test_lines_that_are_no_text_or_have_no_end_are_no_samples():
    good = json.dumps({"t": 1, "q": [0.0] * 6, "tau": [1.5] * 6}).encode()
    stream = io.BytesIO(b"\n".join([good, b"\xff\xfe", b"1" * 300_000, good]))
    assert [sample is None for sample in read_samples(stream, MODEL.robot)] == [False, True, True, False]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing\n" * 12, "neither JSON lines nor CSV"),
        ("t,q_1,q_2,tau_1,tau_2\n", "columns of another robot"),
        ('{"t": 0, "q": [0], "tau": [0], "joints": ["a"]}\n', "samples of another robot"),
    ],
)
def test_streams_of_another_robot_or_none_are_refused(text, message):
    with pytest.raises(SensingError, match=message):
        list(read_samples(lines(text), MODEL.robot))
