"""What is missing in a model: which effects the residual on a recording still holds, joint by joint, by name and term.

Every effect of a catalogue is added to the residual of a recording that was not fitted; what counts is the share of
the squared residual that it removes on stretches of time on which it was not fitted (`fold_gains`). Effects resemble
one another: what is named is found step by step, the strongest first and the others beside it, and effects that do as
well within one standard error are told as alternatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.blas import single_threaded
from tauhat.dynamics.terms import INERTIAL_SYMBOLS
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.recordings.choice import top_speeds
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.naming import advice_on_name
from tauhat.verification.effects import JointView, candidates
from tauhat.verification.fold_gains import passing
from tauhat.verification.joint_search import Effect, JointCase, Search, changes, named, no_columns
from tauhat.verification.probes import ORDERS, Probes
from tauhat.verification.series import (
    PredictedRows,
    base_places,
    covariance_root,
    joined,
    predicted_rows,
    temperature_at,
)
from tauhat.verification.whiteness import Whiteness, whiteness

FALSE_ALARMS = 0.05  # share of what is named that may be false; of logs of a right model on which anything is
_FEWEST_ROWS = 200
_FEWEST_INDEPENDENT = 30  # rows of a joint below which only effects that make most of its residual can be told


@dataclass(frozen=True, slots=True, kw_only=True)
class JointResidual:
    """What the residual of one joint says.

    rms, relative_rms : of the residual [Nm or N], and over the torque's
    rows : how many were looked at
    whiteness : colour, and how many independent rows these are worth
    changed : parameters of the model that are others on this recording than in the fit, strongest first
    missing : effects that the model does not have, in the order in which they were found
    tried : every effect by itself, strongest first
    """

    name: str
    unit: str
    rms: float
    relative_rms: float
    rows: int
    whiteness: Whiteness
    changed: tuple[Effect, ...]
    missing: tuple[Effect, ...]
    tried: tuple[Effect, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        lists = {name: [asdict(effect) for effect in getattr(self, name)] for name in ("changed", "missing", "tried")}
        return {
            "name": self.name, "unit": self.unit, "rms": self.rms, "relative_rms": self.relative_rms,
            "rows": self.rows, **self.whiteness._asdict(), **lists,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LogResiduals:
    """What the residuals of one recording say, joint by joint."""

    log: str
    joints: tuple[JointResidual, ...]

    @property
    def ranked(self) -> tuple[tuple[str, Effect], ...]:
        """Everything that was named, with its joint, strongest first."""
        found = [(joint.name, effect) for joint in self.joints for effect in (*joint.changed, *joint.missing)]
        return tuple(sorted(found, key=lambda pair: -pair[1].share))

    @property
    def silence(self) -> str:
        """What it means that nothing was named: that there is nothing, or that too little can be told."""
        few = [joint.name for joint in self.joints if joint.whiteness.effective < _FEWEST_INDEPENDENT]
        if not few:
            return "no effect of the catalogue can be told in the residuals."
        where = "every joint" if len(few) == len(self.joints) else ", ".join(few)
        return (
            f"no effect of the catalogue can be told in the residuals, which on {where} are worth fewer than "
            f"{_FEWEST_INDEPENDENT} independent rows: effects may be there. A longer recording tells more."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"log": self.log, "false_alarms": FALSE_ALARMS, "joints": [joint.to_dict() for joint in self.joints]}


@single_threaded
def residual_tests(
    estimate: Estimate,
    recordings: Sequence[Recording],
    *,
    processing: Processing | None = None,
    gear_ratios: Mapping[str, float] | None = None,
) -> tuple[LogResiduals, ...]:
    """Return which effects the residuals still hold on recordings that were not fitted.

    Parameters
    ----------
    processing : other filters than the estimate's own
    gear_ratios : of joints by name, motor turns a turn of the joint: ripple is looked for at once and twice a motor
        turn, too

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when a recording is too short to be cut into stretches, or a ratio is of no joint.
    """
    if not recordings:
        raise ModelError("no recording to look at the residuals of")
    settings = processing or estimate.processing
    orders = _orders(estimate, gear_ratios or {})
    return tuple(_log_residuals(estimate, recording, settings, orders) for recording in recordings)


def _orders(estimate: Estimate, ratios: Mapping[str, float]) -> tuple[tuple[float, ...], ...]:
    names = estimate.robot.joint_names
    for name, ratio in ratios.items():
        if name not in names:
            raise ModelError("gear ratio of an unknown joint", got=name, remedy=advice_on_name(name, names))
        if not 0.0 < abs(ratio) < np.inf:
            raise ModelError("gear ratio", where=name, expected="motor turns a turn of the joint, not 0", got=ratio)
    if not ratios:
        return tuple(ORDERS for _ in names)
    turns = [abs(ratios[name]) if name in ratios else 0.5 for name in names]  # the half: orders that are there already
    return tuple((*ORDERS, turn, 2.0 * turn) if turn > 1.0 else (*ORDERS, 2.5, 3.5) for turn in turns)


def _log_residuals(
    estimate: Estimate, recording: Recording, processing: Processing, orders: tuple[tuple[float, ...], ...]
) -> LogResiduals:
    tops = top_speeds([recording])
    probes = Probes(
        tops=tuple(np.where(tops > 0.0, tops, 1.0).tolist()), inertia=_carried(estimate), orders=orders
    )  # fmt: skip
    rows = joined(list(predicted_rows(estimate, recording, processing=processing, probes=probes)), recording)
    if rows.t.size < _FEWEST_ROWS:
        raise ModelError(
            "too short to look at the residuals", where=recording.name, expected=f"{_FEWEST_ROWS} rows or more",
            got=f"{rows.t.size} at {processing.cutoff:g} Hz", remedy="a longer recording, or a higher --cutoff",
        )  # fmt: skip
    cases = [_case(estimate, rows, joint, processing) for joint in range(estimate.robot.n_v)]
    present = _present(estimate)
    searches = [
        Search.of(case, candidates(_view(recording, rows, joint), probes, present)) for joint, case in enumerate(cases)
    ]
    tried = [tuple(outcome.effect for outcome in search.outcomes(no_columns())) for search in searches]
    changed = [changes(case) for case in cases]
    threshold = passing(np.array([effect.p for group in (*tried, *changed) for effect in group]), rate=FALSE_ALARMS)
    return LogResiduals(
        log=recording.name,
        joints=tuple(
            _joint(case, named(search, threshold), [effect for effect in change if effect.passes(threshold)], every)
            for case, search, change, every in zip(cases, searches, changed, tried, strict=True)
        ),
    )


def _joint(
    case: JointCase, missing: Sequence[Effect], changed: Sequence[Effect], tried: Sequence[Effect]
) -> JointResidual:
    return JointResidual(
        name=case.name, unit=case.unit, rms=case.rms, relative_rms=case.relative_rms, rows=case.residual.size,
        whiteness=case.whiteness, changed=tuple(changed), missing=tuple(missing), tried=tuple(tried),
    )  # fmt: skip


def _case(estimate: Estimate, rows: PredictedRows, joint: int, processing: Processing) -> JointCase:
    residual = rows.tau[joint] - rows.predicted[joint]
    step = _step(rows)
    facts = estimate.robot.joints[joint]
    torque = float(np.sqrt(np.mean(rows.tau[joint] ** 2)))
    rms = float(np.sqrt(np.mean(residual**2)))
    return JointCase(
        joint=joint,
        name=facts.name,
        unit=facts.effort_unit,
        rms=rms,
        relative_rms=rms / torque if torque > 0.0 else float("inf"),
        residual=residual,
        own=rows.own[joint],
        terms=_term_keys(estimate, joint),
        root=_root(estimate, joint),
        whiteness=whiteness(residual, step=step, cutoff=processing.cutoff),
    )


def _own_parameters(estimate: Estimate, joint: int) -> IntArray:
    """Return the base parameters' indices in the model whose columns load a joint."""
    layout = estimate.model.layout(estimate.base.independent)
    return np.asarray(layout.parameters[layout.of_joint(joint)])


