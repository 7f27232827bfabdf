"""The client's end of a channel: whole messages, without threads; bytes leave and arrive while one waits."""

from __future__ import annotations

import select
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from tauhat.errors import LiveError, MissingExtraError
from tauhat.live.reasons import reason_of

_PIECE = 65536  # [bytes] taken from the system at a time
_OPENING = 5.0  # [s]
_END = '{"command": "end"}'


class Connection(ABC):
    """Messages in both directions over one socket.

    Parameters
    ----------
    connected : the socket
    """

    def __init__(self, connected: socket.socket) -> None:
        connected.setblocking(False)
        self._socket = connected
        self._outward = bytearray()
        self.is_open = True

    @property
    def waiting(self) -> int:
        """Bytes that the system has not taken yet."""
        return len(self._outward)

    def send(self, text: str) -> None:
        """Send a message, or leave it for the next `exchange` where the system takes no more."""
        self._outward += self._framed(text)
        self._push()

    def exchange(self, seconds: float) -> list[str]:
        """Return the messages that have come; wait so long for the first.

        Parameters
        ----------
        seconds : 0 for only those that are there
        """
        end = time.monotonic() + seconds
        while self.is_open:
            left = max(0.0, end - time.monotonic())
            readable, writable, _ = select.select([self._socket], [self._socket] if self._outward else [], [], left)
            if writable:
                self._push()
            found = self._pull() if readable else []
            if found or left <= 0.0:
                return found
        return []

    def close(self) -> None:
        """End the connection."""
        self.is_open = False
        self._socket.close()

    def _push(self) -> None:
        try:
            while self._outward:
                del self._outward[: self._socket.send(self._outward)]
        except BlockingIOError:
            return
        except OSError:
            self._outward.clear()  # nobody listens; what was said before can still be read

    def _pull(self) -> list[str]:
        try:
            data = self._socket.recv(_PIECE)
        except BlockingIOError:
            return []
        except OSError:
            self._lose()
            return []
        found = self._messages(data)
        if not data:
            self._lose()
        return found

    def _lose(self) -> None:
        self._outward.clear()
        self.is_open = False

    @abstractmethod
    def _framed(self, text: str) -> bytes:
        """Return the bytes of a message."""

    @abstractmethod
    def _messages(self, data: bytes) -> list[str]:
        """Return the messages that are whole with these bytes, empty at the end of the stream."""


class PipeConnection(Connection):
    """Lines over a Unix socket.

    Parameters
    ----------
    path : of the socket
    """

    def __init__(self, path: str) -> None:
        super().__init__(_connected(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM), path))
        self._rest = b""

    def _framed(self, text: str) -> bytes:
        return text.encode() + b"\n"

    def _messages(self, data: bytes) -> list[str]:
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [line.decode() for line in lines]


class UdpConnection(Connection):
    """A message a datagram.

    Parameters
    ----------
    host, port : where the server listens
    """

    def __init__(self, host: str, port: int) -> None:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        super().__init__(_connected(socket.socket(family, kind, protocol), address))

    def send(self, text: str) -> None:
        """Send a datagram; one that the system does not take is lost, as datagrams are."""
        try:
            self._socket.send(self._framed(text))
        except BlockingIOError:
            return
        except OSError:
            self._lose()

    def close(self) -> None:
        """Say that it ends, and end it."""
        if self.is_open:
            self.send(_END)
        super().close()

    def _framed(self, text: str) -> bytes:
        return text.encode()

    def _messages(self, data: bytes) -> list[str]:
        return [data.decode()] if data else []


class WebSocketConnection(Connection):
    """Text messages of a WebSocket.

    Parameters
    ----------
    address : `ws://host:port/`
    headers : beside those of the handshake
    """

    def __init__(self, address: str, *, headers: tuple[tuple[str, str], ...] = ()) -> None:
        try:
            from websockets.client import ClientProtocol
            from websockets.exceptions import InvalidURI
            from websockets.uri import parse_uri
        except ImportError as error:
            raise MissingExtraError("websockets", "live") from error
        try:
            uri = parse_uri(address)
        except (InvalidURI, ValueError) as error:
            raise LiveError("not an address of a server", got=address[:100], expected="ws://host:port/") from error
        self._protocol = ClientProtocol(uri, max_size=None)
        connected = socket.create_connection((uri.host, uri.port), timeout=_OPENING)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().__init__(connected)
        self._early: list[str] = []
        request = self._protocol.connect()
        for name, value in headers:
            request.headers[name] = value
        self._protocol.send_request(request)
        self._outward += self._drained()
        self._push()
        self._shake_hands(address)

    def exchange(self, seconds: float) -> list[str]:
        """Return the messages that have come; wait so long for the first."""
        early, self._early = self._early, []
        return early or super().exchange(seconds)

    def close(self) -> None:
        """Say that it ends, and end it."""
        if self.is_open and self._protocol.state.name != "CONNECTING":
            self._protocol.send_close()
            self._outward += self._drained()
            self._push()
        super().close()

    def _shake_hands(self, address: str) -> None:
        end = time.monotonic() + _OPENING
        while self._protocol.handshake_exc is None and self._protocol.state.name == "CONNECTING":
            if not self.is_open or time.monotonic() > end:
                break
            self._early += super().exchange(0.1)
        if self._protocol.handshake_exc is not None or self._protocol.state.name == "CONNECTING":
            self.close()
            refusal = self._protocol.handshake_exc
            what = "no answer to the handshake" if refusal is None else "the server refused the handshake"
            raise LiveError(what, where=address, got=refusal)

    def _framed(self, text: str) -> bytes:
        if self._protocol.state.name == "OPEN":  # else nobody listens; what was said before can still be read
            self._protocol.send_text(text.encode())
        return self._drained()

    def _messages(self, data: bytes) -> list[str]:
        from websockets.frames import Frame, Opcode

        self._protocol.receive_data(data) if data else self._protocol.receive_eof()
        self._outward += self._drained()
        self._push()
        events = self._protocol.events_received()
        if self._protocol.close_expected():
            self.is_open = False
        return [
            bytes(event.data).decode() for event in events if isinstance(event, Frame) and event.opcode is Opcode.TEXT
        ]

    def _drained(self) -> bytes:
        return b"".join(self._protocol.data_to_send())


def connect(address: str) -> Connection:
    """Return a connection to an address as the server prints it.

    Parameters
    ----------
    address : `ws://host:port/`, `udp://host:port` or `unix:path`

    Raises
    ------
    LiveError
        when it is none of these, or nobody answers there.
    """
    scheme, _, rest = address.partition(":")
    ways: dict[str, Callable[[], Any]] = {
        "ws": lambda: WebSocketConnection(address),
        "udp": lambda: UdpConnection(*_host_and_port(address)),
        "unix": lambda: PipeConnection(rest),
    }
    if scheme not in ways:
        raise LiveError("not an address of a server", got=address[:100], expected="ws://, udp:// or unix:")
    try:
        found: Connection = ways[scheme]()
    except (OSError, UnicodeError) as error:
        raise LiveError("nobody answers", where=address, got=reason_of(error)) from error
    return found


def _connected(made: socket.socket, address: Any) -> socket.socket:
    made.settimeout(_OPENING)
    try:
        made.connect(address)
    except OSError:
        made.close()
        raise
    return made


def _host_and_port(address: str) -> tuple[str, int]:
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if host is None or port is None:
        raise LiveError("not an address of a server", got=address[:100], expected="udp://host:port")
    return host, port
