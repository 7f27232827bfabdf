"""An hour of samples as fast as they go, with garbage, disconnects and slow readers: nothing may crash, grow or be lost.

    python benchmarks/soak.py [--minutes N] [--quick] [--json] [--seed N]

The server runs in a process of its own. On each of its three channels: streams that check every answer, with random
garbage between their samples; clients that come, send a few samples, and vanish amid a message; connections that say
nothing or nonsense; and, on WebSocket and pipe, readers that take their answers slowly. Every valid sample has to be
answered once and in order, or, for a slow reader, be told as dropped; datagrams may be lost before the server sees them,
which is counted apart. The server's resident memory and open files are
looked at all the while: `growth` is the slope of memory over the last four fifths, in kB a minute.
"""

from __future__ import annotations

import argparse
import json
import pickle
import random
import socket
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from live import CHANNELS, RATE, samples, serve_here, server
from tauhat.errors import LiveError
from tauhat.live import Limits
from tauhat.live.connection import Connection, WebSocketConnection, connect

LIMITS = Limits(messages=1e6, clients=16, waiting=8, queue=200, buffer=16384, handshake=1.0, idle=10.0)
AHEAD, TABLE = 24, 4096
LOOKED = 5.0  # [s] between looks at the server
FAULTS = ("out_of_order", "unaccounted", "lost", "streams_broken", "streams_refused")
QUIET = 20.0  # [s] without an answer after which a stream counts as broken
TAILS = [text[text.index(",") :] for text in samples(TABLE)]
NONSENSE = (
    "", "{", "null", "[]", "[" * 3000, '{"a":' * 70, '{"t": 0}', '{"t": "0", "q": [], "tau": []}', '{"q": [1]}',
    '{"t": 1e999, "q": [0,0,0,0,0,0,0], "tau": [0,0,0,0,0,0,0]}', '{"t": -5, "q": [0,0,0,0,0,0,0], "tau": [0,0,0,0,0,0,0]}',
    '{"t": 1, "q": [NaN,0,0,0,0,0,0], "tau": [0,0,0,0,0,0,0]}', '{"t": 1, "q": [0], "tau": [0]}',
    '{"command": "shutdown"}', '{"command": ["zero"]}', '{"token": "guess"}', "\u2028\ufffd", "é" * 900, "9" * 4000,
)  # fmt: skip


class Stream:
    """A client whose every sample is accounted for."""

    def __init__(self, address: str, rng: random.Random, totals: Counter[str], *, slow: bool = False) -> None:
        self.address, self.rng, self.totals, self.slow = address, rng, totals, slow
        self.open()

    def open(self) -> None:
        self.connection = connect(self.address)
        self.is_udp = self.address.startswith("udp")
        self.may_skip = self.slow or self.is_udp
        self.sent = self.heard = self.answered = self.dropped = 0
        self.taken, self.asked = -1, False
        self.read_at = self.heard_at = time.monotonic()
        if self.slow:
            self.connection._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16384)

    def turn(self) -> None:
        """Send what may be sent, read what is there, check it."""
        ahead = 100_000 if self.slow else AHEAD
        for _ in range(AHEAD):
            if self.sent - self.heard >= ahead or self.connection.waiting > 65536:
                break
            self.connection.send(f'{{"t": {self.sent / RATE!r}{TAILS[self.sent % TABLE]}')
            self.sent += 1
            if self.rng.random() < 0.05:
                self.spoil()
        now = time.monotonic()
        if not self.slow or now - self.read_at > 0.05:
            self.read_at = now
            self.read()
        if now - self.heard_at > QUIET or not self.connection.is_open:
            self.totals["streams_broken"] += 1
            print(
                f"broken: {'slow ' * self.slow}{self.address}, open {self.connection.is_open}, no answer for "
                f"{now - self.heard_at:.1f} s; sent {self.sent}, answered {self.answered}, dropped {self.dropped}, waiting {self.connection.waiting}",
                file=sys.stderr,
            )
            self.end()
            self.open()

    def spoil(self) -> None:
        self.totals["garbage"] += 1
        kind = self.rng.randrange(10)
        if kind == 0 and isinstance(self.connection, WebSocketConnection):
            self.connection._protocol.send_binary(pickle.dumps(self.totals))
            self.connection._outward += self.connection._drained()
        elif kind == 1:
            self.connection.send("".join(chr(self.rng.randrange(32, 127)) for _ in range(self.rng.randrange(300))))
        else:
            self.connection.send(self.rng.choice(NONSENSE))

    def read(self) -> None:
        for text in self.connection.exchange(0.0):
            message: dict[str, Any] = json.loads(text)
            if "tau_ext" in message and "t" in message:
                self.check(round(message["t"] * RATE))
            elif message.get("notice") == "dropped":
                self.dropped = message["total"]
            elif message.get("notice") == "counts":
                self.taken = message["counts"]["taken"]
            elif "refused" in message:
                self.totals["streams_refused"] += 1

    def check(self, number: int) -> None:
        """Count an answer, which has to be the next, or a later one where some were told as dropped or lost."""
        self.heard_at = time.monotonic()
        skipped = number - self.heard
        if skipped < 0 or (skipped > 0 and not self.may_skip):
            self.totals["out_of_order"] += 1
        self.answered += 1
        self.heard = max(self.heard, number + 1)

    def has_settled(self) -> bool:
        """Read on; return whether the server has said how many samples it took and all their answers are there."""
        if not self.asked and not self.connection.waiting:
            self.connection.send('{"command": "counts"}')
            self.asked = True
        self.read()
        return not self.connection.is_open or self.taken >= 0

    def end(self) -> None:
        """Account for every sample: those that the server took are answered once, or told as dropped."""
        for name in ("sent", "taken", "answered", "dropped"):
            self.totals[name] += getattr(self, name)
        self.totals["lost_datagrams" if self.is_udp else "lost"] += self.sent - self.taken
        self.totals["unaccounted"] += abs(self.taken - self.answered - self.dropped)
        self.connection.close()


