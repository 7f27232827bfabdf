"""Which blocks of time of many logs become one when there are too many: the same in whatever order logs are merged.

1. While any log has several blocks, the shortest go first: in every log whose blocks are of the least length,
   neighbours merge in pairs.
2. Where every log is one block and there are still too many, logs are thrown together by lot: those whose hashes begin
   with the same bits, as many bits as the limit allows.

The first block of a log has the length of its others, the last one apart. A part of the logs is never thinned out
further than all of them together, and each step leaves of a log what it would have left without the steps before; what
a part has lost, the others lose when they join. So error bars, which are made of the blocks, do not depend on which
worker was done first, nor on the order in which the logs are named.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from hashlib import sha256
from typing import NamedTuple

from tauhat.estimation.block import Block

_LOT = "\0"  # begins the name of what was thrown together; the bits follow
_BITS = 32


class Thinned(NamedTuple):
    """Blocks, log by log in the order of the logs' names, and how long those are that have been merged away [rows]."""

    blocks: tuple[Block, ...]
    merged_length: int


def thinned(blocks: Iterable[Block], most: int, *, merged_length: int = 0) -> Thinned:
    """Return the blocks merged until there are at most `most`.

    Parameters
    ----------
    merged_length : of the blocks that are merged away in any case, as they already are in some of the logs
    """
    logs: dict[str, tuple[Block, ...]] = {}
    for block in blocks:
        logs[block.log] = (*logs.get(block.log, ()), block)
    while len(logs) < _count(logs):
        least = min(own[0].n_t for own in logs.values() if len(own) > 1)
        if least > merged_length and _count(logs) <= most:
            break
        merged_length = max(merged_length, least)
        logs = {log: halved(own) if own[0].n_t <= merged_length else own for log, own in logs.items()}
    if len(logs) > most or any(log.startswith(_LOT) for log in logs):  # lots come of too many logs: all are thrown
        logs = _by_lot(logs, most)
    return Thinned(tuple(block for log in sorted(logs) for block in logs[log]), merged_length)


def halved(blocks: Sequence[Block]) -> tuple[Block, ...]:
    """Return the blocks with neighbours merged in pairs; an odd one stays at the end."""
    pairs = [blocks[k].merged(blocks[k + 1]) for k in range(0, len(blocks) - 1, 2)]
    return (*pairs, blocks[-1]) if len(blocks) % 2 else tuple(pairs)


def _count(logs: Mapping[str, Sequence[Block]]) -> int:
    return sum(len(own) for own in logs.values())


def _by_lot(logs: Mapping[str, tuple[Block, ...]], most: int) -> dict[str, tuple[Block, ...]]:
    bits = {log: _bits(log) for log in logs}
    shared = min(len(own) for own in bits.values())
    kept = next(kept for kept in range(shared, -1, -1) if len({own[:kept] for own in bits.values()}) <= most)
    lots: dict[str, list[Block]] = {}
    for log in sorted(logs):
        lots.setdefault(_LOT + bits[log][:kept], []).extend(logs[log])
    return {lot: (reduce(lambda one, other: one.merged(other), own).of_log(lot),) for lot, own in lots.items()}


def _bits(log: str) -> str:
    """Return the bits of a log's hash; of what was thrown together, those that its logs share."""
    if log.startswith(_LOT):
        return log[len(_LOT) :]
    return f"{int.from_bytes(sha256(log.encode()).digest()[: _BITS // 8], 'big'):0{_BITS}b}"
