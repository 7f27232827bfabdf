"""What the columns of a log mean: which is which, in what unit, on which side of the gear.

A number of the log becomes SI on the joint side in this order:

    value -> x unit -> x scale (or gain) -> x sign -> delay -> coupling -> + offset

so `offset` is in rad, m, Nm or N of the joint, and `coupling` mixes motors that are already in SI.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import MapError
from tauhat.robots.shared_motor import SharedMotor

Column: TypeAlias = str | int

TIME_UNITS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_POSITION: Mapping[str, float | None] = {"rad": 1.0, "deg": math.pi / 180.0, "m": 1.0, "mm": 1e-3, "count": None}
_RPM = 2.0 * math.pi / 60.0

# unit -> factor to SI; None: a raw number that means nothing without a scale or gain
UNITS: Mapping[str, Mapping[str, float | None]] = {
    "position": _POSITION,
    "velocity": {**_POSITION, **{f"{unit}/s": factor for unit, factor in _POSITION.items()}, "rpm": _RPM},
    "acceleration": {**_POSITION, **{f"{unit}/s^2": factor for unit, factor in _POSITION.items()}},
    "torque": {"Nm": 1.0, "N": 1.0, "A": None, "V": None, "count": None},
    "temperature": {"degC": 1.0, "K": 1.0},
    "wrench": {"N": 1.0},
}
KINDS = tuple(UNITS)
_KELVIN = -273.15
_COUPLED = 1e-9  # entry beside the diagonal, in parts of it, from which a motor turns with another joint


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeMap:
    """The clock: a column or a constant rate.

    column : header's name, zero-based index or array key; None when `rate` is given
    rate : samples per second [Hz], the first row of the file at t = 0
    unit : "s", "ms", "us" or "ns"
    file : another file beside the log that holds the column
    """

    column: Column | None = None
    rate: float | None = None
    unit: str = "s"
    file: str | None = None

    def __post_init__(self) -> None:
        if (self.column is None) == (self.rate is None):
            raise MapError("the clock is not defined", where="[time]", expected="either column or rate")
        if self.rate is not None and not 0 < self.rate < math.inf:
            raise MapError("rate is not a positive number", where="[time] rate", got=self.rate)
        if self.unit not in TIME_UNITS:
            raise MapError("unknown unit", where="[time] unit", expected=", ".join(TIME_UNITS), got=self.unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalMap:
    """One measured quantity: its columns and how their numbers become SI. Numbers are one for all or one per column.

    kind : "position", "velocity", "acceleration", "torque", "temperature" or "wrench"
    columns : header's names, zero-based indices or array keys; empty with `interleaved` for all
    unit : one for all or one per column
    scale : SI (or unit) per number of the log; `gain` in a torque section
    sign : 1 or -1
    offset : added last, on the joint side [rad, m, Nm, N, deg C]
    delay_samples : how many samples too late the channel was logged; fractions interpolate linearly
    file : another file beside the log
    interleaved : the file holds one number per line, this many per sample
    """

    kind: str
    columns: tuple[Column, ...] = ()
    unit: tuple[str, ...] = ()
    scale: tuple[float, ...] | None = None
    sign: tuple[float, ...] = (1.0,)
    offset: tuple[float, ...] = (0.0,)
    delay_samples: float = 0.0
    file: str | None = None
    interleaved: int | None = None

    def __post_init__(self) -> None:
        where = f"[{self.kind}]"
        if self.kind not in UNITS:
            raise MapError("unknown quantity", where=where, expected=", ".join(KINDS))
        if not self.columns and self.interleaved is None:
            raise MapError("no columns", where=f"{where} columns", expected="names or zero-based indices")
        if not self.unit:
            object.__setattr__(self, "unit", (next(iter(UNITS[self.kind])),))
        self._check_unit(where)
        if any(abs(sign) != 1.0 for sign in self.sign):
            raise MapError("sign is neither 1 nor -1", where=f"{where} sign", got=list(self.sign))
        if not abs(self.delay_samples) < 1e6:
            raise MapError("absurd delay", where=f"{where} delay_samples", got=self.delay_samples)
        if self.interleaved is not None and not 1 <= self.interleaved <= 1000:
            raise MapError("absurd count", where=f"{where} interleaved", expected="1 to 1000", got=self.interleaved)

    def _check_unit(self, where: str) -> None:
        word = "gain" if self.kind == "torque" else "scale"
        for unit in self.unit:
            if unit not in UNITS[self.kind]:
                raise MapError("unknown unit", where=f"{where} unit", expected=", ".join(UNITS[self.kind]), got=unit)
            if UNITS[self.kind][unit] is None and self.scale is None:
                remedy = f"give {word}: what one {unit} is in SI on the joint side"
                raise MapError(f"unit {unit} without {word}", where=where, remedy=remedy)
        if self.scale is not None and 0.0 in self.scale:
            raise MapError(f"{word} is zero", where=f"{where} {word}")

    def factors(self, count: int) -> FloatArray:
        """Return unit x scale x sign of each of `count` columns, (count,)."""
        units = np.array([UNITS[self.kind][unit] or 1.0 for unit in self.unit])
        unit = self._spread("unit", units, count)
        word = "gain" if self.kind == "torque" else "scale"
        scale = self._spread(word, np.array(self.scale or (1.0,)), count)
        return unit * scale * self._spread("sign", np.array(self.sign), count)

    def offsets(self, count: int) -> FloatArray:
        """Return what is added to each of `count` joints, (count,)."""
        kelvin = np.array([_KELVIN if unit == "K" else 0.0 for unit in self.unit])
        return self._spread("offset", np.array(self.offset), count) + self._spread("unit", kelvin, count)

    def joint_units(self, count: int) -> tuple[str, ...]:
        """Return "rad" or "m" for each of `count` position columns."""
        lengths = np.array([unit.startswith("m") for unit in self.unit], dtype=np.float64)
        return tuple("m" if length else "rad" for length in self._spread("unit", lengths, count))

    def _spread(self, key: str, values: FloatArray, count: int) -> FloatArray:
        if values.size not in {1, count}:
            where = f"[{self.kind}] {key}"
            raise MapError("wrong number of values", where=where, expected=f"1 or {count}", got=values.size)
        return np.broadcast_to(values.astype(np.float64), (count,))


@dataclass(frozen=True, slots=True, kw_only=True)
class RowWindow:
    """Rows `start` to `stop` of a log: zero-based, end excluded, None for the end of the file."""

    start: int = 0
    stop: int | None = None

    def __post_init__(self) -> None:
        if self.start < 0 or (self.stop is not None and self.stop <= self.start):
            expected = "0 <= from < to (zero-based, end excluded)"
            raise MapError("empty window of rows", where="rows", expected=expected, got=f"{self.start}:{self.stop}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coupling:
    """Gears that couple motors: `q = position q_motor`, `tau = torque tau_motor`; velocities like positions.

    position, torque : (n_v, n_v), None where the log is on the joint side already. The power-preserving pair obeys
        `torque = position^-T`; none is derived from the other, because many logs hold one of the two on the joint side.
    """

    position: FloatArray | None = None
    torque: FloatArray | None = None

    def __post_init__(self) -> None:
        for name in ("position", "torque"):
            value = getattr(self, name)
            if value is None:
                continue
            matrix = frozen(name, value, (None, None), where="[coupling]")
            if matrix.shape[0] != matrix.shape[1] or np.linalg.matrix_rank(matrix) < matrix.shape[0]:
                raise MapError("not an invertible square matrix", where=f"[coupling] {name}", got=matrix.shape)
            object.__setattr__(self, name, matrix)

    def shared_motors(self) -> tuple[SharedMotor, ...]:
        """Return the motors that turn with two joints: rows of `position^-1` with an entry beside the diagonal."""
        if self.position is None:
            return ()
        turns = np.linalg.inv(self.position)
        sizes = np.abs(np.diag(turns))
        beside = np.abs(turns) > _COUPLED * np.maximum(sizes[:, None], np.finfo(float).tiny)
        return tuple(
            SharedMotor(int(own), int(other), float(turns[own, other] / turns[own, own]))
            for own, other in np.argwhere(beside)
            if own != other and sizes[own] > 0.0
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogMap:
    """Everything that is needed to read a log: one section per quantity.

    joints : names of the joints, empty for joint_1, joint_2, ...
    source : the map file, for messages
    """

    time: TimeMap
    position: SignalMap
    velocity: SignalMap | None = None
    acceleration: SignalMap | None = None
    torque: SignalMap | None = None
    temperature: SignalMap | None = None
    wrench: SignalMap | None = None
    rows: RowWindow = field(default_factory=RowWindow)
    joints: tuple[str, ...] = ()
    coupling: Coupling = field(default_factory=Coupling)
    source: str = ""

    def __post_init__(self) -> None:
        doubled = sorted({name for name in self.joints if self.joints.count(name) > 1})
        if doubled:
            raise MapError("joint names are not unique", where="[joints] names", got=", ".join(doubled))

    def signals(self) -> dict[str, SignalMap]:
        """Return the sections that are present, in the order of `KINDS`."""
        sections = {kind: getattr(self, kind) for kind in KINDS}
        return {kind: section for kind, section in sections.items() if section is not None}


def parse_rows(text: str) -> tuple[int, int | None]:
    """Return the window that "FROM:TO" names: zero-based, end excluded, either side may be left out.

    >>> parse_rows("634:3510")
    (634, 3510)
    >>> parse_rows("100:")
    (100, None)

    Raises
    ------
    MapError
        not of this form, or an empty window.
    """
    start, colon, stop = (part.strip() for part in text.partition(":"))
    numbers = [part for part in (start, stop) if part]
    if not colon or not all(part.isascii() and part.isdigit() and len(part) < 16 for part in numbers):
        raise MapError("not a window of rows", where="rows", expected="FROM:TO, zero-based", got=repr(text))
    window = RowWindow(start=int(start or 0), stop=int(stop) if stop else None)
    return window.start, window.stop