def vanish(address: str, rng: random.Random) -> None:
    """Come, send a little, and go amid a message."""
    with suppress(LiveError, OSError):
        connection: Connection = connect(address)
        for number in range(rng.randrange(40)):
            connection.send(f'{{"t": {number / RATE!r}{TAILS[number]}')
        if not address.startswith("udp"):
            connection._outward += connection._framed(f'{{"t": 1{TAILS[0]}')[: rng.randrange(1, 200)]
            connection._push()
            connection._socket.close()
        connection.close()


def pester(address: str, rng: random.Random, silent: list[socket.socket]) -> None:
    """Say nothing, half a handshake, or random bytes where a handshake is expected."""
    host, _, port = address.removeprefix("ws://").strip("/").rpartition(":")
    with suppress(OSError):
        raw = socket.create_connection((host, int(port)), timeout=1.0)
        raw.sendall(
            rng.choice([b"GET / HTTP/1.1\r\nHost: x", b"", rng.randbytes(200), b"GET /../etc/passwd HTTP/1.1\r\n\r\n"])
        )
        silent.append(raw)
    while len(silent) > 20:
        silent.pop(0).close()


def looked_at(process: int) -> tuple[float, int]:
    """Return a process's resident memory [kB] and number of open files."""
    status = Path(f"/proc/{process}/status").read_text()
    resident = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return float(resident.split()[1]), len(list(Path(f"/proc/{process}/fd").iterdir()))


def soak(minutes: float, seed: int, *, speaks: bool) -> dict[str, Any]:
    rng, totals = random.Random(seed), Counter[str]()
    looks: list[tuple[float, float, int]] = []
    silent: list[socket.socket] = []
    with server(script=__file__) as (addresses, process):
        streams = [Stream(addresses[name], rng, totals) for name in CHANNELS]
        streams += [Stream(addresses[name], rng, totals, slow=True) for name in ("websocket", "pipe")]
        begin = looked = vanished = pestered = time.monotonic()
        while (now := time.monotonic()) - begin < 60.0 * minutes and process.poll() is None:
            for stream in streams:
                stream.turn()
            if now > vanished:
                vanished = now + 0.1 * rng.random()
                vanish(addresses[rng.choice(CHANNELS)], rng)
                totals["disconnects"] += 1
            if now > pestered:
                pestered = now + 0.4 * rng.random()
                pester(addresses["websocket"], rng, silent)
                totals["pestered"] += 1
            if now - looked > LOOKED:
                looked = now
                looks.append((now - begin, *looked_at(process.pid)))
                if speaks:
                    state = f"{totals['answered'] + sum(s.answered for s in streams):>10} answered, {looks[-1][1] / 1024:.1f} MB, {looks[-1][2]} files"
                    print(f"{(now - begin) / 60:7.2f} min {state}", flush=True)
        end = time.monotonic() + QUIET
        unsettled = streams
        while unsettled and time.monotonic() < end:
            unsettled = [stream for stream in unsettled if not stream.has_settled()]
        for stream in streams:
            stream.end()
        crashes = int(process.poll() is not None)
    return judged(totals, looks, crashes) | {"minutes": minutes, "seed": seed}


def judged(totals: Counter[str], looks: list[tuple[float, float, int]], crashes: int) -> dict[str, Any]:
    table = np.array(looks)
    late = table[table[:, 0] > 0.2 * table[-1, 0]]
    slope = float(np.polyfit(late[:, 0] / 60.0, late[:, 1], 1)[0]) if len(late) > 2 else float("nan")
    return {
        **totals, "crashes": crashes, **{name: totals[name] for name in FAULTS},
        "memory_mb": [float(late[0, 1]) / 1024, float(late[:, 1].max()) / 1024, float(late[-1, 1]) / 1024],
        "growth_kb_a_minute": slope, "files": [int(late[0, 2]), int(late[:, 2].max())],
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="half a minute")
    parser.add_argument("--json", action="store_true", help="one JSON document")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve is not None:
        serve_here(options.serve, with_page=False, limits=LIMITS)
        return
    result = soak(0.5 if options.quick else options.minutes, options.seed, speaks=not options.json)
    if options.json:
        print(json.dumps(result, indent=1))
    else:
        for name, value in result.items():
            print(f"{name:20} {value}")
    sys.exit(int(result["crashes"] or any(result[name] for name in FAULTS)))


if __name__ == "__main__":
    main()
