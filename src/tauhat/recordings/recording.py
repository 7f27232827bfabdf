"""A recording: measured motion on one clock, SI, joint side of the gear, read-only and checked."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import RecordingError
from tauhat.robots.shared_motor import SharedMotor

LARGEST_VALUE = 1e9  # no SI quantity of a robot joint reaches it; larger numbers are corrupt rows
FEWEST_SAMPLES = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Where a recording came from: file name, hash of its bytes and the rows taken."""

    path: str
    sha256: str
    rows: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Measured motion on one clock.

    t : (n_t,) strictly increasing [s]
    q : (n_t, n_v) [rad or m]
    dq, ddq : (n_t, n_v) [rad/s, rad/s^2], where measured
    tau : (n_t, n_v) what the motor delivers at the joint [Nm or N], where measured
    temperature : (n_t, n_v) [deg C], where measured
    wrench : (n_t, 6) force first, then moment [N, Nm], where measured
    joint_names : names of the columns
    name : what reports call it
    shared_motors : motors that, after the log's map, turn with two joints
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray | None = None
    ddq: FloatArray | None = None
    tau: FloatArray | None = None
    temperature: FloatArray | None = None
    wrench: FloatArray | None = None
    joint_names: tuple[str, ...] = ()
    name: str = "recording"
    source: Source | None = None
    shared_motors: tuple[SharedMotor, ...] = ()

    def __post_init__(self) -> None:
        t = frozen("t", self.t, (None,), where=self.name)
        q = frozen("q", self.q, (t.size, None), where=self.name)
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "q", q)
        for name in ("dq", "ddq", "tau", "temperature"):
            self._freeze(name, (t.size, q.shape[1]))
        self._freeze("wrench", (t.size, 6))
        self._name_joints()
        self._check_clock()
        self._check_sizes()

    def _freeze(self, name: str, shape: tuple[int, int]) -> None:
        value = getattr(self, name)
        if value is not None:
            object.__setattr__(self, name, frozen(name, value, shape, where=self.name))

    def _name_joints(self) -> None:
        names = tuple(self.joint_names) or tuple(f"joint_{j + 1}" for j in range(self.n_v))
        if len(names) != self.n_v:
            raise RecordingError("joint names do not fit q", where=self.name, expected=self.n_v, got=len(names))
        object.__setattr__(self, "joint_names", names)

    def _check_clock(self) -> None:
        if self.n_t < FEWEST_SAMPLES:
            raise RecordingError("too few samples", where=self.name, expected=f">= {FEWEST_SAMPLES}", got=self.n_t)
        steps = np.diff(self.t)
        if (steps <= 0).any():
            row = int(np.argmax(steps <= 0)) + 1
            raise RecordingError(
                "time does not increase",
                where=f"{self.name}, row {row}",
                got=f"step {steps[row - 1]:g} s",
                remedy="drop or sort the rows; `tauhat check` lists them all",
            )

    def _check_sizes(self) -> None:
        for name in ("q", "dq", "ddq", "tau", "temperature", "wrench"):
            value = getattr(self, name)
            if value is not None and np.abs(value).max() > LARGEST_VALUE:
                row, column = np.unravel_index(int(np.abs(value).argmax()), value.shape)
                raise RecordingError(
                    f"{name} holds an impossible value",
                    where=f"{self.name}, row {row}, column {column}",
                    expected=f"below {LARGEST_VALUE:g}",
                    got=f"{value[row, column]:g}",
                    remedy="the row is corrupt, or the unit in the map is wrong",
                )

    @property
    def n_t(self) -> int:
        """Number of samples."""
        return int(self.t.size)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def rate(self) -> float:
        """Samples per second on average [Hz]."""
        return (self.n_t - 1) / self.duration

    def rows(self, start: int, stop: int) -> Recording:
        """Return samples `start` to `stop` (zero-based, end excluded) as a recording of their own."""
        window = slice(start, stop)
        return replace(
            self,
            t=self.t[window],
            q=self.q[window],
            dq=None if self.dq is None else self.dq[window],
            ddq=None if self.ddq is None else self.ddq[window],
            tau=None if self.tau is None else self.tau[window],
            temperature=None if self.temperature is None else self.temperature[window],
            wrench=None if self.wrench is None else self.wrench[window],
        )

    def channels(self) -> tuple[str, ...]:
        """Names of the measured quantities that are present."""
        names = ("q", "dq", "ddq", "tau", "temperature", "wrench")
        return tuple(f.name for f in fields(self) if f.name in names and getattr(self, f.name) is not None)
