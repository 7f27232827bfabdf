"""A link as one rigid body in the forms that URDF and MJCF ask for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.export.parameters import second_moments
from tauhat.robots.joint import central_inertia

# Simulators refuse a flat body whose largest moment exceeds the two others by one rounding error.
_FLATTEST = 1e-12  # smallest spread of mass along an axis, relative to the largest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CentralBody:
    """Mass [kg], centre of mass (3,) [m] and tensor of inertia about it (3, 3) [kg m^2], in link axes."""

    mass: float
    com: FloatArray
    inertia: FloatArray


def central_body(inertia: FloatArray) -> CentralBody:
    """Return the body of ten inertial parameters; one that is flat but for rounding is made flat.

    Parameters
    ----------
    inertia : (10,) about the joint frame's origin, physical (`check_parameters`)
    """
    mass, com, central = central_inertia(inertia)
    spread, axes = np.linalg.eigh(second_moments(central))
    floor = _FLATTEST * spread[-1]
    if spread[0] < floor:
        moments = axes @ np.diag(np.maximum(spread, floor)) @ axes.T
        central = np.trace(moments) * np.eye(3) - moments
    return CentralBody(mass=mass, com=com + 0.0, inertia=0.5 * (central + central.T) + 0.0)


def row(*values: float) -> str:
    """Return numbers that read back exactly, with blanks between; no negative zeros."""
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in values)
