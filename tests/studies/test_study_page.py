"""The page of a study: complete, inert, and every table, line, band and bar on it."""

from __future__ import annotations

import base64
import json
import math
import re
from dataclasses import replace
from html import unescape
from typing import Any

import numpy as np
import pytest

from tauhat.report import write_study
from tauhat.report.study_figures import study_plot
from tauhat.studies.study import Chapter, Chart, Series, StudyResult, Table

HOSTILE = "<script>alert(1)</script>"
LINES = Chart(
    title="Lines & bands",
    kind="lines",
    x_title="s",
    y_title="%",
    series=(
        Series(name="banded", x=(1, 10, 100), y=(3.0, 2.0, 1.0), low=(2.0, 1.0, 0.5), high=(4.0, 3.0, 2.0)),
        Series(name=HOSTILE, x=(1, 10, 100), y=(1.0, float("nan"), -2.0)),
    ),
    logarithmic=("x", "y"),
    note="look here",
)
POINTS = Chart(
    title="Points",
    kind="lines",
    x_title="name",
    y_title="Nm",
    series=(Series(name="a", x=("p", "q"), y=(1.0, -2.0), low=(0.0, -5.0), high=(1.5, -1.0)),),
)
BARS = Chart(
    title="Bars",
    kind="bars",
    x_title="name",
    y_title="%",
    series=(
        Series(name="one", x=("p", "q"), y=(1.0, 2.0), low=(0.5, 1.5), high=(2.0, 2.5)),
        Series(name="two", x=("p", "q"), y=(3.0, 4.0)),
    ),
)
SHORT = Table(
    title="Short [kg m^2]",
    header=("name", "count", "value"),
    rows=((HOSTILE, 12345, 0.123456), ("b", 2, float("inf"))),
    note="a note",
)
LONG = Table(title="Long", header=("k",), rows=tuple((k,) for k in range(40)))
RESULT = StudyResult(
    name="made-up",
    title=f"A study of {HOSTILE}",
    summary="It is 4.2 % in short.",
    chapters=(
        Chapter(title="First", text=("One paragraph.", "Another."), tables=(SHORT, LONG), charts=(LINES, POINTS)),
        Chapter(title="Second", text=("The end.",), charts=(BARS,)),
    ),
    settings={"seeds": 3, "inner": {"noise": (0.1, 0.2)}},
)


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = write_study(tmp_path_factory.mktemp("study") / "page.html", RESULT)
    return path.read_text(encoding="utf-8")


def shown(html: str) -> str:
    """Return the document up to the drawings' data."""
    return html.partition('<script type="application/json"')[0]


def figure(chart: Chart) -> dict[str, Any]:
    return json.loads(study_plot(chart, key="k").json)


def values(part: Any) -> list[float | None]:
    """Return an array of Plotly's JSON, plain or in base64, nan as None."""
    if isinstance(part, dict):
        part = np.frombuffer(base64.b64decode(part["bdata"]), dtype=part["dtype"]).tolist()
    return [None if item is None or math.isnan(item) else item for item in part]


def test_summary_text_and_settings_are_on_the_page(html: str) -> None:
    text = shown(html)
    for words in (RESULT.summary, "One paragraph.", "Another.", "The end.", "a note", "look here"):
        assert words in text
    assert "<dt><code>seeds</code></dt><dd>3</dd>" in text
    assert "<dt><code>inner.noise</code></dt><dd>0.1, 0.2</dd>" in text


def test_cells_have_three_digits_and_whole_numbers_stay_whole(html: str) -> None:
    cells = re.findall(r"<td(?: class=\"number\")?>([^<]*)</td>", shown(html))
    assert cells[:6] == [HOSTILE.replace("<", "&lt;").replace(">", "&gt;"), "12345", "0.123", "b", "2", "–"]
    assert "Short [kg m²]" in shown(html)


def test_a_long_table_is_folded_and_a_short_one_is_not(html: str) -> None:
    assert "<summary>Long (40 rows)</summary>" in shown(html)
    assert "<h3>Short" in shown(html)


def test_names_are_text_and_nothing_is_loaded_from_elsewhere(html: str) -> None:
    assert HOSTILE not in shown(html)
    assert HOSTILE in unescape(shown(html))
    assert not re.search(r"(?:src|href)=\"(?!#)", shown(html))


def test_every_drawing_has_its_data(html: str) -> None:
    places = re.findall(r'data-source="(data-[a-z0-9-]+)"', html)
    assert places == ["data-chart-0-0", "data-chart-0-1", "data-chart-1-0"]
    assert all(f'id="{place}"' in html for place in places)


def test_a_line_with_an_interval_has_a_band_around_it() -> None:
    band, line, second = figure(LINES)["data"]
    assert values(band["x"]) == [1, 10, 100, 100, 10, 1]
    assert values(band["y"]) == [4, 3, 2, 0.5, 1, 2]
    assert band["fill"] == "toself"
    assert values(line["y"]) == [3, 2, 1]
    assert second["name"] == "&lt;script&gt;alert(1)&lt;/script&gt;"


@pytest.mark.parametrize(
    ("values", "marks"),
    [
        ((0.2, 30.0), ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50", "100", "200", "500"]),
        ((3.0, -1.0), ["1", "2", "5", "10", "20", "50"]),
        ((1e-6, 1.0), ["1e-06", "1e-05", "0.0001", "0.001", "0.01", "0.1", "1"]),
        ((1e-20, 1e5), ["1e-20", "1e-18", "1e-16"]),
        ((0.0, -1.0), ["1", "2", "5"]),
    ],
)
def test_a_logarithmic_axis_writes_whole_numbers(values: tuple[float, float], marks: list[str]) -> None:
    series = (Series(name="one", x=("p", "q"), y=values),)
    chart = replace(BARS, series=series, logarithmic=("y",))
    axis = json.loads(study_plot(chart, key="k").json)["layout"]["yaxis"]
    assert axis["ticktext"][: len(marks)] == marks
    assert [float(text) for text in axis["ticktext"]] == pytest.approx(axis["tickvals"])
    assert len(axis["ticktext"]) <= 13


def test_what_cannot_stand_on_a_logarithmic_axis_is_left_out() -> None:
    drawn = figure(LINES)
    assert drawn["layout"]["xaxis"]["type"] == drawn["layout"]["yaxis"]["type"] == "log"
    assert values(drawn["data"][2]["y"]) == [1.0, None, None]
    assert values(figure(POINTS)["data"][0]["y"]) == [1.0, -2.0]
    assert "type" not in figure(POINTS)["layout"]["yaxis"]


@pytest.mark.parametrize(
    ("chart", "above", "below"), [(POINTS, [0.5, 1.0], [1.0, 3.0]), (BARS, [1.0, 0.5], [0.5, 0.5])]
)
def test_values_over_names_have_error_bars(chart: Chart, above: list[float], below: list[float]) -> None:
    trace = figure(chart)["data"][0]
    assert trace["type"] == ("bar" if chart.kind == "bars" else "scatter")
    assert list(trace["x"]) == ["p", "q"]
    assert values(trace["error_y"]["array"]) == above
    assert values(trace["error_y"]["arrayminus"]) == below


def test_a_series_without_interval_has_no_error_bars() -> None:
    assert "error_y" not in figure(BARS)["data"][1]
