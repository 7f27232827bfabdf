"""Friction that warms up: what heats it, and its time constants.

The warmth of a joint is heated by its friction, which falls as it warms: friction and its slopes are those of the pass
before. The time constants show over minutes, so that they are chosen on whole recordings, by variable projection as
other shapes are (`shapes`), and then taken off the grid by Gauss-Newton steps (`shape_uncertainty`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Thermal
from tauhat.dynamics.terms.thermal import TYPICAL_PART
from tauhat.errors import TauhatWarning
from tauhat.estimation.evidence import Gather, gathering
from tauhat.estimation.friction import steady_friction
from tauhat.estimation.least_squares import Estimator, WeightedLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.shape_uncertainty import nearer_shapes
from tauhat.estimation.shapes import chosen_form
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

_MOST_PASSES = 10  # friction that falls heats less: each pass takes the slopes of the one before
_SETTLED = 0.005  # of a time constant, and of friction: passes that move less are the last
_LARGEST_RATIO = 0.75  # of a pass's move to that of the one before, in the extrapolation
_LOOKED_BACK = 3  # passes behind which the next ones are foreseen
_SHORT = 120.0  # [s]
_LOOKED_AT = (0.2, 0.8)  # of the top speed: where friction is split into a dry and a viscous part


def thermal_term(model: TorqueModel) -> Thermal | None:
    """Return the model's friction that warms up, or None."""
    return next((term for term in model.terms if isinstance(term, Thermal)), None)


def warmed(
    model: TorqueModel,
    recordings: Sequence[Recording],
    processing: Processing,
    estimator: Estimator,
    *,
    gather: Gather | None = None,
) -> TorqueModel:
    """Return the model whose thermal term knows what heats it, and its time constants; the model itself without one.

    Parameters
    ----------
    gather : makes the evidence where the recordings are not here

    Warns
    -----
    TauhatWarning
        when every recording is too short to show a warm-up.
    """
    term = thermal_term(model)
    if term is None:
        return model
    _warn_of_short_logs(recordings)
    take = gather or gathering(recordings, processing)
    term, is_open = _heated_by_rest(model, term, take, estimator), not term.times
    model = model.with_term(term)
    if is_open:
        model = _timed(model, term, take)
    passed = [_own(model)]
    for _ in range(_MOST_PASSES):
        model = model.with_term(_heated_back(model, passed[-1], take, estimator))
        model = _nearer(model, processing, take) if is_open else model
        passed.append(_own(model))
        if _settled(*passed[-2:]):
            break
        if len(passed) > _LOOKED_BACK:
            passed = [_farther(*passed[-3:])]
            model = model.with_term(passed[0])
    return model


def _warn_of_short_logs(recordings: Sequence[Recording]) -> None:
    longest = max((recording.duration for recording in recordings), default=_SHORT)
    if longest < _SHORT:
        warnings.warn(
            f"the longest recording is {longest:.0f} s, too short to show friction that warms up: slopes and time "
            "constants mean nothing; leave out the term thermal, or record one motion for tens of minutes",
            TauhatWarning,
            stacklevel=4,
        )


def _own(model: TorqueModel) -> Thermal:
    return next(term for term in model.terms if isinstance(term, Thermal))


def _farther(first: Thermal, second: Thermal, third: Thermal) -> Thermal:
    """Return where the passes go: each moves the same part of the one before (Aitken's extrapolation, value by value).

    Friction that falls by half when warm makes passes that halve the error each: without this there would be ten.
    """
    states = [np.column_stack([np.log(term.times or np.ones(len(term.friction))), term.friction]) for term in
              (first, second, third)]  # fmt: skip
    moves = states[1] - states[0], states[2] - states[1]
    ratio = np.clip(moves[1] / np.where(moves[0] != 0.0, moves[0], np.inf), 0.0, _LARGEST_RATIO)
    ahead = states[2] + moves[1] * ratio / (1.0 - ratio)
    rows = ahead[:, 1:].tolist()
    times = tuple(np.exp(ahead[:, 0]).tolist()) if third.times != first.times else third.times
    return replace(third, times=times, friction=tuple((row[0], row[1], row[2], row[3]) for row in rows))


