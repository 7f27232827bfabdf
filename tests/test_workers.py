"""Work done in pieces: results in order, merged as one tree, whoever does it."""

from __future__ import annotations

import pytest

from tauhat.cluster import ClusterWorkers, workers_of
from tauhat.errors import ArrayError, TauhatError
from tauhat.workers import LocalWorkers, merged_as_tree


def joined(left: str, right: str) -> str:
    return f"({left} {right})"


def level_by_level(names: list[str]) -> str:
    """Merge neighbours in pairs, then the pairs, by the definition."""
    while len(names) > 1:
        pairs = [joined(*names[k : k + 2]) for k in range(0, len(names) - 1, 2)]
        names = pairs + names[2 * len(pairs) :]
    return names[0]


@pytest.mark.parametrize("count", [*range(1, 20), 31, 32, 33, 100])
def test_neighbours_are_merged_first_then_the_pairs(count):
    names = [str(number) for number in range(count)]
    assert merged_as_tree(joined, iter(names)) == level_by_level(names)


def test_few_results_wait_for_their_merge():
    waiting, most = 0, 0

    def coming():
        nonlocal waiting, most
        for number in range(1000):
            waiting += 1
            most = max(most, waiting)
            yield number

    def merge(left: int, right: int) -> int:
        nonlocal waiting
        waiting -= 1
        return left + right

    assert merged_as_tree(merge, coming()) == sum(range(1000))
    assert most <= 11


def test_nothing_cannot_be_merged():
    with pytest.raises(ArrayError, match="nothing to merge"):
        merged_as_tree(joined, [])


@pytest.mark.parametrize("count", [1, 2])
def test_processes_give_results_in_order_and_the_same_tree(count):
    workers = LocalWorkers(count=count)
    assert list(workers.map(str, range(5))) == list("01234")
    assert workers.reduce(joined, str, range(5)) == level_by_level(list("01234"))


def test_an_address_or_a_number_of_processes_chooses_the_workers():
    assert workers_of(None, None) == LocalWorkers()
    assert workers_of(None, 3) == LocalWorkers(count=3)
    assert workers_of("tcp://host:8786", None) == ClusterWorkers(address="tcp://host:8786")
    with pytest.raises(TauhatError, match="give one of the two"):
        workers_of("tcp://host:8786", 3)
