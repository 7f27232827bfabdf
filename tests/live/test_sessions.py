"""One stream without sockets: answers are the sensor's, waiting answers are bounded, pages are shown the newest."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as some
from live_server import LOG, MESSAGES, RATE, SENSOR, SERVICE, THRESHOLDS

from tauhat.errors import LiveError, SensingError
from tauhat.live import Feed, Limits, Service, Session, Snapshot
from tauhat.live.clients import Clients
from tauhat.live.followers import Followers
from tauhat.live.outbox import Outbox
from tauhat.live.protocol import AnswerForm
from tauhat.live.throttle import Throttle
from tauhat.live.waiting_room import WaitingRoom
from tauhat.recordings import Recording
from tauhat.report.live_panel import counts_html
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing import ContactDetector, WrenchSolver, zeroed
from tauhat.sensing.judged_log import judged_log
from tauhat.sensing.touch import Touch

PUSHED = slice(700, 1100)


class Panel:
    """A page that remembers what it is shown."""

    def __init__(self) -> None:
        self.url = "http://127.0.0.1:1"
        self.shown: list[Snapshot] = []
        self.ended: list[str] = []
        self.last: tuple[Touch, ...] = ()
        self.closed = self.is_busy = False

    def end(self, stream: str, contacts: tuple[Touch, ...]) -> None:
        self.ended.append(stream)
        self.last = contacts

    def send(self, snapshot: Snapshot) -> bool:
        if self.is_busy:
            return False
        self.shown.append(snapshot)
        return True

    def commands(self) -> list[str]:
        return ["zero"]

    def close(self) -> None:
        self.closed = True


def emptied(outbox: Outbox) -> list[dict[str, Any]]:
    found = []
    while (text := outbox.take(np.inf)) is not None:
        found.append(json.loads(text))
    return found


def pushed_log() -> Recording:
    """Return the motion with Pinocchio's torque, but for 0.4 s in which something pushes down with 60 N."""
    solver, model = WrenchSolver(robot=SENSOR.model.robot), pinocchio_model(SENSOR.model.robot)
    data, swing = model.createData(), 2.0 * LOG.t[:, None] + np.arange(7)
    states = zip(LOG.q, np.cos(swing), -2.0 * np.sin(swing), strict=True)
    tau = np.array([pinocchio.rnea(model, data, *state) for state in states])
    for row in range(LOG.n_t)[PUSHED]:
        tau[row] -= solver.jacobian(LOG.q[row])[0].T @ [0.0, 0.0, -60.0, 0.0, 0.0, 0.0]
    return replace(LOG, tau=tau)


def test_contacts_of_a_stream_are_those_of_the_log():
    pushed = pushed_log()
    outbox, panel = Outbox(LOG.n_t), Panel()
    service = Service(sensor=SENSOR, thresholds=THRESHOLDS, feed=Feed(panel))
    session = Session(service, name="one", outbox=outbox)
    found = ContactDetector(thresholds=THRESHOLDS, step=1.0 / RATE).along(SENSOR.along(pushed))
    unseen = next(event for event in found.events if event.start > 0.6)
    for t, q, tau in zip(pushed.t.tolist(), pushed.q.tolist(), pushed.tau.tolist(), strict=True):
        panel.is_busy = unseen.start - 0.1 < t < unseen.end + 0.1  # it begins and ends while nothing is shown
        session.receive(json.dumps({"t": t, "q": q, "tau": tau}).encode(), t)
    answers = emptied(outbox)
    assert [answer["contact"] for answer in answers] == found.touched.tolist()
    starts = [answer["t"] for answer in answers if answer.get("event") == "start"]
    assert starts == [event.start for event in found.events]
    assert any(0.7 <= start <= 0.9 for start in starts)
    over = [event for event in found.events if not event.open]
    assert [answer["link"] for answer in answers if answer.get("event") == "end"] == [event.link for event in over]
    assert len({answer["link"] for answer in answers if answer["contact"]}) > len(over)  # links change meanwhile
    shown = {touch.number: touch for snapshot in panel.shown for touch in snapshot.contacts}
    told = {touch.number: found.events[touch.number - 1] for touch in shown.values() if not touch.open}
    last = panel.shown[-1].t
    assert set(told) == {k for k, event in enumerate(found.events, 1) if not event.open and event.end < last}
    assert unseen in told.values()
    assert len([touch for snapshot in panel.shown for touch in snapshot.contacts if not touch.open]) == len(told)
    panel.is_busy = True
    for row in range(PUSHED.start, PUSHED.stop + 400):  # once more, unseen to its end
        t = float(pushed.t[-1]) + (row - PUSHED.start + 1) / RATE
        session.receive(json.dumps({"t": t, "q": pushed.q[row].tolist(), "tau": pushed.tau[row].tolist()}).encode(), t)
    service.feed.forget("one", session.unshown)
    assert panel.last
    assert min(touch.number for touch in panel.last) > max(shown)
    for number, event in told.items():
        assert (shown[number].link, shown[number].start, shown[number].end) == (event.link, event.start, event.end)


