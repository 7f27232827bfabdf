"""All steps of a project in their order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from tauhat.errors import ProjectError
from tauhat.project.settings import GivenLogs, Project, SimulatedLogs, UnseenMotion
from tauhat.project.step import Step
from tauhat.project.steps.export_step import export_step
from tauhat.project.steps.identify_step import check_step, identify_step
from tauhat.project.steps.instructions_step import instructions_step
from tauhat.project.steps.motion_step import motion_step
from tauhat.project.steps.record_step import record_step, unseen_step
from tauhat.project.steps.robot_step import robot_step
from tauhat.project.steps.verify_step import report_step, verify_step
from tauhat.project.steps.workplace import Workplace, workplace_of


def steps_of(project: Project) -> tuple[Step, ...]:
    """Return the steps of a project in the order they are made.

    Raises
    ------
    RobotError
        when there is no such robot.
    ProjectError
        when a file that is named is not there and is no log, or a step would overwrite a file that is read.
    """
    steps = tuple(_steps(workplace_of(project)))
    _check_files(project, steps)
    return steps


def _steps(place: Workplace) -> Iterator[Step]:
    project = place.project
    yield robot_step(place)
    if project.motion is not None:
        yield motion_step(place, project.motion)
    if isinstance(project.record, GivenLogs):
        yield instructions_step(place)
    yield record_step(place)
    if isinstance(project.record, SimulatedLogs) and isinstance(project.verify, UnseenMotion):
        yield unseen_step(place, project.record, project.verify)
    yield check_step(place)
    yield identify_step(place)
    if project.export is not None:  # before what may wait for another log
        yield export_step(place, project.export)
    if project.verify is not None:
        yield verify_step(place)
    yield report_step(place)


def _check_files(project: Project, steps: Sequence[Step]) -> None:
    written = {(project.folder / name).resolve() for step in steps for name in step.outputs}
    for step in steps:
        for path in step.files:
            if not path.is_file():
                raise ProjectError("no such file", where=path, remedy=f"it is named in {project.file.name}")
        for path in (*step.files, *step.awaited):
            if path.resolve() in written:
                raise ProjectError("would be overwritten", where=path, remedy="give your own file another name")
