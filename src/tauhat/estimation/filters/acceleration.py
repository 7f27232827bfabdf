"""Accelerations of a torque model whose base parameters differ from sample to sample."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import Layout, TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.simulated_arm import rotor_entries
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Inertia, RotorInertia
from tauhat.dynamics.terms.simplified import InertiaWithoutProducts
from tauhat.dynamics.tree import kernel_tree
from tauhat.estimation.filters.points_kernel import points_kernel

_BODIES = (Inertia, InertiaWithoutProducts, RotorInertia)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointAccelerations:
    """The forward dynamics of a model at points of state and base parameters.

    links : of the robot, as kernels read them
    inertial, rotor : base parameters that are of links and of rotors
    inertial_place, rotor_place : where they go in (n_v, 10) and (n_v, n_v), flattened
    rotor_share : how often they do
    others : the model of all other terms, None when there is none
    layout : its columns
    other_place : base parameter of each of its parameters, -1 where it is none
    """

    n_v: int
    links: NDArray[np.void]
    inertial: IntArray
    inertial_place: IntArray
    rotor: IntArray
    rotor_place: IntArray
    rotor_share: FloatArray
    others: TorqueModel | None
    layout: Layout | None
    other_place: IntArray

    def __post_init__(self) -> None:
        for array in (
            self.inertial,
            self.inertial_place,
            self.rotor,
            self.rotor_place,
            self.rotor_share,
            self.other_place,
        ):
            read_only(array)

    def at(self, q: FloatArray, dq: FloatArray, tau: FloatArray, values: FloatArray) -> FloatArray:
        """Return the accelerations, (n, n_v).

        Parameters
        ----------
        q, dq, tau : (n, n_v)
        values : (n, n_b) base parameters

        Raises
        ------
        numpy.linalg.LinAlgError
            when a mass matrix is not positive definite.
        """
        n = q.shape[0]
        inertia, rotor = np.zeros((n, 10 * self.n_v)), np.zeros((n, self.n_v**2))
        inertia[:, self.inertial_place] = values[:, self.inertial]
        rotor[:, self.rotor_place] = self.rotor_share * values[:, self.rotor]
        free = np.ascontiguousarray(tau - self._other_torque(q, dq, values))
        out = np.empty((n, self.n_v))
        bodies = (inertia.reshape(n, self.n_v, 10), rotor.reshape(n, self.n_v, self.n_v))
        states = (np.ascontiguousarray(q), np.ascontiguousarray(dq), free)
        if points_kernel(self.links, bodies, states, out) >= 0:
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        return out

    def _other_torque(self, q: FloatArray, dq: FloatArray, values: FloatArray) -> FloatArray:
        if self.others is None or self.layout is None:
            return np.zeros_like(q)
        position, speed = np.ascontiguousarray(q.T), np.ascontiguousarray(dq.T)
        columns, _ = self.others.columns(Motion(q=position, dq=speed, ddq=np.zeros_like(speed)), self.layout)
        weights = values[:, self.other_place[self.layout.parameters]].T
        products = columns * weights
        joints = [products[self.layout.of_joint(joint)].sum(axis=0) for joint in range(self.n_v)]
        return np.array(joints).T


def point_accelerations(model: TorqueModel, base: BaseParameters) -> PointAccelerations:
    """Return the forward dynamics of a model; terms beside links and motors must not act on accelerations."""
    owners = [term for term in model.terms for _ in term.parameters(model.robot)]
    body = np.array([isinstance(term, _BODIES) for term in owners])
    place = np.full(model.n_p, -1)
    place[base.independent] = np.arange(base.n_b)
    inertial = []
    for index in base.independent:
        parameter = model.parameters[index]
        if parameter.symbol in INERTIAL_SYMBOLS:
            inertial.append((place[index], 10 * parameter.joint + INERTIAL_SYMBOLS.index(parameter.symbol)))
    driven = [entry for entry in rotor_entries(model) if place[entry.parameter] >= 0]
    rotor = [(place[entry.parameter], model.robot.n_v * entry.row + entry.column) for entry in driven]
    other_place = place[~body] if (~body).any() else np.zeros(0, dtype=np.intp)
    terms = tuple(term for term in model.terms if not isinstance(term, _BODIES))
    others = replace(model, terms=terms) if terms else None
    return PointAccelerations(
        n_v=model.robot.n_v,
        links=kernel_tree(model.robot).links,
        inertial=_column(inertial, 0),
        inertial_place=_column(inertial, 1),
        rotor=_column(rotor, 0),
        rotor_place=_column(rotor, 1),
        rotor_share=np.array([entry.share for entry in driven], dtype=np.float64),
        others=others,
        layout=others.layout(np.flatnonzero(other_place >= 0)) if others is not None else None,
        other_place=other_place,
    )


def _column(pairs: list[tuple[int, int]], which: int) -> IntArray:
    return np.array([pair[which] for pair in pairs], dtype=np.intp)