def test_zero_is_what_zeroing_the_log_by_it_gives():
    outbox = Outbox(LOG.n_t + 9)
    session = Session(SERVICE, name="one", outbox=outbox)
    for number, text in enumerate(MESSAGES):
        if number == 1000:
            session.command("zero")
        session.receive(text.encode(), 0.0)
    answers = [message for message in emptied(outbox) if "t" in message]
    sensed = SENSOR.along(LOG)
    wanted = zeroed(sensed, np.broadcast_to(sensed.tau[999], sensed.tau.shape), solver=SENSOR.solver)
    np.testing.assert_allclose([a["wrench"] for a in answers[1000:]], wanted.wrench[1000:], rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose([a["wrench_std"] for a in answers], sensed.wrench_std, rtol=1e-5)


def test_a_standing_zero_is_off_what_a_stream_is_told_as_along_a_log():
    held = replace(LOG, q=np.repeat(LOG.q[:1], LOG.n_t, axis=0), tau=np.repeat(LOG.tau[:1], LOG.n_t, axis=0))
    outbox = Outbox(LOG.n_t + 9)
    session = Session(Service(sensor=SENSOR, thresholds=THRESHOLDS, zero="standing"), name="one", outbox=outbox)
    for t, q, tau in zip(held.t.tolist(), held.q.tolist(), held.tau.tolist(), strict=True):
        session.receive(json.dumps({"t": t, "q": q, "tau": tau}).encode(), t)
    answers = [message for message in emptied(outbox) if "tau_ext" in message]
    wanted = judged_log(SENSOR, held, THRESHOLDS, zero="standing")
    assert np.abs(wanted.contacts.zero[-1]).max() > 1.0
    np.testing.assert_allclose([a["tau_ext"] for a in answers], wanted.sensed.tau, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose([a["wrench"] for a in answers], wanted.sensed.wrench, rtol=1e-4, atol=1e-3)
    assert [answer["contact"] for answer in answers] == wanted.contacts.touched.tolist()
    with pytest.raises(LiveError, match="thresholds"):
        Service(sensor=SENSOR, zero="standing")


def test_another_robots_samples_end_a_session_and_malformed_ones_do_not():
    session = Session(SERVICE, name="one", outbox=Outbox(99))
    names = json.dumps({"t": 0.0, "q": [0.0] * 7, "tau": [0.0] * 7, "joints": ["a"] * 7})
    with pytest.raises(SensingError, match="another robot"):
        session.receive(names.encode(), 0.0)
    session.receive(MESSAGES[0].encode(), 0.0)
    session.receive(b'{"t": 0.5, "q": [0.0], "tau": [0.0]}', 0.0)
    assert session.counts["malformed"] == 1
    with pytest.raises(EOFError):
        session.receive(b'{"command": "end"}', 0.0)


def test_skips_are_told_at_once_and_then_once_a_second():
    outbox = Outbox(999)
    session = Session(SERVICE, name="one", outbox=outbox)
    for k in range(250):
        session.receive(b"nonsense", 0.01 * k)
    notices = emptied(outbox)
    assert [notice["counts"]["malformed"] for notice in notices] == [1, 101, 201]


def test_a_controller_that_hangs_is_told_once_a_second_and_shown_on_the_page():
    outbox, panel = Outbox(9999), Panel()
    session = Session(Service(sensor=SENSOR, feed=Feed(panel)), name="one", outbox=outbox)
    hung = {"q": LOG.q[99].tolist(), "tau": LOG.tau[99].tolist()}
    for row in range(2100):
        text = MESSAGES[row] if row < 100 else json.dumps({"t": row / RATE} | hung)
        session.receive(text.encode(), row / 1024.0)  # a clock whose seconds are exact
    told = emptied(outbox)
    notices = [message for message in told if "notice" in message]
    assert [notice["notice"] for notice in notices] == ["frozen", "frozen"]
    assert [notice["counts"]["frozen"] for notice in notices] == [10, 1034]
    assert len(told) == 2100 + 2
    assert session.counts["frozen"] == 2000
    assert panel.shown[0].counts["frozen"] == 0
    assert panel.shown[-1].counts["frozen"] > 1900
    assert "12 frozen" in counts_html({"frozen": 12})


def test_a_zero_without_samples_says_that_nothing_was_zeroed():
    outbox = Outbox(9)
    session = Session(SERVICE, name="one", outbox=outbox, followers=Followers())
    session.receive(b'{"command": "zero"}', 0.0)
    (notice,) = emptied(outbox)
    assert (notice["notice"], notice["tau_ext"]) == ("zero", None)
    assert "no samples" in notice["why"]
    assert not session.command("zero")
    session.receive(MESSAGES[0].encode(), 0.0)
    assert session.command("zero")
    assert len(emptied(outbox)[-1]["tau_ext"]) == 7


def test_a_follower_is_told_that_a_robot_that_has_left_or_not_come_is_not_zeroed():
    clients = Clients(SERVICE)
    clients.followers.robot = "ur://robot"
    robot, follower = (clients.admit(kind, 0.0, hang_up=int) for kind in ("robot", "pipe"))
    follower.session.receive(b'{"command": "follow"}', 0.0)
    follower.session.receive(b'{"command": "zero"}', 0.0)
    robot.session.receive(MESSAGES[0].encode(), 0.0)
    follower.session.receive(b'{"command": "zero"}', 0.0)
    clients.leave(robot)
    told = len(robot.outbox)
    follower.session.receive(b'{"command": "zero"}', 0.0)
    _, *notices = emptied(follower.outbox)
    assert [(notice["tau_ext"], notice["why"]) for notice in notices] == [(None, "no samples of the robot come")] * 2
    assert len(robot.outbox) == told == 2


def test_a_session_without_a_robot_to_follow_says_so():
    outbox = Outbox(9)
    session = Session(SERVICE, name="one", outbox=outbox, followers=Followers())
    session.receive(b'{"command": "follow"}', 0.0)
    assert emptied(outbox) == [{"notice": "follow", "robot": None, "state": None}]


numbers = some.floats(allow_nan=False, allow_infinity=False, width=32)


@given(some.lists(numbers, min_size=3, max_size=3), some.floats(-1e9, 1e9))
def test_answers_are_json_with_six_digits(values: list[float], t: float):
    tau, variance = np.array(values), np.square(np.array(values, dtype=np.float64))
    text = AnswerForm(3).text(t, (tau, variance, np.full(6, values[0]), np.diag(np.full(6, 4.0))), ', "contact": false')
    found = json.loads(text)
    assert found["t"] == t
    np.testing.assert_allclose(found["tau_ext"], tau, rtol=1e-5)
    np.testing.assert_allclose(found["tau_ext_std"], np.abs(tau), rtol=1e-5)
    assert found["wrench_std"] == [2.0] * 6
    assert found["contact"] is False


def test_numbers_that_are_none_are_null():
    tau = np.array([np.nan, -np.inf, 1.0])
    text = AnswerForm(3).text(0.5, (tau, np.ones(3), np.ones(6), np.eye(6)))
    assert json.loads(text)["tau_ext"] == [None, None, 1.0]


@given(some.lists(some.integers(-1, 3), max_size=200), some.integers(1, 9))
def test_an_outbox_delivers_in_order_and_tells_every_loss(steps: list[int], room: int):
    """A step puts so many answers, or takes one message."""
    outbox, put, got, told = Outbox(room), 0, [], 0

    def take() -> bool:
        nonlocal told
        text = outbox.take(0.0)
        if text is None:
            return False
        if text.startswith("{"):
            told += json.loads(text)["count"]
        else:
            got.append(int(text))
        return True

    for step in steps:
        for _ in range(step):
            outbox.put(str(put))
            put += 1
        if step < 0:
            take()
        assert len(outbox) <= room
    while take():
        pass
    assert got == sorted(set(got))
    assert len(got) + told == put
    assert outbox.dropped == told
    assert got[-room:] == list(range(put))[-room:][-len(got[-room:]) :]


def test_an_outbox_ends_when_it_is_empty():
    async def read() -> list[str]:
        outbox, found = Outbox(5), []
        asyncio.get_running_loop().call_later(0.01, outbox.put, "b")
        asyncio.get_running_loop().call_later(0.02, outbox.close)
        outbox.put("a")
        with suppress(EOFError):
            while True:
                found.append(await outbox.next())
        return found

    assert asyncio.run(read()) == ["a", "b"]


@given(some.lists(some.floats(0.0, 0.3), min_size=1, max_size=100), some.floats(1.0, 500.0))
def test_a_throttle_grants_its_rate_and_a_tenth_of_a_second_more(gaps: list[float], rate: float):
    throttle, now, granted, begin = Throttle(rate), 100.0, 0, 100.0 + gaps[0]
    for gap in gaps:
        now += gap
        while throttle.wait(now) <= 0.0:
            throttle.take(now)
            granted += 1
        assert granted <= rate * (now - begin + 0.1) + 3.0
        assert throttle.wait(now + 1.0 / rate) <= 1e-9


def test_a_waiting_room_sends_the_oldest_away():
    sent: list[str] = []
    room = WaitingRoom(2)
    for name in "abcd":
        room.enter(name, hang_up=lambda name=name: sent.append(name))
    room.leave("c")
    room.leave("never came")
    assert (sent, len(room)) == (["a", "b"], 1)


def test_the_page_is_shown_the_newest_thirty_times_a_second_by_turns():
    panel = Panel()
    feed = Feed(panel)
    service = Service(sensor=SENSOR, thresholds=THRESHOLDS, feed=feed)
    sessions = [Session(service, name=name, outbox=Outbox(9)) for name in ("one", "two")]
    for number, text in enumerate(MESSAGES[:1000]):
        for session in sessions:
            session.receive(text.encode(), number / RATE)
    assert 28 <= len(panel.shown) <= 33
    assert {snapshot.stream for snapshot in panel.shown} == {"one", "two"}
    last = panel.shown[-1]
    row = round(last.t * RATE)
    sensed = SENSOR.along(LOG)
    np.testing.assert_allclose(last.wrench, sensed.wrench[row])
    np.testing.assert_allclose(np.sqrt(np.diagonal(last.covariance)), sensed.wrench_std[row])
    assert last.counts["taken"] == row + 1
    feed.forget("two")
    feed.forget("two")
    feed.forget("never shown")
    assert panel.ended == ["two"]
    assert feed.commands() == ["zero"]
    feed.close()
    assert panel.closed
    assert (Feed().url, Feed().is_due("one", 0.0), Feed().commands()) == (None, False, [])


def test_limits_bound_something():
    for name in ("message", "messages", "clients", "idle"):
        for value in (0, np.inf, np.nan):
            with pytest.raises(LiveError, match=rf"limits of a server, {name}; expected a finite number above zero"):
                Limits(**{name: value})
