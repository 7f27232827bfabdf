"""Over every channel each valid sample is answered once, in order; what cannot be delivered is told."""

from __future__ import annotations

import asyncio
import json
import socket
import stat
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_server import (
    CHANNELS,
    LOG,
    MESSAGES,
    SENSED,
    SENSOR,
    SERVICE,
    THRESHOLDS,
    Running,
    recording,
    running,
    wrenches,
)

from tauhat.errors import LiveError
from tauhat.live import Access, Channels, Limits, LiveServer, Sender, Service, connection
from tauhat.live.connection import Connection, connect
from tauhat.recordings import Log

FAST = np.inf


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory):
    service = Service(sensor=SENSOR, thresholds=THRESHOLDS, limits=Limits(messages=1e5))
    with running(tmp_path_factory.mktemp("served"), service=service) as found:
        yield found


def received(address: str, count: int, *, seconds: float = 10.0) -> list[dict[str, Any]]:
    """Return the messages to a client that sends all samples, until there are so many answers and drops told."""
    connection, found, end = connect(address), [], time.monotonic() + seconds
    for text in MESSAGES[:count]:
        connection.send(text)
        found += connection.exchange(0.0)
    while told(found) < count and time.monotonic() < end:
        found += connection.exchange(0.2)
    connection.close()
    return [json.loads(text) for text in found]


def counted(connection: Connection) -> list[dict[str, Any]]:
    """Return the messages up to the counts that were asked for."""
    found: list[dict[str, Any]] = []
    while not any(message.get("notice") == "counts" for message in found):
        texts = connection.exchange(5.0)
        assert texts, f"no counts, but {found[-3:]}"
        found += map(json.loads, texts)
    return found


def told(texts: list[str]) -> int:
    messages = [json.loads(text) for text in texts]
    return sum("wrench" in message or message.get("count", 0) for message in messages)


@pytest.mark.parametrize("channel", CHANNELS)
def test_every_sample_is_answered_once_in_order_with_what_the_log_would_tell(served: Running, channel: str):
    with Sender(served.addresses[channel]) as sender:
        answers = list(sender.replay(LOG, speed=FAST))
        assert sender.hello["joints"] == list(SENSOR.model.robot.joint_names)
    assert [answer["t"] for answer in answers] == LOG.t.tolist()
    np.testing.assert_allclose(wrenches(answers), SENSED.wrench, rtol=1e-5, atol=1e-5)
    found = [answer["tau_ext_std"] for answer in answers]
    np.testing.assert_allclose(found, SENSED.tau_std, rtol=1e-5)
    assert all({"contact", "excess", "link"} <= set(answer) for answer in answers)


@pytest.mark.parametrize("channel", CHANNELS)
def test_the_greeting_does_not_end_the_wait_for_an_answer(served: Running, channel: str):
    with Sender(served.addresses[channel]) as sender:
        sender.send(LOG.t[0], LOG.q[0].tolist(), LOG.tau[0].tolist())
        assert [answer["t"] for answer in sender.answers(10.0)] == [0.0]
        assert sender.hello["hello"] == "tauhat"
        begin = time.monotonic()
        assert sender.answers(0.3) == []
        assert time.monotonic() - begin >= 0.29
        sender.command("counts")
        assert sender.answers(10.0) == []
        assert sender.notices[-1]["notice"] == "counts"


@pytest.mark.parametrize("channel", CHANNELS)
def test_garbage_among_the_samples_is_counted_and_answers_nothing(served: Running, channel: str):
    garbage = ["{", "[]", "null", '{"t": 1}', '{"t": "x", "q": [], "tau": []}', '{"command": "stop"}', "\ufffd" * 9]
    connection = connect(served.addresses[channel])
    found: list[dict[str, Any]] = []
    for number, text in enumerate(MESSAGES[:70]):
        connection.send(text)
        connection.send(garbage[number % len(garbage)])
        found += map(json.loads, connection.exchange(0.05 if number % 10 == 9 else 0.0))
    connection.send('{"command": "counts"}')
    found += counted(connection)
    connection.close()
    assert [message["t"] for message in found if "t" in message] == LOG.t[:70].tolist()
    counts = found[-1]["counts"]
    assert (counts["taken"], counts["malformed"], counts["dropped"]) == (70, 70, 0)
    assert any(message.get("notice") == "skipped" for message in found)


