"""Samples over a Unix domain socket: one line each, for programs of the same user on the same machine.

The socket is made with mode 0600, so the file system says who may connect and no token is asked for.
"""

from __future__ import annotations

import asyncio
import os
import socket
import stat
from pathlib import Path

from tauhat.errors import LiveError
from tauhat.live.clients import Clients
from tauhat.live.conversation import converse

_ONLY_OWNER = 0o177  # taken away from a new file's mode
_FAREWELL = 2.0  # [s] for a client to take what is left for it


class _Channel:
    """A stream of lines as a channel of whole messages."""

    kind = "pipe"

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, clients: Clients) -> None:
        self._reader = reader
        self._writer = writer
        self._clients = clients
        clients.waiting.enter(self, hang_up=self.abort)

    async def receive(self) -> bytes:
        try:
            return await self._reader.readuntil(b"\n")
        except asyncio.LimitOverrunError as error:
            raise LiveError("a message that is too long", where=self.kind, got=f"{error.consumed} bytes") from error
        except asyncio.IncompleteReadError as error:
            raise EOFError from error  # half a line is no message

    async def send(self, text: str) -> None:
        self._writer.write(text.encode() + b"\n")
        await self._writer.drain()

    def abort(self) -> None:
        self._writer.transport.abort()

    def admitted(self) -> None:
        self._clients.waiting.leave(self)


class PipeServer:
    """A Unix socket that answers clients until it is closed.

    Parameters
    ----------
    clients : all that are connected
    path : of the socket; one that nobody listens at any more is replaced, any other file is not
    """

    def __init__(self, clients: Clients, path: Path) -> None:
        self.path = path
        self._clients = clients
        self._tasks: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None
        self._file: tuple[int, int] | None = None

    async def start(self) -> None:
        """Listen.

        Raises
        ------
        LiveError
            when the path is that of another file, another server listens there, or it cannot be made.
        """
        bound = _bound(self.path)
        self._file = _identity(self.path)
        limit = self._clients.service.limits.message
        self._server = await asyncio.start_unix_server(self._accept, sock=bound, limit=limit)

    async def close(self) -> None:
        """End all conversations and take the socket away."""
        if self._server is None:
            return
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if _identity(self.path) == self._file:
            self.path.unlink(missing_ok=True)

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        buffer, channel = self._clients.service.limits.buffer, _Channel(reader, writer, self._clients)
        connected: socket.socket = writer.get_extra_info("socket")
        connected.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, buffer)
        writer.transport.set_write_buffer_limits(high=buffer)
        task = asyncio.ensure_future(converse(channel, self._clients, access=None))
        self._tasks.add(task)
        try:
            await asyncio.wait({task})
        finally:
            self._tasks.discard(task)
            self._clients.waiting.leave(channel)
            _part(writer)


def _part(writer: asyncio.StreamWriter) -> None:
    """End a connection; one that does not take what is left for it is not kept for that."""
    writer.close()
    if writer.transport.get_write_buffer_size():
        asyncio.get_running_loop().call_later(_FAREWELL, writer.transport.abort)


def _bound(path: Path) -> socket.socket:
    """Return a socket bound to a path, readable and writable by its owner alone."""
    found = _identity(path)
    if found is not None and not stat.S_ISSOCK(path.lstat().st_mode):
        raise LiveError("a file that is no socket is not replaced", where=path, remedy="choose another path")
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        if found is not None:
            _check_abandoned(path)
            path.unlink(missing_ok=True)
        before = os.umask(_ONLY_OWNER)
        try:
            listening.bind(str(path))
        finally:
            os.umask(before)
    except OSError as error:
        listening.close()
        raise LiveError("the socket cannot be made", where=path, got=error.strerror or str(error)) from error
    except LiveError:
        listening.close()
        raise
    return listening


def _check_abandoned(path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as trial:
        trial.settimeout(1.0)
        try:
            trial.connect(str(path))
        except ConnectionRefusedError:
            return
    raise LiveError("another server listens there", where=path, remedy="end it, or choose another path")


def _identity(path: Path) -> tuple[int, int] | None:
    """Return which file this is, None where there is none."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
