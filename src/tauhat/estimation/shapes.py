"""Shapes of terms, joint by joint, by variable projection on evidence.

All forms of a term stand side by side as columns of one evidence: a single pass over the recordings. Choosing one form
a joint (or shared motor) is then choosing columns of its factor. The linear parameters of the whole model are solved
for every choice, so that only the shape is searched; joints are visited in turn, since what one joint's friction does
not explain, another's inertia may.

Source: Golub, Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems whose variables
separate", 1973.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Bank, Shaped
from tauhat.estimation.evidence import Evidence, Gather
from tauhat.estimation.solution import joint_residuals, joint_torques, weighted_rows

FINER = (0.6, 0.8, 1.0, 1.25, 1.6)  # of the best shape on the grid: the second look
LEAST_GAIN = 0.002  # of the residual of all joints, for one joint to take another form than most
_SWEEPS = 2
_RIDGE = 1e-7  # on columns of unit norm: a form that the motion never shows must not spoil the factor


def chosen_form(model: TorqueModel, base: BaseParameters, forms: Sequence[Shaped], gather: Gather) -> Shaped:
    """Return the mixture of `forms` of one of the model's terms that leaves the least residual.

    The shape is then looked at more closely around the best of the forms.

    Parameters
    ----------
    base : of the model with the term in any of its forms
    gather : makes the evidence
    """
    best = _mixture(model, base, forms, gather)
    closer = [best.with_shape([factor * value for value in best.shape]) for factor in FINER]
    return _mixture(model, base, closer, gather)


def _mixture(model: TorqueModel, base: BaseParameters, forms: Sequence[Shaped], gather: Gather) -> Shaped:
    choice, values = _choice(model, base, forms, gather), len(forms[0].shape)
    alike = [choice.residual([form] * values) for form in range(len(forms))]
    picks, level = [int(np.argmin(alike))] * values, min(alike)
    for _ in range(_SWEEPS):
        before = list(picks)
        for value in choice.owned:
            tried = [choice.residual([*picks[:value], pick, *picks[value + 1 :]]) for pick in range(len(forms))]
            if min(tried) < (1.0 - LEAST_GAIN) * level:
                picks[value], level = int(np.argmin(tried)), min(tried)
        if picks == before:
            break
    return forms[0].mixed(forms, picks)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Choice:
    """The weighted triangle of all columns, and which of them belong to which form.

    triangle : (n, n + 1) with columns of unit norm and the torque last
    rest : columns of the other terms, and those of this one that no value shapes
    owned : place of a value in the shape -> per form, the columns that it shapes
    """

    triangle: FloatArray
    rest: IntArray
    owned: Mapping[int, tuple[IntArray, ...]]

    def residual(self, picks: Sequence[int]) -> float:
        """Return the weighted residual when value k of the shape is that of form `picks[k]`."""
        own = [columns[picks[value]] for value, columns in self.owned.items()]
        columns = np.concatenate([self.rest, *own, [self.triangle.shape[1] - 1]])
        count = columns.size - 1
        damped = np.vstack([self.triangle[:, columns], _RIDGE * np.eye(count, count + 1)])
        reduced = np.asarray(np.linalg.qr(damped, mode="r"))
        return abs(float(reduced[count, count]))


def _choice(model: TorqueModel, base: BaseParameters, forms: Sequence[Shaped], gather: Gather) -> _Choice:
    key = forms[0].key
    place = next(index for index, term in enumerate(model.terms) if term.key == key)
    bank = Bank(forms=tuple(forms))
    banked = replace(model, terms=(*model.terms[:place], bank, *model.terms[place + 1 :]))
    start = sum(len(term.parameters(model.robot)) for term in model.terms[:place])
    shaping = forms[0].shaping(model.robot)
    size = shaping.size
    more = size * (len(forms) - 1)
    others = base.independent[(base.independent < start) | (base.independent >= start + size)]
    moved = np.where(others < start, others, others + more)
    unshaped = start + np.flatnonzero(shaping < 0)
    shaped = start + np.flatnonzero(np.tile(shaping, len(forms)) >= 0)
    kept = np.sort(np.concatenate([moved, unshaped, shaped]))
    evidence = gather(banked, _kept_set(banked, kept), 1)
    owned = {
        int(value): tuple(
            np.searchsorted(kept, start + form * size + np.flatnonzero(shaping == value)) for form in range(len(forms))
        )
        for value in np.unique(shaping[shaping >= 0])
    }
    return _Choice(
        triangle=_weighted_triangle(evidence),
        rest=np.searchsorted(kept, np.concatenate([moved, unshaped])),
        owned=owned,
    )


def _kept_set(model: TorqueModel, kept: IntArray) -> BaseParameters:
    """Return the kept columns as if they were a base set: forms of one term need not be independent."""
    names = tuple(parameter.name for parameter in model.parameters)
    nothing = np.zeros(0, dtype=np.intp)
    return BaseParameters(
        names=names,
        independent=kept,
        dependent=nothing,
        regrouping=np.zeros((kept.size, 0)),
        unidentifiable=np.setdiff1d(np.arange(len(names)), kept),
    )


def _weighted_triangle(evidence: Evidence) -> FloatArray:
    """Return the triangle of all joints, each divided by the residual that all columns together leave on it."""
    torque = joint_torques(evidence)
    floor = np.maximum(1e-6 * torque.max(), np.finfo(float).tiny)
    stacked, norms = _scaled_rows(evidence, 1.0 / np.maximum(torque, floor))
    values = np.linalg.lstsq(stacked[:, :-1], stacked[:, -1], rcond=_RIDGE)[0] / norms
    weights = 1.0 / np.maximum(joint_residuals(evidence, values), floor)
    return np.asarray(np.linalg.qr(_scaled_rows(evidence, weights)[0], mode="r"))


def _scaled_rows(evidence: Evidence, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the weighted factors of all joints stacked, columns of unit norm and the torque last, and the norms."""
    rows = weighted_rows(evidence, weights)
    norms = np.linalg.norm(rows[:, :-1], axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    rows[:, :-1] /= norms
    return rows, norms
