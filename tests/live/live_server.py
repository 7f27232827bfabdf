"""A server in a thread of its own on loopback, samples for it, and what the answers have to be."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauhat.dynamics.passive_kernel import ELEMENT
from tauhat.errors import LiveError
from tauhat.live import Access, Channels, Limits, LiveServer, Sender, Service
from tauhat.recordings import Recording
from tauhat.robots import load_robot
from tauhat.sensing import ForceSensor, SensedModel, assumed_contact_thresholds

RATE = 1000.0
N_T = 1500
TOKEN = "correct-horse-battery-staple"  # noqa: S105
CHANNELS = ("websocket", "udp", "pipe")


def sensor(name: str = "panda") -> ForceSensor:
    robot = load_robot(name)
    nothing = np.zeros(0, dtype=ELEMENT)
    model = SensedModel(
        robot=robot, inertia=robot.inertia, rotor=np.zeros(robot.n_v), sliding=nothing, bristles=nothing,
        rms=np.full(robot.n_v, 0.1), slow=np.full(robot.n_v, 0.02),
    )  # fmt: skip
    return ForceSensor(model=model, rate=RATE)


def recording(n_t: int = N_T, n_v: int = 7) -> Recording:
    t = np.arange(n_t) / RATE
    phase = np.arange(n_v)
    swing = 2.0 * t[:, None] + phase
    return Recording(t=t, q=0.5 * np.sin(swing), tau=10.0 * np.cos(swing))


SENSOR = sensor()
LOG = recording()
SENSED = SENSOR.along(LOG)
THRESHOLDS = assumed_contact_thresholds(SENSOR)
SERVICE = Service(sensor=SENSOR)
MESSAGES = [
    json.dumps({"t": t, "q": q, "tau": tau})
    for t, q, tau in zip(LOG.t.tolist(), LOG.q.tolist(), LOG.tau.tolist(), strict=True)
]


@dataclass(frozen=True)
class Running:
    """A server that runs: its addresses, and what went wrong in its loop."""

    addresses: dict[str, str]
    server: LiveServer
    complaints: list[Any]
    loop: asyncio.AbstractEventLoop

    def port(self, channel: str) -> int:
        return int(self.addresses[channel].strip("/").rpartition(":")[2])

    def serves(self, channel: str = "websocket", token: str | None = None) -> bool:
        """Return whether a newcomer gets every answer, within 20 s where those before it have not left yet.

        Connections that a test has closed may still wait to be accepted, and are clients then for a moment.
        """
        end = time.monotonic() + 20.0
        while True:
            try:
                with Sender(self.addresses[channel], token=token) as sender:
                    answers = list(sender.replay(LOG.rows(0, 20), speed=np.inf))
            except LiveError as error:
                if "too many clients" not in str(error) or time.monotonic() > end:
                    raise
                time.sleep(0.05)
                continue
            return [answer["t"] for answer in answers] == LOG.t[:20].tolist()


@contextmanager
def running(
    folder: Path, *, access: Access | None = None, service: Service = SERVICE, limits: Limits | None = None
) -> Iterator[Running]:
    """Serve on all three channels; nothing may go wrong in the server's loop."""
    given = service if limits is None else Service(sensor=service.sensor, thresholds=service.thresholds, limits=limits)
    channels = Channels(websocket=0, udp=0, pipe=folder / "samples", access=access or Access())
    found: list[Running] = []
    ready, loop, ended = threading.Event(), asyncio.new_event_loop(), asyncio.Event()
    complaints: list[Any] = []
    loop.set_exception_handler(lambda _, context: complaints.append(context))

    async def serve() -> None:
        async with LiveServer(given, channels) as server:
            found.append(Running(dict(server.addresses), server, complaints, loop))
            ready.set()
            await ended.wait()

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    assert ready.wait(20.0)
    try:
        yield found[0]
    finally:
        loop.call_soon_threadsafe(ended.set)
        thread.join(15.0)
        assert not thread.is_alive()
        loop.close()
    assert complaints == [], complaints


def wrenches(answers: list[dict[str, Any]]) -> NDArray[np.float64]:
    return np.array([answer["wrench"] for answer in answers])