def _root(estimate: Estimate, joint: int) -> FloatArray:
    place = base_places(estimate, _own_parameters(estimate, joint))
    return covariance_root(estimate.covariance[np.ix_(place, place)])


def _term_keys(estimate: Estimate, joint: int) -> tuple[str, ...]:
    """Return the term of each of a joint's own columns."""
    keys = [term.key for term in estimate.model.terms for _ in term.parameters(estimate.robot)]
    return tuple(keys[index] for index in _own_parameters(estimate, joint))


def _view(recording: Recording, rows: PredictedRows, joint: int) -> JointView:
    temperature = temperature_at(recording, rows.t)
    return JointView(rows, joint, _step(rows), None if temperature is None else temperature[:, joint])


def _step(rows: PredictedRows) -> float:
    return float(rows.t[-1] - rows.t[0]) / (rows.t.size - 1)


def _present(estimate: Estimate) -> frozenset[str]:
    terms = estimate.model.terms
    return frozenset({term.key for term in terms} | {key for term in terms for key in term.stands_for})


def _carried(estimate: Estimate) -> tuple[float, ...]:
    """Return rigid-body parameters with the torque of the estimate's links, (10 n_v,); none where it has none."""
    parameters = estimate.model.parameters
    inertia = np.zeros((estimate.robot.n_v, len(INERTIAL_SYMBOLS)))
    for index, value in zip(estimate.base.independent, estimate.values, strict=True):
        parameter = parameters[index]
        if parameter.symbol in INERTIAL_SYMBOLS:
            inertia[parameter.joint, INERTIAL_SYMBOLS.index(parameter.symbol)] = value
    return tuple(inertia.ravel().tolist()) if inertia.any() else ()
