"""What the server grants its clients, so that none of them can take it from the others."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.arrays import check_fields
from tauhat.errors import LiveError


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Bounds of one server.

    message : longest message [bytes]; a sample of seven joints in full precision has about 350
    openings : most brackets and braces in a message, so that nesting is no deeper; a sample has three
    messages : a second, of one client, whatever they hold; connections are then read more slowly, datagrams skipped
    clients : at a time, over all channels
    waiting : connections that have not said who they are yet
    queue : answers that wait for a slow reader; above it the oldest are dropped
    buffer : bytes that the system holds for a slow reader before answers begin to wait
    handshake : time to say who one is [s]
    idle : time without a message after which a client is let go [s]
    notice : least time between two notices of the same kind [s]
    """

    message: int = 4096
    openings: int = 64
    messages: float = 4000.0
    clients: int = 8
    waiting: int = 16
    queue: int = 1000
    buffer: int = 32768
    handshake: float = 5.0
    idle: float = 60.0
    notice: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self, error=LiveError, name="limits of a server")
