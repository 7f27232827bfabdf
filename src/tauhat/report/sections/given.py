"""What went in: recordings, robot, terms and processing."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tauhat.dynamics.terms import Term
from tauhat.recordings.processing import Processing
from tauhat.report.case import Case, Section
from tauhat.report.rendering import rendered

_LONGEST = 16  # values of a setting that are shown one by one
_PROCESSING = {
    "cutoff": (
        "Low-pass of torque and model",
        "{} Hz, zero phase, the same for the torque and for every column of the model",
    ),
    "motion_cutoff": ("Low-pass of the motion", "{} Hz, zero phase, before it is differentiated"),
    "velocity": ("Velocity from", "measured {}"),
    "delay": ("Position logged late by", "{} s against the torque; compensated"),
}


def given(case: Case) -> Section:
    """Return what the estimate was made from."""
    estimate = case.estimate
    html = rendered(
        "given.html.j2",
        robot=estimate.robot,
        inputs=estimate.inputs,
        verified=[(log.log, log.t.size) for log in case.logs],
        terms=[_described(term) for term in estimate.model.terms],
        processing=_processing(estimate.processing),
        estimator=_estimator(dict(estimate.estimator)),
        structure=estimate.structure,
        version=estimate.version,
    )
    return Section(key="given", title="What was given", html=html)


def _processing(processing: Processing) -> list[tuple[str, str]]:
    """Return label and value of every setting; one that has no label yet goes by its own name."""
    values = {name: _short(value) for name, value in processing.to_dict().items() if value not in {None, 0.0}}
    lines = [
        (label, wording.format(values.pop(name))) for name, (label, wording) in _PROCESSING.items() if name in values
    ]
    return lines + [(name.replace("_", " "), value) for name, value in values.items()]


def _estimator(settings: dict[str, Any]) -> str:
    name = settings.pop("name", "unnamed")
    return f"{name} ({_settings(settings)})" if settings else str(name)


def _described(term: Term) -> tuple[str, str, str]:
    """Return a term's key, the first line of its description and its settings."""
    line = (type(term).__doc__ or "").strip().splitlines()
    return term.key, line[0].replace("`", "") if line else "", _settings(asdict(term))


def _settings(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {_short(value)}" for name, value in values.items() if value not in {None, ()})


def _short(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, tuple | list) and len(value) > _LONGEST:
        return f"{len(value)} values"
    if isinstance(value, tuple | list):
        return "(" + ", ".join(_short(item) for item in value) + ")"
    return str(value)
