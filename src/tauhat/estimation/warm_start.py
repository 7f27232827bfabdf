"""How warm a robot is when a log begins, from the first seconds of the log itself.

The thermal term is at theta = 0 where the recording that was fitted began. On another log the robot may be warmer; on
its first rows the residual of the cold model is, to first order, `theta_0 d`, with d the change of the predicted torque
by one unit of initial warmth. theta_0 is its weighted mean, with a prior of zero and an error bar.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.terms import Thermal
from tauhat.dynamics.thermal_kernel import warmth_kernel
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.rows import filtered_rows
from tauhat.estimation.warming import thermal_term
from tauhat.recordings.processing import Processing, clock_step, stretches
from tauhat.recordings.recording import FEWEST_SAMPLES, Recording

_INDEPENDENT = 1.0  # [s] over which errors of a model are alike
_SPREAD = 1.0  # standard deviation of theta_0 before the log is looked at


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmStart:
    """An estimate that begins where a log does.

    estimate : its thermal term has the warmth of the first sample
    rest : the recording behind the seconds that were looked at; None where nothing is left
    later : the same estimate with the warmth of the first sample of the rest
    warmth, standard_errors : of each joint at the first sample, (n_v,); one is what its typical speed would bring
    """

    estimate: Estimate
    rest: Recording | None
    later: Estimate
    warmth: FloatArray
    standard_errors: FloatArray

    def __post_init__(self) -> None:
        for name in ("warmth", "standard_errors"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (self.estimate.robot.n_v,)))


def warm_start(estimate: Estimate, recording: Recording, *, seconds: float = 30.0) -> WarmStart:
    """Return the estimate with the warmth that the first seconds of a recording show.

    Parameters
    ----------
    seconds : of the recording that are looked at, in free motion

    Raises
    ------
    ModelError
        when the estimate has no thermal term, or the recording no motion in that time.
    RecordingError
        when the recording does not fit the robot.
    """
    term = thermal_term(estimate.model)
    if term is None:
        raise ModelError("the estimate has no friction that warms up", remedy="identify with --model plain,thermal")
    if not seconds > 0.0:
        raise ModelError("time to tell the warmth from", expected="above zero", got=f"{seconds} s")
    count = int(np.searchsorted(recording.t, recording.t[0] + seconds))
    head = recording if count >= recording.n_t else recording.rows(0, count)
    n_v = estimate.robot.n_v
    tau, cold = _torques(_from(estimate, term, np.zeros(n_v)), head)
    _, warm = _torques(_from(estimate, term, np.ones(n_v)), head)
    if not tau.size:
        raise ModelError("no motion to tell the warmth from", where=recording.name, remedy="look at more seconds")
    change = warm - cold
    share = min(1.0, _spacing(estimate.processing, head) / _INDEPENDENT)  # of the rows that is independent
    known = share * (change**2).sum(axis=1) / estimate.joint_rms**2 + 1.0 / _SPREAD**2
    warmth = share * (change * (tau - cold)).sum(axis=1) / estimate.joint_rms**2 / known
    return WarmStart(
        estimate=_from(estimate, term, warmth), rest=_behind(recording, count), warmth=warmth,
        later=_from(estimate, term, _warmed_along(term, warmth, estimate.processing, head)),
        standard_errors=1.0 / np.sqrt(known),
    )  # fmt: skip


def _from(estimate: Estimate, term: Thermal, warmth: FloatArray) -> Estimate:
    return replace(estimate, model=estimate.model.with_term(replace(term, initial=tuple(warmth.tolist()))))


def _behind(recording: Recording, count: int) -> Recording | None:
    return recording.rows(count, recording.n_t) if recording.n_t - count >= FEWEST_SAMPLES else None


def _spacing(processing: Processing, recording: Recording) -> float:
    """Return the time between filtered rows [s]."""
    step = clock_step(recording)
    return step * processing.decimation(1.0 / step)


def _warmed_along(term: Thermal, warmth: FloatArray, processing: Processing, recording: Recording) -> FloatArray:
    """Return the warmth behind a recording that begins at `warmth`, (n_v,)."""
    numbers, theta = term.numbers(warmth.size, clock_step(recording)), warmth.copy()
    for stretch in stretches(recording, processing):
        warmth_kernel(numbers, stretch.dq, theta, np.empty(stretch.dq.shape))
    return theta


def _torques(estimate: Estimate, recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Return measured and predicted torque, filtered, (n_v, n) each."""
    model, base = estimate.model, estimate.base
    layout = model.layout(base.independent)
    standard = np.zeros(model.n_p)
    standard[base.independent] = estimate.values
    weights, tau, predicted = standard[layout.parameters], [], []
    for rows in filtered_rows(model, layout, recording, estimate.processing):
        own = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
        predicted.append(np.array([weights[part] @ rows.columns[part] for part in own]))
        tau.append(rows.tau)
    nothing = np.zeros((model.robot.n_v, 0))
    return np.hstack([nothing, *tau]), np.hstack([nothing, *predicted])
