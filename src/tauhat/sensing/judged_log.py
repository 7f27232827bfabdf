"""One log from end to end: sensed, zeroed, contacts, bodies that are carried, hidden directions, warmth."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tauhat.arrays import FloatArray
from tauhat.errors import SensingError
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording
from tauhat.sensing.contact import ContactDetector, Contacts
from tauhat.sensing.contact_thresholds import ContactThresholds
from tauhat.sensing.hidden import Hidden, hidden_along
from tauhat.sensing.observers import ThermalObserver
from tauhat.sensing.payload_check import check_payload, long_enough
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.torque_observer import SensedWarmth
from tauhat.sensing.wrench import WrenchSolver
from tauhat.sensing.zero import AirPass, Zero, without_air, zeroed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedLog:
    """All that a sensor tells along a log.

    sensed : torque and wrench, less the zero that was asked for
    contacts : what touched the arm; events that are long enough say whether a carried body explains them
    thresholds : of the contacts
    hidden : directions of the wrench that the joints did not tell
    zero, air : whether a standing zero, and whether a pass in air, is off torque and wrench
    warm_times, warmth : (n,) [s] and the warmth of the joints there; None by an observer that follows none
    """

    sensed: SensedLog
    contacts: Contacts
    thresholds: ContactThresholds
    hidden: Hidden
    zero: Zero = "as sensed"
    air: bool = False
    warm_times: FloatArray | None = None
    warmth: SensedWarmth | None = None


def judged_log(
    sensor: ForceSensor,
    log: Recording | Log,
    thresholds: ContactThresholds,
    *,
    zero: Zero = "as sensed",
    air: AirPass | None = None,
) -> JudgedLog:
    """Return all that a sensor tells along a log.

    Contacts are told by the torque less the detector's own zero, whatever is taken off what is told.

    Parameters
    ----------
    sensor : should count in the error of the thresholds, `thresholds.sensor_of(sensor)`
    zero : taken off torque and wrench
    air : pass in air that is taken off first

    Raises
    ------
    SensingError
        when log, thresholds or pass do not suit the sensor, or the thresholds are behind a pass, or their error behind
        a standing zero, that is not taken off here.
    """
    check_taken_off(thresholds, air, zero=zero)
    sensed = sensor.along(log)
    if air is not None:
        sensed = without_air(sensed, air, solver=sensor.solver)
    contacts = ContactDetector(thresholds=thresholds, step=sensed.step).along(sensed)
    contacts = told_from_payloads(contacts, sensed, sensor.solver)
    if zero == "standing":
        sensed = zeroed(sensed, contacts.zero, solver=sensor.solver)
    times, warmth = sensor.warmth_along(log) if isinstance(sensor.observer, ThermalObserver) else (None, None)
    return JudgedLog(
        sensed=sensed, contacts=contacts, thresholds=thresholds, hidden=hidden_along(sensed, sensor.solver),
        zero=zero, air=air is not None, warm_times=times, warmth=warmth,
    )  # fmt: skip


def told_from_payloads(contacts: Contacts, sensed: SensedLog, solver: WrenchSolver) -> Contacts:
    """Return the contacts with a check of each event of three seconds or more: a body that is carried, or a contact.

    Parameters
    ----------
    sensed : the log of the contacts, not less their zero
    solver : whose frame would carry the body
    """
    felt = replace(sensed, tau=sensed.tau - contacts.zero)
    events = [
        replace(event, payload=check_payload(felt, solver, between=(event.start, event.end)))
        if long_enough(felt, between=(event.start, event.end)) else event
        for event in contacts.events
    ]  # fmt: skip
    return replace(contacts, events=tuple(events))


def check_taken_off(thresholds: ContactThresholds, air: AirPass | None, *, zero: Zero = "as sensed") -> None:
    """Pass unless thresholds, or the error they hold, are of what remains behind something that stays on here.

    Raises
    ------
    SensingError
        when that is so.
    """
    if thresholds.taken_off == "air" and air is None:
        raise SensingError(
            "thresholds of what remains behind a pass in air", where="contact",
            remedy="take the pass off here as well (--zero air:LOG), or learn thresholds without it",
        )  # fmt: skip
    if thresholds.error is not None and thresholds.error.zero == "standing" and zero != "standing":
        raise SensingError(
            "error bars of what remains behind a standing zero", where="contact",
            remedy="take the zero off here as well (sense --zero standing), or learn without it (--free)",
        )  # fmt: skip
