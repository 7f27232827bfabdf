"""What to do about each cause of error, with the numbers of the budget."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tauhat.dynamics.model import PLAIN_TERMS, TERMS, known_terms
from tauhat.simulation.typical import MODEL_TERMS
from tauhat.verification.error_budget.causes import Case

WORTH = 0.02  # share of the squared error below which a cause is better left alone


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Facts:
    """What advice is made of.

    case : with every cause
    terms : of the model
    seconds : of the motion [s]
    condition, further_condition : of the fit to the motion, and to a further one as well
    cutoff : low-pass of the fits [Hz]
    """

    case: Case
    terms: str
    seconds: float
    condition: float
    further_condition: float
    cutoff: float


def advice_on(key: str, facts: Facts) -> str:
    """Return what to do about a cause."""
    return _REMEDIES[key](facts)


def _noise(facts: Facts) -> str:
    return (
        f"A motion of {4.0 * facts.seconds:g} s instead of {facts.seconds:g} s halves what noise does to the model: "
        "repeat it and average its periods (identify --period). What noise adds to a log's error no model can help."
    )


def _quantisation(facts: Facts) -> str:
    step = float(np.max(facts.case.sensors.encoder_step))
    return f"Encoders step by {step:.2g} rad or m: log the motors' own encoders, or the velocity, or lower --cutoff."


def _differentiation(facts: Facts) -> str:
    rate = facts.case.experiment.settings.sample_rate
    return (
        f"Filters cut at {facts.cutoff:.3g} Hz of a log at {rate:g} Hz: log faster, log the drives' velocity, and "
        "compare --cutoff values on unseen logs."
    )


def _conditioning(facts: Facts) -> str:
    change = f"from {facts.condition:.3g} to {facts.further_condition:.3g}"
    return (
        f"A second motion of {facts.seconds:g} s, designed with tauhat excite, takes the condition number {change}: "
        "record one."
    )


def _friction(facts: Facts) -> str:
    kind = facts.case.experiment.friction
    known = known_terms(facts.terms)
    missing = [term for term in MODEL_TERMS[kind].split(",") if term not in PLAIN_TERMS and not _covers(known, term)]
    if missing:
        return f"The robot has {kind} friction and the model no {', '.join(missing)}: add it to --model, or take auto."
    return f"The model has the terms of {kind} friction: what is left is their shape; more slow motion shows it."


def _covers(known: tuple[str, ...], term: str) -> bool:
    return term in known or any(term in TERMS[key].stands_for for key in known)


def _temperature(facts: Facts) -> str:
    return (
        f"The joints are {facts.case.warmer:+g} K from where they were: identify at the temperature of the task, warm "
        "up first, or log temperatures and identify at several."
    )


def _elasticity(facts: Facts) -> str:
    elastic, robot = facts.case.experiment.elasticity, facts.case.experiment.robot
    if elastic is None:
        return "Stay below the resonance."
    bend = 1e3 * float(np.max(robot.effort_limit[list(elastic.joints)] / elastic.stiffness))
    return (
        f"Joints bend by up to {bend:.2g} mrad or mm at their largest torque: lower accelerations and --cutoff to "
        "stay below the resonance, or log the positions of the links."
    )


def _delay(facts: Facts) -> str:
    late = 1e3 * facts.case.sensors.torque_delay
    return (
        f"Torque is read {late:.2g} ms late, which identify compensates only where it is sure: measure it, and give "
        "delay_samples in the map."
    )


def _gains(facts: Facts) -> str:
    off = 100.0 * float(np.sqrt(np.mean((np.asarray(facts.case.sensors.torque_factor) - 1.0) ** 2)))
    return (
        f"Torque constants are off by {off:.2g} % (root mean square of the first robot), which no log shows: weigh a "
        "known payload and run tauhat calibrate-drives."
    )


def _offsets(_: Facts) -> str:
    return "Zero the torque sensors warm and unloaded before each log; the term offset takes only what stays the same."


def _ripple(facts: Facts) -> str:
    orders = sorted({f"{float(np.max(ripple.order)):g}" for ripple in facts.case.sensors.ripples})
    return (
        f"Torque ripples {', '.join(orders)} times a turn of the joint or motor: map it at slow constant speed and "
        "subtract it, or keep --cutoff below it."
    )


def _clock(_: Facts) -> str:
    return "Log with the controller's own time stamps, and write the log on a machine that loses no rows."


_REMEDIES: Mapping[str, Callable[[Facts], str]] = {
    "noise": _noise,
    "quantisation": _quantisation,
    "differentiation": _differentiation,
    "conditioning": _conditioning,
    "friction": _friction,
    "temperature": _temperature,
    "elasticity": _elasticity,
    "delay": _delay,
    "gains": _gains,
    "offsets": _offsets,
    "ripple": _ripple,
    "clock": _clock,
}
