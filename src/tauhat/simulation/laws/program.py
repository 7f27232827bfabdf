"""Passive laws as flat arrays, which a compiled kernel runs through without seeing a Python object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.errors import SimulationError
from tauhat.simulation.laws import program_kernel as codes
from tauhat.simulation.laws.law import PassiveLaw
from tauhat.simulation.laws.load import LoadedBristles, LoadedCoulomb
from tauhat.simulation.laws.presliding import Bristles
from tauhat.simulation.laws.shared_drive import SharedDrive
from tauhat.simulation.laws.speed_laws import (
    CubeRootDrag,
    DirectionalFriction,
    DirectionalViscous,
    PolynomialDrag,
    SmoothCoulomb,
    StribeckBump,
)
from tauhat.simulation.laws.springs import BalancingSpring, GasCylinder

_CODES: Mapping[type, int] = {
    SmoothCoulomb: codes.SMOOTH_COULOMB,
    CubeRootDrag: codes.CUBE_ROOT,
    DirectionalViscous: codes.DIRECTIONAL_VISCOUS,
    DirectionalFriction: codes.DIRECTIONAL,
    StribeckBump: codes.STRIBECK,
    PolynomialDrag: codes.POLYNOMIAL,
    Bristles: codes.BRISTLES,
    LoadedCoulomb: codes.LOADED_COULOMB,
    LoadedBristles: codes.LOADED_BRISTLES,
    BalancingSpring: codes.SPRING,
    GasCylinder: codes.GAS_CYLINDER,
}


class Program(NamedTuple):
    """The laws of a plant, n of them.

    kinds : (n,) what each is, the codes of `program_kernel`
    first : (n + 1,) the first of each law's rows in `values`
    values : (n_rows, n_v) parameters; laws that are not joint by joint have theirs in the first column
    remembered : (n + 1,) the first of each law's rows in the memory
    """

    kinds: IntArray
    first: IntArray
    values: FloatArray
    remembered: IntArray


def compiled(laws: Sequence[PassiveLaw], n_v: int) -> Program:
    """Return the program of the laws of a robot with n_v joints.

    Raises
    ------
    SimulationError
        when a law is of a kind that the kernel does not know.
    """
    rows = [law.rows() for law in laws]
    values = np.zeros((sum(len(block) for block in rows), n_v))
    first = _starts([len(block) for block in rows])
    for begin, block in zip(first[:-1].tolist(), rows, strict=True):
        values[begin : begin + len(block), : block.shape[1]] = block
    return Program(
        kinds=read_only(np.array([_code(law) for law in laws], dtype=np.intp)),
        first=first,
        values=np.asarray(read_only(values)),
        remembered=_starts([len(law.memory()) for law in laws]),
    )


def initial_memory(laws: Sequence[PassiveLaw], n_v: int) -> FloatArray:
    """Return the memory of all laws at the start, (n_rows, n_v)."""
    blocks = [law.memory() for law in laws]
    memory = np.zeros((sum(len(block) for block in blocks), n_v))
    for begin, block in zip(_starts([len(block) for block in blocks])[:-1].tolist(), blocks, strict=True):
        memory[begin : begin + len(block), : block.shape[1]] = block
    return memory


def parts_of_memory(laws: Sequence[PassiveLaw], memory: FloatArray) -> tuple[FloatArray, ...]:
    """Return views of each law's own memory, shaped as the law made it."""
    shapes = [law.memory().shape for law in laws]
    first = _starts([rows for rows, _ in shapes]).tolist()
    return tuple(
        memory[begin : begin + rows, :columns] for begin, (rows, columns) in zip(first[:-1], shapes, strict=True)
    )


def _starts(lengths: Sequence[int]) -> IntArray:
    return np.asarray(read_only(np.concatenate([[0], np.cumsum(lengths, dtype=np.intp)]).astype(np.intp)))


def _code(law: PassiveLaw) -> int:
    if isinstance(law, SharedDrive):
        return codes.SHARED_BRISTLES if isinstance(law.dry, Bristles) else codes.SHARED_SMOOTH
    if type(law) not in _CODES:
        raise SimulationError("the kernel does not know this law", got=law.key)
    return _CODES[type(law)]
