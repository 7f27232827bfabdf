"""A Dask cluster of two worker processes on this machine, and pieces of work that its workers can import."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from distributed import LocalCluster

from tauhat.cluster import ClusterWorkers
from tauhat.workers import Workers


@contextmanager
def cluster_of(count: int) -> Iterator[str]:
    """Yield the address of a cluster of so many worker processes; its nannies replace those that die."""
    with LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # a free port: no page is drawn, but a server is there all the same
        host="127.0.0.1",
        silence_logs=50,
    ) as cluster:
        yield cluster.scheduler_address


def named(number: int) -> str:
    return str(number)


def slow(number: int) -> tuple[int, int]:
    """Return the number and the process that has it."""
    time.sleep(0.1)
    return number, os.getpid()


def joined(left: str, right: str) -> str:
    return f"({left} {right})"


def refused(number: int) -> str:
    """Refuse one number alone: of several that are refused, the first to be done is the one that is told."""
    if number == 1:
        raise ValueError(f"no {number}")
    return named(number)


def noted(path: str) -> None:
    """Write down that this was called, and fail."""
    with Path(path).open("a", encoding="utf-8") as file:
        file.write("called\n")
    raise OSError("as itself")


def deadly(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@dataclass(frozen=True)
class DiesOnce:
    """A function that kills its worker the first time it is called with the item at `place` among `items`."""

    function: Any
    item: Any
    marker: Path

    def __call__(self, item: Any) -> Any:
        if item == self.item and not self.marker.exists():
            self.marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return self.function(item)


@dataclass(frozen=True)
class LosingWorkers(Workers):
    """A cluster that loses a worker in its first map and in its first reduction, at the item in the middle."""

    cluster: ClusterWorkers
    folder: Path

    def map(self, function, items):
        given = list(items)
        yield from self.cluster.map(self._deadly(function, given, "map"), given)

    def reduce(self, merge, function, items):
        return self.cluster.reduce(merge, self._deadly(function, items, "reduce"), items)

    def _deadly(self, function, items, way):
        return DiesOnce(function, items[len(items) // 2], self.folder / way)