@pytest.mark.parametrize("channel", CHANNELS)
def test_who_comes_again_starts_afresh(served: Running, channel: str):
    """After other samples, late ones among them, the second time gives what the first gave."""
    both = []
    for _ in range(2):
        with Sender(served.addresses[channel]) as sender:
            both.append(wrenches(list(sender.replay(LOG.rows(300, 600), speed=FAST))))
    assert len(both[0]) == 300
    assert (both[0] == both[1]).all()


@pytest.mark.parametrize("channel", ["websocket", "pipe"])
def test_a_disconnect_amid_a_message_leaves_the_server_as_it_was(served: Running, channel: str):
    for _ in range(5):
        connection = connect(served.addresses[channel])
        connection.send(MESSAGES[0])
        half = connection._framed(MESSAGES[1])[:100]
        connection._socket.settimeout(5.0)
        connection._socket.sendall(half)
        connection._socket.close()
    assert served.serves(channel)
    deadline = time.monotonic() + 5.0
    while len(served.server.clients) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(served.server.clients) == 0


@pytest.mark.parametrize("channel", CHANNELS)
def test_samples_that_are_skipped_have_no_answer_and_hold_up_nobody(served: Running, channel: str):
    q = LOG.q[:60].copy()
    t = LOG.t[:60].copy()
    q[20, 3], t[40] = np.nan, t[39]
    spoiled = Log(t=t, q=q, tau=LOG.tau[:60], joint_names=SENSOR.model.robot.joint_names, units=("rad",) * 7)
    with Sender(served.addresses[channel]) as sender:
        answers = list(sender.replay(spoiled, speed=FAST))
    assert [answer["t"] for answer in answers] == np.delete(t, [20, 40]).tolist()


def test_a_recording_is_replayed_in_its_own_time(served: Running):
    begin = time.monotonic()
    with Sender(served.addresses["pipe"]) as sender:
        assert len(list(sender.replay(LOG.rows(0, 500), speed=2.0))) == 500
    assert 0.249 <= time.monotonic() - begin < 2.0


def test_zero_takes_off_what_is_sensed_until_unzero(served: Running):
    q, tau = LOG.q[0].tolist(), LOG.tau[0].tolist()
    with Sender(served.addresses["pipe"]) as sender:
        heard: list[dict[str, Any]] = []
        for number, t in enumerate((np.arange(2400) / 1000.0).tolist()):
            if number in {800, 1600}:
                sender.command("zero" if number == 800 else "unzero")
            sender.send(t, q, tau)
            heard += sender.answers(0.0)
        end = time.monotonic() + 10.0
        while len(heard) < 2400 and time.monotonic() < end:
            heard += sender.answers(0.5)
        zeros = [notice["tau_ext"] for notice in sender.notices if notice["notice"] == "zero"]
    found, torque = wrenches(heard), np.array([answer["tau_ext"] for answer in heard])
    assert np.linalg.norm(found[799, :3]) > 5.0
    assert np.linalg.norm(found[1599]) < 1e-3 * np.linalg.norm(found[799])
    np.testing.assert_allclose(zeros[0], torque[799], rtol=1e-5)
    assert zeros[1] == [0.0] * 7
    np.testing.assert_allclose(found[2399], found[799], rtol=1e-3)


@pytest.mark.parametrize("channel", ["websocket", "pipe"])
def test_a_reader_that_is_too_slow_loses_the_oldest_answers_and_is_told_how_many(tmp_path: Path, channel: str):
    limits = Limits(messages=1e6, queue=50, buffer=4096)
    with running(tmp_path, limits=limits) as served:
        connection = connect(served.addresses[channel])
        connection._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for text in MESSAGES:
            connection.send(text)
        time.sleep(
            0.3
        )  # TCP itself may stall meanwhile: a client without room for answers hears of no room for samples
        found: list[str] = []
        while told(found) < len(MESSAGES):
            found += connection.exchange(2.0) or pytest.fail(f"{told(found)} of {len(MESSAGES)} told")
        connection.close()
        assert served.serves(channel)
    messages = [json.loads(text) for text in found]
    times = [message["t"] for message in messages if "t" in message]
    drops = [message for message in messages if message.get("notice") == "dropped"]
    assert times == sorted(set(times))
    assert times[-1] == LOG.t[-1]
    assert drops[-1]["total"] == sum(drop["count"] for drop in drops) == len(MESSAGES) - len(times) > 100
    gaps = sum(round(1000 * (later - earlier)) - 1 for earlier, later in pairwise(times))
    assert gaps == drops[-1]["total"]


