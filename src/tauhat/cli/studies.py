"""What commands share that run a study: the experiment that is asked for, and the result with its page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import FAILED, say

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.cli.options import Locks
    from tauhat.robots.robot import Robot
    from tauhat.simulation.planned_experiment import PlannedExperiment
    from tauhat.studies.study import StudyResult


def experiment_of(
    source: str, usual: Callable[[Robot], PlannedExperiment], *, lock: Locks | None, seed: int | None
) -> PlannedExperiment:
    """Return what an experiment's file plans, or the usual experiment with a robot, with the seed that is given."""
    from tauhat.robots.library import load_robot
    from tauhat.simulation.experiment_file import is_experiment, load_experiment

    if is_experiment(source):
        if lock:
            raise typer.BadParameter("the experiment's file says that, in [locked]", param_hint="'--lock'")
        planned = load_experiment(source)
    else:
        planned = usual(load_robot(source, locked=lock))
    return planned if seed is None else replace(planned, seed=seed, robot_seed=seed)


def show_result(result: StudyResult, beside: Mapping[str, Any], *, page: Path | None, as_json: bool) -> None:
    """Write the page of a study where one is wanted, and show what the study found; leave with status 1 after failures.

    Parameters
    ----------
    beside : what the JSON document has beside the result
    """
    document: dict[str, Any] = {**result.to_dict(), **beside}
    if page is not None:
        from tauhat.report.study_page import write_study

        document["page"] = str(write_study(page, result))

    def view() -> Iterator[RenderableType]:
        from tauhat.cli.views.study import study_view

        yield from study_view(result)
        if page is not None:
            yield unbroken(f"Written: {page}")

    show(document, view, as_json=as_json)
    for line in result.failures:
        say("error", line)
    if result.failures:
        raise typer.Exit(FAILED)
