"""The regressor of tracking control, `Y(q, dq, v, dv) x = M(q) dv + C(q, dq) v + g(q) + friction(v)`, at one state.

C must be the matrix of Christoffel symbols, for which `dM/dt - 2 C` is skew-symmetric. It is had from the ordinary
regressor: `c(u) = C(q, u) u` is what that gives, and C(q, a) b is symmetric and bilinear, so that

    C(q, dq) v = c((dq + v)/2) - c((dq - v)/2)

Both terms hold gravity, which cancels; a third call at rest brings M dv and gravity back. All three are samples of one
call of the batched kernel, which costs as much as one.

Friction is taken at v, not at dq. For friction f that grows with speed `(dq - v)'(f(dq) - f(v)) >= 0`: the difference
only damps, and v has the noise of positions, not that of measured speeds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.control.model_torque_kernel import bend_kernel, element_columns_kernel
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.regressor_kernel import regressor_kernel
from tauhat.dynamics.simulated_arm import simulated_arm
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

_PARTS = np.array([1.0, -1.0, 1.0])  # of the three states in the regressor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingRegressor:
    """Which column of the regressor comes from where; make it with `tracking_regressor`.

    robot : geometry and gravity
    n_b : number of base parameters
    bodies : (n_i, 2) column, row among the 10 n_v of the links
    rotors : (n_r, 3) column, row and column of the rotor inertia
    shares : (n_r,) of the parameter there
    passive : (n_e,) column of the elements of friction, springs and offsets
    elements : (n_e,) of unit weight
    links : of the kernel tree
    """

    robot: Robot
    n_b: int
    bodies: IntArray
    rotors: IntArray
    shares: FloatArray
    passive: IntArray
    elements: NDArray[np.void]
    links: NDArray[np.void]

    def bent(self, before: FloatArray, moved: FloatArray) -> FloatArray:
        """Return the states of the bristles (n_e,) behind a displacement of the joints (n_v,) [rad or m]."""
        after = before.copy()
        bend_kernel(self.elements, moved, after)
        return after

    def columns(
        self, state: tuple[FloatArray, FloatArray], v: FloatArray, dv: FloatArray, *, bent: FloatArray
    ) -> FloatArray:
        """Return Y, (n_v, n_b).

        Parameters
        ----------
        state : q, dq, (n_v,) each
        v, dv : (n_v,) reference velocity and its derivative
        bent : (n_e,) states of the bristles
        """
        q, dq = state
        n_v = q.size
        speeds, accelerations = np.zeros((n_v, 3)), np.zeros((n_v, 3))
        speeds[:, 0], speeds[:, 1], accelerations[:, 2] = 0.5 * (dq + v), 0.5 * (dq - v), dv
        places = np.empty((n_v, 3))
        places[:] = q[:, None]
        whole = np.zeros((10 * n_v, n_v, 3))
        regressor_kernel(self.links, places, speeds, accelerations, whole)
        rows = np.zeros((self.n_b, n_v))
        rows[self.bodies[:, 0]] = whole[self.bodies[:, 1]] @ _PARTS
        np.add.at(rows, (self.rotors[:, 0], self.rotors[:, 1]), self.shares * dv[self.rotors[:, 2]])
        taken = np.empty((self.passive.size, n_v))
        element_columns_kernel(self.elements, (q, v), bent, taken)
        rows[self.passive] = taken
        return rows.T


def tracking_regressor(model: TorqueModel, base: BaseParameters) -> TrackingRegressor:
    """Return the regressor of tracking control on a model's base parameters.

    Raises
    ------
    ModelError
        when a term is not linear in the parameters at a single state, as friction that grows with the load, or has no
        value there.
    """
    loaded = [term.key for term in model.terms if term.iterated]
    if loaded:
        raise ModelError(
            f"term {', '.join(loaded)} is not linear in the parameters: load times friction",
            where="tracking regressor",
            remedy="leave it out of the model that adapts",
        )
    arm = simulated_arm(model)
    place = np.full(model.n_p, -1)
    place[base.independent] = np.arange(base.n_b)
    kept = place[arm.parameters] >= 0
    driven = place[arm.rotors[:, 0]] >= 0
    rotors = arm.rotors[driven].copy()
    rotors[:, 0] = place[rotors[:, 0]]
    return TrackingRegressor(
        robot=model.robot,
        n_b=base.n_b,
        bodies=_placed(place, arm.bodies[:, 0], 10 * arm.bodies[:, 1] + arm.bodies[:, 2]),
        rotors=read_only(rotors),
        shares=read_only(arm.shares[driven]),
        passive=read_only(place[arm.parameters[kept]]),
        elements=read_only(arm.elements[kept]),
        links=kernel_tree(model.robot).links,
    )


def _placed(place: IntArray, parameters: IntArray, sources: IntArray) -> IntArray:
    """Return column and source of the parameters that are independent, (n, 2)."""
    kept = place[parameters] >= 0
    return np.asarray(read_only(np.column_stack([place[parameters[kept]], sources[kept]])))
