"""Going through a project: what is up to date is kept, what is not is made, and any moment is a good one to be killed.

A step is kept when its inputs are those that its manifest tells and its outputs are there, byte for byte. Outputs are
written one by one, each whole or not at all, and the manifest after them. So whatever a killed run leaves is one of:
old outputs with their manifest, some new outputs that the old manifest does not fit, or all new ones without a new
manifest; in the last two cases the step is made again.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias

from tauhat.errors import OutputError, ProjectError, TauhatWarning
from tauhat.project.lock import only_run, remove_unfinished
from tauhat.project.manifest import Manifest, changes, load_manifest, manifest_path
from tauhat.project.settings import Project
from tauhat.project.step import FileDigests, Step
from tauhat.project.steps import steps_of
from tauhat.robots.naming import advice_on_name

State: TypeAlias = Literal["kept", "made", "to make", "waits", "not reached"]
Tell: TypeAlias = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class StepReport:
    """What became of a step.

    state : `kept` as it was, `made`, `to make` (nothing was done yet), `waits` for files, or `not reached`
    reasons : why it is not kept
    warnings : that were given when it was made, now or in an earlier run
    seconds : it took [s]
    """

    name: str
    state: State
    outputs: tuple[str, ...]
    reasons: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "name": self.name,
            "state": self.state,
            "reasons": list(self.reasons),
            "outputs": list(self.outputs),
            "warnings": list(self.warnings),
            "seconds": self.seconds,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectRun:
    """What became of all steps; `awaited` are the files that the one that waits is waiting for."""

    folder: Path
    steps: tuple[StepReport, ...]
    awaited: tuple[Path, ...] = ()

    @property
    def finished(self) -> bool:
        """Whether every step that was asked for is up to date."""
        return all(step.state in {"kept", "made"} for step in self.steps)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "folder": str(self.folder),
            "finished": self.finished,
            "awaited": [str(path) for path in self.awaited],
            "steps": [step.to_dict() for step in self.steps],
        }


def run_project(
    project: Project, *, until: str | None = None, forced: Collection[str] = (), tell: Tell | None = None
) -> ProjectRun:
    """Make every step of a project that is not up to date, in order, and return what became of each.

    Parameters
    ----------
    until : the last step; all by default
    forced : steps that are made even if they are up to date; those after them only if their outputs change
    tell : called with each step in words as it begins

    Raises
    ------
    ProjectError
        an unknown step, or another run in the same folder.
    TauhatError
        whatever a step raises; all steps before it are kept by the next run.

    Warns
    -----
    TauhatWarning
        what a step warned of, also when it is kept.
    """
    return run_steps(project.folder, _asked_for(project, until, forced), forced=forced, tell=tell)


def plan_project(project: Project, *, until: str | None = None, forced: Collection[str] = ()) -> ProjectRun:
    """Return what `run_project` would do, and why, without doing it.

    A step after one that is to be made is `to make` as well; it is kept if that one's outputs come out as they were.

    Raises
    ------
    ProjectError
        an unknown step.
    """
    return plan_steps(project.folder, _asked_for(project, until, forced), forced=forced)


def run_steps(
    folder: Path, steps: Sequence[Step], *, forced: Collection[str] = (), tell: Tell | None = None
) -> ProjectRun:
    """Make steps in a folder; see `run_project`."""
    with only_run(folder):
        remove_unfinished(_all_files(folder, steps))
        reports: list[StepReport] = []
        digests = FileDigests()
        for number, step in enumerate(steps, start=1):
            if step.missing():
                return _stopped(folder, steps, reports)
            numbered = partial(_numbered, tell or _silent, f"{number}/{len(steps)}")
            report = _brought_up_to_date(step, folder, digests, forced=forced, tell=numbered)
            for message in report.warnings:
                warnings.warn(message, TauhatWarning, stacklevel=3)
            reports.append(report)
    return ProjectRun(folder=folder, steps=tuple(reports))


def plan_steps(folder: Path, steps: Sequence[Step], *, forced: Collection[str] = ()) -> ProjectRun:
    """Return what would become of steps in a folder; see `plan_project`."""
    reports: list[StepReport] = []
    pending: dict[str, str] = {}
    digests = FileDigests()
    for step in steps:
        if step.missing():
            return _stopped(folder, steps, reports)
        report = _planned(step, folder, digests, pending=pending, forced=forced)
        if report.reasons:
            pending |= dict.fromkeys(step.outputs, step.name)
        reports.append(report)
    return ProjectRun(folder=folder, steps=tuple(reports))


def _stopped(folder: Path, steps: Sequence[Step], reports: Sequence[StepReport]) -> ProjectRun:
    """Return a run that ends at the first step without a report, since that one waits for files."""
    waits, *others = steps[len(reports) :]
    ahead = [StepReport(name=step.name, state="not reached", outputs=step.outputs) for step in others]
    waiting = StepReport(name=waits.name, state="waits", outputs=waits.outputs)
    return ProjectRun(folder=folder, steps=(*reports, waiting, *ahead), awaited=waits.missing())


def _planned(
    step: Step, folder: Path, digests: FileDigests, *, pending: Mapping[str, str], forced: Collection[str]
) -> StepReport:
    known = load_manifest(folder, step.name)
    settled = {name: value for name, value in step.inputs(folder, digests).items() if name not in pending}
    before = {} if known is None else {name: value for name, value in known.inputs.items() if name not in pending}
    upstream = sorted({pending[name] for name in step.reads if name in pending})
    reasons = (
        *(("it is asked for",) if step.name in forced else ()),
        *(f"{name} is made before it" for name in upstream),
        *_reasons(step, folder, known, changes(settled, before), digests),
    )
    if reasons or known is None:
        return StepReport(name=step.name, state="to make", outputs=step.outputs, reasons=reasons)
    return StepReport(name=step.name, state="kept", outputs=step.outputs, warnings=known.warnings)


def _brought_up_to_date(
    step: Step, folder: Path, digests: FileDigests, *, forced: Collection[str], tell: Tell
) -> StepReport:
    known = load_manifest(folder, step.name)
    inputs = step.inputs(folder, digests)
    reasons = _reasons(step, folder, known, changes(inputs, known.inputs if known else {}), digests)
    if known is not None and not reasons and step.name not in forced:
        return StepReport(name=step.name, state="kept", outputs=step.outputs, warnings=known.warnings)
    reasons = ("it is asked for", *reasons) if step.name in forced else reasons
    tell(f"{step.name}: {reasons[0]}{' and more' if len(reasons) > 1 else ''}")
    began = time.monotonic()
    _make_folders(folder, step.outputs)
    said = _made(step)
    outputs = {name: digests.of(folder / name) for name in step.outputs}
    lost = [name for name, digest in outputs.items() if not digest]
    if lost:
        raise ProjectError(f"step {step.name} did not leave {lost[0]}", where=folder)
    Manifest(step=step.name, inputs=inputs, outputs=outputs, warnings=said).save(folder)
    return StepReport(
        name=step.name,
        state="made",
        outputs=step.outputs,
        reasons=reasons,
        warnings=said,
        seconds=time.monotonic() - began,
    )


def _made(step: Step) -> tuple[str, ...]:
    """Do the work of a step; return what it warned of, each once."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", TauhatWarning)
        step.make()
    others = [found for found in caught if not issubclass(found.category, TauhatWarning)]
    for found in others:
        warnings.warn_explicit(found.message, found.category, found.filename, found.lineno)
    said = (str(found.message) for found in caught if issubclass(found.category, TauhatWarning))
    return tuple(dict.fromkeys(said))


