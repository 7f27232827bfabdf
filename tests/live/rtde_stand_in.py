"""A stand-in for a Universal Robots controller: speaks the published RTDE protocol, version 2, and plays a recording.

Port 30004 cannot be chosen in `ur_rtde`; so that tests run beside each other, each stand-in has an address of its own
in 127.0.0.0/8. Its clock goes on while nobody is connected, as a controller's does. Faults come at given cycles.
"""

from __future__ import annotations

import random
import socket
import struct
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

PORT = 30004
KINDS = {
    "timestamp": ("DOUBLE", ">d"), "robot_mode": ("INT32", ">i"), "safety_status_bits": ("UINT32", ">I"),
    "actual_q": ("VECTOR6D", ">6d"), "actual_current": ("VECTOR6D", ">6d"), "target_current": ("VECTOR6D", ">6d"),
    "target_moment": ("VECTOR6D", ">6d"), "joint_temperatures": ("VECTOR6D", ">6d"),
}  # fmt: skip


@dataclass
class RtdeStandIn:
    """Plays columns of (n_t, ..) numbers, one row a cycle.

    columns : variable -> rows; robot_mode 7 and safety_status_bits 1 (normal) where there are none
    rate : at which rows go out [Hz]
    faults : row -> disconnect, garbage, repeat, late, silence; each happens once
    version : of the software it says it has
    protocols : it accepts
    absent : how long it takes no connection behind a disconnect [s]
    missing : variables it does not know
    """

    columns: Mapping[str, np.ndarray]
    rate: float = 500.0
    faults: dict[int, str] = field(default_factory=dict)
    version: tuple[int, int, int, int] = (5, 15, 2, 0)
    protocols: tuple[int, ...] = (1, 2)
    absent: float = 0.0
    missing: tuple[str, ...] = ()
    address: str = ""
    asked: list[tuple[str, bytes]] = field(default_factory=list)

    def __enter__(self) -> Self:
        self._began: float | None = None
        self._ended = threading.Event()
        self._away_until = 0.0
        self._listen()
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._listener.close()
        for thread in self._threads:
            thread.join(timeout=5.0)

    def _listen(self) -> None:
        for _ in range(100):
            self.address = f"127.{random.randint(1, 250)}.{random.randint(1, 250)}.{random.randint(2, 250)}"
            self._listener = socket.socket()
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.settimeout(0.05)
            try:
                self._listener.bind((self.address, PORT))
            except OSError:
                self._listener.close()
                continue
            self._listener.listen()
            return
        raise RuntimeError("no free address in 127.0.0.0/8")

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                link, _ = self._listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            if time.monotonic() < self._away_until:
                link.close()
                continue
            thread = threading.Thread(target=self._serve, args=(link,), daemon=True)
            self._threads.append(thread)
            thread.start()

    def _serve(self, link: socket.socket) -> None:
        link.settimeout(5.0)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with link:
            try:
                names = self._agree(link)
                if names:
                    self._play(link, names)
            except (OSError, EOFError):
                return

    def _agree(self, link: socket.socket) -> list[str]:
        """Answer questions until the client says start; return the variables it wants."""
        names: list[str] = []
        while True:
            kind, content = _package(link)
            self.asked.append((kind, content))
            if kind == "V":
                accepted = struct.unpack(">H", content)[0] in self.protocols
                _send(link, "V", bytes([accepted]))
            elif kind == "v":
                _send(link, "M", b"\5Hello\10stand-in\2")  # a controller may say something in between
                _send(link, "v", struct.pack(">4I", *self.version))
            elif kind == "O":
                names = [name for name in content[8:].decode().split(",") if name]
                known = [name in KINDS and name not in self.missing for name in names]
                types = [KINDS[name][0] if ok else "NOT_FOUND" for name, ok in zip(names, known, strict=True)]
                _send(link, "O", b"\1" + ",".join(types).encode())
            elif kind == "S":
                _send(link, "S", b"\1")
                return names
            else:
                _send(link, kind, b"\0")

    def _play(self, link: socket.socket, names: list[str]) -> None:
        began = self._began = self._began or time.monotonic()
        row = max(0, int((time.monotonic() - began) * self.rate))
        while row < len(self.columns["timestamp"]) and not self._ended.is_set():
            self._ended.wait(max(0.0, began + row / self.rate - time.monotonic()))
            if not self._fault(link, row, names):
                return
            _send(link, "U", self._data(names, row))
            row += 1
        self._ended.wait(30.0)  # the recording is over: the line stays open, silent

    def _fault(self, link: socket.socket, row: int, names: list[str]) -> bool:
        """Make what goes wrong at a row; return whether the connection still stands."""
        fault = self.faults.pop(row, "")
        if fault == "disconnect":
            self._away_until = time.monotonic() + self.absent
            return False
        if fault == "garbage":
            link.sendall(bytes(random.Random(row).randbytes(200)))
        if fault == "repeat":
            _send(link, "U", self._data(names, row - 1))
        if fault == "late":
            time.sleep(0.1)
        if fault == "silence":
            self._ended.wait(30.0)
        return True

    def _data(self, names: list[str], row: int) -> bytes:
        parts = [b"\1"]
        for name in names:
            usual = 7 if name == "robot_mode" else 1
            value = self.columns[name][row] if name in self.columns else np.full(6, 0.0)
            if name in ("robot_mode", "safety_status_bits"):
                value = int(value) if name in self.columns else usual
            parts.append(struct.pack(KINDS[name][1], *np.atleast_1d(value)))
        return b"".join(parts)


def _package(link: socket.socket) -> tuple[str, bytes]:
    size, kind = struct.unpack(">HB", _exactly(link, 3))
    return chr(kind), _exactly(link, size - 3)


def _exactly(link: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        part = link.recv(size - len(data))
        if not part:
            raise EOFError
        data += part
    return data


def _send(link: socket.socket, kind: str, content: bytes) -> None:
    link.sendall(struct.pack(">HB", 3 + len(content), ord(kind)) + content)
