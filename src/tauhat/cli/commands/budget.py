"""`tauhat budget`: which part of the error comes from where, rehearsed or on real logs."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import (
    ClusterOption,
    CutoffOption,
    ExperimentSeedOption,
    JsonOption,
    LockOption,
    MapOption,
    RowsOption,
    StudyPageOption,
    WorkersOption,
)
from tauhat.cli.reporting import say, working
from tauhat.cli.studies import experiment_of, show_result

if TYPE_CHECKING:
    from tauhat.simulation.planned_experiment import PlannedExperiment
    from tauhat.studies.error_budget import ErrorBudgetStudy
    from tauhat.studies.study import StudyResult

_LOGS_ONLY = ("map_file", "rows", "cutoff", "period")
_REHEARSED_ONLY = ("seconds", "model", "seeds", "seed", "warmer", "workers", "cluster", "lock")
_NAMES = {"map_file": "--map"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat budget` takes."""

    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="Robot or EXPERIMENT.toml, to be rehearsed; or with logs the ESTIMATE to hold against them.",
            show_default=False,
        ),
    ]
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG]...", help="Recordings that were not fitted.", show_default=False, readable=False),
    ] = None
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", metavar="S", min=0.5, help="Length of the motion (s).", show_default="20 or its own"),
    ] = None
    model: Annotated[
        str | None,
        typer.Option(
            "--model", metavar="TERMS", help="robust, plain, or terms with commas between.", show_default="robust"
        ),
    ] = None
    seeds: Annotated[int | None, typer.Option("--seeds", metavar="N", min=1, help="True robots.", show_default="5")] = (
        None
    )
    seed: ExperimentSeedOption = None
    warmer: Annotated[
        float | None,
        typer.Option(
            "--warmer",
            metavar="K",
            help="How much warmer joints are on the unseen motion than on the fitted one (K).",
            show_default="10",
        ),
    ] = None
    workers: WorkersOption = None
    cluster: ClusterOption = None
    lock: LockOption = None
    period: Annotated[
        float | None,
        typer.Option(
            "--period",
            metavar="SECONDS",
            min=0.0,
            help="Length of a repeated motion in the logs: what does not repeat is noise.",
            show_default=False,
        ),
    ] = None
    map_file: MapOption = None
    rows: RowsOption = None
    cutoff: CutoffOption = None
    output: StudyPageOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Tell which part of the error comes from where, ranked, and what to do about it.

    A robot or experiment is rehearsed with each cause of error switched off and on. With logs, the residual of an
    estimate is split into effects that the model lacks, noise, and what has no name.
    """
    from tauhat.files import check_output

    _refuse_strange(options)
    if options.output is not None:
        check_output(options.output, inputs=[options.source, *(options.logs or ())])
    started = time.perf_counter()
    result, found = _of_logs(options) if options.logs else _rehearsed(options)
    beside = {"budget": found, "seconds": time.perf_counter() - started}
    show_result(result, beside, page=options.output, as_json=options.as_json)


def _refuse_strange(options: Options) -> None:
    strange, why = (_REHEARSED_ONLY, "logs are not rehearsed") if options.logs else (_LOGS_ONLY, "there is no log")
    for name in strange:
        if getattr(options, name) is not None:
            raise typer.BadParameter(why, param_hint=f"'{_NAMES.get(name, f'--{name}')}'")


def _of_logs(options: Options) -> tuple[StudyResult, Any]:
    from tauhat.cli.inputs import processing_of, recordings_of_estimate
    from tauhat.estimation.estimate import load_estimate
    from tauhat.studies.error_budget import log_budget_result
    from tauhat.verification.error_budget import log_budget

    estimate = load_estimate(options.source)
    processing = processing_of(estimate, cutoff=options.cutoff)
    with working("looking at residuals"):
        recordings = recordings_of_estimate(estimate, options.logs or (), map_file=options.map_file, rows=options.rows)
        budgets = log_budget(estimate, recordings, period=options.period, processing=processing)
    return log_budget_result(estimate, budgets), [budget.to_dict() for budget in budgets]


def _rehearsed(options: Options) -> tuple[StudyResult, Any]:
    from tauhat.cluster import workers_of

    study, workers = _study(options), workers_of(options.cluster, options.workers)
    with working(study.title):
        settings, budget = study.budget(workers, tell=lambda text: say(study.key, text))
    return study.result(settings, budget), budget.to_dict()


def _study(options: Options) -> ErrorBudgetStudy:
    from tauhat.studies.error_budget import ErrorBudgetStudy

    changes = {"terms": options.model, "seeds": options.seeds, "warmer": options.warmer}
    given: dict[str, Any] = {name: value for name, value in changes.items() if value is not None}
    return ErrorBudgetStudy(experiment=_experiment(options), **given)


def _experiment(options: Options) -> PlannedExperiment:
    """Return the experiment with as long a motion as was asked for."""
    from tauhat.studies.error_budget import typical_experiment

    planned = experiment_of(options.source, typical_experiment, lock=options.lock, seed=options.seed)
    if options.seconds is None:
        return planned
    if planned.motion.given is not None:
        raise typer.BadParameter("the experiment's motion has its own length", param_hint="'--seconds'")
    return replace(planned, motion=replace(planned.motion, seconds=options.seconds))
