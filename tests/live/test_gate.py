"""The gate lets nobody in who may not, whatever they send, and the page is alive after each attack."""

from __future__ import annotations

import re
import secrets
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from tauhat.errors import LiveError, OutputError
from tauhat.live.access import Access
from tauhat.live.gate import Gate, GateLimits
from tauhat.live.request_head import Answer, RequestHead, read_head

viser = pytest.importorskip("viser", reason="viser is not installed: there is no page behind the gate")

pytestmark = pytest.mark.filterwarnings("default")
TOKEN = "a-secret-of-24-letters-00"  # noqa: S105
QUICK = GateLimits(handshake=1.0, waiting=4, pages=2, delay=0.05)
VISER = Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture(scope="module")
def door(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    from tauhat.report.hidden_viser import hidden_server

    place = tmp_path_factory.mktemp("door") / "door"
    server = hidden_server(place)
    server.gui.add_button("Zero")
    yield place
    server.stop()


@contextmanager
def gate_to(door: Path, *, token: str | None = None, limits: GateLimits = QUICK) -> Iterator[Gate]:
    gate = Gate(Access(token=token), port=0, door=door, limits=limits)
    gate.start()
    try:
        yield gate
    finally:
        gate.close()


@pytest.fixture(scope="module")
def opened(door: Path) -> Iterator[Gate]:
    with gate_to(door) as gate:
        yield gate


@pytest.fixture(scope="module")
def guarded(door: Path) -> Iterator[Gate]:
    with gate_to(door, token=TOKEN) as gate:
        yield gate


def said(gate: Gate, data: bytes) -> bytes:
    """Send bytes and return all that comes back."""
    with socket.create_connection(("127.0.0.1", gate.port), timeout=5.0) as connection:
        connection.sendall(data)
        received = b""
        try:
            while piece := connection.recv(65536):
                received += piece
        except ConnectionResetError:
            pass
    return received


def request(gate: Gate, path: str = "/", *, method: str = "GET", **fields: str) -> bytes:
    lines = {"Host": f"127.0.0.1:{gate.port}"} | {name.replace("_", "-"): text for name, text in fields.items()}
    return "\r\n".join([f"{method} {path} HTTP/1.1", *(f"{n}: {t}" for n, t in lines.items()), "", ""]).encode()


def status(answer: bytes) -> int:
    return int(answer.split(b" ", 2)[1])


def cookie(gate: Gate) -> str:
    found = re.search(
        rb"Set-Cookie: ([^;]+); Path=/; HttpOnly; SameSite=Strict\r\n", said(gate, request(gate, f"/?token={TOKEN}"))
    )
    assert found is not None
    return found[1].decode()


def page(gate: Gate, *, origin: str | None = "", **fields: str) -> connect:
    """Return a WebSocket to the page, as its own script opens it unless told otherwise."""
    own = f"http://127.0.0.1:{gate.port}" if origin == "" else origin
    return connect(
        f"ws://127.0.0.1:{gate.port}", origin=None if own is None else Origin(own), subprotocols=[VISER],
        additional_headers=fields, max_size=None, open_timeout=5.0, compression=None,
    )  # fmt: skip


def is_alive(gate: Gate, **fields: str) -> bool:
    """Whether the page and its WebSocket can still be had."""
    fetched = said(gate, request(gate, **fields))
    with page(gate, **fields) as connection:
        return status(fetched) == 200 and b"<!doctype html>" in fetched and len(connection.recv(timeout=5.0)) > 16


def test_the_page_is_let_through_with_headers_that_bind_it_to_its_own_site(opened):
    answer = said(opened, request(opened))
    head, _, body = answer.partition(b"\r\n\r\n")
    assert status(answer) == 200
    assert f"connect-src 'self' ws://127.0.0.1:{opened.port} ".encode() in head
    assert b"frame-ancestors 'none'" in head
    assert body.rstrip().endswith(b"</html>")
    assert is_alive(opened)


@pytest.mark.parametrize("path", [
    "/../../etc/passwd", "/..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..\\..\\etc\\passwd", "//etc/passwd",
    "/.", "/index.html/..", "/assets/x.js", "/%00",
])  # fmt: skip
def test_a_path_leads_nowhere_but_to_the_page(opened, path):
    assert status(said(opened, request(opened, path))) == 404
    assert is_alive(opened)


@pytest.mark.parametrize(("data", "expected"), [
    (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", 400),
    ("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: \u00fc\r\n\r\n".encode("latin-1"), 400),
    (b"GET / HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n", 400),
    (b"GET http://127.0.0.1/ HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", 400),
    (b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4\r\n\r\nzero", 405),
    (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4\r\n\r\nzero", 400),
    (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: evil.example\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n folded\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\nHost : 127.0.0.1\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: h2c\r\nConnection: Upgrade\r\n\r\n", 400),
])  # fmt: skip
def test_what_is_no_plain_request_is_refused(opened, data, expected):
    assert status(said(opened, data)) == expected
    assert is_alive(opened)


def test_a_second_request_behind_the_first_is_not_read(opened):
    answer = said(opened, request(opened, "/x") + request(opened))
    assert answer.count(b"HTTP/1.1 ") == 1
    whole = said(opened, request(opened) + request(opened, "/x"))
    assert whole.count(b"HTTP/1.1 200") == 1
    assert b"HTTP/1.1 404" not in whole


def test_an_endless_head_is_cut_off(opened):
    answer = said(opened, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"X: " + b"a" * 20_000)
    assert status(answer) == 431
    assert is_alive(opened)


def test_slow_heads_end_in_time_and_keep_nobody_out(opened):
    with ExitStack() as stack:
        slow = [
            stack.enter_context(socket.create_connection(("127.0.0.1", opened.port), timeout=5.0)) for _ in range(20)
        ]
        for connection in slow:
            connection.sendall(b"GET / HTTP/1.1\r\n")
        assert is_alive(opened)
        begin = time.monotonic()
        answers = [_rest(connection) for connection in slow]
        assert time.monotonic() - begin < 4.0
    assert {answer[:12] for answer in answers} == {b"", b"HTTP/1.1 408"}  # the oldest made way, the others were told
    assert is_alive(opened)


def _rest(connection: socket.socket) -> bytes:
    try:
        return connection.recv(65536)
    except ConnectionResetError:
        return b""


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "evil.example:80", "", "127.0.0.1@evil"])
def test_a_name_that_was_made_to_mean_this_machine_is_refused(opened, host):
    assert status(said(opened, request(opened, Host=host))) == 403
    assert is_alive(opened)


@pytest.mark.parametrize("origin", [
    "http://evil.example", "null", "http://127.0.0.1:1", "http://localhost", "file://",
    "http://127.0.0.1.evil.example", "http://[::1", None,
])  # fmt: skip
def test_pages_of_other_sites_get_no_socket(opened, origin):
    with pytest.raises(InvalidStatus, match="403"), page(opened, origin=origin):
        pass
    assert is_alive(opened)


@pytest.mark.parametrize(
    "query",
    [
        "websocket=ws://evil.example",
        "playbackPath=http://evil.example",
        "token=",
        "a",
        "token=x&b=c",
        "token=a&token=b",
    ],
)
def test_an_address_cannot_send_the_page_to_another_server(guarded, query):
    assert status(said(guarded, request(guarded, f"/?{query}"))) in {400, 403}
    assert is_alive(guarded, Cookie=cookie(guarded))


def test_the_token_becomes_a_cookie_that_lets_in(guarded):
    assert guarded.url == f"http://127.0.0.1:{guarded.port}/?token={TOKEN}"
    answer = said(guarded, request(guarded, f"/?token={TOKEN}"))
    assert status(answer) == 200
    assert b'content="0;url=/"' in answer
    assert TOKEN.encode() not in answer
    assert is_alive(guarded, Cookie=f"other=1; {cookie(guarded)}; more=2")


@pytest.mark.parametrize("wrong", ["", "x", TOKEN[:-1], TOKEN + "0", TOKEN.upper(), "%ff%fe"])
def test_a_wrong_token_is_refused(guarded, wrong):
    answer = said(guarded, request(guarded, f"/?token={wrong}"))
    assert status(answer) == 403
    assert b"Set-Cookie" not in answer
    assert is_alive(guarded, Cookie=cookie(guarded))


def test_without_its_cookie_neither_page_nor_socket_is_had(guarded):
    name, _, right = cookie(guarded).partition("=")
    for sent in (
        {},
        {"Cookie": f"{name}={TOKEN}"},
        {"Cookie": f"{name}={right[:-1]}"},
        {"Cookie": f"x{name}={right}"},
    ):
        assert status(said(guarded, request(guarded, **sent))) == 401
        with pytest.raises(InvalidStatus, match="401"), page(guarded, **sent):
            pass
    assert is_alive(guarded, Cookie=cookie(guarded))


def ended_by(connection: ClientConnection, message: bytes) -> int | None:
    """Return the code with which the server ends a connection after a message; None where it just breaks off."""
    try:
        connection.send(message)
        while True:
            connection.recv(timeout=5.0)
    except ConnectionClosed as closed:
        return None if closed.rcvd is None else closed.rcvd.code


def test_too_long_a_message_ends_its_connection_alone(opened):
    with page(opened) as other, page(opened) as connection:
        connection.recv(timeout=5.0)
        assert ended_by(connection, secrets.token_bytes(200_000)) in {None, 1009}
        assert len(other.recv(timeout=5.0)) > 16
    assert is_alive(opened)


@pytest.mark.parametrize(
    "message", [b"", b"\xc1", b"\x81\xa4type\xa4Nope", "text", b"\xdd\xff\xff\xff\xff" + b"\x91" * 50_000]
)
def test_messages_that_mean_nothing_leave_the_page_alive(opened, message):
    with page(opened) as connection:
        connection.recv(timeout=5.0)
        connection.send(message)
    assert is_alive(opened)


def test_more_pages_than_may_be_open_are_refused(opened):
    with page(opened), page(opened), pytest.raises(InvalidStatus, match="503"), page(opened):
        pass
    until = time.monotonic() + 5.0
    while not _has_room(opened) and time.monotonic() < until:
        time.sleep(0.02)
    assert is_alive(opened)


def _has_room(gate: Gate) -> bool:
    try:
        return is_alive(gate)
    except InvalidStatus:  # the gate has not seen yet that the others ended
        return False


def test_pages_that_ask_at_once_are_no_more_than_may_be_open(opened):
    asking = request(
        opened, Origin=f"http://127.0.0.1:{opened.port}", Upgrade="websocket", Connection="Upgrade",
        Sec_WebSocket_Key="dGhlIHNhbXBsZSBub25jZQ==", Sec_WebSocket_Version="13", Sec_WebSocket_Protocol=VISER,
    )  # fmt: skip
    with ExitStack() as stack:
        address = ("127.0.0.1", opened.port)
        asked = [stack.enter_context(socket.create_connection(address, timeout=5.0)) for _ in range(QUICK.waiting)]
        for connection in asked:
            connection.sendall(asking[:-2])
        time.sleep(0.1)
        for connection in asked:
            connection.sendall(asking[-2:])
        answers = sorted(status(_rest(connection)) for connection in asked)
    assert answers == [101] * QUICK.pages + [503] * (QUICK.waiting - QUICK.pages)


def test_a_browser_that_takes_nothing_is_let_go(tmp_path):
    limits = GateLimits(stalled=0.2)
    with _endless_page(tmp_path / "door") as place, gate_to(place, limits=limits) as gate:
        own = f"http://127.0.0.1:{gate.port}"
        with socket.create_connection(("127.0.0.1", gate.port), timeout=5.0) as connection:
            connection.sendall(request(gate, Origin=own, Upgrade="websocket", Connection="Upgrade"))
            until = time.monotonic() + 10.0
            # its end of the connection is gone, not just forgotten
            with pytest.raises(OSError, match=r"reset|pipe"):  # noqa: PT012
                while time.monotonic() < until:
                    connection.send(b"x")
                    time.sleep(0.05)


@contextmanager
def _endless_page(place: Path) -> Iterator[Path]:
    """Serve one connection with bytes as long as somebody takes them."""
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(place))
        listening.listen(1)

        def pour() -> None:
            with listening.accept()[0] as connection, suppress(OSError):
                while True:
                    connection.sendall(bytes(65536))

        pouring = threading.Thread(target=pour)
        pouring.start()
        yield place
        pouring.join(timeout=10.0)
        assert not pouring.is_alive()


def test_a_token_with_signs_that_addresses_read_otherwise_lets_in(door):
    with gate_to(door, token="a+secret/of=many~signs.+") as gate:
        found = urlsplit(gate.url)
        answer = said(gate, request(gate, f"{found.path}?{found.query}"))
    assert status(answer) == 200
    assert b"Set-Cookie" in answer


def test_viser_has_no_port_and_its_door_is_its_owners(door):
    assert door.is_socket()
    assert door.stat().st_mode & 0o077 == 0
    with socket.socket(socket.AF_UNIX) as own:
        own.connect(str(door))  # it is there that viser listens


def test_a_page_cannot_ask_for_a_tunnel_to_the_world(opened, monkeypatch):
    tunnels = []
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *given: tunnels.append(given))
    with page(opened) as connection:
        connection.send(b"\x81\xa4type\xafShareUrlRequest")
        ended_by(connection, b"\xc1")  # no message: the connection ends once both were read
    assert tunnels == []


def test_a_page_that_is_not_there_is_said(tmp_path):
    with gate_to(tmp_path / "nothing") as gate:
        assert status(said(gate, request(gate))) == 502


def test_a_port_that_is_taken_is_refused(opened):
    with pytest.raises(OutputError, match="cannot be used"):
        Gate(Access(), port=opened.port, door=Path("door"))


def test_a_limit_of_nothing_is_refused():
    with pytest.raises(LiveError, match="bounds nothing"):
        GateLimits(waiting=0)


@given(st.binary(max_size=300))
def test_any_bytes_are_a_request_or_an_answer(data):
    read = read_head(data + b"\r\n\r\n")
    assert isinstance(read, Answer) or (isinstance(read, RequestHead) and read.path.startswith("/"))


@given(
    st.lists(
        st.sampled_from(
            ["Host: a", "Cookie: b=1", "X-Forwarded-For: 1", "Range: bytes=0-1", "Origin: http://a", "Accept: */*"]
        ),
        max_size=6,
        unique=True,
    )
)
def test_only_known_fields_are_handed_on(lines):
    read = read_head("\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).encode())
    if isinstance(read, RequestHead):
        assert read.forwarded() == b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"
    else:
        assert "Host: a" not in lines
