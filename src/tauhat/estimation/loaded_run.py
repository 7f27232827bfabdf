"""A run with a payload, in the base parameters of the arm without it.

A payload moves with one link, so it adds ten inertial parameters p to that link's own: `tau = Y_b (x + P p)`, with P
the ten columns of the base set's projection. The columns Y_b are those of the arm alone, except that friction which
grows with the load must feel the payload, too: its columns are made with the rigid-body parameters of arm and payload.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.base import BaseParameters, independent_among
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.selection import in_terms_of
from tauhat.dynamics.terms import Inertia
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.rotor_load import load_term, rigid_parameters, standard_with_rotors

TEN = 10  # inertial parameters of a body
_PURE = 1e-6  # weight below which another parameter does not come with one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadColumns:
    """Where a payload hangs, and what ten parameters there do to the base parameters.

    link : index of the link that carries it
    columns : (n_b, 10) matrix P
    base : of the ten parameters: which can be told from each other
    """

    link: int
    columns: FloatArray
    base: BaseParameters

    def __post_init__(self) -> None:
        read_only(self.columns)

    @property
    def kept(self) -> IntArray:
        """Indices among the ten of those that can be told from each other."""
        return self.base.independent

    @property
    def kept_columns(self) -> FloatArray:
        """The columns of P that belong to them, (n_b, k)."""
        return self.columns[:, self.base.independent]

    @property
    def pure(self) -> tuple[bool, ...]:
        """Which of the ten are found alone, not in a sum with others, (10,)."""
        alone = (np.abs(self.base.projection) > _PURE).sum(axis=1) == 1
        return tuple(bool(k in self.kept[alone]) for k in range(TEN))

    def ten(self, kept_values: FloatArray) -> FloatArray:
        """Return all ten parameters, (10,), zero for those that are in sums with others or act on no joint."""
        values = np.zeros(TEN)
        values[self.kept] = kept_values
        return values


def payload_columns(estimate: Estimate, link: str = "") -> PayloadColumns:
    """Return what a payload on a link does to the torque.

    Parameters
    ----------
    link : name of the joint that moves the link; the last one by default

    Raises
    ------
    ModelError
        when there is no such link, the model lacks whole links, or no joint can feel the payload's mass.
    """
    model, names = estimate.model, estimate.robot.joint_names
    if link and link not in names:
        raise ModelError("no such link to carry a payload", expected=", ".join(names), got=link)
    index = names.index(link) if link else len(names) - 1
    start = _start_of_inertia(model) + TEN * index
    own = np.arange(start, start + TEN)
    kept = independent_among(model, own) - start
    if 0 not in kept:
        raise ModelError(
            "no joint feels the mass of a payload", where=f"link of joint {names[index]}",
            remedy="it must be lifted, or swung at a distance from a joint's axis",
        )  # fmt: skip
    columns = np.array(estimate.base.projection[:, own])
    return PayloadColumns(link=index, columns=columns, base=_base_of_ten(model, own, columns, kept))


def _start_of_inertia(model: TorqueModel) -> int:
    start = 0
    for term in model.terms:
        if isinstance(term, Inertia):
            return start
        start += len(term.parameters(model.robot))
    raise ModelError(
        "a payload needs a model with whole links", expected="the term inertia",
        got=", ".join(term.key for term in model.terms),
    )  # fmt: skip


def _base_of_ten(model: TorqueModel, own: IntArray, columns: FloatArray, kept: IntArray) -> BaseParameters:
    acting = np.flatnonzero(np.abs(columns).max(axis=0) > 0.0)
    dependent = np.setdiff1d(acting, kept)
    parameters = model.parameters
    return BaseParameters(
        names=tuple(parameters[index].name for index in own),
        independent=read_only(kept),
        dependent=read_only(dependent),
        regrouping=read_only(in_terms_of(columns, kept)[:, dependent]),
        unidentifiable=read_only(np.setdiff1d(np.arange(TEN), acting)),
    )


def loaded_model(estimate: Estimate, values: FloatArray, payload: FloatArray, link: int) -> TorqueModel:
    """Return the estimate's model with its iterated terms made for arm and payload.

    Parameters
    ----------
    values : (n_b,) base parameters of the arm alone
    payload : (10,) inertial parameters about the origin of the link's frame
    """
    model = estimate.model
    inertia = rigid_parameters(model, standard_with_rotors(model, estimate.base, values))
    inertia[link] += payload
    loaded = load_term(model)
    rotors = np.array(loaded.rotors) if loaded is not None else None
    return replace(model, terms=tuple(term.after(inertia, rotors) if term.iterated else term for term in model.terms))
