"""A Dask cluster as workers: pieces of work that outlast the machines they are done on.

The scheduler remembers how every result is made. When a worker is lost, what it was doing and what it had done and kept
is done again by others. Pieces of work and results travel as pickles: use a cluster only inside a trusted network.
"""

from __future__ import annotations

import asyncio
import socket
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic

import tauhat
from tauhat.blas import single_threaded
from tauhat.errors import MissingExtraError, TauhatError
from tauhat.workers import Item, LocalWorkers, Result, Workers, merged_as_tree

_LOOK = 2.0  # [s] between two looks at whether the cluster still has workers
_MERGE_FIRST = 1  # priority of merges over first pieces of work: what is merged no longer takes memory
_STARTING = "dask scheduler, then dask worker ADDRESS"


def workers_of(cluster: str | None, count: int | None) -> Workers:
    """Return the workers of the cluster at this address, or `count` processes here where there is no address.

    Raises
    ------
    TauhatError
        when both are given.
    """
    if cluster is None:
        return LocalWorkers(count=count)
    if count is not None:
        raise TauhatError(
            "a cluster has the workers it has",
            expected="an address or a number of processes",
            got=f"{cluster} and {count}",
            remedy="give one of the two",
        )
    return ClusterWorkers(address=cluster)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterWorkers(Workers):
    """Workers of a Dask cluster that runs already.

    address : of its scheduler, such as tcp://10.0.0.5:8786
    ahead : pieces of work given out for each thread of the cluster, done or not, before the first is taken
    patience : how long to wait for the scheduler, for a first worker, and for another after the last was lost [s]

    A piece of work whose worker dies is done again; only one that takes four workers with it (the scheduler's
    `allowed-failures` and one) is given up. Workers need this version of the library, and may come and go.
    """

    address: str
    ahead: int = 4
    patience: float = 10.0

    def __post_init__(self) -> None:
        if self.ahead < 1:
            raise TauhatError("pieces of work ahead", expected="at least 1", got=self.ahead)
        if not self.patience > 0.0:
            raise TauhatError("the patience must be a positive time", got=f"{self.patience} s")

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """Yield the result for each item, in order; items are taken as they are given out.

        Raises
        ------
        TauhatError
            when the cluster cannot be reached, has no workers, has another version, or is lost.
        MissingExtraError
            without the library `distributed`.
        """
        with self._connected() as cluster:
            given: deque[Any] = deque()
            for item in items:
                given.append(cluster.submit(function, item))
                if len(given) >= cluster.room():
                    yield cluster.result(given.popleft())
            while given:
                yield cluster.result(given.popleft())

    def reduce(
        self, merge: Callable[[Result, Result], Result], function: Callable[[Item], Result], items: Sequence[Item]
    ) -> Result:
        """Return the merged results; they are merged by the workers, and only the last one travels here.

        Raises
        ------
        TauhatError, MissingExtraError
            as `map`.
        ArrayError
            when there is no item.
        """
        with self._connected() as cluster:
            whole: Any = merged_as_tree(cluster.merging(merge), cluster.leaves(function, items))
            merged: Result = cluster.result(whole)
            return merged

    @contextmanager
    def _connected(self) -> Iterator[_Cluster]:
        distributed = _library()
        try:
            _greet(self.address, self.patience)
            client = distributed.Client(self.address, timeout=self.patience, set_as_default=False)
        except (OSError, OverflowError, ValueError, MemoryError) as error:  # MemoryError: its answer is not Dask's
            raise TauhatError(
                "no Dask scheduler can be reached",
                where=self.address,
                got=str(error) or f"no answer within {self.patience:g} s",
                remedy=f"give the address that it prints at its start, or start one: {_STARTING}",
            ) from error
        with client:
            cluster = _Cluster(settings=self, client=client)
            cluster.check_workers()
            yield cluster


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cluster:
    """A connection to a cluster while it lasts. Futures are Dask's."""

    settings: ClusterWorkers
    client: Any

    def check_workers(self) -> None:
        """Refuse a cluster without workers, or whose workers have another version of the library."""
        try:
            self.client.wait_for_workers(1, timeout=self.settings.patience)
        except TimeoutError as error:
            raise self._deserted("no worker has joined the cluster") from error
        except OSError as error:
            raise self._lost() from error

        def installed() -> str:  # local, so that it travels as code: a worker may lack the library
            import tauhat as theirs

            return theirs.__version__

        versions = self.client.run(installed, on_error="return")
        other = {worker: _words(found) for worker, found in versions.items() if _differs(found)}
        if other:
            raise TauhatError(
                "workers have another version of tauhat",
                where=self.settings.address,
                expected=tauhat.__version__,
                got="; ".join(f"{found} at {worker}" for worker, found in sorted(other.items())),
                remedy="install the same version there and start them again",
            )

    def room(self) -> int:
        """Return how many pieces of work may be given out; more as workers join."""
        return max(1, self.settings.ahead * self._threads())

    def submit(self, function: Callable[..., Any], *items: Any, priority: int = 0) -> Any:
        """Return the future of one piece of work; items may be futures."""
        piece = _Piece(function, tauhat.__version__)
        return self.client.submit(piece, *items, pure=False, priority=priority)

    def merging(self, merge: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """Return the merge of two futures to a future."""
        return lambda left, right: self.submit(merge, left, right, priority=_MERGE_FIRST)

    def leaves(self, function: Callable[[Item], Any], items: Iterable[Item]) -> Iterator[Any]:
        """Yield a future for each item, so slowly that few results wait to be merged."""
        running: deque[Any] = deque()
        for item in items:
            while len(running) >= self.room():
                self.wait(running.popleft())
            leaf = self.submit(function, item)
            running.append(leaf)
            yield leaf

    def wait(self, future: Any) -> None:
        """Wait until a piece of work is done; raise what it raised.

        Raises
        ------
        TauhatError
            when the cluster has been without workers for too long, or is lost.
        """
        deserted = 0.0
        while not future.done():
            try:
                future.exception(timeout=_LOOK)
            except TimeoutError:
                deserted = 0.0 if self._threads() else deserted + _LOOK
            except CancelledError as error:
                raise self._lost() from error
            if deserted >= self.settings.patience:
                raise self._deserted("every worker has left the cluster")
        if future.status != "finished":
            self.result_of(future)

    def result(self, future: Any) -> Any:
        """Return the result of a piece of work, however often its worker had to be replaced; raise what it raised."""
        self.wait(future)
        return self.result_of(future)

    def result_of(self, future: Any) -> Any:
        """Return the result of a piece of work that is done; the errors of the function are its own."""
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise TauhatError(
                f"a piece of work was given up: it took {error.allowed_failures + 1} workers with it",
                where=self.settings.address,
                remedy="look at their logs; most often a worker has too little memory: give it more, or fewer threads",
            ) from error
        except CancelledError as error:
            raise self._lost() from error

    def _threads(self) -> int:
        try:
            return sum(self.client.nthreads().values())
        except OSError as error:
            raise self._lost() from error

    def _deserted(self, what: str) -> TauhatError:
        waited = f"none within {self.settings.patience:g} s"
        return TauhatError(what, where=self.settings.address, got=waited, remedy=f"start some: {_STARTING}")

    def _lost(self) -> TauhatError:
        return TauhatError(
            "the scheduler of the cluster was lost, and with it what was under way",
            where=self.settings.address,
            remedy="start it again and repeat the command",
        )


@dataclass(frozen=True, slots=True)
class _Piece(Generic[Result]):
    """A function as a worker does it: with one BLAS thread, and by the version of the library it was written for."""

    function: Callable[..., Result]
    version: str

    def __call__(self, *items: Any) -> Result:
        if tauhat.__version__ != self.version:  # of a worker that joined after the others were asked
            raise TauhatError(
                "a worker has another version of tauhat",
                expected=self.version,
                got=tauhat.__version__,
                remedy="install the same version there and start it again",
            )
        return single_threaded(self.function)(*items)


def _library() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError("distributed", "cluster") from error
    return distributed


def _greet(address: str, patience: float) -> None:
    """Refuse an address where no scheduler answers, before Dask makes a client that it could not close again."""
    from distributed import Security
    from distributed.comm import connect, parse_address, parse_host_port

    scheme, place = parse_address(address)
    if scheme in {"tcp", "tls"}:  # a port that refuses is known at once, while Dask would knock again
        socket.create_connection(parse_host_port(place), timeout=patience).close()

    async def greeted() -> None:
        greeting = connect(address, timeout=patience, **Security().get_connection_args("client"))
        comm = await asyncio.wait_for(greeting, patience)  # `connect` alone waits for ever for one that does not answer
        comm.abort()

    with ThreadPoolExecutor(1) as thread:  # an event loop may run in this one, as in notebooks
        thread.submit(asyncio.run, greeted()).result()


def _differs(found: object) -> bool:
    """Return whether a worker's answer is another version, or that it has none; a worker just lost has no say."""
    return found != tauhat.__version__ and not isinstance(found, OSError)


def _words(found: object) -> str:
    return "none" if isinstance(found, ImportError) else str(found)
