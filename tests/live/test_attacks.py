"""What an attacker may try on each channel is refused, and everybody else is served as before."""

from __future__ import annotations

import hmac
import json
import os
import pickle
import random
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from live_server import CHANNELS, LOG, MESSAGES, TOKEN, Running, running

from tauhat.errors import LiveError
from tauhat.live import Access, Limits, Sender, protocol, read_token
from tauhat.live.connection import Connection, WebSocketConnection, connect
from tauhat.live.protocol import decoded

KEY = "dGhlIHNhbXBsZSBub25jZQ=="
GUARDED = Access(token=TOKEN)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory):
    with running(tmp_path_factory.mktemp("served"), limits=Limits(handshake=0.4, clients=4, waiting=6)) as found:
        yield found
        assert all(found.serves(channel) for channel in CHANNELS)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("guarded")
    with running(folder, access=GUARDED, limits=Limits(handshake=0.4, waiting=6)) as found:
        yield found
        assert all(found.serves(channel, TOKEN) for channel in CHANNELS)


def handshake(served: Running, *, path: str = "/", **fields: str) -> tuple[int, bytes]:
    """Return the status of a handshake with these header fields, and all that was answered."""
    headers = {
        "Host": f"127.0.0.1:{served.port('websocket')}", "Upgrade": "websocket", "Connection": "Upgrade",
        "Sec-WebSocket-Key": KEY, "Sec-WebSocket-Version": "13",
    } | fields  # fmt: skip
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items()), "", ""]
    answer = said(served, "\r\n".join(lines).encode())
    return int(answer.split()[1]), answer


def said(served: Running, data: bytes) -> bytes:
    """Return what the WebSocket port answers to these bytes within a moment."""
    with socket.create_connection(("127.0.0.1", served.port("websocket")), timeout=1.0) as raw:
        raw.sendall(data)
        raw.settimeout(0.2)
        answer = b""
        try:
            while data := raw.recv(65536):
                answer += data
        except (TimeoutError, ConnectionResetError):
            pass
    return answer


def refusal(connection: Connection) -> str:
    """Return why the server ended the conversation, empty where it did so without a word."""
    reason, end = "", time.monotonic() + 3.0
    while connection.is_open and time.monotonic() < end:
        for text in connection.exchange(0.1):
            reason = json.loads(text).get("refused", reason)
    assert not connection.is_open
    connection.close()
    return reason


def malformed(connection: Connection) -> int:
    connection.send('{"command": "counts"}')
    end = time.monotonic() + 5.0
    while time.monotonic() < end:
        for text in connection.exchange(0.2):
            message: dict[str, Any] = json.loads(text)
            if message.get("notice") == "counts":
                connection.close()
                return message["counts"]["malformed"]
    raise AssertionError("no counts")


@pytest.mark.parametrize("channel", ["websocket", "pipe"])
def test_a_message_that_is_too_long_ends_the_connection(served: Running, channel: str):
    connection = connect(served.addresses[channel])
    connection.send(MESSAGES[0])
    connection.send('{"t": 0.001, "pad": "' + "x" * 5000 + '"}')
    assert channel == "websocket" or "too long" in refusal(connection)
    if isinstance(connection, WebSocketConnection):
        assert refusal(connection) == ""
        assert connection._protocol.close_rcvd.code == 1009
    assert served.serves(channel)


def test_a_stream_without_an_end_of_line_is_not_kept(served: Running):
    connection = connect(served.addresses["pipe"])
    connection._outward += b"x" * 10**6
    assert "too long" in refusal(connection)
    assert served.serves("pipe")


def test_a_datagram_that_is_too_long_is_no_sample(served: Running):
    connection = connect(served.addresses["udp"])
    connection.send(MESSAGES[0])
    connection.send('{"t": 0.001, "pad": "' + "x" * 60000 + '"}')
    assert malformed(connection) == 1


@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_nesting_is_judged_before_anything_is_decoded(monkeypatch: pytest.MonkeyPatch, opening: str):
    generous = Limits(message=10**6)
    here, loads = threading.get_ident(), protocol.json.loads

    def loads_elsewhere(text: str) -> Any:
        if threading.get_ident() == here:  # servers of other tests may still be running
            pytest.fail("decoded")
        return loads(text)

    monkeypatch.setattr(protocol.json, "loads", loads_elsewhere)
    assert decoded((opening * 100_000).encode(), generous) is None
    assert decoded((opening * 65).encode(), generous) is None
    assert decoded(b'{"t": 0, "pad": "' + b"x" * 10**6 + b'"}', generous) is None


