"""The tool file: what `tauhat payload --json` found of a payload, read for a sensor that has to know it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SensingError, TauhatError
from tauhat.files import read_text

_LARGEST_FILE = 10_000_000
_TEN = "m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tool:
    """A body on the link of a joint.

    link : name of the joint; empty for the last one
    body : (10,) about the origin of the joint's frame
    """

    link: str
    body: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "body", frozen("values", self.body, (10,), where="tool"))


def load_tool(path: str | Path) -> Tool:
    """Return the tool of a file: a JSON object with `link` and ten `values`, as `tauhat payload --json` prints it.

    Raises
    ------
    SensingError
        when the file is missing or none of these; an estimate of arm and payload is sensed with as it is.
    """
    text = read_text(Path(path), error=SensingError, largest=_LARGEST_FILE)
    remedy = f"`tauhat payload ESTIMATE LOADED_LOG --json > {path}`"
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SensingError("not a readable tool", where=path, got=str(error)[:120], remedy=remedy) from error
    if isinstance(data, dict) and "schema" in data:
        remedy = f"it holds arm and payload: sense with it alone, tauhat sense {path} LOG"
        raise SensingError("an estimate, not a tool", where=path, remedy=remedy)
    if not isinstance(data, dict) or not isinstance(data.get("link"), str) or not isinstance(data.get("values"), list):
        raise SensingError("not a tool", where=path, expected=f"link, and values ({_TEN})", remedy=remedy)
    try:
        return Tool(link=data["link"], body=data["values"])
    except TauhatError as error:
        raise SensingError("not a tool", where=path, expected=f"values ({_TEN})", got=error, remedy=remedy) from error
