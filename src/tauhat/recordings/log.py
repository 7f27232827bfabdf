"""A log: the columns of a file in SI on the joint side, not yet judged. It may hold NaN, and time may go back."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import RecordingError, TauhatWarning
from tauhat.recordings.recording import FEWEST_SAMPLES, LARGEST_VALUE, Recording, Source
from tauhat.robots.shared_motor import SharedMotor

LARGEST_TIME = 1e19  # [s] more than nanoseconds since 1970 taken for seconds
SIGNALS = ("q", "dq", "ddq", "tau", "temperature", "wrench")
_CHECK = "`tauhat check` lists all such rows"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """What a file holds, mapped to SI.

    t : (n_t,) [s]
    q : (n_t, n_v) [rad or m]
    dq, ddq, tau, temperature : (n_t, n_v), None where the log has none
    wrench : (n_t, 6) [N, Nm]
    units : "rad" or "m" of each joint
    path : the file, for messages
    first_row : row of the file that sample 0 came from
    shared_motors : motors that, after the map, turn with two joints
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray | None = None
    ddq: FloatArray | None = None
    tau: FloatArray | None = None
    temperature: FloatArray | None = None
    wrench: FloatArray | None = None
    joint_names: tuple[str, ...]
    units: tuple[str, ...]
    name: str = "recording"
    path: str = "log"
    first_row: int = 0
    source: Source | None = None
    shared_motors: tuple[SharedMotor, ...] = ()

    def __post_init__(self) -> None:
        read_only(self.t)
        for signal in self.signals().values():
            read_only(signal)

    @property
    def n_t(self) -> int:
        """Number of samples."""
        return int(self.t.size)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    def signals(self) -> dict[str, FloatArray]:
        """Return the measured quantities that are present, by name."""
        values = {name: getattr(self, name) for name in SIGNALS}
        return {name: value for name, value in values.items() if value is not None}

    def place(self, sample: int) -> str:
        """Return how messages call a sample: file and row."""
        return f"{self.path}, row {self.first_row + sample}"

    def recording(self) -> Recording:
        """Return the log as a valid recording; exact duplicates are dropped with a warning, nothing else is mended.

        Raises
        ------
        RecordingError
            NaN, impossible values, time going back, two samples at one time, too few samples.
        """
        self._refuse_corrupt()
        kept = self._distinct()
        signals = {name: signal[kept] for name, signal in self.signals().items()}
        return Recording(
            t=self.t[kept], **signals, joint_names=self.joint_names, name=self.name, source=self.source,
            shared_motors=self.shared_motors,
        )  # fmt: skip

    def _refuse_corrupt(self) -> None:
        if self.n_t < FEWEST_SAMPLES:
            raise RecordingError("too few rows", where=self.path, expected=f">= {FEWEST_SAMPLES}", got=self.n_t)
        for name, signal in {"t": self.t[:, None], **self.signals()}.items():
            bad = ~np.isfinite(signal)
            if bad.any():
                sample, column = (int(index) for index in np.argwhere(bad)[0])
                raise RecordingError(
                    f"{name} is not a number", where=f"{self.place(sample)}, {self._column(name, column)}",
                    got=f"{signal[sample, column]} ({np.count_nonzero(bad.any(axis=1))} such rows)",
                    remedy=f"remove the rows or choose others; {_CHECK}",
                )  # fmt: skip
            largest = LARGEST_TIME if name == "t" else LARGEST_VALUE
            large = np.abs(signal) > largest
            if large.any():
                sample, column = (int(index) for index in np.argwhere(large)[0])
                raise RecordingError(
                    f"{name} holds an impossible value", where=f"{self.place(sample)}, {self._column(name, column)}",
                    expected=f"below {largest:g}", got=f"{signal[sample, column]:g}",
                    remedy="the row is corrupt, or the unit in the map is wrong",
                )  # fmt: skip

    def _column(self, name: str, column: int) -> str:
        if name == "t":
            return "time"
        return f"wrench component {column}" if name == "wrench" else f"joint {self.joint_names[column]}"

    def _distinct(self) -> np.ndarray | slice:
        """Return what to keep when exact copies of the row before are dropped."""
        steps = np.diff(self.t)
        if (steps < 0).any():
            sample = int(np.argmax(steps < 0)) + 1
            raise RecordingError(
                "time goes back", where=self.place(sample), got=f"a step of {steps[sample - 1]:g} s",
                remedy=f"cut the log there with rows FROM:TO; {_CHECK}",
            )  # fmt: skip
        if (steps > 0).all():
            return slice(None)
        same = np.logical_and.reduce([(np.diff(signal, axis=0) == 0).all(axis=1) for signal in self.signals().values()])
        torn = (steps == 0) & ~same
        if torn.any():
            raise RecordingError(
                "two samples at one time with different values", where=self.place(int(np.argmax(torn)) + 1),
                got=f"{np.count_nonzero(torn)} such rows",
                remedy=f"the clock is too coarse: give [time] rate; {_CHECK}",
            )  # fmt: skip
        count = np.count_nonzero(steps == 0)
        warnings.warn(f"{self.path}: {count} exact duplicate rows dropped", TauhatWarning, stacklevel=4)
        return np.append(True, steps > 0)

    def samples(self, start: int, stop: int) -> Log:
        """Return samples `start` to `stop` as a log of their own."""
        cut: dict[str, Any] = {name: signal[start:stop] for name, signal in self.signals().items()}
        return replace(self, t=self.t[start:stop], **cut, first_row=self.first_row + start)
