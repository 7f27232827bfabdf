"""Settings with one number for all joints or one a joint: checked, read-only, spread over the joints of a robot."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError


def checked(name: str, value: object, *, least: float = -np.inf) -> FloatArray:
    """Return a setting as a read-only array, () or (n_v,).

    Raises
    ------
    SimulationError
        when it is not finite, has rows, or is below `least`.
    """
    try:
        values = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise SimulationError(f"sensor error {name}", expected="numbers", got=repr(value)[:60]) from error
    values.setflags(write=False)
    if values.ndim > 1 or not values.size or not np.isfinite(values).all():
        raise SimulationError(f"sensor error {name}", expected="one finite number, or one a joint", got=value)
    if values.min() < least:
        what = f"sensor error {name} is negative" if least == 0.0 else f"sensor error {name} is too small"
        raise SimulationError(what, expected="" if least == 0.0 else f">= {least:g}", got=value)
    return values


def per_joint(name: str, value: float | FloatArray, n_v: int) -> FloatArray:
    """Return a setting joint by joint, (n_v,).

    Raises
    ------
    SimulationError
        when there is neither one value nor one a joint.
    """
    values = np.asarray(value, dtype=np.float64)
    if values.shape not in {(), (n_v,)}:
        raise SimulationError(
            f"sensor error {name} does not fit the robot", expected=f"1 or {n_v} values", got=values.size
        )
    return np.broadcast_to(values, (n_v,))
