"""One family of errors: what, where, expected, got, what to do, on one line."""

from __future__ import annotations


class TauhatError(Exception):
    """Root of every error the library raises on purpose.

    Parameters
    ----------
    what : the fact, in plain words
    where : file, field or link it concerns
    expected, got : the rule and the value that broke it
    remedy : what the reader can do about it
    """

    def __init__(
        self, what: str, *, where: object = "", expected: object = "", got: object = "", remedy: str = ""
    ) -> None:
        self.what = what
        self.where = str(where)
        self.expected = str(expected)
        self.got = str(got)
        self.remedy = remedy
        super().__init__(self._line())

    def _line(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        facts = [f"expected {self.expected}" if self.expected else "", f"got {self.got}" if self.got else ""]
        body = ", ".join(fact for fact in facts if fact)
        parts = [part for part in (head, body, self.remedy) if part]
        return " ".join("; ".join(parts).split())


class ArrayError(TauhatError):
    """An array of the wrong shape, type or with values that are not finite."""


class RobotError(TauhatError):
    """A robot description that cannot be read or is not a physical robot."""


class RecordingError(TauhatError):
    """A log that cannot be read or is not a motion on one clock."""


class MapError(TauhatError):
    """A log's map that is malformed or does not fit the log."""


class ModelError(TauhatError):
    """A torque model that cannot be built or identified."""


class ControlError(TauhatError):
    """A force-controlled job that cannot be set up, or a command beyond what was checked."""


class EstimateError(TauhatError):
    """An estimate file that is damaged, too new or of another robot."""


class ExcitationError(TauhatError):
    """A motion that cannot be built inside its limits."""


class SimulationError(TauhatError):
    """A simulated experiment that cannot be run or went unstable."""


class SensingError(TauhatError):
    """A force cannot be sensed: settings, samples or an estimate that do not fit."""


class LiveError(TauhatError):
    """A server of live samples that cannot start, a client or message it refuses, a robot that does not answer."""


class ExportError(TauhatError):
    """A model that cannot be written for another program: no body, no word for it there, another robot's file."""


class OutputError(TauhatError):
    """A file that could not be written; nothing half-written is left behind."""


class ProjectError(TauhatError):
    """A project whose file cannot be read, whose folder another run works in, or whose logs cannot be used."""


class MissingExtraError(TauhatError):
    """An optional library is missing; names the extra that installs it."""

    def __init__(self, library: str, extra: str) -> None:
        super().__init__(f"{library} is not installed", remedy=f"pip install 'tauhat[{extra}]'")
        self.library = library
        self.extra = extra

    def __reduce__(self) -> tuple[type[MissingExtraError], tuple[str, str]]:
        """Return how to make it again: a worker's error travels as a pickle."""
        return type(self), (self.library, self.extra)


class TauhatWarning(UserWarning):
    """Legal but doubtful; the message names its number."""