@pytest.mark.parametrize("channel", ["websocket", "pipe"])
def test_who_ends_without_reading_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, channel: str):
    for module in ("conversation", "pipe_server", "websocket_server"):
        monkeypatch.setattr(f"tauhat.live.{module}._FAREWELL", 0.2)
    limits = Limits(messages=1e6, queue=50, buffer=4096)
    with running(tmp_path, limits=limits) as served:
        connection = connect(served.addresses[channel])
        connection._socket.settimeout(5.0)
        for text in [*MESSAGES, '{"command": "end"}']:
            connection.send(text)
        with pytest.raises(OSError, match=r"reset|pipe"):
            wait_until(lambda: connection._socket.send(connection._framed("{}")) == 0)
        connection.close()
        assert served.serves(channel)


def wait_until(condition) -> None:
    end = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize("channel", ["websocket", "pipe"])
def test_messages_above_the_granted_rate_are_read_more_slowly_and_none_is_lost(tmp_path: Path, channel: str):
    with running(tmp_path, limits=Limits(messages=1000.0)) as served:
        begin = time.monotonic()
        messages = received(served.addresses[channel], 600)
        assert time.monotonic() - begin > 0.45  # all but a burst of a tenth of a second
    assert [message["t"] for message in messages if "t" in message] == LOG.t[:600].tolist()
    assert any(message.get("notice") == "slowed" for message in messages)


def test_datagrams_above_the_granted_rate_are_skipped_and_counted(tmp_path: Path):
    with running(tmp_path, limits=Limits(messages=100.0)) as served:
        connection = connect(served.addresses["udp"])
        for text in MESSAGES[:200]:
            connection.send(text)
        time.sleep(0.3)
        connection.send('{"command": "counts"}')
        found = counted(connection)
        connection.close()
    counts, answered = found[-1]["counts"], [message["t"] for message in found if "t" in message]
    assert counts["taken"] + counts["limited"] == 200
    assert len(answered) == counts["taken"] <= 30
    assert answered == sorted(answered)
    assert any(message.get("notice") == "slowed" for message in found)


def test_there_are_so_many_clients_and_no_more_over_all_channels(tmp_path: Path):
    with running(tmp_path, limits=Limits(clients=2)) as served:
        first, second = (Sender(served.addresses[channel]) for channel in ("websocket", "pipe"))
        for sender in (first, second):
            sender.send(0.0, [0.0] * 7, [0.0] * 7)
            wait_until(lambda sender=sender: sender.answers(0.1))
        for channel in CHANNELS:
            with Sender(served.addresses[channel]) as third, pytest.raises(LiveError, match="too many clients"):
                list(third.replay(LOG, speed=FAST))
        assert (served.server.clients.totals["clients"], served.server.clients.totals["turned_away"]) == (2, 2)
        first.close()
        wait_until(lambda: len(served.server.clients) == 1)
        assert served.serves("udp")
        second.close()


def test_who_is_silent_for_too_long_is_let_go(tmp_path: Path):
    with running(tmp_path, limits=Limits(idle=0.2)) as served:
        senders = [Sender(served.addresses[channel]) for channel in CHANNELS]
        for sender in senders:
            sender.command("counts")
        wait_until(lambda: len(served.server.clients) == 3)
        wait_until(lambda: len(served.server.clients) == 0)
        for sender in senders:
            sender.close()
        assert served.serves("websocket")


