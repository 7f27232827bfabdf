"""From the options of `tauhat sense` to thresholds of contact, and the contacts along what was sensed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tauhat.sensing.contact import ContactEvent
    from tauhat.sensing.contact_thresholds import ContactThresholds
    from tauhat.sensing.sensed_log import SensedLog
    from tauhat.sensing.sensor import ForceSensor


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactChoice:
    """Where thresholds of contact come from.

    free : logs without contact, to learn them from
    thresholds : file to read them from; with free logs, to write them to
    alarms : false ones an hour that are allowed
    map_file : of the free logs
    """

    free: tuple[Path, ...]
    thresholds: Path | None
    alarms: float
    map_file: Path | None

    @property
    def learns(self) -> bool:
        """Whether thresholds are learnt here."""
        return bool(self.free)

    def limits(self, sensor: ForceSensor) -> ContactThresholds:
        """Return the thresholds: learnt and written, read, or assumed where nothing is given.

        Raises
        ------
        TauhatError
            files that cannot be read or written, logs of another robot.
        """
        from tauhat.recordings.reading import read_log
        from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
        from tauhat.sensing.contact_thresholds import learn_contact_thresholds, load_contact_thresholds

        if self.free:
            logs = [read_log(log, map=self.map_file) for log in self.free]
            learnt = learn_contact_thresholds(sensor, logs, rate=self.alarms)
            if self.thresholds is not None:
                learnt.save(self.thresholds)
            return learnt
        if self.thresholds is not None:
            return load_contact_thresholds(self.thresholds)
        return assumed_contact_thresholds(sensor)


def found_contacts(thresholds: ContactThresholds, sensed: Sequence[SensedLog]) -> list[tuple[int, ContactEvent]]:
    """Return the contacts of all logs, each with the place of its log.

    Raises
    ------
    SensingError
        when the thresholds are of other joints.
    """
    from tauhat.sensing.contact import ContactDetector

    return [
        (place, event)
        for place, log in enumerate(sensed)
        for event in ContactDetector(thresholds=thresholds, step=log.step).along(log).events
    ]
