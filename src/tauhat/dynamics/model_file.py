"""A model in a TOML file: names of terms, and terms with settings of their own.

    terms = "robust"

    [[term]]
    term = "gas-spring"
    joint = "joint_2"
    distance = 0.8
    ...

Joints are named or counted from zero. A term with settings takes the place of the one of its name.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tauhat.dynamics.model import TERMS, TorqueModel, default_term, known_terms
from tauhat.dynamics.terms import Term
from tauhat.errors import ModelError
from tauhat.files import read_text
from tauhat.robots.robot import Robot

_LARGEST_FILE = 1_000_000


def load_model(path: str | Path, robot: Robot) -> TorqueModel:
    """Return the model that a TOML file describes for this robot.

    Raises
    ------
    ModelError
        when the file cannot be read, or a term or one of its settings is not known or not possible.
    """
    text = read_text(Path(path), error=ModelError, largest=_LARGEST_FILE)
    try:
        return _model(tomllib.loads(text), robot)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ModelError("not a readable model file", where=path, got=error) from error
    except ModelError as error:
        where = f"{path}, {error.where}" if error.where else path
        raise ModelError(
            error.what, where=where, expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def _model(data: Mapping[str, Any], robot: Robot) -> TorqueModel:
    unknown = sorted(set(data) - {"terms", "term"})
    if unknown:
        raise ModelError("unknown key", expected="terms, [[term]]", got=", ".join(unknown))
    names, tables = data.get("terms", ""), data.get("term", [])
    if not isinstance(names, str) or not isinstance(tables, list):
        raise ModelError("terms must be a string and [[term]] a table")
    own = [_term(table, robot) for table in tables]
    settled = {term.key: term for term in own}
    if len(settled) < len(own):
        raise ModelError("a [[term]] is given twice", got=", ".join(term.key for term in own))
    named = known_terms(names) if names.strip() else ()
    further = [term for term in own if term.key not in named]
    return TorqueModel(
        robot=robot, terms=(*(settled[key] if key in settled else default_term(key) for key in named), *further)
    )


def _term(table: Any, robot: Robot) -> Term:
    key = table.get("term") if isinstance(table, Mapping) else table
    if not isinstance(key, str) or key not in TERMS:
        raise ModelError("unknown term", expected=", ".join(TERMS), got=key)
    settings = {name: _indexed(name, value, robot) for name, value in table.items() if name != "term"}
    try:
        made = TERMS[key](**settings)
        made.parameters(robot)
    except (TypeError, ValueError) as error:
        raise ModelError(f"term {key}: settings that it does not take", got=error) from error
    return made


def _indexed(name: str, value: Any, robot: Robot) -> Any:
    """Return the setting with joints by name replaced by what the terms take; lists become tuples."""
    if name == "joint" and isinstance(value, str):
        return _index(value, robot)
    if name == "joints" and isinstance(value, list) and any(isinstance(part, str) for part in value):
        wanted = {_index(part, robot) for part in value}
        return tuple(joint in wanted for joint in range(robot.n_v))
    if name == "motors" and isinstance(value, list):
        return tuple(_motor(motor, robot) for motor in value)
    return tuple(value) if isinstance(value, list) else value


def _motor(motor: Any, robot: Robot) -> tuple[Any, ...]:
    if not isinstance(motor, list) or len(motor) != 3:
        raise ModelError("a motor is not [own joint, other joint, ratio]", got=motor)
    return tuple(_index(part, robot) if isinstance(part, str) else part for part in motor)


def _index(name: Any, robot: Robot) -> int:
    if name not in robot.joint_names:
        raise ModelError("no such joint", expected=", ".join(robot.joint_names), got=name)
    return robot.joint_names.index(name)
