"""A text for another program, and what it could not say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tauhat.export.parameters import StandardParameters
from tauhat.files import write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedText:
    """A model in another program's words.

    text : the whole file
    left_out : what its format has no word for, with the largest coefficient
    """

    text: str
    left_out: Mapping[str, float] = field(default_factory=dict)

    def save(self, path: str | Path) -> None:
        """Write the file whole or not at all.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        write_text(path, self.text)


def untold_friction(parameters: StandardParameters) -> dict[str, float]:
    """Return the laws that a simulator's damping and dry friction do not cover -> largest coefficient."""
    plain = {"viscous", "coulomb"}
    return {law.key: law.largest for law in parameters.friction if law.key not in plain and law.largest > 0.0}
