"""The page in a process of its own, so that drawing takes no time from sensing.

Towards the page go tuples of the server's own numbers, and of streams that have ended their names and last contacts.
Back come single words, which are compared and never unpacked: whatever a browser does to the page's process, nothing of
it is run in the server, and sending never waits: what the system would not take at once is not sent.
"""

from __future__ import annotations

import multiprocessing
import os
import select
import shutil
import signal
import tempfile
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tauhat.errors import LiveError, TauhatError
from tauhat.live.access import Access
from tauhat.live.feed import Snapshot
from tauhat.live.gate import Gate

if TYPE_CHECKING:
    from tauhat.report.live_page import LivePage
    from tauhat.robots.robot import Robot
    from tauhat.sensing.touch import Touch
    from tauhat.sensing.wrench import Axes

_A_SECOND, _BURST = 30.0, 3.0  # snapshots on average, and at once
_UNDERWAY = 2  # snapshots that the page has not taken yet
_WORDS = frozenset({b"zero"})
_ENDS = 64  # streams whose end the page was not told yet
_TAKEN, _LONGEST, _HEARD = b"taken", 2048, 16  # words at one look
_BEGIN = 60.0  # [s] for the process to begin
_END = 5.0  # [s] for it to end
_IDLE = 0.05  # [s] between looks at the page without a snapshot
_NICENESS = 5  # the page gives way to sensing


class _Settings(NamedTuple):
    """What the page's process is told."""

    robot: Robot
    frame: str | None
    axes: Axes
    port: int
    access: Access


class PageProcess:
    """A running page; made by `start_page`."""

    def __init__(self, process: Any, connection: Connection, url: str) -> None:
        self._process, self._connection = process, connection
        self._room = select.poll()
        self._room.register(connection, select.POLLOUT)  # a Unix socket has room as long as most of its buffer is free
        self.url = url
        self.dropped = 0
        self._underway = 0
        self._allowance, self._counted_at = _BURST, time.monotonic()
        self._looked_at = 0.0
        self._asked: list[str] = []
        self._ended: deque[tuple[str, tuple[Touch, ...]]] = deque(maxlen=_ENDS)
        self._lock = threading.Lock()

    @property
    def is_alive(self) -> bool:
        """Whether the page runs."""
        return bool(self._process.is_alive())

    def send(self, snapshot: Snapshot) -> bool:
        """Show a snapshot; return False, at once, where the page is slow, gone, or was shown one just now."""
        if not self._lock.acquire(blocking=False):
            return False
        try:
            if self._is_free():
                self._connection.send(tuple(snapshot))
                self._underway += 1
                self._allowance -= 1.0
                return True
        except (OSError, EOFError, ValueError):
            pass  # the page is gone
        finally:
            self._lock.release()
        self.dropped += 1
        return False

    def end(self, stream: str, contacts: tuple[Touch, ...] = ()) -> None:
        """Tell the page, behind what it was shown of a stream, that it has ended: now or when it takes more.

        Parameters
        ----------
        contacts : of the stream since its last snapshot
        """
        with self._lock:
            self._ended.append((stream, contacts))
            self._tell_ends()

    def commands(self) -> list[str]:
        """Return what was asked for on the page since the last call, at once: `zero`."""
        now = time.monotonic()
        with self._lock:
            if now - self._looked_at >= 1.0 / _A_SECOND:
                self._looked_at = now
                self._tell_ends()
            asked, self._asked = self._asked, []
        return asked

    def close(self) -> None:
        """End the page's process."""
        self._connection.close()
        self._process.join(timeout=_END)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(timeout=_END)

    def _is_free(self) -> bool:
        now = time.monotonic()
        self._allowance = min(_BURST, self._allowance + _A_SECOND * (now - self._counted_at))
        self._counted_at = now
        if self._allowance < 1.0:
            return False
        self._tell_ends()
        return self._has_room()

    def _tell_ends(self) -> None:
        """Take the words that have come, and tell of ends as far as the page takes more."""
        self._listen()
        try:
            while self._ended and self._has_room():
                self._connection.send(self._ended.popleft())
                self._underway += 1
        except (OSError, ValueError):
            self._ended.clear()  # the page is gone

    def _has_room(self) -> bool:
        """Return whether something may be sent: the page keeps up as it says, and sending would not wait either."""
        return self._underway < _UNDERWAY and any(event == select.POLLOUT for _, event in self._room.poll(0))

    def _listen(self) -> None:
        """Take the words that have come."""
        try:
            for _ in range(_HEARD):
                if not self._connection.poll():
                    return
                self._hear(self._connection.recv_bytes(_LONGEST))
        except (OSError, EOFError):
            self._underway = _UNDERWAY  # the page is gone: nothing more is sent

    def _hear(self, word: bytes) -> None:
        if word == _TAKEN:
            self._underway -= 1
        elif word in _WORDS:
            self._asked.append(word.decode())


