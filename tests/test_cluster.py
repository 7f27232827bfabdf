"""A cluster does what this process would do, in the same order, and loses nothing when it loses a worker."""

from __future__ import annotations

import os
import pickle
import signal
import socket
import sys
import time
from collections.abc import Iterator

import pytest

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

import tauhat
from tauhat.cluster import ClusterWorkers, _Piece
from tauhat.errors import ArrayError, MissingExtraError, TauhatError
from tauhat.workers import LocalWorkers
from two_workers import DiesOnce, cluster_of, deadly, joined, named, noted, refused, slow

HERE = LocalWorkers(count=1)


@pytest.fixture(scope="module")
def workers() -> Iterator[ClusterWorkers]:
    with cluster_of(2) as address:
        yield ClusterWorkers(address=address)


def test_results_come_in_the_order_of_the_items(workers):
    assert list(workers.map(named, range(40))) == [str(number) for number in range(40)]


@pytest.mark.parametrize("count", [1, 2, 7, 20])
def test_the_cluster_merges_the_tree_that_one_process_merges(workers, count):
    assert workers.reduce(joined, named, range(count)) == HERE.reduce(joined, named, range(count))


def test_items_are_taken_no_faster_than_the_cluster_has_room(workers):
    taken = []
    results = ClusterWorkers(address=workers.address, ahead=2).map(named, (taken.append(k) or k for k in range(50)))
    assert next(results) == "0"
    assert len(taken) == 4  # two threads, two pieces of work each
    results.close()


def test_a_worker_killed_in_the_middle_of_a_map_loses_nothing(workers):
    found = []
    for number, process in workers.map(slow, range(24)):
        found.append((number, process))
        if number == 3:
            os.kill(process, signal.SIGKILL)
            killed = process
    assert [number for number, _ in found] == list(range(24))
    assert found[-1][1] != killed
    assert len({process for _, process in found}) > 1


def test_a_worker_killed_in_the_middle_of_a_reduction_loses_nothing(workers, tmp_path):
    marker = tmp_path / "died"
    merged = workers.reduce(joined, DiesOnce(named, 13, marker), range(20))
    assert marker.exists()
    assert merged == HERE.reduce(joined, named, range(20))


def test_work_that_kills_every_worker_is_given_up(workers):
    with pytest.raises(TauhatError, match="given up: it took 4 workers with it"):
        list(workers.map(deadly, range(1)))


@pytest.mark.parametrize("way", ["map", "reduce"])
def test_an_error_of_the_function_is_raised_as_itself(workers, way):
    with pytest.raises(ValueError, match=r"^no 1$"):
        list(workers.map(refused, range(3))) if way == "map" else workers.reduce(joined, refused, range(3))


def test_work_that_fails_is_not_tried_again(workers, tmp_path):
    with pytest.raises(OSError, match=r"^as itself$"):
        list(workers.map(noted, [str(tmp_path / "calls")]))
    assert (tmp_path / "calls").read_text() == "called\n"


def test_nothing_cannot_be_merged_there_either(workers):
    with pytest.raises(ArrayError, match="nothing to merge"):
        workers.reduce(joined, named, [])


def test_workers_of_another_version_are_refused_by_name(workers, monkeypatch):
    monkeypatch.setattr(tauhat, "__version__", "9.9")
    with pytest.raises(TauhatError, match=r"another version of tauhat; expected 9\.9, got [\d.]+ at tcp://127"):
        list(workers.map(named, range(2)))


def test_a_worker_of_another_version_that_joins_later_refuses_the_work():
    assert _Piece(named, tauhat.__version__)(3) == "3"
    with pytest.raises(TauhatError, match=r"expected 9\.9"):
        _Piece(named, "9.9")(3)


def test_an_address_where_nobody_listens_is_refused_at_once():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(TauhatError, match=f"^{address}: no Dask scheduler can be reached") as caught:
        list(ClusterWorkers(address=address).map(named, range(2)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("address", ["nonsense", "http://127.0.0.1:8786", "", "tcp://127.0.0.1:99999999"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(TauhatError, match="no Dask scheduler can be reached"):
        list(ClusterWorkers(address=address).map(named, range(2)))


def test_a_server_that_does_not_answer_is_given_up():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        started = time.monotonic()
        with pytest.raises(TauhatError, match=r"no Dask scheduler can be reached; got no answer within 0\.5 s"):
            list(ClusterWorkers(address=address, patience=0.5).map(named, range(2)))
        assert time.monotonic() - started < 10.0


def test_a_cluster_without_workers_is_refused():
    with cluster_of(0) as address, pytest.raises(TauhatError, match="no worker has joined the cluster"):
        list(ClusterWorkers(address=address, patience=0.5).map(named, range(2)))


def test_without_the_library_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"distributed is not installed; pip install 'tauhat\[cluster\]'"):
        list(ClusterWorkers(address="tcp://127.0.0.1:1").map(named, range(2)))


def test_settings_that_mean_nothing_are_refused():
    with pytest.raises(TauhatError, match="at least 1"):
        ClusterWorkers(address="tcp://127.0.0.1:1", ahead=0)
    with pytest.raises(TauhatError, match="positive"):
        ClusterWorkers(address="tcp://127.0.0.1:1", patience=0.0)


def test_errors_survive_the_way_from_a_worker():
    for error in (MissingExtraError("distributed", "cluster"), TauhatError("what", where="there", got=3)):
        back = pickle.loads(pickle.dumps(error))  # noqa: S301
        assert (type(back), str(back), vars(back)) == (type(error), str(error), vars(error))
