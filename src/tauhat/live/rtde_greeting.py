"""Asking a controller what it is before `ur_rtde` is let near it: who answers, which version, which variables.

The library has no time limit while it connects and ends the process when a variable is unknown; so the same questions
are asked here first, over a connection of their own that is closed behind them. RTDE packages are big-endian: size
(2 bytes, with the header), kind (1 byte), content (Universal Robots, Real-Time Data Exchange guide, protocol 2).
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from typing import NamedTuple

from tauhat.errors import LiveError

PORT = 30004
_HEADER = struct.Struct(">HB")
_PROTOCOL = 2
_LARGEST = 2**16
_MOST_OTHERS = 100  # packages of other kinds before an answer
_CB3, _OLDEST = 3, (3, 3)
_PORT_REMEDY = "is the robot switched on, the address right, and RTDE not blocked in its security settings?"


class Controller(NamedTuple):
    """Version of a controller's software."""

    major: int
    minor: int
    bugfix: int
    build: int

    @property
    def version(self) -> str:
        """As the pendant shows it."""
        return f"{self.major}.{self.minor}.{self.bugfix}"

    @property
    def fastest(self) -> float:
        """Cycles it tells a second [Hz]: 125 of a CB3, 500 of an e-Series."""
        return 125.0 if self.major <= _CB3 else 500.0


def greet(address: str, variables: Sequence[str], *, timeout: float = 2.0) -> Controller:
    """Return what controller answers at an address, after it has agreed to tell the variables.

    Parameters
    ----------
    timeout : for each answer [s]

    Raises
    ------
    LiveError
        nobody answers, no controller does, it is too old, or does not know a variable.
    """
    try:
        with socket.create_connection((address, PORT), timeout=timeout) as link:
            return _asked(link, address, variables)
    except TimeoutError as error:
        raise LiveError(
            "no answer", where=_place(address), got=f"{timeout:g} s of silence", remedy=_PORT_REMEDY
        ) from error
    except (ConnectionResetError, ConnectionAbortedError, BrokenPipeError) as error:
        raise _no_controller(address, error.strerror or type(error).__name__) from error
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise LiveError("no connection to the robot", where=_place(address), got=reason, remedy=_PORT_REMEDY) from error


def _asked(link: socket.socket, address: str, variables: Sequence[str]) -> Controller:
    accepted = _ask(link, "V", struct.pack(">H", _PROTOCOL), address)
    told = _ask(link, "v", b"", address)
    if len(told) != 4 * 4:
        raise _no_controller(address, f"a version of {len(told)} bytes")
    controller = Controller(*struct.unpack(">4I", told))
    if not _OLDEST <= controller[:2] < (100, 0) or accepted != b"\1":
        raise LiveError(
            "the controller does not speak RTDE protocol 2", where=_place(address),
            got=f"software {controller.version}", remedy="update the controller",
        )  # fmt: skip
    question = struct.pack(">d", controller.fastest) + ",".join(variables).encode("ascii")
    types = _ask(link, "O", question, address)[1:].decode("ascii", "replace").split(",")
    unknown = [name for name, kind in zip(variables, types, strict=False) if kind == "NOT_FOUND"]
    if unknown or len(types) != len(variables):
        got = f"software {controller.version}"
        what = f"the controller does not tell {', '.join(unknown) or 'what it is asked for'}"
        raise LiveError(what, where=_place(address), got=got, remedy="update the controller")
    return controller


def _ask(link: socket.socket, kind: str, content: bytes, address: str) -> bytes:
    """Return the content of the answer to a package; messages in between are passed over."""
    link.sendall(_HEADER.pack(_HEADER.size + len(content), ord(kind)) + content)
    for _ in range(_MOST_OTHERS):
        size, answered = _HEADER.unpack(_exactly(link, _HEADER.size, address))
        if size < _HEADER.size or not 0x20 < answered < 0x7F:
            raise _no_controller(address, f"a package of kind {answered}, {size} bytes")
        body = _exactly(link, size - _HEADER.size, address)
        if answered == ord(kind):
            return body
    raise _no_controller(address, f"no answer to {kind}")


def _exactly(link: socket.socket, size: int, address: str) -> bytes:
    data = b""
    while len(data) < size:
        part = link.recv(min(size - len(data), _LARGEST))
        if not part:
            raise _no_controller(address, "the connection was closed")
        data += part
    return data


def _no_controller(address: str, got: str) -> LiveError:
    remedy = "is it a Universal Robots controller, and has it finished booting?"
    return LiveError("what answers does not speak RTDE", where=_place(address), got=got, remedy=remedy)


def _place(address: str) -> str:
    return f"ur://{address[:80]}, port {PORT}"
