"""Terms whose columns depend on what the fit finds: the load on a joint, from the pass before; the heat of friction.

A joint keeps its load friction only where the recordings show it: its coefficient must have the sign of friction.
Rotors that are regrouped into links do not load the gear; what of their sum they have is found pass by pass, too
(`rotor_load`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, JointTerm, LoadCoulomb, LoadDahl, Term
from tauhat.estimation.evidence import Evidence, Gather, collect_all, gathering
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.problem import Problem
from tauhat.estimation.rotor_load import (
    hidden_rotors,
    load_term,
    rigid_parameters,
    rotor_load,
    standard_with_rotors,
    with_rotors,
)
from tauhat.estimation.shape_uncertainty import rotor_moves
from tauhat.estimation.warming import warmed
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

_PASSES = 2
_ROTOR_PASSES = 1  # more, where rotors are regrouped into links


def first_loaded(
    model: TorqueModel, recordings: Sequence[Recording], processing: Processing, estimator: Estimator
) -> TorqueModel:
    """Return the model whose iterated terms know the rigid-body parameters of a fit without them.

    The nominal parameters of a description are often far off, or missing. A model without rigid bodies of its own has
    nothing better.
    """
    others = replace(model, terms=tuple(term for term in model.terms if not term.iterated))
    if len(others.terms) == len(model.terms) or not _has_bodies(others):
        return model
    base = base_parameters(others)
    evidence = collect_all(others, base, recordings, processing, most_blocks=1)
    standard = standard_with_rotors(others, base, estimator.solve(evidence).values)
    return _loaded(model, others, standard, rotors=np.zeros(model.robot.n_v))


def iterated(
    model: TorqueModel,
    recordings: Sequence[Recording],
    processing: Processing,
    estimator: Estimator,
    *,
    gather: Gather | None = None,
) -> TorqueModel:
    """Return the model with its iterated terms settled; the model itself when it has none.

    Parameters
    ----------
    gather : makes the evidence where the recordings are not here; each pass asks for it anew
    """
    if any(term.iterated for term in model.terms):
        model = _settled_load(model, recordings, processing, estimator=estimator, gather=gather)
    return warmed(model, recordings, processing, estimator, gather=gather)


def _settled_load(
    model: TorqueModel,
    recordings: Sequence[Recording],
    processing: Processing,
    *,
    estimator: Estimator,
    gather: Gather | None,
) -> TorqueModel:
    for _ in range(_PASSES):
        model = _next_pass(model, recordings, processing, estimator=estimator, gather=gather)
    for _ in range(_ROTOR_PASSES if _has_rotors(model) else 0):
        model = _next_pass(model, recordings, processing, estimator=estimator, gather=gather)
    return model


def _has_rotors(model: TorqueModel) -> bool:
    return any(term.rotors for term in model.terms if isinstance(term, LoadCoulomb | LoadDahl))


def _has_bodies(model: TorqueModel) -> bool:
    return any(parameter.symbol in INERTIAL_SYMBOLS for parameter in model.parameters)


def _loaded(model: TorqueModel, fitted: TorqueModel, standard: FloatArray, *, rotors: FloatArray) -> TorqueModel:
    """Return the model whose iterated terms know the rigid bodies that were fitted, where there were any."""
    if not _has_bodies(fitted):
        return model
    inertia = rigid_parameters(fitted, standard)
    return replace(model, terms=tuple(term.after(inertia, rotors) for term in model.terms))


class _Fitted(NamedTuple):
    """A fit without load friction that drives its joint.

    values : (n_b,), zero for what was left out
    weights : (n_v,) of the joints' equations
    driving : parameters that were left out
    """

    values: FloatArray
    weights: FloatArray
    driving: IntArray


def _next_pass(
    model: TorqueModel,
    recordings: Sequence[Recording],
    processing: Processing,
    *,
    estimator: Estimator,
    gather: Gather | None,
) -> TorqueModel:
    """Return the model with the load that a fit finds."""
    base = base_parameters(model)
    evidence = (gather or gathering(recordings, processing))(model, base, 1)
    fitted = _without_driving(model, base, evidence, estimator)
    problem = Problem(
        model=model, base=base, recordings=tuple(recordings), processing=processing, evidence=evidence, gather=gather
    )
    rotors = _rotors(problem, fitted)
    standard = standard_with_rotors(with_rotors(model, rotors), base, fitted.values)
    return _loaded(_left(model, fitted.driving), model, standard, rotors=rotors)


def _rotors(problem: Problem, fitted: _Fitted) -> FloatArray:
    """Return the regrouped rotors (n_v,) one step nearer to where load friction fits best; no body goes negative."""
    model, base, term = problem.model, problem.base, load_term(problem.model)
    rotors = np.zeros(model.robot.n_v)
    slope = rotor_load(model, base, fitted.values)
    if slope is None:
        return rotors
    if term is not None and term.rotors:
        rotors += term.rotors
    moves = rotor_moves(problem, slope, values=fitted.values, weights=fitted.weights)
    most = np.zeros(model.robot.n_v)
    for rotor, move in zip(hidden_rotors(model, base, fitted.values), moves, strict=True):
        most[rotor.joint] = rotor.most
        rotors[rotor.joint] += move * rotor.most
    return np.clip(rotors, 0.0, most)


def _without_driving(model: TorqueModel, base: BaseParameters, evidence: Evidence, estimator: Estimator) -> _Fitted:
    """Return a fit without load friction that drives its joint.

    What is left may change its sign when the others go, so that the fit is repeated until none of it is negative.
    """
    own = np.array([k for k, term in enumerate(model.terms) for _ in term.parameters(model.robot)])
    may_go = np.array([_can_leave(term) for term in model.terms], dtype=np.bool_)[own[base.independent]]
    columns = np.arange(base.n_b)
    while True:
        solved = estimator.solve(evidence.keeping(columns))
        values = np.zeros(base.n_b)
        values[columns] = solved.values
        left = columns[~(may_go & (values < 0.0))[columns]]
        if left.size == columns.size:
            return _Fitted(values, solved.weights, np.setdiff1d(base.independent, base.independent[columns]))
        columns = left


def _can_leave(term: Term) -> bool:
    return term.iterated and isinstance(term, JointTerm)


def _left(model: TorqueModel, driving: IntArray) -> TorqueModel:
    """Return the model whose iterated terms are left to the joints of which no coefficient is among `driving`."""
    start = 0
    terms: list[Term] = []
    for term in model.terms:
        parameters = term.parameters(model.robot)
        bad = {item.joint for k, item in enumerate(parameters, start) if k in driving}
        start += len(parameters)
        if bad and isinstance(term, JointTerm) and term.iterated:
            present = set(term.present(model.robot).tolist()) - bad
            term = replace(term, joints=tuple(joint in present for joint in range(model.robot.n_v)))  # noqa: PLW2901
        terms.append(term)
    return replace(model, terms=tuple(terms))
