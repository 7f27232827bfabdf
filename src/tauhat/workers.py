"""Where many independent pieces of work are done: in this process, on all cores, or on a cluster."""

from __future__ import annotations

import multiprocessing
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Generic, TypeVar

from tauhat.blas import single_threaded
from tauhat.errors import ArrayError

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers(ABC):
    """Does pieces of work that know nothing of each other; functions and items must be picklable."""

    @abstractmethod
    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """Yield the result for each item, in the order of the items; an error of the function is raised here."""

    @abstractmethod
    def reduce(
        self, merge: Callable[[Result, Result], Result], function: Callable[[Item], Result], items: Sequence[Item]
    ) -> Result:
        """Return the results for all items merged two by two, neighbours first, as a tree."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalWorkers(Workers):
    """Processes on this machine.

    count : of processes; the number of cores by default, and with one the work is done in this process
    """

    count: int | None = None

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise ArrayError("number of processes", expected="at least 1", got=self.count)

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """Yield the result for each item; idle processes take the next one."""
        count = self.count or os.cpu_count() or 1
        if count == 1:
            yield from map(function, items)
            return
        # Forked processes would inherit locks of threads that do not live in them.
        with ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn")) as pool:
            yield from pool.map(_Alone(function), items)

    def reduce(
        self, merge: Callable[[Result, Result], Result], function: Callable[[Item], Result], items: Sequence[Item]
    ) -> Result:
        """Return the merged results; what the processes send back is merged here."""
        return merged_as_tree(merge, self.map(function, items))


@dataclass(frozen=True, slots=True)
class _Alone(Generic[Item, Result]):
    """A function whose BLAS leaves the other cores to the other processes."""

    function: Callable[[Item], Result]

    def __call__(self, item: Item) -> Result:
        return single_threaded(self.function)(item)


def merged_as_tree(merge: Callable[[Result, Result], Result], results: Iterable[Result]) -> Result:
    """Return the results merged in pairs of neighbours, then the pairs, until one is left.

    Two halves are merged as soon as both are there: of n results at most log2(n) + 1 wait. Which results are merged
    with which depends on their number alone, never on when they come.

    Raises
    ------
    ArrayError
        when there is none.
    """
    waiting: list[tuple[int, Result]] = []
    for result in results:
        size, merged = 1, result
        while waiting and waiting[-1][0] == size:
            merged = merge(waiting.pop()[1], merged)
            size *= 2
        waiting.append((size, merged))
    if not waiting:
        raise ArrayError("nothing to merge")
    whole = waiting.pop()[1]
    while waiting:
        whole = merge(waiting.pop()[1], whole)
    return whole