def _reasons(
    step: Step, folder: Path, known: Manifest | None, changed: Sequence[str], digests: FileDigests
) -> tuple[str, ...]:
    """Return in words why a step is not up to date; nothing where it is."""
    if known is None:
        return ("it was not made yet",)
    reasons = [*changed]
    if set(known.outputs) != set(step.outputs):
        reasons.append("it has other outputs")
    for name in step.outputs:
        digest = digests.of(folder / name)
        if digest != known.outputs.get(name, digest):
            reasons.append(f"{name} was changed or is damaged" if digest else f"{name} is missing")
    return tuple(reasons)


def _asked_for(project: Project, until: str | None, forced: Collection[str]) -> tuple[Step, ...]:
    steps = steps_of(project)
    names = [step.name for step in steps]
    for name in (*forced, *([until] if until is not None else ())):
        if name not in names:
            remedy = advice_on_name(name, names)
            raise ProjectError("no such step of this project", where=project.file, got=name[:60], remedy=remedy)
    return steps if until is None else steps[: names.index(until) + 1]


def _all_files(folder: Path, steps: Sequence[Step]) -> list[Path]:
    """Return every file that these steps write, or wrote under other settings."""
    names = {name for step in steps for name in step.outputs}
    for step in steps:
        known = load_manifest(folder, step.name)
        names |= set() if known is None else set(known.outputs)
    return [*(folder / name for name in names), *(manifest_path(folder, step.name) for step in steps)]


def _make_folders(folder: Path, outputs: Collection[str]) -> None:
    try:
        for name in outputs:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError("a folder of the project cannot be made", where=folder, got=error.strerror) from error


def _numbered(tell: Tell, number: str, text: str) -> None:
    tell(f"{number} {text}")


def _silent(_: str) -> None:
    """Say nothing."""