def start_page(
    robot: Robot, *, frame: str | None = None, axes: Axes = "base", port: int = 8080, access: Access | None = None
) -> PageProcess:
    """Return a page that is ready, in a process of its own.

    Parameters
    ----------
    frame : where the force acts; the robot's last where not stated
    axes : whose axes wrenches are along
    port : 0 for any free one
    access : who is let in; this machine alone where not stated

    Raises
    ------
    LiveError
        when the page cannot begin: the port is taken, viser is missing.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    settings = _Settings(robot, frame, axes, port, access or Access())
    process = context.Process(target=_serve_page, args=(theirs, settings), name="page", daemon=True)
    with _deaf_to_interrupts():
        process.start()
    theirs.close()
    try:
        first = ours.recv_bytes(_LONGEST).decode() if ours.poll(_BEGIN) else "it took too long"
    except (OSError, EOFError):
        first = "its process ended"
    kind, _, rest = first.partition(" ")
    if kind == "ready":
        return PageProcess(process, ours, rest)
    ours.close()
    process.kill()
    process.join(timeout=_END)
    raise LiveError(first, where="page")


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Let a process begin that is deaf to Ctrl-C: a terminal sends it to both, and the server ends both."""
    if threading.current_thread() is not threading.main_thread():
        yield  # which alone hears it
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _serve_page(connection: Connection, settings: _Settings) -> None:
    """Run the page until the server ends; the whole life of its process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends it
    signal.signal(signal.SIGTERM, _leave)
    os.nice(_NICENESS)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)  # what viser says on standard output is none of the server's answers
    folder = Path(tempfile.mkdtemp(prefix="tauhat-"))  # nobody else may enter
    try:
        _run(connection, settings, folder / "door")
    except TauhatError as error:
        connection.send_bytes(str(error).encode()[:_LONGEST])
    except (EOFError, OSError):
        pass  # the server is gone
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _leave(_signal: int, _frame: object) -> None:
    """Let a server that ends without closing its page leave nothing behind."""
    raise SystemExit(0)


def _run(connection: Connection, settings: _Settings, door: Path) -> None:
    import logging

    from tauhat.report.hidden_viser import hidden_server
    from tauhat.report.live_page import LivePage

    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # whoever breaks off could fill the log
    gate = Gate(settings.access, port=settings.port, door=door)
    page = LivePage(hidden_server(door), settings.robot, frame=settings.frame, axes=settings.axes)
    gate.start()
    connection.send_bytes(f"ready {gate.url}".encode())
    _follow(connection, page)


def _follow(connection: Connection, page: LivePage) -> None:
    """Show what comes until nothing can come any more."""
    parent = multiprocessing.parent_process()
    ends: list[Any] = [connection] if parent is None else [connection, parent.sentinel]
    while True:
        ready = wait(ends, timeout=_IDLE)
        if connection in ready:
            told = connection.recv()
            match told:
                case (stream, contacts):
                    page.end(stream, contacts)
                case _:
                    page.show(Snapshot(*told))
            connection.send_bytes(_TAKEN)
        elif ready:
            return
        page.refresh()
        for word in page.commands():
            connection.send_bytes(word.encode())
