"""Reading a program strictly, line by line: what is not among the statements that are written is named, not guessed."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError, TauhatError
from tauhat.excitation.waypoints.moves import Move
from tauhat.export.programs.program import Program

Take: TypeAlias = Callable[[re.Match[str]], None]
LARGEST_PROGRAM = 8_000_000  # letters
_SHOWN = 80


class Rule(NamedTuple):
    """A statement and what is done with it.

    pattern : of the whole statement, blanks at both ends removed
    """

    pattern: re.Pattern[str]
    take: Take


def rule(pattern: str, take: Take) -> Rule:
    """Return the rule of a pattern in which a blank stands for any number of blanks."""
    return Rule(re.compile(pattern.replace(" ", r"\s*"), re.ASCII), take)


def passed(match: re.Match[str]) -> None:
    """Take a statement that says nothing about the motion."""


def scan(text: str, rules: Sequence[Rule], *, language: str, comment: str) -> None:
    """Take every statement of a text by the rule that it matches.

    Parameters
    ----------
    comment : what lines that say nothing begin with

    Raises
    ------
    ExportError
        when a statement matches no rule, or says what cannot be: names the line.
    """
    if len(text) > LARGEST_PROGRAM:
        expected = f"at most {LARGEST_PROGRAM} letters"
        raise ExportError("too long a program", where=language, expected=expected, got=len(text))
    for number, line in enumerate(text.splitlines(), 1):
        statement = line.strip()
        if not statement or statement.startswith(comment):
            continue
        where = f"{language} program, line {number}"
        found = ((one, one.pattern.fullmatch(statement)) for one in rules)
        take, match = next(((one.take, match) for one, match in found if match), (passed, None))
        if match is None:
            raise ExportError(
                "unknown statement", where=where, got=statement[:_SHOWN],
                remedy="only statements that tauhat writes are read",
            )  # fmt: skip
        try:
            take(match)
        except TauhatError as error:
            raise ExportError(str(error), where=where) from error


class Registers:
    """Values that statements set, and that hold for all moves until they are set again."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def put(self, match: re.Match[str]) -> None:
        """Take a statement of a name and its value."""
        self.values[match[1]] = float(match[2])

    def value(self, name: str) -> float:
        """Return the value of a name.

        Raises
        ------
        ExportError
            when it is not set.
        """
        if name not in self.values:
            raise ExportError(f"a move before {name} is set")
        return self.values[name]


class Gathered:
    """What the lines of a program have said so far.

    start : of the motion: the first target
    looped, closed : whether the loop over repeats has begun, and ended
    finished : whether the program's own end was read, so that none is cut off
    """

    def __init__(self) -> None:
        self.start: FloatArray | None = None
        self.moves: list[Move] = []
        self.repeats = 1
        self.looped = self.closed = self.finished = False

    def begin(self, start: FloatArray) -> None:
        """Take the position in which the motion begins."""
        self.start = start

    def add(self, move: Move) -> None:
        """Take the next move.

        Raises
        ------
        ExportError
            when the motion has not begun or is over.
        """
        if self.start is None:
            raise ExportError("a line before the first joint move: where the motion begins is unknown")
        if self.closed or self.finished:
            raise ExportError("a move behind the end of the motion")
        self.moves.append(move)

    def dwell(self, seconds: float) -> None:
        """Stand still at the last target.

        Raises
        ------
        ExportError
            when there is none, it is passed by, or has a dwell already.
        """
        if not self.moves or self.closed:
            raise ExportError("a dwell outside the motion")
        if self.moves[-1].dwell > 0.0:
            raise ExportError("two dwells at one target", remedy="add them up")
        self.moves[-1] = replace(self.moves[-1], dwell=seconds)

    def loop(self, repeats: int) -> None:
        """Begin the loop over repeats.

        Raises
        ------
        ExportError
            when the motion has begun already, or not at its start.
        """
        if self.start is None or self.moves or self.looped:
            raise ExportError("a loop that does not hold the whole motion")
        self.repeats, self.looped = repeats, True

    def close(self) -> None:
        """End the loop.

        Raises
        ------
        ExportError
            when there is none.
        """
        if not self.looped or self.closed:
            raise ExportError("an end without a loop")
        self.closed = True

    def finish(self) -> None:
        """End the program."""
        self.finished = True

    def program(self, language: str) -> Program:
        """Return the motion.

        Raises
        ------
        ExportError
            when there is no move, or the end is missing.
        """
        where = f"{language} program"
        if self.start is None or not self.moves:
            raise ExportError("no moves", where=where, expected="a joint move to the start, and a move from there")
        if not self.finished or self.looped != self.closed:
            raise ExportError("the end is missing", where=where, remedy="is the file whole?")
        return Program(start=self.start, moves=tuple(self.moves), repeats=self.repeats)
