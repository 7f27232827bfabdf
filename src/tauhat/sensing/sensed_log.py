"""What was sensed along a log: external torque and wrench at every sample that was taken, with standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.sensing.wrench import COMPONENTS, SensedWrench, WrenchSolver

FRAME_KEY, AXES_KEY = "tauhat.frame", "tauhat.axes"
_ARRAYS = (
    "t", "rows", "q", "dq", "tau", "tau_std", "raw", "wrench", "wrench_std", "settled", "lag", "force_shared",
)  # fmt: skip


class SampleCounts(NamedTuple):
    """How many samples were taken, and why others were not.

    late : time before that of the last sample
    repeated : time of the last sample
    not_finite : a number that is none, or too large to be a robot's
    malformed : lines that are no sample
    restarts : gaps in time behind which everything began again
    frozen : of those taken, in rows of samples that are the same to the bit, as a controller that hangs repeats them
    """

    taken: int = 0
    late: int = 0
    repeated: int = 0
    not_finite: int = 0
    malformed: int = 0
    restarts: int = 0
    frozen: int = 0

    @property
    def skipped(self) -> int:
        """Samples that were not taken."""
        return self.late + self.repeated + self.not_finite + self.malformed


class Size(NamedTuple):
    """How large one quantity was: rms, largest size with its standard error there, and the median standard error."""

    rms: float
    peak: float
    peak_std: float
    std: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensedLog:
    """External torque and wrench along a log.

    name : of the log
    joint_names : of the columns
    prismatic : those that slide: force in place of torque
    frame, axes : where the wrench acts, and along whose axes its components are
    step : between samples [s]
    t : (n_t,) of the samples that were taken [s]
    rows : (n_t,) their places in the log
    q : (n_t, n_v) position to which the torque belongs, as late as it is
    dq : (n_t, n_v) filtered velocity
    tau, tau_std : (n_t, n_v) external torque and its standard error [Nm or N]
    raw : (n_t, n_v) external torque since the sample before, not smoothed [Nm or N]
    wrench, wrench_std : (n_t, 6) force, then moment [N, Nm]
    settled : (n_t,) whether the last start is forgotten
    counts : of samples
    lag : (n_t, n_v) what the torque changed by within the observer's delay; `wrench_std` holds it [Nm or N]
    force_shared : (n_t, 3) covariances of fx and fy, fx and fz, fy and fz [N^2]
    believed : of how many samples the time stamps were believed; of the others they count periods
    """

    name: str
    joint_names: tuple[str, ...]
    prismatic: tuple[str, ...]
    frame: str
    axes: str
    step: float
    t: FloatArray
    rows: IntArray
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    tau_std: FloatArray
    raw: FloatArray
    wrench: FloatArray
    wrench_std: FloatArray
    settled: NDArray[np.bool_]
    counts: SampleCounts
    lag: FloatArray
    force_shared: FloatArray
    believed: int = 0

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            read_only(getattr(self, name))

    @property
    def n_t(self) -> int:
        """Number of samples that were taken."""
        return int(self.t.size)

    @property
    def solved(self) -> tuple[bool, ...]:
        """Which of the six components of the wrench were asked for."""
        return tuple(bool((column > 0.0).any()) for column in self.wrench_std.T)

    def force_std(self, along: FloatArray, rows: slice) -> FloatArray:
        """Return the standard error of the force along directions, `sqrt(u'C u)` with u = along / |along|, (n,) [N].

        Parameters
        ----------
        along : (n, 3) of any length; those of none have no error
        rows : the n samples to which they belong
        """
        sizes = np.linalg.norm(along, axis=1)
        x, y, z = (along / np.maximum(sizes, np.finfo(float).tiny)[:, None]).T
        alone = np.square(np.stack([x, y, z], axis=1) * self.wrench_std[rows, :3]).sum(axis=1)
        together = (np.stack([x * y, x * z, y * z], axis=1) * self.force_shared[rows]).sum(axis=1)
        return np.asarray(np.sqrt(np.maximum(alone + 2.0 * together, 0.0)))

    def solved_by(self, solver: WrenchSolver, rows: slice | IntArray) -> SensedWrench:
        """Return the wrench at some of the samples by a solver, with covariances (n, 6, 6)."""
        variance, own = np.square(self.tau_std[rows]), np.square(self.lag[rows])
        return solver.along(self.q[rows], self.tau[rows], variance, own=own)

    def columns(self) -> dict[str, FloatArray]:
        """Return the columns of a file: t, tau_ext_1 .., tau_ext_std_1 .., fx .. mz, fx_std .. mz_std."""
        found = {"t": self.t}
        for name, values in (("tau_ext", self.tau), ("tau_ext_std", self.tau_std)):
            found |= {f"{name}_{index + 1}": column for index, column in enumerate(values.T)}
        found |= dict(zip(COMPONENTS, self.wrench.T, strict=True))
        found |= {f"{name}_std": column for name, column in zip(COMPONENTS, self.wrench_std.T, strict=True)}
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: what was taken and skipped, and sizes where the start is forgotten."""
        return {
            "log": self.name,
            "samples": self.n_t,
            "rate": 1.0 / self.step,
            "settled": int(np.count_nonzero(self.settled)),
            "skipped": {name: getattr(self.counts, name) for name in ("late", "repeated", "not_finite")},
            "restarts": self.counts.restarts,
            "frozen": self.counts.frozen,
            "stamps_believed": self.believed,
            "joints": [
                {"name": name, **size._asdict()}
                for name, size in zip(self.joint_names, self.sizes(self.tau, self.tau_std), strict=True)
            ],
            "wrench": [
                {"name": name, **size._asdict()}
                for name, size in zip(COMPONENTS, self.sizes(self.wrench, self.wrench_std), strict=True)
            ],
        }

    def sizes(self, values: FloatArray, errors: FloatArray) -> tuple[Size, ...]:
        """Return how large each column of values is where the start is forgotten; nan where it never is.

        Parameters
        ----------
        values, errors : (n_t, n) one of the quantities and its standard errors
        """
        if not self.settled.any():
            nothing = float("nan")
            return tuple(Size(nothing, nothing, nothing, nothing) for _ in values.T)
        found = []
        for column, error in zip(values.T, errors.T, strict=True):
            kept, spread = column[self.settled], error[self.settled]
            top = int(np.argmax(np.abs(kept)))
            rms = float(np.sqrt(np.mean(np.square(kept))))
            found.append(Size(rms, float(abs(kept[top])), float(spread[top]), float(np.median(spread))))
        return tuple(found)


def sensed_columns(sensed: Sequence[SensedLog]) -> dict[str, FloatArray]:
    """Return the columns of one file for all logs, one behind the other; `log` counts them from zero where several."""
    if len(sensed) == 1:
        return sensed[0].columns()
    each = [log.columns() for log in sensed]
    found = {name: np.concatenate([part[name] for part in each]) for name in each[0]}
    return {"log": np.repeat(np.arange(len(sensed), dtype=np.float64), [log.n_t for log in sensed]), **found}


def sensed_metadata(sensed: SensedLog) -> Mapping[str, str]:
    """Return what a file says of its columns: frame and axes of the wrench."""
    return {FRAME_KEY: sensed.frame, AXES_KEY: sensed.axes}
