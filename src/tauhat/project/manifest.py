"""What a step was made from and what it left; written after the outputs, so that it never promises too much."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauhat.errors import ProjectError, TauhatError
from tauhat.files import read_text, write_text
from tauhat.project.step import digest_of

STATE = ".tauhat"
"""The folder inside a project's that holds lock and manifests."""
_SCHEMA, _SCHEMA_VERSION = "tauhat/step", 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What is known of a step that was made.

    inputs : label -> value or digest, as `Step.inputs` has them
    outputs : path relative to the project's folder -> digest
    warnings : that were given while it was made
    """

    step: str
    inputs: Mapping[str, Any]
    outputs: Mapping[str, str]
    warnings: tuple[str, ...] = ()

    def save(self, folder: Path) -> None:
        """Write it into the project's folder.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        data = {"step": self.step, "inputs": self.inputs, "outputs": self.outputs, "warnings": list(self.warnings)}
        document = {"schema": _SCHEMA, "schema_version": _SCHEMA_VERSION, "digest": digest_of(data), **data}
        write_text(manifest_path(folder, self.step), json.dumps(document, indent=1))


def manifest_path(folder: Path, step: str) -> Path:
    """Return where the manifest of a step is."""
    return folder / STATE / f"{step}.json"


def load_manifest(folder: Path, step: str) -> Manifest | None:
    """Return the manifest of a step; None where there is none, or where it is damaged or of another version."""
    path = manifest_path(folder, step)
    if not path.exists():
        return None
    try:
        document = json.loads(read_text(path, error=ProjectError))
        data = {key: document[key] for key in ("step", "inputs", "outputs", "warnings")}
        sound = document["digest"] == digest_of(data) and document["schema_version"] == _SCHEMA_VERSION
    except (TauhatError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if not sound or data["step"] != step:
        return None
    return Manifest(step=step, inputs=data["inputs"], outputs=data["outputs"], warnings=tuple(data["warnings"]))


def changes(inputs: Mapping[str, Any], before: Mapping[str, Any]) -> tuple[str, ...]:
    """Return in words which inputs are others than before."""
    changed = [f"{name} changed" for name in inputs if name in before and inputs[name] != before[name]]
    added = [f"{name} is new" for name in inputs if name not in before]
    gone = [f"{name} is gone" for name in before if name not in inputs]
    return (*changed, *added, *gone)
