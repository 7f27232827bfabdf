"""Physical constraints in a TOML file.

margin = 1e-6                 # see PhysicalConstraints; every key may be left out
unbounded = ["Ia"]

[pull]
kind = "gaussian"             # or "entropic"
deviation = 10

[[link]]
joint = "elbow_joint"
mass = [1.0, 5.0]
centre = { lower = [-0.1, -0.1, 0.0], upper = [0.1, 0.1, 0.4] }
body = { centre = [0.0, 0.0, 0.2], semi_axes = [0.1, 0.1, 0.3] }
trust = 1.0
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.errors import ModelError
from tauhat.estimation.physical_constraints import (
    Box,
    Ellipsoid,
    EntropicPull,
    GaussianPull,
    LinkConstraints,
    PhysicalConstraints,
    Pull,
)
from tauhat.files import read_text

_LARGEST_FILE = 1_000_000
_PULLS: Mapping[str, type[GaussianPull | EntropicPull]] = {pull.key: pull for pull in (GaussianPull, EntropicPull)}


def load_constraints(path: str | Path) -> PhysicalConstraints:
    """Return the constraints that a TOML file states.

    Raises
    ------
    ModelError
        when the file cannot be read, a key is unknown or a value is not possible.
    """
    text = read_text(Path(path), error=ModelError, largest=_LARGEST_FILE)
    try:
        data = tomllib.loads(text)
        top = _known(data, ("margin", "least_mass", "unbounded", "pull", "link"), "top level")
        settings = {key: top[key] for key in ("margin", "least_mass", "unbounded") if key in top}
        links = tuple(_link(table) for table in top.get("link", ()))
        return PhysicalConstraints(**settings, links=links, pull=_pull(top.get("pull", {})))
    except ModelError as error:
        raise ModelError(str(error), where=path) from error
    except (tomllib.TOMLDecodeError, TypeError, ValueError, KeyError, IndexError, AttributeError) as error:
        raise ModelError(
            "not a readable constraints file", where=path, got=f"{type(error).__name__} {error}"
        ) from error


def _known(table: Any, keys: tuple[str, ...], where: str) -> Mapping[str, Any]:
    if not isinstance(table, Mapping):
        raise ModelError("not a table", where=where, got=table)
    unknown = sorted(set(table) - set(keys))
    if unknown:
        raise ModelError("unknown key", where=where, expected=", ".join(keys), got=", ".join(unknown))
    return table


def _pull(table: Any) -> Pull:
    known = _known(table, ("kind", "deviation"), "pull")
    kind = known.get("kind", GaussianPull.key)
    if kind not in _PULLS:
        raise ModelError("unknown pull", expected=", ".join(_PULLS), got=kind)
    return _PULLS[kind](deviation=float(known["deviation"])) if "deviation" in known else _PULLS[kind]()


def _link(table: Any) -> LinkConstraints:
    known = _known(table, ("joint", "mass", "centre", "body", "trust"), "link")
    if "joint" not in known:
        raise ModelError("a link needs the name of the joint that moves it", where="link")
    settings: dict[str, Any] = {key: known[key] for key in ("joint", "mass", "trust") if key in known}
    if "mass" in settings and len(settings["mass"]) != 2:
        raise ModelError("mass", where=f"link of joint {known['joint']}", expected="[smallest, largest]")
    for key in ("centre", "body"):
        if key in known:
            settings[key] = _region(known[key], f"link of joint {known['joint']}, {key}")
    return LinkConstraints(**settings)


def _region(table: Any, where: str) -> Box | Ellipsoid:
    known = _known(table, ("lower", "upper", "centre", "semi_axes"), where)
    arrays = {key: np.array(value, dtype=np.float64) for key, value in known.items()}
    return Box(**arrays) if "lower" in arrays or "upper" in arrays else Ellipsoid(**arrays)
