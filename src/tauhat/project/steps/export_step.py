"""Step `export`: the estimate for other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from tauhat.estimation.estimate import Estimate
from tauhat.export import StandardParameters, ccode, fill_urdf, mjcf, new_urdf, standard_parameters
from tauhat.project.settings import FORMATS, Exports, labelled
from tauhat.project.step import Step
from tauhat.project.steps.workplace import ESTIMATE, Workplace

_URDF = ".urdf"


def export_step(place: Workplace, wanted: Exports) -> Step:
    """Return the step; a URDF is the robot's own where it has one, with the identified numbers in it."""
    own = _own_urdf(place) if "urdf" in wanted.formats else None
    return Step(
        name="export",
        settings=labelled("export", wanted),
        files=() if own is None else (own,),
        reads=(ESTIMATE,),
        outputs=tuple(_output(name) for name in wanted.formats),
        make=partial(_make, place, wanted),
    )


def _make(place: Workplace, wanted: Exports) -> None:
    estimate = place.estimate()
    parameters = standard_parameters(estimate, without=wanted.without)
    for name in wanted.formats:
        path = place.path(_output(name))
        if name == "urdf":
            _write_urdf(path, _own_urdf(place), estimate, parameters)
        elif name == "mjcf":
            mjcf(estimate.robot, parameters).save(path)
        else:
            fingerprint = estimate.model.fingerprint
            ccode(estimate.robot, parameters, prefix=wanted.prefix, fingerprint=fingerprint).save(path)


def _write_urdf(path: Path, own: Path | None, estimate: Estimate, parameters: StandardParameters) -> None:
    if own is None:
        new_urdf(estimate.robot, parameters).save(path)
    else:
        fill_urdf(own, estimate.robot, parameters).save(path)


def _own_urdf(place: Workplace) -> Path | None:
    source = place.source
    return source if source is not None and source.suffix.lower() == _URDF else None


def _output(name: str) -> str:
    return f"export/{FORMATS[name]}"
