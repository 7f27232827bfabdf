"""Where a log is and how it is read: a few words that travel to a worker, so that the log itself need not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tauhat.recordings.logmap import LogMap
from tauhat.recordings.periods import average_periods
from tauhat.recordings.reading import Rows, read_recording
from tauhat.recordings.recording import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class LogSource:
    """A log to be read by whoever needs it, under the same path.

    path : CSV (plain or gzip), Parquet, NPZ or MAT file; made absolute, since a worker stands elsewhere
    map : the map or its file; by default the one beside the log
    rows : window of rows, zero-based, end excluded; overrides the map's
    period : of a repeated motion that is averaged [s]
    """

    path: Path
    map: LogMap | Path | None = None
    rows: Rows | None = None
    period: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", Path(self.path).absolute())
        if isinstance(self.map, str | Path):
            object.__setattr__(self, "map", Path(self.map).absolute())

    def read(self) -> Recording:
        """Return the recording.

        Raises
        ------
        RecordingError, MapError
            as `read_recording`.
        """
        recording = read_recording(self.path, map=self.map, rows=self.rows)
        return recording if self.period is None else average_periods(recording, period=self.period).recording
