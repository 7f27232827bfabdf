"""Step `instructions`: what a person does with the motions, so that the logs come that the next steps wait for."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from tauhat.files import write_text
from tauhat.project.settings import DesignedMotion, GivenLogs, labelled
from tauhat.project.step import Step
from tauhat.project.steps.workplace import ADVICE, ROBOT, Workplace


def instructions_step(place: Workplace) -> Step:
    """Return the step."""
    project = place.project
    sections = {"motion": project.motion, "record": project.record, "verify": project.verify}
    settings = [labelled(section, given) for section, given in sections.items() if given is not None]
    return Step(
        name="instructions",
        settings={name: value for known in settings for name, value in known.items()} | {"file": project.file.name},
        reads=(ROBOT,),
        outputs=(ADVICE,),
        make=partial(_make, place),
    )


def _make(place: Workplace) -> None:
    lines = [f"# Recording {place.robot.name}", "", *_motion_lines(place), *_log_lines(place), ""]
    write_text(place.path(ADVICE), "\n".join(lines))


def _motion_lines(place: Workplace) -> Iterator[str]:
    if not place.motions:
        yield "- Move all joints at once over much of their range, at several speeds, for 20 s or longer."
        return
    motion, robot = place.project.motion, place.project.robot.source
    yield f"- Look at the motion first: `tauhat view {place.motions[0]} --robot {robot}`."
    yield f"- Run it on the robot: {', '.join((*place.motions, *place.programs))}. A .parquet file holds the columns"
    yield "  t, q_1.., dq_1.., ddq_1..; a .script file is a program for a Universal Robots controller."
    if isinstance(motion, DesignedMotion):
        yield f"- It lasts {motion.periods} x {motion.seconds:g} s, starts and ends at rest in one pose, and keeps the"
        yield "  joint limits at all times. The way to its start pose is not checked for collisions: go there slowly."


def _log_lines(place: Workplace) -> Iterator[str]:
    record, verify = place.project.record, place.project.verify
    yield "- Log meanwhile, at 100 Hz or more: time, positions, motor currents or torques. Nothing touches the robot."
    if isinstance(record, GivenLogs):
        yield f"- Save as: {', '.join(record.logs)}."
        yield f"- Say in {record.map or 'a map beside the log'} what its columns mean; `tauhat check LOG` helps."
    if isinstance(verify, GivenLogs):
        yield f"- Record another motion to verify on, and save as: {', '.join(verify.logs)}."
    yield f"- Then `tauhat run {place.project.file.name}` in the project's folder goes on."
