"""Step `motion`: motions designed or given, and a robot's programs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.excitation.criteria import criterion_named
from tauhat.excitation.design import Design, DesignSettings, design, method_named
from tauhat.excitation.limits import load_limits
from tauhat.excitation.motion_file import motion_for
from tauhat.export.urscript import ServoSettings, write_urscript
from tauhat.project.settings import DesignedMotion, GivenMotion, labelled
from tauhat.project.step import Step, with_named_files
from tauhat.project.steps.workplace import DESIGN, ROBOT, Workplace
from tauhat.recordings.recording import Recording
from tauhat.recordings.writing import write_recording
from tauhat.robots.robot import Robot


def motion_step(place: Workplace, motion: DesignedMotion | GivenMotion) -> Step:
    """Return the step."""
    if isinstance(motion, GivenMotion):
        return _given(place, motion)
    limits = () if place.limits is None else with_named_files(place.limits)
    return Step(
        name="motion",
        settings=labelled("motion", motion),
        files=(*limits, *(_body(place) if limits else ())),
        reads=(ROBOT,),
        outputs=(*place.motions, *place.programs, DESIGN),
        make=partial(_design, place, motion),
    )


def _given(place: Workplace, motion: GivenMotion) -> Step:
    files = tuple(place.project.place(name) for name in motion.files)
    return Step(
        name="motion",
        settings=labelled("motion", motion),
        files=files,
        reads=(ROBOT,),
        outputs=place.motions,
        make=partial(_copy, place, files),
    )


def _copy(place: Workplace, files: tuple[Path, ...]) -> None:
    for file, name in zip(files, place.motions, strict=True):
        given = motion_for(place.robot, file).samples
        names = place.robot.joint_names
        write_recording(
            Recording(t=given.t, q=given.q, dq=given.dq, ddq=given.ddq, joint_names=names), place.path(name)
        )


def _design(place: Workplace, motion: DesignedMotion) -> None:
    designs = _designs(place.robot, motion, place.limits)
    for found, name in zip(designs, place.motions, strict=True):
        recording = found.recording(rate=motion.rate, joint_names=place.robot.joint_names, periods=motion.periods)
        write_recording(recording, place.path(name))
    for found, name in zip(designs, place.programs, strict=False):
        settings = ServoSettings(periods=motion.periods)
        write_urscript(place.path(name), place.robot, found.trajectory, settings=settings)
    figures = [_figures(found, name) for found, name in zip(designs, place.motions, strict=True)]
    place.write(DESIGN, {"motions": figures})


def _designs(robot: Robot, motion: DesignedMotion, limits: Path | None) -> list[Design]:
    """Return the motions, each designed for what those before it leave uncertain."""
    settings = DesignSettings(
        period=motion.seconds,
        harmonics=motion.harmonics,
        method=method_named(motion.method),
        starts=motion.starts,
        margin=motion.margin,
        limits=None if limits is None else load_limits(limits, robot),
    )
    rng, criterion = np.random.default_rng(motion.seed), criterion_named(motion.criterion)
    designs: list[Design] = []
    for _ in range(motion.motions):
        earlier = tuple(found.trajectory for found in designs)
        designs.append(design(robot, rng=rng, criterion=criterion, settings=replace(settings, earlier=earlier)))
    return designs


def _figures(found: Design, name: str) -> dict[str, Any]:
    """Return what the design is worth; without the time it took, which is another at every run."""
    figures = {key: value for key, value in found.to_dict().items() if key != "seconds"}
    finite = {key: None if value == np.inf else value for key, value in figures.items()}
    return {"motion": name, **finite}


def _body(place: Workplace) -> Iterator[Path]:
    """Yield the files that tell the shape of the robot, which limits may rest on."""
    if place.source is not None:
        yield place.source
    yield from (solid.path for solid in place.robot.solids if solid.path is not None)
