"""Barycentric parameters: the same links, each with the masses beyond it gathered where they hang on it.

The augmented body of link j is the link plus, at the origin of each joint frame that it carries, a point of the mass of
everything beyond that joint. With `d_c` the constant vector from the origin of link j to that of child c at q = 0:

    mb_j = m_j + sum_c mb_c                                      barycentric mass [kg]
    b_j  = (mx, my, mz)_j + sum_c mb_c d_c                       first moment of the augmented body [kg m]
    K_j  = I_j + sum_c mb_c (d_c.d_c E - d_c d_c')               its tensor about the origin of link j [kg m^2]

The map from the standard parameters is linear and has an inverse; the torque is linear in both sets. What it brings:
the masses of links on revolute joints drop out of the equations, only their sums in b and K are left.

Source: Maes, Samin, Willems, "Linearity of multibody systems with respect to barycentric parameters", 1989; Raucent,
Campion, Bastin, Samin, Willems, "Identification of the barycentric parameters of robot manipulators from external
measurements", 1992; Fisette, Raucent, Samin, "Minimal dynamic characterization of tree-like multibody systems", 1996.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.closed_form_base import PREFERENCE, base_of_projection
from tauhat.dynamics.selection import independent_columns
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Inertia, Parameter
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

SYMBOLS = ("mb", "bx", "by", "bz", "Kxx", "Kxy", "Kyy", "Kxz", "Kyz", "Kzz")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BarycentricParameters:
    """The barycentric parameters of a robot and how they follow from the standard ones.

    parameters : `mb, bx, ..., Kzz` of every link, in the order of the standard parameters
    matrix : (n_p, n_p) that takes the standard parameters to these
    inverse : (n_p, n_p) that takes them back; the torque is `Y inverse beta`
    """

    parameters: tuple[Parameter, ...]
    matrix: FloatArray
    inverse: FloatArray

    def __post_init__(self) -> None:
        count = len(self.parameters)
        for name in ("matrix", "inverse"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (count, count), where="barycentric"))

    def base(self, standard: BaseParameters) -> BaseParameters:
        """Return the minimal set among the barycentric parameters: as many as in the standard base set.

        Parameters
        ----------
        standard : base set of the rigid links alone, numeric or by closed-form rules

        Raises
        ------
        ModelError
            when the base set is of another robot or of more than its rigid links.
        """
        count = len(self.parameters)
        if len(standard.names) != count:
            raise ModelError(
                "barycentric parameters describe rigid links only",
                expected=f"a base set of {count} parameters",
                got=len(standard.names),
                remedy='make it of torque_model(robot, "inertia")',
            )
        projection = standard.projection @ self.inverse
        order = sorted(range(count), key=self._preference)
        kept = independent_columns(projection, [parameter.unit for parameter in self.parameters], order)
        return base_of_projection(tuple(parameter.name for parameter in self.parameters), projection, kept)

    def _preference(self, index: int) -> tuple[int, int]:
        parameter = self.parameters[index]
        return parameter.joint, PREFERENCE.index(INERTIAL_SYMBOLS[SYMBOLS.index(parameter.symbol)])


def barycentric_parameters(robot: Robot) -> BarycentricParameters:
    """Return the robot's barycentric parameters as a linear map of the standard ones; serial arms and trees."""
    count = 10 * robot.n_v
    hung, matrix = np.eye(count), np.eye(count)
    for index in reversed(range(robot.n_v)):
        joint = robot.joints[index]
        if joint.parent < 0:
            continue
        own, carrier = slice(10 * index, 10 * index + 10), slice(10 * joint.parent, 10 * joint.parent + 10)
        point = np.outer(_point_mass(joint.translation), np.eye(10)[0])
        matrix[carrier] += point @ matrix[own]
        hung[carrier, own] -= point
    standard = Inertia().parameters(robot)
    parameters = tuple(
        Parameter(
            symbol=SYMBOLS[INERTIAL_SYMBOLS.index(item.symbol)], joint=item.joint, unit=item.unit, lower=item.lower
        )
        for item in standard
    )
    return BarycentricParameters(parameters=parameters, matrix=matrix, inverse=hung)


def _point_mass(place: FloatArray) -> FloatArray:
    """Return the ten standard parameters of one kilogram at a point, (10,)."""
    x, y, z = place
    return np.array([1.0, x, y, z, y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])
