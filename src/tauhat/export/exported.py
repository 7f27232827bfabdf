"""A text for another program, and what it could not say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tauhat.files import write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedText:
    """A model in another program's words.

    text : the whole file
    left_out : what its format has no word for, with the largest coefficient
    set_to_zero : what came out negative and cannot be in this format, by name, with its value
    """

    text: str
    left_out: Mapping[str, float] = field(default_factory=dict)
    set_to_zero: Mapping[str, float] = field(default_factory=dict)

    def save(self, path: str | Path) -> None:
        """Write the file whole or not at all.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        write_text(path, self.text)
