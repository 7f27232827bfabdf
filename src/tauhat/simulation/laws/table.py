"""All passive laws by key, to read them back from plain data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tauhat.errors import SimulationError, TauhatError
from tauhat.simulation.laws.law import PassiveLaw
from tauhat.simulation.laws.load import LoadedBristles, LoadedCoulomb
from tauhat.simulation.laws.presliding import Bristles
from tauhat.simulation.laws.shared_drive import SharedDrive
from tauhat.simulation.laws.speed_laws import (
    CubeRootDrag,
    DirectionalFriction,
    DirectionalViscous,
    PolynomialDrag,
    SmoothCoulomb,
    StribeckBump,
)
from tauhat.simulation.laws.springs import BalancingSpring, GasCylinder

_KNOWN: tuple[type[PassiveLaw], ...] = (
    *(SmoothCoulomb, CubeRootDrag, DirectionalViscous, DirectionalFriction, StribeckBump, PolynomialDrag),
    *(Bristles, LoadedCoulomb, LoadedBristles, SharedDrive, BalancingSpring, GasCylinder),
)
LAWS: Mapping[str, type[PassiveLaw]] = {law.key: law for law in _KNOWN}


def law_from_dict(data: Mapping[str, Any]) -> PassiveLaw:
    """Return the law that `PassiveLaw.to_dict` described.

    Raises
    ------
    SimulationError
        when the law is unknown or its values do not fit it.
    """
    key = str(data.get("law"))
    if key not in LAWS:
        raise SimulationError("unknown law", expected=", ".join(LAWS), got=key)
    values = {
        name: law_from_dict(value) if isinstance(value, Mapping) else value
        for name, value in data.items()
        if name != "law"
    }
    try:
        return LAWS[key](**values)
    except (TypeError, AttributeError) as error:
        raise SimulationError(f"law {key} has other values in this version", got=", ".join(values)) from error
    except TauhatError as error:
        raise SimulationError("the law is damaged", where=key, got=error) from error
