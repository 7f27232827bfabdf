"""Garbage is collected when we say so: a full collection amid samples takes tens of milliseconds."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Collect no garbage by itself within; what is there already is never looked at again until the end.

    What streams leave behind is freed by reference counts. Connections that end leave cycles: call `gc.collect` now and
    then, which is a matter of a millisecond since it looks only at what has come since.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()
