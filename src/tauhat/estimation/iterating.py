"""Terms whose columns depend on what the fit finds: the load on a joint, from the pass before.

A joint keeps its load friction only where the recordings show it: its coefficient must have the sign of friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, JointTerm, Term
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.least_squares import Estimator
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

_PASSES = 2


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
    return _loaded(model, others, _standard(base, estimator.solve(evidence).values))


def iterated(
    model: TorqueModel, recordings: Sequence[Recording], processing: Processing, estimator: Estimator
) -> TorqueModel:
    """Return the model with its iterated terms settled; the model itself when it has none."""
    if not any(term.iterated for term in model.terms):
        return model
    for _ in range(_PASSES):
        base = base_parameters(model)
        evidence = collect_all(model, base, recordings, processing, most_blocks=1)
        standard, driving = _without_driving(model, base, evidence, estimator)
        model = _loaded(_left(model, driving), model, standard)
    return model


def rigid_parameters(model: TorqueModel, standard: FloatArray) -> FloatArray:
    """Return the inertial parameters among `standard` (n_p,), link by link, (n_v, 10); zero where there is none."""
    inertia = np.zeros((model.robot.n_v, len(INERTIAL_SYMBOLS)))
    for parameter, value in zip(model.parameters, standard, strict=True):
        if parameter.symbol in INERTIAL_SYMBOLS:
            inertia[parameter.joint, INERTIAL_SYMBOLS.index(parameter.symbol)] = value
    return inertia


def _has_bodies(model: TorqueModel) -> bool:
    return any(parameter.symbol in INERTIAL_SYMBOLS for parameter in model.parameters)


def _loaded(model: TorqueModel, fitted: TorqueModel, standard: FloatArray) -> TorqueModel:
    """Return the model whose iterated terms know the rigid bodies that were fitted, where there were any."""
    if not _has_bodies(fitted):
        return model
    inertia = rigid_parameters(fitted, standard)
    return replace(model, terms=tuple(term.after(inertia) for term in model.terms))


def _standard(base: BaseParameters, values: FloatArray) -> FloatArray:
    """Return standard parameters that load the joints as the base parameters do: the regrouped ones are zero."""
    standard = np.zeros(len(base.names))
    standard[base.independent] = values
    return standard


def _without_driving(
    model: TorqueModel, base: BaseParameters, evidence: Evidence, estimator: Estimator
) -> tuple[FloatArray, IntArray]:
    """Return the standard parameters of a fit without load friction that drives its joint, and the ones left out.

    What is left may change its sign when the others go, so that the fit is repeated until none of it is negative.
    """
    own = np.array([k for k, term in enumerate(model.terms) for _ in term.parameters(model.robot)])
    may_go = np.array([_can_leave(term) for term in model.terms], dtype=np.bool_)[own[base.independent]]
    columns = np.arange(base.n_b)
    while True:
        values = np.zeros(base.n_b)
        values[columns] = estimator.solve(evidence.keeping(columns)).values
        left = columns[~(may_go & (values < 0.0))[columns]]
        if left.size == columns.size:
            return _standard(base, values), np.setdiff1d(base.independent, base.independent[columns])
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
