"""The truth beside a simulated log, read back: what the plant was made of.

Version 3 holds the plant as it is (`plant`): links, drives, laws, elasticity, heat and what is attached. Version 2 had
links, drives and laws. Beside it are the standard and base parameters of the plain model that people read. Version 1,
without a `schema_version`, held the latter only, which is all such a plant had.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.errors import SimulationError, TauhatError
from tauhat.files import read_text
from tauhat.simulation.parameters import DRIVES, SYMBOLS, TrueParameters

SCHEMA = "tauhat.truth"
SCHEMA_VERSION = 3
_WITH_A_PLANT = (2, 3)


def plant_document(truth: TrueParameters) -> dict[str, Any]:
    """Return schema, version and the plant as plain data, to stand in the file of the truth."""
    return {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "plant": truth.to_dict()}


def load_true_parameters(path: str | Path) -> TrueParameters:
    """Return the true parameters in the file beside a simulated log, of any version.

    Raises
    ------
    SimulationError
        when the file is missing, damaged, not a truth, or of a newer version.
    """
    text = read_text(Path(path), error=SimulationError)
    try:
        document = json.loads(text)
        version = document.get("schema_version", 1)
        if version == 1:
            return _from_names(document["parameters"])
        if version in _WITH_A_PLANT and document.get("schema") == SCHEMA:
            return TrueParameters.from_dict(document["plant"])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, TauhatError) as error:
        raise SimulationError("not a readable truth", where=path, got=error) from error
    remedy = "update tauhat, if the file is newer"
    expected = f"{SCHEMA}, version 1 to {SCHEMA_VERSION}"
    raise SimulationError("unknown form of truth", where=path, expected=expected, got=version, remedy=remedy)


def _from_names(parameters: list[Mapping[str, Any]]) -> TrueParameters:
    """Return the plant of a file of version 1: `Ixx_3` and the like, link by link."""
    values = {str(known["name"]): float(known["value"]) for known in parameters}
    joints = range(1, 1 + sum(name.startswith("m_") for name in values))
    inertia = np.array([[values[f"{symbol}_{joint}"] for symbol in SYMBOLS] for joint in joints])
    drives = {name: [values[f"{symbol}_{joint}"] for joint in joints] for symbol, name in DRIVES.items()}
    return TrueParameters.from_dict({"inertia": inertia, "laws": [], **drives})
