"""Evidence: a log boiled down to what a least-squares problem can ever learn from it.

For joint j the stacked equation is `W_j x = tau_j`. The triangular factor `[R_j z_j; 0 r_j] = qr([W_j tau_j])` is a
sufficient statistic of at most (p_j + 1)^2 numbers, whatever the log's length, and two factors merge by one small QR.

The factors are kept for a bounded number of consecutive blocks of time rather than for the whole log: residuals of real
robots are correlated in time, and blocks longer than that correlation are what honest standard errors and
cross-validation can be made of. When there are too many blocks, neighbours merge; memory stays constant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TypeAlias

import numpy as np

from tauhat.arrays import IntArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import Layout, TorqueModel
from tauhat.errors import ModelError
from tauhat.estimation.block import Block, reduced
from tauhat.estimation.block_merging import halved, thinned
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.recordings.processing import CHUNK, Processing
from tauhat.recordings.recording import Recording
from tauhat.workers import merged_as_tree

MOST_BLOCKS = 64
_FIRST_ROWS = 8  # rows of a block before the first merges; blocks grow with the log


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """What recordings say about a model's kept parameters.

    supports : per joint, which of the `n_b` kept parameters load it, (p_j,)
    n_b : number of kept parameters
    blocks : consecutive stretches of time, at most 64
    recordings : names of the recordings inside
    fingerprint : of the model whose columns these are
    merged_length : blocks of a log up to this length were merged with their neighbours to make room [rows]
    total : the factors of all blocks together
    """

    supports: tuple[IntArray, ...]
    n_b: int
    blocks: tuple[Block, ...]
    recordings: tuple[str, ...] = ()
    fingerprint: str = ""
    merged_length: int = 0
    total: Block = field(init=False)

    def __post_init__(self) -> None:
        for support in self.supports:
            read_only(support)
        object.__setattr__(self, "total", _together(self.blocks))

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return len(self.supports)

    @property
    def n_t(self) -> int:
        """Number of rows per joint."""
        return sum(block.n_t for block in self.blocks)

    def merged(self, other: Evidence) -> Evidence:
        """Return the evidence of both; any order of merging gives the same estimate and the same error bars.

        Raises
        ------
        ModelError
            when the two belong to different models.
        """
        if self.n_b != other.n_b or self.fingerprint != other.fingerprint:
            raise ModelError("evidence of different models cannot be merged")
        length = max(self.merged_length, other.merged_length)
        blocks, length = thinned((*self.blocks, *other.blocks), MOST_BLOCKS, merged_length=length)
        recordings = (*self.recordings, *other.recordings)
        return replace(self, blocks=blocks, recordings=recordings, merged_length=length)

    def keeping(self, columns: IntArray) -> Evidence:
        """Return the evidence on some of the parameters alone, as if the others were not in the model.

        Parameters
        ----------
        columns : increasing indices of the kept parameters
        """
        place = np.full(self.n_b, -1)
        place[columns] = np.arange(columns.size)
        picked = [np.flatnonzero(place[support] >= 0) for support in self.supports]
        blocks = tuple(
            replace(
                block,
                factors=tuple(factor[:, np.append(own, -1)] for factor, own in zip(block.factors, picked, strict=True)),
            )
            for block in self.blocks
        )
        supports = tuple(place[support[own]] for support, own in zip(self.supports, picked, strict=True))
        return replace(self, supports=supports, n_b=int(columns.size), blocks=blocks, fingerprint="")

    def of_blocks(self, blocks: Iterable[Block]) -> Evidence:
        """Return the evidence of some of the blocks."""
        return replace(self, blocks=tuple(blocks))

    def merged_blocks(self, most: int) -> tuple[Block, ...]:
        """Return the blocks of time with neighbours merged until there are at most `most`."""
        return _at_most(self.blocks, most)


def _together(blocks: tuple[Block, ...]) -> Block:
    stacked = (np.vstack(factors) for factors in zip(*(block.factors for block in blocks), strict=True))
    return Block(factors=tuple(reduced(rows) for rows in stacked), n_t=sum(block.n_t for block in blocks))


def _at_most(blocks: tuple[Block, ...], most: int) -> tuple[Block, ...]:
    while len(blocks) > most:
        blocks = halved(blocks)
    return blocks


def collect(
    model: TorqueModel,
    base: BaseParameters,
    recording: Recording,
    processing: Processing,
    *,
    chunk: int = CHUNK,
    most_blocks: int = MOST_BLOCKS,
) -> Evidence:
    """Return the evidence of one recording on the model's base parameters, in constant memory.

    Parameters
    ----------
    most_blocks : how many blocks of time are kept; one is enough where no error bars are wanted

    Raises
    ------
    RecordingError
        when the recording does not fit the model or no row is left.
    """
    return collected(
        model, base, recording, most_blocks=most_blocks,
        rows_of=lambda layout: filtered_rows(model, layout, recording, processing, chunk=chunk),
    )  # fmt: skip


def collected(
    model: TorqueModel,
    base: BaseParameters,
    recording: Recording,
    *,
    rows_of: Callable[[Layout], Iterable[Rows]],
    most_blocks: int,
) -> Evidence:
    """Return the evidence of one recording whose rows come from elsewhere.

    Parameters
    ----------
    rows_of : makes the `filtered_rows` of the recording in a layout

    Raises
    ------
    ModelError
        when there is no row.
    """
    layout = model.layout(base.independent)
    rows = rows_of(layout)
    blocks = tuple(_grown_blocks(layout, rows) if most_blocks > 1 else _one_block(layout, rows))
    log = f"{recording.name} {recording.t[0]} {recording.n_t}"  # windows of one file have the same name
    blocks = tuple(block.of_log(log) for block in blocks)
    return _evidence(layout, base, blocks, name=recording.name, fingerprint=model.fingerprint)


def evidence_from_rows(
    layout: Layout,
    base: BaseParameters,
    rows: Iterable[Rows],
    *,
    name: str = "rows",
    most_blocks: int = MOST_BLOCKS,
    first_rows: int = _FIRST_ROWS,
) -> Evidence:
    """Return the evidence of a stream of rows, in at most `most_blocks` blocks of time.

    Parameters
    ----------
    first_rows : of a block before the first merges; a stream of known length needs none
    """
    grown = _grown_blocks(layout, rows, first_rows) if most_blocks > 1 else _one_block(layout, rows)
    blocks = tuple(block.of_log(name) for block in grown)
    return _evidence(layout, base, blocks, name=name, fingerprint="")


def _evidence(
    layout: Layout, base: BaseParameters, blocks: tuple[Block, ...], *, name: str, fingerprint: str
) -> Evidence:
    if not blocks:
        raise ModelError("no row of the recording is left to identify from", where=name)
    place = np.full(len(base.names), -1)
    place[base.independent] = np.arange(base.n_b)
    supports = tuple(place[layout.parameters[layout.of_joint(joint)]] for joint in range(layout.bounds.size - 1))
    return Evidence(supports=supports, n_b=base.n_b, blocks=blocks, recordings=(name,), fingerprint=fingerprint)


def _one_block(layout: Layout, rows: Iterable[Rows]) -> list[Block]:
    pieces = (_block(layout, piece, 0, piece.t.size) for piece in rows)
    first = next(pieces, None)
    return [] if first is None else [reduce(Block.merged, pieces, first).reduced()]


def _grown_blocks(layout: Layout, rows: Iterable[Rows], first_rows: int = _FIRST_ROWS) -> list[Block]:
    """Cut the stream into blocks of equal length; when there are too many, merge neighbours and double the length."""
    size = first_rows
    done: list[Block] = []
    open_block: Block | None = None
    for piece in rows:
        start = 0
        while start < piece.t.size:
            room = size - (open_block.n_t if open_block else 0)
            part = _block(layout, piece, start, min(start + room, piece.t.size))
            start += part.n_t
            open_block = part if open_block is None else open_block.merged(part)
            if open_block.n_t >= size:
                done.append(open_block.reduced())
                open_block = None
            if len(done) == MOST_BLOCKS:
                done = list(halved(done))
                size *= 2
    if open_block is not None:
        done = _with_rest(done, open_block.reduced(), size)
    return done


def _with_rest(done: list[Block], rest: Block, size: int) -> list[Block]:
    if done and rest.n_t < size // 2:
        return [*done[:-1], done[-1].merged(rest)]
    return [*done, rest]


def _block(layout: Layout, piece: Rows, start: int, stop: int) -> Block:
    factors = []
    for joint in range(piece.tau.shape[0]):
        columns = piece.columns[layout.of_joint(joint), start:stop]
        stacked = np.concatenate([columns, piece.tau[joint : joint + 1, start:stop]])
        factors.append(stacked.T)
    return Block(factors=tuple(factors), n_t=stop - start)


def collect_all(
    model: TorqueModel,
    base: BaseParameters,
    recordings: Iterable[Recording],
    processing: Processing,
    *,
    most_blocks: int = MOST_BLOCKS,
) -> Evidence:
    """Return the merged evidence of several recordings; `most_blocks` of each.

    It is merged as a tree, as workers merge theirs, so that even its rounding is the same wherever the work is done.
    """
    parts = (collect(model, base, recording, processing, most_blocks=most_blocks) for recording in recordings)
    return merged_as_tree(Evidence.merged, parts)


Gather: TypeAlias = Callable[[TorqueModel, BaseParameters, int], Evidence]
"""Makes the evidence of all recordings on a model's base parameters, with at most so many blocks of time of each."""


def gathering(recordings: Iterable[Recording], processing: Processing) -> Gather:
    """Return what makes evidence of recordings that are here, through this processing."""
    held = tuple(recordings)
    return lambda model, base, most_blocks: collect_all(model, base, held, processing, most_blocks=most_blocks)
