"""Identification of many logs by many workers: each reads logs where it is, and only evidence travels.

The passes of `identify`, each of them one map or one reduction over the logs:
1. a survey: length, cut-off, top speeds of each log;
2. a sample of leading rows, 20 000 in all, on which shapes of terms, delay and source of velocity are chosen here;
3. where friction grows with the load, one pass for every fit that finds the load;
4. the evidence, merged as a tree;
5. where shapes were chosen, a last pass for the error bars that know of it.
The merges are those of `identify` on the same logs, and so is the result.
"""

from __future__ import annotations

from tauhat.blas import single_threaded
from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError, RecordingError
from tauhat.estimation.essential import EssentialLeastSquares
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.evidence import MOST_BLOCKS
from tauhat.estimation.identify import concluded
from tauhat.estimation.iterating import iterated
from tauhat.estimation.least_squares import Estimator, LeastSquares, OrdinaryLeastSquares, WeightedLeastSquares
from tauhat.estimation.log_survey import LogSurvey
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.prior import PriorLeastSquares, PulledLeastSquares, RidgeLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.total_least_squares import TotalLeastSquares
from tauhat.estimation.tuning import tuned_from, tuned_through
from tauhat.recordings.choice import MOTION_CUTOFF
from tauhat.recordings.processing import Processing

_FAMILIES = (LeastSquares, PulledLeastSquares, TotalLeastSquares)
_NAMES = ", ".join(
    method.key
    for method in (
        OrdinaryLeastSquares,
        WeightedLeastSquares,
        TotalLeastSquares,
        RidgeLeastSquares,
        PriorLeastSquares,
        EssentialLeastSquares,
    )
)


@single_threaded
def identify_files(
    model: TorqueModel,
    logs: LogSurvey,
    *,
    estimator: Estimator | None = None,
    processing: Processing | None = None,
    cutoff: float | None = None,
    constraints: PhysicalConstraints | None = None,
) -> Estimate:
    """Return the estimate that `identify` makes of the same logs, read by the workers of the survey.

    Parameters
    ----------
    logs : from `survey_logs`
    estimator : one that needs evidence alone; weighted least squares by default
    processing, cutoff, constraints : as `identify`

    Raises
    ------
    RecordingError, ModelError
        as `identify`, and when the estimator reads every row of the logs.

    Warns
    -----
    TauhatWarning
        as `identify`.
    """
    method = estimator or WeightedLeastSquares()
    check_evidence_alone(method)
    _check_joints(model, logs)
    sample = logs.sample()
    if processing is None:
        low_pass = logs.cutoff() if cutoff is None else cutoff
        settled, settings = tuned_from(
            model, sample, Processing(cutoff=low_pass, motion_cutoff=MOTION_CUTOFF * low_pass)
        )
    else:
        settled, settings = tuned_through(model, sample, processing), processing
    gather = logs.gather(settings)
    settled = iterated(settled, (), settings, method, gather=gather)
    base = base_parameters(settled)
    evidence = gather(settled, base, MOST_BLOCKS)
    problem = Problem(model=settled, base=base, recordings=(), processing=settings, evidence=evidence, gather=gather)
    return concluded(problem, method, logs.seen(), constraints=constraints)


def check_evidence_alone(estimator: Estimator) -> None:
    """Refuse an estimator that reads every row of the recordings again.

    Raises
    ------
    ModelError
        naming it and those that do not.
    """
    inner = estimator.inner if isinstance(estimator, EssentialLeastSquares) else estimator
    if not isinstance(inner, _FAMILIES):
        raise ModelError(
            f"{inner.key} reads every row of the logs, and workers send evidence alone",
            expected=_NAMES,
            got=inner.key,
            remedy="take one of these, or identify without --cluster and --workers",
        )


def _check_joints(model: TorqueModel, logs: LogSurvey) -> None:
    names = logs.facts[0].joint_names
    if len(names) != model.robot.n_v:
        raise RecordingError(
            "the logs do not fit the robot",
            where=logs.facts[0].name,
            expected=f"{model.robot.n_v} joints ({', '.join(model.robot.joint_names)})",
            got=len(names),
            remedy="lock the robot's other joints, or name the right columns in the map",
        )
