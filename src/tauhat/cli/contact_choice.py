"""From options to thresholds of contact, the error they count in, and what is taken off before."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import typer

from tauhat.cli.zero_choice import ZeroChoice
from tauhat.errors import SensingError, TauhatWarning

if TYPE_CHECKING:
    from tauhat.cli.sensing_options import SensingOptions
    from tauhat.recordings.log import Log
    from tauhat.sensing.contact_thresholds import ContactThresholds
    from tauhat.sensing.sensor import ForceSensor
    from tauhat.sensing.zero import AirPass, StandingZero

_ALARMS = 1.0  # false contacts an hour

Source: TypeAlias = Literal["fit", "free motion", "thresholds"]
"""Where the standard errors of a sensor come from."""


class Prepared(NamedTuple):
    """All that is known before the first log is judged.

    sensor : with the error that was learnt
    thresholds : of contact, in that error
    air : pass that is taken off, None for none
    source : of the error
    """

    sensor: ForceSensor
    thresholds: ContactThresholds
    air: AirPass | None
    source: Source


def prepared(options: SensingOptions, sensor: ForceSensor, *, logs: Sequence[Path] = ()) -> Prepared:
    """Return what the options say of contacts, in the error of free motion where there is any.

    Parameters
    ----------
    logs : that are sensed along, and must not be written over

    Raises
    ------
    TauhatError
        as `ContactChoice.prepared`.
    """
    choice = ContactChoice(
        free=tuple(options.free or ()), thresholds=options.thresholds, alarms=options.alarms,
        map_file=options.map_file, zero=options.zero or ZeroChoice(), inputs=(*options.inputs, *logs),
    )  # fmt: skip
    return choice.prepared(sensor)


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactChoice:
    """Where thresholds of contact come from.

    free : logs without contact, to learn thresholds and the sensor's error from
    thresholds : file to read both from; with free logs, to write them to
    alarms : false ones an hour that are allowed, to learn with; None: one
    map_file : of the free logs and of the pass in air
    zero : what is taken off
    inputs : other files that are read, and must not be written over
    """

    free: tuple[Path, ...] = ()
    thresholds: Path | None = None
    alarms: float | None = None
    map_file: Path | None = None
    zero: ZeroChoice = field(default_factory=ZeroChoice)
    inputs: tuple[Path, ...] = ()

    def prepared(self, sensor: ForceSensor) -> Prepared:
        """Return sensor and thresholds: learnt and written, read, or as the fit and experience have them.

        Raises
        ------
        TauhatError
            files that cannot be read or written, logs of another robot, a zero that the thresholds do not know, a
            sensor that they were not learnt with.
        """
        from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
        from tauhat.sensing.judged_log import check_taken_off

        if self.alarms is not None and not self.free:
            raise typer.BadParameter("needs --free LOG, to learn thresholds from", param_hint="'--alarms'")

        air = self.zero.air_pass(sensor, self.map_file)
        if self.free:
            return self._learnt(sensor, air)
        if self.thresholds is not None:
            found = self._read(self.thresholds)
            check_taken_off(found, air, zero=self.zero.told)
            source: Source = "thresholds" if found.error is not None and found.error.is_learnt else "fit"
            return Prepared(found.sensor_of(sensor), found, air, source)
        return Prepared(sensor, assumed_contact_thresholds(sensor, rules=self.zero.rules), air, "fit")

    def _learnt(self, sensor: ForceSensor, air: AirPass | None) -> Prepared:
        from tauhat.files import check_output
        from tauhat.recordings.reading import read_log
        from tauhat.sensing.learnt_error import error_of
        from tauhat.sensing.threshold_learning import learn_contact_thresholds

        if self.thresholds is not None:
            check_output(self.thresholds, inputs=(*self.inputs, *self.free))
        if self.zero.log is not None and self.zero.log.resolve() in {log.resolve() for log in self.free}:
            raise SensingError(
                "the pass in air is no free motion to learn from", where=self.zero.log,
                remedy="give another pass of the same motion with --free: what remains of it is what is learnt",
            )  # fmt: skip
        logs = [read_log(log, map=self.map_file) for log in self.free]
        taught, source = self._taught(sensor, logs, air)
        error = error_of(taught, zero=self.zero.told if source == "free motion" else "as sensed")
        learnt = learn_contact_thresholds(
            sensor, logs, rate=self.alarms or _ALARMS, rules=self.zero.rules, air=air, error=error
        )
        if self.thresholds is not None:
            learnt.save(self.thresholds)
        return Prepared(taught, learnt, air, source)

    def _taught(self, sensor: ForceSensor, logs: Sequence[Log], air: AirPass | None) -> tuple[ForceSensor, Source]:
        """Return the sensor with the error that it shows in free motion, where there is enough of it."""
        from tauhat.sensing.contact_rules import ContactRules
        from tauhat.sensing.free_logs import sensed_free, settled_seconds
        from tauhat.sensing.free_motion import FEWEST_SECONDS, learnt_from_free_motion

        seconds = settled_seconds(sensed_free(sensor, logs, air=air))
        if seconds < FEWEST_SECONDS:
            warnings.warn(
                f"{seconds:.1f} s of free motion are too few to learn an error bar from, {FEWEST_SECONDS:g} s are "
                "needed: error bars are those of the fit",
                TauhatWarning,
                stacklevel=3,
            )
            return sensor, "fit"
        standing = (self.zero.rules or ContactRules()) if self.zero.told == "standing" else None
        return learnt_from_free_motion(sensor, logs, air=air, standing=standing), "free motion"

    def _read(self, path: Path) -> ContactThresholds:
        from tauhat.sensing.contact_thresholds import load_contact_thresholds

        found, asked = load_contact_thresholds(path), self.zero.rules
        learnt = found.rules.zero
        wanted = learnt if asked is None else asked.zero
        if wanted != learnt or (self.zero.kind == "standing" and not learnt.seconds):
            kept = "the numbers" if self.zero.numbers and learnt.seconds else "--zero"
            raise SensingError(
                "thresholds were learnt with another zero", where=path, expected=_zero_words(learnt),
                got=_zero_words(wanted) if wanted != learnt else "standing",
                remedy=f"leave {kept} out, or learn thresholds with this zero (--free)",
            )  # fmt: skip
        return found


def _zero_words(zero: StandingZero) -> str:
    return f"standing:{zero.seconds:g}:{zero.follow:g}" if zero.seconds else "none"
