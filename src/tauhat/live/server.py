"""The server: channels, clients and page together, from the first address to the last farewell."""

from __future__ import annotations

import asyncio
import gc
import signal
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Self

from tauhat.errors import LiveError
from tauhat.live.access import Access
from tauhat.live.clients import Clients
from tauhat.live.collecting import seldom_collecting
from tauhat.live.pipe_server import PipeServer
from tauhat.live.service import Service
from tauhat.live.udp_server import UdpServer

if TYPE_CHECKING:
    from websockets.asyncio.server import Server

    from tauhat.live.universal_robots import RobotLink, UniversalRobot

_COLLECTED = 10.0  # [s] between collections of garbage


@dataclass(frozen=True, slots=True, kw_only=True)
class Channels:
    """Where samples may come in.

    websocket, udp : ports, 0 for any that is free, None for none
    pipe : path of a Unix socket, None for none
    robot : that the server itself reads, None for none; its clients may follow it
    access : address of the ports, and who is let in
    """

    websocket: int | None = None
    udp: int | None = None
    pipe: Path | None = None
    robot: UniversalRobot | None = None
    access: Access = field(default_factory=Access)

    def __post_init__(self) -> None:
        if all(way is None for way in (self.websocket, self.udp, self.pipe, self.robot)):
            raise LiveError("no channel for samples", expected="a WebSocket port, a UDP port, a pipe or a robot")


class LiveServer:
    """Streams of samples in, answers out; an asynchronous context in which it serves.

    Parameters
    ----------
    service : what every client is given
    channels : where it listens
    """

    def __init__(self, service: Service, channels: Channels) -> None:
        self.clients = Clients(service)
        self.addresses: dict[str, str] = {}
        self._service = service
        self._channels = channels
        self._websocket: Server | None = None
        self._udp: UdpServer | None = None
        self._pipe: PipeServer | None = None
        self._chores: list[asyncio.Task[None]] = []
        self._robot: asyncio.Task[None] | None = None
        self._link: RobotLink | None = None

    async def __aenter__(self) -> Self:
        async with AsyncExitStack() as unless_started:
            unless_started.push_async_callback(self.close)
            await self._start()
            unless_started.pop_all()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def _start(self) -> None:
        """Listen on all channels, and to the robot.

        Raises
        ------
        TauhatError
            when one of them cannot be had.
        """
        access, wanted = self._channels.access, self._channels
        self._service.warm_up()
        shown = f"[{access.host}]" if ":" in access.host else access.host
        if wanted.pipe is not None:
            self._pipe = PipeServer(self.clients, wanted.pipe)
            await self._pipe.start()
            self.addresses["pipe"] = f"unix:{wanted.pipe}"
        if wanted.udp is not None:
            self._udp = UdpServer(self.clients, access)
            self.addresses["udp"] = f"udp://{shown}:{self._udp.start(wanted.udp)}"
        if wanted.websocket is not None:
            from tauhat.live.websocket_server import serve_websocket

            self._websocket, port = await serve_websocket(self.clients, access, port=wanted.websocket)
            self.addresses["websocket"] = f"ws://{shown}:{port}/"
        chores = (self.clients.watch(), self.clients.obey(), _collect())
        self._chores = [asyncio.create_task(chore) for chore in chores]
        if wanted.robot is not None:
            await self._listen_to(wanted.robot)

    async def _listen_to(self, robot: UniversalRobot) -> None:
        """Read a robot as a client of its own; it comes last, so that its samples do not wait."""
        from tauhat.live.robot_channel import stream_robot

        self._link = await asyncio.to_thread(robot.connect)
        self._robot = asyncio.create_task(stream_robot(self._link, self.clients))
        self._chores.append(self._robot)
        self.addresses["source"] = f"ur://{robot.address}"

    async def until(self, ended: asyncio.Event) -> None:
        """Serve until an event.

        Raises
        ------
        TauhatError
            as soon as the robot that the server reads is gone for good, or its samples are refused.
        """
        event = asyncio.create_task(ended.wait())
        waiting = {event} if self._robot is None else {event, self._robot}
        try:
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            event.cancel()
        if self._robot is not None and self._robot.done():
            self._robot.result()

    async def close(self) -> None:
        """Say farewell to all clients and stop listening."""
        for chore in self._chores:
            chore.cancel()
        await asyncio.gather(*self._chores, return_exceptions=True)
        if self._link is not None:
            self._link.close()
        if self._udp is not None:
            self._udp.close()
        if self._pipe is not None:
            await self._pipe.close()
        if self._websocket is not None:
            self._websocket.close()
            await self._websocket.wait_closed()


def serve(service: Service, channels: Channels, *, started: Callable[[dict[str, str]], object]) -> dict[str, int]:
    """Serve until SIGINT or SIGTERM, then end the page; return how many clients there were, and samples by their fate.

    Parameters
    ----------
    started : called once with the address of every channel

    Raises
    ------
    TauhatError
        when an address cannot be had, or the robot that it reads is gone for good.
    """
    try:
        return asyncio.run(_serve(LiveServer(service, channels), started))
    finally:
        service.feed.close()


async def _serve(server: LiveServer, started: Callable[[dict[str, str]], object]) -> dict[str, int]:
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    async with server:
        with seldom_collecting():  # after all is loaded and compiled
            started(dict(server.addresses))
            await server.until(ended)
    return dict(server.clients.totals)


async def _collect() -> None:
    while True:
        await asyncio.sleep(_COLLECTED)
        gc.collect()
