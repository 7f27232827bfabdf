"""Whether inertial figures could belong to a rigid body; doubts are warnings with their number."""

from __future__ import annotations

import warnings

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import TauhatWarning
from tauhat.robots.robot import Robot

_TOLERANCE = 1e-9  # of the largest moment: rounding of printed figures
_LARGEST_GYRATION = 5.0  # [m] a link whose mass sits farther out than this is a unit error


def inertia_defect(mass: float, inertia_at_com: FloatArray) -> str:
    """Return what makes a central inertia (3, 3) [kg m^2] impossible for a rigid body, or "".

    A body's principal moments are positive, and none exceeds the sum of the other two.
    """
    moments = np.linalg.eigvalsh(inertia_at_com)
    smallest, middle, largest = (float(moment) for moment in moments)
    if smallest <= 0.0 and (mass > 0.0 or largest > 0.0 or smallest < 0.0):
        return f"inertia is not positive definite: smallest principal moment {smallest:.3g} kg m^2"
    excess = largest - middle - smallest
    if excess > _TOLERANCE * largest:
        return f"inertia breaks the triangle inequality: largest moment exceeds the two others by {excess:.3g} kg m^2"
    gyration = float(np.sqrt(largest / mass)) if mass > 0.0 else 0.0
    if gyration > _LARGEST_GYRATION:
        return f"inertia far too large for its mass: radius of gyration {gyration:.3g} m; is it in kg m^2?"
    return ""


def warn_of_impossible_inertia(where: str, mass: float, inertia_at_com: FloatArray) -> None:
    """Warn when no rigid body could have this central inertia; the message names the offending number."""
    defect = inertia_defect(mass, inertia_at_com)
    if defect:
        warnings.warn(f"{where}: {defect}", TauhatWarning, stacklevel=2)


def warn_of_massless_links(robot: Robot) -> None:
    """Warn when some moving links have no mass although others do."""
    massless = [joint.name for joint in robot.joints if joint.inertia[0] <= 0.0]
    if massless and robot.has_inertia:
        names = ", ".join(massless[:6]) + (", ..." if len(massless) > 6 else "")
        message = f"{robot.name}: {len(massless)} of {robot.n_v} moving links have no mass (moved by {names})"
        warnings.warn(message, TauhatWarning, stacklevel=2)
