"""Merging is associative and commutative, blocks and all: error bars do not know who merged what first."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauhat.estimation.block import Block
from tauhat.estimation.block_merging import thinned
from tauhat.estimation.evidence import MOST_BLOCKS, Evidence


def evidence(log: int, blocks: int, length: int) -> Evidence:
    """Return one joint's evidence of blocks of equal length, the last one shorter."""
    rng = np.random.default_rng(log)
    sizes = [*[length] * (blocks - 1), max(1, length // 2)]
    made = (Block(factors=(rng.normal(size=(size, 3)),), n_t=size, log=f"run {log}").reduced() for size in sizes)
    return Evidence(supports=(np.arange(2),), n_b=2, blocks=tuple(made), recordings=(f"run {log}",))


def grams(found: Evidence) -> list[tuple[str, int, np.ndarray]]:
    return [(block.log, block.n_t, block.factors[0].T @ block.factors[0]) for block in found.blocks]


def merged_somehow(parts: list[Evidence], rng: np.random.Generator) -> Evidence:
    """Merge any two of what is left, until one is."""
    left = list(parts)
    while len(left) > 1:
        one, other = (left.pop(int(rng.integers(len(left)))) for _ in range(2))
        left.append(one.merged(other))
    return left[0]


@pytest.mark.parametrize("count", [2, 5, 40, 64, 65, 200])
@given(seed=st.integers(0, 10_000))
def test_any_way_of_merging_leaves_the_same_blocks(count, seed):
    rng = np.random.default_rng(seed)
    shapes = [(int(rng.integers(1, 20)), 8 * 2 ** int(rng.integers(3))) for _ in range(count)]
    parts = [evidence(log, *shape) for log, shape in enumerate(shapes)]
    expected = grams(merged_somehow(parts, np.random.default_rng(1)))
    found = grams(merged_somehow(parts, rng))
    assert [block[:2] for block in found] == [block[:2] for block in expected]
    assert len(found) <= MOST_BLOCKS
    assert sum(n_t for _, n_t, _ in found) == sum(part.n_t for part in parts)
    for (_, _, ours), (_, _, theirs) in zip(found, expected, strict=True):
        assert np.allclose(ours, theirs, rtol=0, atol=1e-10 * np.abs(theirs).max())


def test_as_many_blocks_as_there_is_room_for_are_kept_of_each_log():
    both = evidence(0, 60, 8).merged(evidence(1, 30, 16))
    assert [block.n_t for block in both.blocks if block.log == "run 0"][:2] == [16, 16]
    assert [block.n_t for block in both.blocks if block.log == "run 1"] == [16] * 29 + [8]


def test_few_blocks_are_left_as_they_are():
    blocks = (*evidence(1, 30, 8).blocks, *evidence(0, 34, 8).blocks)
    assert thinned(blocks, 64) == ((*blocks[30:], *blocks[:30]), 0)


@pytest.mark.parametrize("count", [100, 1000])
def test_many_logs_are_thrown_together_in_lots_of_moderate_size(count):
    found = merged_somehow([evidence(log, 1, 8) for log in range(count)], np.random.default_rng(0))
    assert MOST_BLOCKS // 4 < len(found.blocks) <= MOST_BLOCKS
    assert max(block.n_t for block in found.blocks) < 0.2 * found.n_t
