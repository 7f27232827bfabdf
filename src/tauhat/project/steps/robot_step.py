"""Step `robot`: the description as it was read, and a copy of its file."""

from __future__ import annotations

from functools import partial

from tauhat.files import replace_file
from tauhat.project.settings import labelled
from tauhat.project.step import Step
from tauhat.project.steps.workplace import ROBOT, Workplace


def robot_step(place: Workplace) -> Step:
    """Return the step."""
    source = place.source
    copy = () if source is None else (f"robot/description{source.suffix.lower()}",)
    return Step(
        name="robot",
        settings=labelled("robot", place.project.robot),
        files=() if source is None else (source,),
        outputs=(ROBOT, *copy),
        make=partial(_make, place, copy),
    )


def _make(place: Workplace, copies: tuple[str, ...]) -> None:
    place.write(ROBOT, {"fingerprint": place.robot.fingerprint, **place.robot.to_dict()})
    if place.source is not None:
        content = place.source.read_bytes()
        for copy in copies:
            replace_file(place.path(copy), lambda part: part.write_bytes(content))
