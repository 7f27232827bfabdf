"""`tauhat study`: what there is, one of them run, its tables and its page."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from cli_workshop import Tauhat
from rich.console import Console

from tauhat.cli.views.study import study_view
from tauhat.report.study_page import shown_table
from tauhat.studies import registry
from tauhat.studies.crs_a465 import CrsA465Study
from tauhat.studies.study import Chapter, Study, StudyResult, Table
from tauhat.workers import LocalWorkers, Workers

WORDS = ("study", "crs-a465", "--seeds", "2", "--workers", "1")


class Asked(list[tuple[int | None, Workers]]):
    """Seeds and workers that a study was run with."""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    """Put a study in the place of the real one that only notes what it was asked."""
    heard = Asked()

    class Noting(Study):
        key = "crs-a465"
        title = "Noted"

        def __init__(self, seeds: int | None = None) -> None:
            self.seeds = seeds

        def run(self, workers: Workers, *, tell: Callable[[str], None] = print) -> StudyResult:
            tell("half")
            heard.append((self.seeds, workers))
            long = Table(title="Long", header=("k",), rows=tuple((k,) for k in range(31)))
            short = Table(title="Short", header=("method", "error [%]"), rows=(("ols", 0.123456),), note="noted")
            chapters = (
                Chapter(title="Tables", text=("hidden",), tables=(short, long)),
                Chapter(title="End", text=("so",)),
            )
            return StudyResult(name=self.key, title=self.title, summary="In short.", chapters=chapters, settings={})

    monkeypatch.setitem(registry.STUDIES, "crs-a465", Noting)
    return heard


def test_without_a_name_the_studies_are_listed(tauhat: Tauhat) -> None:
    said = json.loads(tauhat("study", "--json").stdout)
    assert {"name": "crs-a465", "title": CrsA465Study.title} in said["studies"]
    assert CrsA465Study.title in tauhat("study").stdout


def test_a_study_runs_and_leaves_json_and_a_page(tauhat: Tauhat, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    result = tauhat(*WORDS, "-o", page, "--json")
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    assert (said["name"], said["page"], said["settings"]["seeds"]) == ("crs-a465", str(page), 2)
    assert said["seconds"] > 0.0
    assert said["summary"] in page.read_text(encoding="utf-8")
    assert "2 of 2 arms" in result.stderr


def test_seeds_and_workers_reach_the_study(tauhat: Tauhat, asked: Asked) -> None:
    assert tauhat(*WORDS).exit_code == 0
    assert tauhat("study", "crs-a465").exit_code == 0
    assert asked == [(2, LocalWorkers(count=1)), (None, LocalWorkers())]


def test_the_terminal_shows_the_summary_and_the_tables(tauhat: Tauhat, asked: Asked) -> None:
    result = tauhat(*WORDS)
    shown = result.stdout
    assert "crs-a465: half" in result.stderr
    assert "In short." in shown
    assert "0.123" in shown
    assert "noted" in shown
    assert "Long: 31 rows, on the page" in shown
    assert "hidden" not in shown
    assert "so\n" in shown


def test_an_unknown_study_is_refused_with_the_known_ones(tauhat: Tauhat) -> None:
    result = tauhat("study", "nothing")
    assert result.exit_code == 1
    assert "unknown study" in result.stderr
    assert "crs-a465" in result.stderr


def test_a_study_that_could_not_do_all_shows_the_rest_and_leaves_with_status_one(
    tauhat: Tauhat, asked: Asked, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    whole = registry.STUDIES["crs-a465"].run
    monkeypatch.setattr(
        registry.STUDIES["crs-a465"],
        "run",
        lambda *given, **kept: replace(whole(*given, **kept), failures=("No end.",)),
    )
    page = tmp_path / "page.html"
    result = tauhat(*WORDS, "--json", "-o", page)
    assert asked
    assert result.exit_code == 1
    said = json.loads(result.stdout)
    assert said["failures"] == ["No end."]
    assert said["chapters"][1]["text"] == ["so"]
    assert "error: No end." in result.stderr
    assert "noted" in page.read_text(encoding="utf-8")


WIDE = Table(
    title="Errors of everything",
    header=("", "cause of the error", *(f"share number {column} [%]" for column in range(14)), "what to do about it"),
    rows=tuple(
        (
            row,
            f"cause {row} of many that are not short",
            *(row + column / 7.0 for column in range(14)),
            "leave [it] alone",
        )
        for row in range(3)
    ),
)


@pytest.mark.parametrize("width", [40, 60, 80, 120, 400])
def test_a_table_loses_no_cell_and_no_head_in_a_narrow_terminal(width: int) -> None:
    told = StudyResult(
        name="wide", title="Wide", summary="-", settings={}, chapters=(Chapter(title="All", text=(), tables=(WIDE,)),)
    )
    console = Console(width=width, file=StringIO(), highlight=False)
    for part in study_view(told):
        console.print(part)
    text = console.file.getvalue()
    assert max(map(len, text.splitlines())) <= width
    words = Counter(text.split())
    shown = shown_table(WIDE)
    wanted = Counter(word for row in (shown.header, *shown.rows) for cell in row for word in cell.text.split())
    assert not wanted - words
    assert ("continued" in text) == (width < 200)


def test_numbers_that_are_rounding_beside_others_of_their_column_are_zero() -> None:
    table = Table(title="t", header=("joint", "a", "b"), rows=(("one", -6.94e-18, 3e-18), ("two", 0.128, 2e-18)))
    assert [[cell.text for cell in row] for row in shown_table(table).rows] == [
        ["one", "0", "3e-18"],
        ["two", "0.128", "2e-18"],
    ]