def _settled(before: Thermal, after: Thermal) -> bool:
    """Return whether neither the time constants nor the friction that heats have moved."""
    heat, moved = np.array(before.friction), np.array(after.friction) - np.array(before.friction)
    sizes = np.abs(heat[:, :2]).max(axis=0) + np.abs(heat[:, :2])
    still = bool((np.abs(moved) <= _SETTLED * np.tile(sizes, 2)).all())
    if not before.times:
        return still
    return still and bool((np.abs(np.log(np.divide(after.times, before.times))) <= _SETTLED).all())


def slopes_of(model: TorqueModel, standard: FloatArray) -> FloatArray:
    """Return by how much dry and viscous friction change per unit of warmth, (n_v, 2); zero on joints without the term.

    Parameters
    ----------
    standard : (n_p,) parameters; base parameters do as well
    """
    slopes = np.zeros((model.robot.n_v, 2))
    for parameter, value in zip(model.parameters, standard, strict=True):
        if parameter.symbol in Thermal.symbols:
            slopes[parameter.joint, Thermal.symbols.index(parameter.symbol)] = value
    return slopes


def _heated_by_rest(model: TorqueModel, term: Thermal, gather: Gather, estimator: Estimator) -> Thermal:
    """Return the term with the heat of the friction that a fit without it finds."""
    cold = replace(model, terms=tuple(other for other in model.terms if other is not term))
    base = base_parameters(cold)
    parts = _split_friction(cold, base, estimator.solve(gather(cold, base, 1)).values, term)
    return replace(term, friction=tuple((dry, viscous, 0.0, 0.0) for dry, viscous in parts.tolist()))


def _heated_back(model: TorqueModel, term: Thermal, gather: Gather, estimator: Estimator) -> Thermal:
    """Return the term with the heat of the friction, and its slopes, that a fit with it finds."""
    base = base_parameters(model)
    values = estimator.solve(gather(model, base, 1)).values
    standard = np.zeros(model.n_p)
    standard[base.independent] = values
    parts = _split_friction(model.with_term(replace(term, initial=())), base, values, term)
    rows = np.hstack([parts, slopes_of(model, standard)]).tolist()
    return replace(term, friction=tuple((row[0], row[1], row[2], row[3]) for row in rows))


def _split_friction(model: TorqueModel, base: BaseParameters, values: FloatArray, term: Thermal) -> FloatArray:
    """Return dry and viscous friction at theta = 0, (n_v, 2), by steady friction at two speeds; none drives."""
    n_v = model.robot.n_v
    tops = np.array(term.speeds or (1.0,) * n_v) / TYPICAL_PART
    unsure = np.zeros((base.n_b, base.n_b))
    low, high = (steady_friction(model, base, values, unsure, part * tops).torque for part in _LOOKED_AT)
    viscous = np.maximum((high - low) / ((_LOOKED_AT[1] - _LOOKED_AT[0]) * tops), 0.0)
    dry = np.maximum(np.where(viscous > 0.0, low - _LOOKED_AT[0] * tops * viscous, 0.5 * (low + high)), 0.0)
    return np.column_stack([np.where(dry + viscous > 0.0, dry, 1.0), viscous])  # without friction motion itself warms


def _timed(model: TorqueModel, term: Thermal, gather: Gather) -> TorqueModel:
    """Return the model with the time constants of the grid that leave the least residual."""
    forms = term.forms(model.robot.n_v)
    base = base_parameters(model.with_term(forms[0]))
    return model.with_term(chosen_form(model, base, forms, gather))


def _nearer(model: TorqueModel, processing: Processing, gather: Gather) -> TorqueModel:
    """Return the model with its time constants one Gauss-Newton step nearer to the least residual."""
    base = base_parameters(model)
    evidence = gather(model, base, 1)
    problem = Problem(
        model=model, base=base, recordings=(), processing=processing, evidence=evidence, gather=gather
    )  # fmt: skip
    return nearer_shapes(problem, WeightedLeastSquares().fit(evidence), {Thermal.key})
