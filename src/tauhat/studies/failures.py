"""What a long study could not do: the rest is kept, and every failure is told where it was and when the study ends."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

from tauhat.errors import TauhatError
from tauhat.studies.study import Chapter
from tauhat.workers import Workers

# Refusals, workers that died, and defects: hours of work behind the other chapters must not go with any of them.
_FAILURES = (
    TauhatError, ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, TypeError,
    ValueError,
)  # fmt: skip

Item = TypeVar("Item")
Result = TypeVar("Result")


class Failure(NamedTuple):
    """Why there is no result, in one line."""

    line: str


class Failures:
    """Failures of one study, a line each; `tell` hears of each at once."""

    __slots__ = ("_lines", "_tell")

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._lines: list[str] = []
        self._tell = tell

    @property
    def lines(self) -> tuple[str, ...]:
        """All of them, in the order in which they came."""
        return tuple(self._lines)

    def results(
        self, workers: Workers, function: Callable[[Item], Result], items: Sequence[Item], *, what: str
    ) -> Iterator[Result]:
        """Yield the results of the items that one can be had for, in their order; `tell` hears how far it is.

        Parameters
        ----------
        what : the items are, in the plural
        """
        for number, found in enumerate(workers.map(_Attempt(function), items), start=1):
            reached = f"{number} of {len(items)} {what}"
            self._tell(reached)
            if isinstance(found, Failure):
                self._note(f"{reached} failed: {found.line}")
            else:
                yield found

    def chapter(self, title: str, write: Callable[[], Chapter]) -> Chapter:
        """Return the chapter, or in its place, under this title, why there is none."""
        try:
            return write()
        except _FAILURES as error:
            return Chapter(title=title, text=(self._note(f'the chapter "{title}" failed: {_line_of(error)}'),))

    def summary(self, text: str) -> str:
        """Return the summary of the rest, with what is missing named."""
        return f"{text} Missing: {'; '.join(self._lines)}." if self._lines else text

    def _note(self, line: str) -> str:
        self._lines.append(line)
        self._tell(line)
        return line


@dataclass(frozen=True, slots=True)
class _Attempt(Generic[Item, Result]):
    """A function whose refusals are results like any other; what is no refusal but a defect is raised."""

    function: Callable[[Item], Result]

    def __call__(self, item: Item) -> Result | Failure:
        try:
            return self.function(item)
        except TauhatError as error:
            return Failure(_line_of(error))


def _line_of(error: Exception) -> str:
    """Return one line; of a defect also its kind and where it is."""
    words = " ".join(str(error).split())
    if isinstance(error, TauhatError):
        return words
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {words} ({Path(place.filename).name}, line {place.lineno})"