@pytest.mark.parametrize("channel", CHANNELS)
def test_nesting_a_hundred_thousand_deep_harms_nobody(tmp_path: Path, channel: str):
    deep = "[" * 30_000 if channel == "udp" else "[" * 100_000
    with running(tmp_path, limits=Limits(message=10**6)) as served:
        connection = connect(served.addresses[channel])
        connection.send(MESSAGES[0])
        connection.send(deep)
        connection.send('{"t": 0.001, "q": ' + "[" * 60 + "]" * 60 + ', "tau": []}')
        assert malformed(connection) == 2
        assert served.serves(channel)


class Bomb:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize("channel", CHANNELS)
def test_pickles_are_bytes_that_nobody_opens(served: Running, tmp_path: Path, channel: str):
    target = tmp_path / "owned"
    pickled = pickle.dumps(Bomb(target), protocol=4)
    pickle.loads(pickled)  # noqa: S301 - it would do harm
    target.rmdir()
    connection = connect(served.addresses[channel])
    connection.send(MESSAGES[0])
    if isinstance(connection, WebSocketConnection):
        connection._protocol.send_binary(pickled)
        connection._outward += connection._drained()
    else:
        connection._socket.send(pickled + (b"\n" if channel == "pipe" else b""))
    assert malformed(connection) >= 1
    assert not target.exists()


@pytest.mark.parametrize("channel", CHANNELS)
def test_random_bytes_end_nothing_but_their_own_connection(served: Running, channel: str):
    rng = random.Random(5)
    for _ in range(20):
        connection = connect(served.addresses[channel])
        for _ in range(5):
            connection._socket.setblocking(True)
            try:
                connection._socket.send(rng.randbytes(rng.randrange(1, 400)))
            except OSError:
                break
        connection._socket.close() if channel != "udp" else connection.close()
    assert served.serves(channel)


def test_without_a_token_only_this_machine_can_connect():
    for host in ("0.0.0.0", "::", "192.168.1.5", "robot.example"):  # noqa: S104
        with pytest.raises(LiveError, match="no token"):
            Access(host=host)
    assert [Access(host=host).is_guarded for host in ("127.0.0.1", "127.8.8.8", "::1", "localhost")] == [False] * 4
    assert Access(host="0.0.0.0", token=TOKEN).is_guarded  # noqa: S104
    assert TOKEN not in repr(GUARDED)


@pytest.mark.parametrize("host", ["", " "])
def test_an_address_that_is_left_empty_does_not_mean_all_of_them(host: str):
    with pytest.raises(LiveError, match="no address to listen at"):
        Access(host=host, token=TOKEN)


def test_a_token_that_is_no_secret_is_refused(tmp_path: Path):
    for token in ("", "short", "x" * 300, "white space is not sent", "später-als-gedacht"):
        with pytest.raises(LiveError, match="no secret"):
            Access(token=token)
    path = tmp_path / "token"
    path.write_text(f"{TOKEN}\n")
    path.chmod(0o644)
    with pytest.raises(LiveError, match="others may read"):
        read_token(path)
    path.chmod(0o600)
    assert read_token(path) == TOKEN
    with pytest.raises(LiveError, match="cannot be read"):
        read_token(tmp_path / "absent")
    os.mkfifo(tmp_path / "pipe", mode=0o600)
    with pytest.raises(LiveError, match="expected a plain file"):
        read_token(tmp_path / "pipe")


def test_tokens_are_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch):
    compared = []
    real = hmac.compare_digest
    monkeypatch.setattr(hmac, "compare_digest", lambda a, b: compared.append((a, b)) or real(a, b))
    wrong = [TOKEN[:-1], TOKEN + "x", "x" * len(TOKEN), "", "\ud800", None, 5, [TOKEN]]
    assert [GUARDED.admits(token) for token in wrong] == [False] * len(wrong)
    assert GUARDED.admits(TOKEN)
    assert not GUARDED.admits_authorization(TOKEN)
    assert GUARDED.admits_authorization(f"Bearer {TOKEN}")
    assert len(compared) == len(wrong) + 3
    assert all(right == TOKEN.encode() for _, right in compared)


@pytest.mark.parametrize("first", [json.dumps({"token": TOKEN[:-1]}), MESSAGES[0], "\x00", "[" * 3000])
def test_a_first_message_without_the_token_is_refused(guarded: Running, first: str):
    connection = connect(guarded.addresses["websocket"])
    connection.send(first)
    assert "not the token" in refusal(connection)
    assert guarded.serves("websocket", TOKEN)


def test_the_token_may_come_in_the_handshake_and_a_wrong_one_ends_it(guarded: Running):
    assert handshake(guarded, Authorization=f"Bearer {TOKEN}x")[0] == 401
    assert handshake(guarded, Authorization=TOKEN)[0] == 401
    status, answer = handshake(guarded, Authorization=f"Bearer {TOKEN}")
    assert status == 101
    assert b'"hello": "tauhat"' in answer
    assert b"hello" not in handshake(guarded)[1]


