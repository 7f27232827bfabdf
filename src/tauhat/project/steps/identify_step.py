"""Steps `check` and `identify`: are the logs sound, and the model they make."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path

from tauhat.dynamics.model import PLAIN_TERMS
from tauhat.dynamics.named_model import AUTO, named_model
from tauhat.errors import ProjectError
from tauhat.estimation.constraints_file import load_constraints
from tauhat.estimation.essential import EssentialLeastSquares
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.identify import identify
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.selecting import identify_selected
from tauhat.project.settings import FREE, PHYSICAL, Identification, labelled
from tauhat.project.step import Step, with_named_files
from tauhat.project.steps.workplace import CHECKS, ESTIMATE, ROBOT, Workplace
from tauhat.recordings.periods import average_periods
from tauhat.recordings.recording import Recording
from tauhat.robots.fitting import check_joint_order, fit_to_joints
from tauhat.verification.checked_log import checked_log

_FILE = ".toml"


def check_step(place: Workplace) -> Step:
    """Return the step that judges the logs before anything is identified from them."""
    record = place.project.record
    return Step(
        name="check",
        settings=place.settings_of_logs("record", record),
        files=place.files_of_logs(record),
        awaited=place.awaited(record),
        reads=(ROBOT, *place.simulated_logs),
        outputs=(CHECKS,),
        make=partial(_check, place),
    )


def identify_step(place: Workplace) -> Step:
    """Return the step that leaves the estimate."""
    record, wanted = place.project.record, place.project.identify
    named = [name for name in (wanted.model, wanted.constraints) if name.endswith(_FILE)]
    own = [file for name in named for file in with_named_files(place.project.place(name))]
    return Step(
        name="identify",
        settings=labelled("identify", wanted) | place.settings_of_logs("record", record),
        files=(*own, *place.files_of_logs(record)),
        awaited=place.awaited(record),
        reads=(ROBOT, *place.simulated_logs),
        outputs=(ESTIMATE,),
        make=partial(_identify, place, wanted),
    )


def _check(place: Workplace) -> None:
    checked = [checked_log(log, robot=place.robot, terms=PLAIN_TERMS) for log in place.fitted_logs()]
    logs = [
        {"log": one.log.name, "usable": one.usable, "findings": [asdict(found) for found in one.findings]}
        for one in checked
    ]
    place.write(CHECKS, {"logs": logs})
    bad = next((one for one in checked if not one.usable), None)
    if bad is not None:
        finding = bad.findings[0]
        remedy = f"{finding.advice or 'correct the log or its map'}; all findings are in {CHECKS}"
        raise ProjectError(f"the log cannot be used: {finding.message}", where=bad.log.name, remedy=remedy)


def _identify(place: Workplace, wanted: Identification) -> None:
    measured = [log.recording() for log in place.fitted_logs()]
    recordings = [_averaged(recording, wanted) for recording in measured]
    robot = fit_to_joints(place.robot, recordings[0].joint_names, where=recordings[0].name)
    for recording in recordings:
        check_joint_order(robot, recording.joint_names, where=recording.name)
    shared = [motor for recording in recordings for motor in recording.shared_motors]
    text = str(place.project.place(wanted.model)) if wanted.model.endswith(_FILE) else wanted.model
    model = named_model(robot, text, shared_motors=shared)
    way = identify_selected if text.strip() == AUTO else identify
    constraints = _constraints(wanted, place.project.folder)
    estimate = way(model, recordings, estimator=_estimator(wanted), cutoff=wanted.cutoff, constraints=constraints)
    estimate.save(place.path(ESTIMATE))


def _averaged(recording: Recording, wanted: Identification) -> Recording:
    return recording if wanted.period is None else average_periods(recording, period=wanted.period).recording


def _estimator(wanted: Identification) -> Estimator:
    named = estimator_named(wanted.estimator)
    return EssentialLeastSquares(inner=named) if wanted.essential else named


def _constraints(wanted: Identification, folder: Path) -> PhysicalConstraints | None:
    if wanted.constraints == FREE:
        return None
    return PhysicalConstraints() if wanted.constraints == PHYSICAL else load_constraints(folder / wanted.constraints)
