"""Commands that talk to others over sockets outlive those who leave."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def outliving_readers() -> Iterator[None]:
    """Let a write to whoever has left raise `BrokenPipeError`, within; also a decorator.

    Elsewhere such a write ends the program without a word, as `tauhat ... | head` is to end. A server would end so with
    the first client that leaves before it has read its answers.
    """
    if sys.platform == "win32":  # which knows no such signal
        yield
        return
    before = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGPIPE, before)