def test_who_says_nothing_behind_the_handshake_is_sent_away(guarded: Running):
    connection = connect(guarded.addresses["websocket"])
    assert "no token in time" in refusal(connection)


def test_an_address_that_has_not_said_the_token_hears_nothing_at_all(guarded: Running):
    before = guarded.server.clients.totals["unknown_datagrams"]
    connection = connect(guarded.addresses["udp"])
    for text in (MESSAGES[0], json.dumps({"token": "x" * 30}), '{"command": "counts"}', "", "[", "x" * 9000):
        connection.send(text)
    assert connection.exchange(0.3) == []
    assert guarded.server.clients.totals["unknown_datagrams"] == before + 6
    connection.send(json.dumps({"token": TOKEN}))
    assert json.loads(connection.exchange(2.0)[0])["hello"] == "tauhat"
    connection.close()


def test_an_answer_to_a_datagram_is_not_much_longer_than_it(guarded: Running):
    connection = connect(guarded.addresses["udp"])
    connection.send(json.dumps({"token": TOKEN}))
    assert len(connection.exchange(2.0)) == 1
    received = 0
    for text in MESSAGES[:200]:
        connection.send(text)
        received += sum(map(len, connection.exchange(2.0)))
    connection.close()
    assert received < 3 * sum(map(len, MESSAGES[:200]))


@pytest.mark.parametrize(
    "origin",
    ["https://evil.example", "null", "http://127.0.0.1.evil.example", "http://127.0.0.1", "file://", "http://[::1"],
)
def test_pages_of_other_origins_are_refused(served: Running, origin: str):
    assert handshake(served, Origin=origin)[0] == 403
    assert handshake(served, Origin=f"http://127.0.0.1:{served.port('websocket')}")[0] == 101


def test_a_page_that_is_allowed_may_connect(tmp_path: Path):
    with running(tmp_path, access=Access(origins=("https://panel.example",))) as served:
        assert handshake(served, Origin="https://panel.example")[0] == 101
        assert handshake(served, Origin="https://panel.example.evil")[0] == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8765", "127.0.0.1.evil.example", "", "a b", "localhost@evil"]
)
def test_names_that_were_made_to_mean_this_machine_are_refused(served: Running, host: str):
    """DNS rebinding: origin and host agree, and are not ours."""
    assert handshake(served, Host=host, Origin=f"http://{host}")[0] in {400, 403, 421}
    for own in ("localhost", "127.0.0.1:1", "[::1]:8765"):
        assert handshake(served, Host=own)[0] == 101


@pytest.mark.parametrize(
    "path", ["/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..\\..\\boot.ini", "//etc/passwd", "/?x"]
)
def test_no_path_leads_to_a_file(served: Running, path: str):
    status, answer = handshake(served, path=path)
    assert status == 404
    assert b"root:" not in answer


@pytest.mark.parametrize("data", [
    b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"\x16\x03\x01",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\nUpgrade: websocket\r\n\r\n",
    b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 500 + b"\r\n", b"GET /" + b"x" * 20000,
])  # fmt: skip
def test_what_is_no_handshake_gets_nowhere(served: Running, data: bytes):
    assert b" 101 " not in said(served, data)
    assert served.serves("websocket")


def test_half_handshakes_keep_nobody_out_and_are_ended_in_time(served: Running):
    halves = [socket.create_connection(("127.0.0.1", served.port("websocket"))) for _ in range(30)]
    for half in halves:
        half.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
    assert served.serves("websocket")
    time.sleep(0.5)
    for half in halves:
        half.settimeout(1.0)
        with suppress(ConnectionResetError):
            assert half.recv(100) == b""
        half.close()
    assert len(served.server.clients.waiting) == 0


def test_who_asks_for_pongs_and_reads_none_is_cut_off(tmp_path: Path):
    with running(tmp_path, limits=Limits(buffer=8192)) as served:
        connection = connect(served.addresses["websocket"])
        raw = connection._socket
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        raw.settimeout(0.5)
        connection._protocol.send_ping(b"x" * 125)
        pings = connection._drained() * 100_000
        with pytest.raises(ConnectionError):
            raw.sendall(pings)
        connection.close()
        assert served.serves("websocket")


def test_a_server_that_needs_a_token_serves_who_knows_it(guarded: Running):
    for channel in CHANNELS:
        with Sender(guarded.addresses[channel], token=TOKEN) as sender:
            assert len(list(sender.replay(LOG.rows(0, 50), speed=float("inf")))) == 50
    with Sender(guarded.addresses["pipe"]) as sender:  # its file's mode says who may
        assert len(list(sender.replay(LOG.rows(0, 50), speed=float("inf")))) == 50
