"""What a study is and what it leaves: sections of words, tables and charts, in plain data that any page can draw."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal, TypeAlias

from tauhat.errors import ModelError
from tauhat.plain_data import without_infinities
from tauhat.workers import Workers

Cell: TypeAlias = str | float | int
Kind: TypeAlias = Literal["lines", "bars"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows of cells under a header.

    title : what it shows
    header : a name for each column, with its unit
    rows : as many cells each; floats are shown to three digits
    note : what a reader must know to read it
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.header):
                raise ModelError("cells of a row", where=self.title, expected=len(self.header), got=len(row))


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """One line, or the bars of one colour.

    x : places, numbers or names
    y : values; nan where there is none
    low, high : ends of an interval about each value; empty for none
    """

    name: str
    x: tuple[Cell, ...]
    y: tuple[float, ...]
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        lengths = {len(self.x), len(self.y), len(self.low) or len(self.y), len(self.high) or len(self.y)}
        if len(lengths) > 1:
            raise ModelError("lengths of a series", where=self.name, expected="all alike", got=sorted(lengths))


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """Series over one axis.

    kind : "lines" or "bars"
    x_title, y_title : of the axes, with units
    logarithmic : names of the axes ("x", "y") that are
    note : what a reader should see in it
    """

    title: str
    kind: Kind
    x_title: str
    y_title: str
    series: tuple[Series, ...]
    logarithmic: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chapter:
    """One step of a study's story.

    text : paragraphs
    """

    title: str
    text: tuple[str, ...]
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyResult:
    """What a study found.

    name : of the study
    title : of its page
    summary : the answer in a few sentences, with its numbers
    settings : what it was run with
    failures : what could not be done, a line each; the result is that of the rest
    """

    name: str
    title: str
    summary: str
    chapters: tuple[Chapter, ...]
    settings: dict[str, Any]
    failures: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; numbers that are not finite become None."""
        plain: dict[str, Any] = without_infinities(asdict(self))
        return plain


class Study(ABC):
    """Settings of a study that one command runs.

    Subclasses are frozen settings objects; `key` names them on the command line, `title` heads their page. `takes` are
    the settings that the command line may give, `needs` those of them without which there is no study.
    """

    __slots__ = ()
    key: ClassVar[str]
    title: ClassVar[str]
    takes: ClassVar[tuple[str, ...]] = ("seeds",)
    needs: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return what the study finds, its independent parts done by the workers; `tell` hears how far it is."""


def require_arms(study: str, seeds: int) -> None:
    """Refuse a study of no arms.

    Raises
    ------
    ModelError
        names the study.
    """
    if seeds < 1:
        raise ModelError("arms of the study", where=study, expected="1 seed or more", got=seeds)