def test_a_server_that_accepts_and_says_nothing_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(connection, "_OPENING", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as silent, pytest.raises(LiveError, match="no answer to the handshake"):
        Sender(f"ws://127.0.0.1:{silent.getsockname()[1]}/")


def test_a_server_that_stood_still_blames_nobody_for_silence(tmp_path: Path):
    with running(tmp_path, limits=Limits(idle=0.4)) as served:
        senders = [Sender(served.addresses[channel]) for channel in CHANNELS]
        for sender in senders:
            sender.command("counts")
        wait_until(lambda: len(served.server.clients) == 3)
        goes_on = threading.Event()
        served.loop.call_soon_threadsafe(time.sleep, 1.5)
        served.loop.call_soon_threadsafe(goes_on.set)
        assert goes_on.wait(10.0)
        time.sleep(0.1)
        for sender in senders:
            sender.command("counts")
        for sender in senders:
            wait_until(lambda sender=sender: [*sender.answers(0.05), len(sender.notices) == 2][-1])
            sender.close()


@pytest.mark.parametrize("channel", CHANNELS)
def test_samples_of_another_rate_or_robot_are_refused_in_a_sentence(served: Running, channel: str):
    slow = Log(
        t=LOG.t[:300] * 2.0, q=LOG.q[:300], tau=LOG.tau[:300], joint_names=SENSOR.model.robot.joint_names,
        units=("rad",) * 7,
    )  # fmt: skip
    with Sender(served.addresses[channel]) as sender, pytest.raises(LiveError, match="another rate"):
        list(sender.replay(slow, speed=FAST))
    with Sender(served.addresses[channel]) as sender, pytest.raises(LiveError, match="another robot"):
        list(sender.replay(recording(20, n_v=6), speed=FAST))
    assert served.serves(channel)


def test_what_a_client_still_waits_for_comes_before_a_pipe_ends(served: Running):
    with socket.socket(socket.AF_UNIX) as pipe:
        pipe.connect(served.addresses["pipe"].partition(":")[2])
        pipe.sendall("\n".join([*MESSAGES[:400], ""]).encode())
        pipe.shutdown(socket.SHUT_WR)
        text = b""
        while data := pipe.recv(65536):
            text += data
    assert [json.loads(line)["t"] for line in text.splitlines()[1:]] == LOG.t[:400].tolist()


def test_the_pipe_is_its_owners_alone_and_goes_with_the_server(tmp_path: Path):
    path = tmp_path / "samples"
    with running(tmp_path):
        assert stat.S_ISSOCK(path.stat().st_mode)
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert not path.exists()


async def started(channels: Channels) -> None:
    async with LiveServer(SERVICE, channels):
        pass


def test_a_pipe_replaces_what_a_dead_server_left_and_nothing_else(tmp_path: Path):
    path = tmp_path / "samples"
    path.write_text("dear diary")
    with pytest.raises(LiveError, match="no socket is not replaced"):
        asyncio.run(started(Channels(pipe=path)))
    assert path.read_text() == "dear diary"
    link = tmp_path / "link"
    link.symlink_to(path)
    with pytest.raises(LiveError, match="no socket is not replaced"):
        asyncio.run(started(Channels(pipe=link)))
    left = tmp_path / "left"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(left))
    asyncio.run(started(Channels(pipe=left)))
    path.unlink()
    with running(tmp_path), pytest.raises(LiveError, match="another server listens"):
        asyncio.run(started(Channels(pipe=path)))
    with pytest.raises(LiveError, match="cannot be made"):
        asyncio.run(started(Channels(pipe=tmp_path / "no" / "folder")))


def test_a_port_or_host_that_cannot_be_had_is_an_error_in_a_line(served: Running):
    for name in ("websocket", "udp"):
        with pytest.raises(LiveError, match="cannot listen"):
            asyncio.run(started(Channels(**{name: served.port(name)})))
        with pytest.raises(LiveError, match="got not a name of a machine"):
            asyncio.run(started(Channels(**{name: 0}, access=Access(host="a..b", token="x" * 16))))
    with pytest.raises(LiveError, match="no channel"):
        Channels(access=Access())


def test_addresses_that_are_none_and_servers_that_are_absent_are_told():
    nowhere = ("http://127.0.0.1:1/", "udp://127.0.0.1", "udp://127.0.0.1:x", "ws://", "ws://127.0.0.1:99999/")
    for address in nowhere:
        with pytest.raises(LiveError, match="not an address"):
            connect(address)
    for address in ("unix:/no/such/pipe", "ws://127.0.0.1:9/", "udp://a..b:9"):
        with pytest.raises(LiveError, match="nobody answers"):
            connect(address)
    with Sender("udp://127.0.0.1:9") as sender, pytest.raises(LiveError, match="nobody answers"):
        list(sender.replay(LOG.rows(0, 20)))


def test_a_server_that_says_nothing_is_not_waited_for(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tauhat.live.sender._QUIET", 0.1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as silent:
        silent.bind(("127.0.0.1", 0))
        address = f"udp://127.0.0.1:{silent.getsockname()[1]}"
        with Sender(address) as sender, pytest.raises(LiveError, match=r"nobody answers.*token"):
            list(sender.replay(LOG.rows(0, 20)))
