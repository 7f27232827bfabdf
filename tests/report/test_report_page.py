"""The file: complete, inert, honest about what is missing."""

from __future__ import annotations

import base64
import json
import re
import sys
from dataclasses import dataclass, field, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hostile_names import HOSTILE_JOINT, HOSTILE_LOG
from hypothesis import given
from hypothesis import strategies as st

from tauhat.errors import MissingExtraError, OutputError
from tauhat.estimation import Estimate
from tauhat.recordings.findings import Finding
from tauhat.report import write_report
from tauhat.report.rendering import script_json
from tauhat.verification import LogPrediction, Verification


@dataclass
class Page(HTMLParser):
    """What a browser would see: elements, text outside scripts, and the data of the drawings."""

    tags: list[str] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    text: str = ""
    data: dict[str, str] = field(default_factory=dict)
    _script: str | None = None

    def __post_init__(self) -> None:
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        facts = dict(attrs)
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in {"src", "href", "action", "srcset", "onerror"}]
        if tag in {"script", "style"}:
            self._script = facts.get("id") or tag

    def handle_endtag(self, tag: str) -> None:
        if tag in {"script", "style"}:
            self._script = None

    def handle_data(self, data: str) -> None:
        if self._script is None:
            self.text += data
        elif self._script.startswith("data-"):
            self.data[self._script] = self.data.get(self._script, "") + data


def parsed(path: Path) -> Page:
    page = Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, verified: tuple[Estimate, Verification]) -> Page:
    estimate, verification = verified
    return parsed(write_report(tmp_path_factory.mktemp("page") / "r.html", estimate, verification=verification))


def decoded(array: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype=np.dtype(array["dtype"]))


def test_the_page_loads_nothing_from_elsewhere(page: Page) -> None:
    assert {"link", "iframe", "object", "base", "img"}.isdisjoint(page.tags)
    assert page.links
    assert all(link.startswith("#") for link in page.links)


def test_hostile_names_are_shown_as_text_and_make_no_element(page: Page) -> None:
    assert {"i", "img"}.isdisjoint(page.tags)
    assert page.tags.count("script") == len(page.data) + 2
    assert HOSTILE_JOINT in page.text
    assert HOSTILE_LOG in page.text
    assert "<i>arm</i>: identified torque model" in page.text


@given(st.text())
def test_data_cannot_end_its_script_element_and_reads_back_the_same(text: str) -> None:
    written = script_json(json.dumps([text, "</script><!--&"], ensure_ascii=False))
    assert not set("<>&\u2028\u2029") & set(written)
    assert json.loads(written) == [text, "</script><!--&"]


def test_every_drawing_has_its_data_and_escapes_names(page: Page) -> None:
    figures = {key: json.loads(text) for key, text in page.data.items()}
    assert set(figures) == {
        *(f"data-torque-{log}-{joint}" for log in (0, 1) for joint in (0, 1)),
        *(f"data-speed-{log}-{joint}" for log in (0, 1) for joint in (0, 1)),
        "data-time-0", "data-time-1", "data-parameters",
    }  # fmt: skip
    names = [trace["name"] for trace in figures["data-time-0"]["data"]]
    assert names[0] == "j1"
    assert "<" not in names[1]
    assert "elbow&lt;script&gt;" in names[1]


def test_drawings_carry_the_measured_torque_with_its_peaks(page: Page, verification: Verification) -> None:
    log = verification.logs[1]
    measured, predicted, residual = json.loads(page.data["data-torque-1-0"])["data"]
    np.testing.assert_allclose(decoded(measured["y"]), log.tau[:, 0], rtol=1e-6)
    np.testing.assert_allclose(decoded(measured["x"]), log.t, rtol=1e-6)
    assert np.abs(decoded(predicted["y"])).max() == pytest.approx(np.abs(log.predicted[:, 0]).max(), rel=1e-6)
    assert np.abs(decoded(residual["y"])).max() == pytest.approx(log.joints[0].worst, rel=1e-6)


def _stretched(log: LogPrediction, n: int, start: float) -> LogPrediction:
    rows = np.arange(n) % log.t.size
    tau = log.tau[rows].copy()
    tau[12345, 0] = 1e3
    return replace(log, t=start + 0.01 * np.arange(n), tau=tau, predicted=log.predicted[rows], dq=log.dq[rows])


def test_a_long_log_is_thinned_without_hiding_its_peak_and_says_so(
    tmp_path: Path, estimate: Estimate, verification: Verification
) -> None:
    long = replace(verification, logs=(_stretched(verification.logs[1], 200_000, 0.0),))
    path = write_report(tmp_path / "r.html", estimate, verification=long)
    page = parsed(path)
    for trace in json.loads(page.data["data-torque-0-0"])["data"]:
        assert decoded(trace["y"]).size <= 4000
    assert decoded(json.loads(page.data["data-torque-0-0"])["data"][0]["y"]).max() == pytest.approx(1e3)
    assert "200000 rows, drawn with at most 4000 points a line" in page.text
    assert path.stat().st_size < 6e6


def test_wall_clock_times_are_shown_from_their_start_to_the_millisecond(
    tmp_path: Path, estimate: Estimate, verification: Verification
) -> None:
    late = replace(verification, logs=(_stretched(verification.logs[1], 20_000, 1.7e9),))
    figure = json.loads(parsed(write_report(tmp_path / "r.html", estimate, verification=late)).data["data-torque-0-0"])
    assert decoded(figure["data"][0]["x"])[-1] == pytest.approx(199.99, abs=1e-3)
    assert figure["layout"]["xaxis2"]["title"]["text"] == "time − 1700000000 s [s]"


def test_axes_name_quantity_and_unit(page: Page) -> None:
    layout = json.loads(page.data["data-torque-0-0"])["layout"]
    assert layout["yaxis"]["title"]["text"] == "torque [Nm]"
    assert layout["yaxis2"]["title"]["text"] == "residual [Nm]"
    assert layout["xaxis2"]["title"]["text"] == "time [s]"
    assert layout["xaxis"]["matches"] == "x2"
    assert json.loads(page.data["data-speed-0-0"])["layout"]["xaxis"]["title"]["text"] == "velocity [rad/s]"


def test_every_parameter_is_there_with_its_formula_and_unit(page: Page, estimate: Estimate) -> None:
    for row in estimate.summary():
        assert row.formula in page.text
    assert "kg m²" in page.text
    assert f"rank {estimate.base.n_b} of {estimate.base.n_b}" in page.text


def test_inputs_are_named_with_hash_and_rows(tmp_path: Path, estimate: Estimate) -> None:
    log = replace(estimate.inputs[0], sha256="ab12" * 16, rows=(3, 777))
    text = parsed(write_report(tmp_path / "r.html", replace(estimate, inputs=(log,)))).text
    assert "ab12ab12ab12ab12…" in text
    assert "3 … 777" in text
    assert "8 Hz, zero phase" in text


def test_without_verification_the_report_says_that_nothing_is_proven(tmp_path: Path, estimate: Estimate) -> None:
    path = write_report(tmp_path / "r.html", estimate, title="A & B")
    page = parsed(path)
    assert "Not verified yet" in page.text
    assert '<p class="headline unproven">' in path.read_text(encoding="utf-8")
    assert list(page.data) == ["data-parameters"]
    assert "A & B" in page.text


def test_unseen_and_fitted_logs_are_told_apart(
    page: Page, tmp_path: Path, verified: tuple[Estimate, Verification]
) -> None:
    estimate, verification = verified
    assert "on 2 recordings that were not used for the fit" in " ".join(page.text.split())
    seen = replace(verification, logs=(replace(verification.logs[1], input=estimate.inputs[0]),))
    text = parsed(write_report(tmp_path / "r.html", estimate, verification=seen)).text
    assert "but not proven" in text
    assert "rows also in the fit" in text


def test_the_first_unseen_log_is_the_one_unfolded(tmp_path: Path, verified: tuple[Estimate, Verification]) -> None:
    estimate, verification = verified
    seen = replace(verification.logs[1], input=estimate.inputs[0])
    both = replace(verification, logs=(seen, verification.logs[1]))
    html = write_report(tmp_path / "r.html", estimate, verification=both).read_text(encoding="utf-8")
    unfolded = re.findall(r'<details class="log" open>\s*<summary>(run \d)', html)
    assert unfolded == ["run 2", "run 2"]


def test_findings_are_listed_gravest_first_and_their_absence_is_not_taken_for_health(
    tmp_path: Path, estimate: Estimate
) -> None:
    findings = [
        Finding(code="clock", severity="ok", message="the clock is even"),
        Finding(code="a", severity="note", message="some <note>"),
        Finding(
            code="b", severity="error", joint="j1", message="torque is zero", number=0.0, advice="look at the cable"
        ),
    ]
    text = parsed(write_report(tmp_path / "a.html", estimate, findings=findings)).text
    assert text.index("torque is zero") < text.index("some <note>") < text.index("the clock is even")
    assert "look at the cable" in text
    assert "nothing doubtful" not in text
    assert "Of the logs that were verified on; tauhat check tells the same of those that were fitted" in text
    assert "found nothing doubtful" in parsed(write_report(tmp_path / "b.html", estimate, findings=findings[:1])).text
    assert "were not checked" in parsed(write_report(tmp_path / "c.html", estimate)).text


def test_findings_of_several_logs_stand_under_their_names(tmp_path: Path, estimate: Estimate) -> None:
    findings = {HOSTILE_LOG: (), "run 2": (Finding(code="a", severity="warning", message="it jitters"),)}
    text = parsed(write_report(tmp_path / "a.html", estimate, findings=findings)).text
    words = [HOSTILE_LOG, "found nothing doubtful", "run 2", "it jitters"]
    places = [text.index(word) for word in words]
    assert places == sorted(places)


def test_a_joint_without_torque_is_drawn_and_graded(
    tmp_path: Path, estimate: Estimate, verification: Verification
) -> None:
    log = verification.logs[1]
    tau = log.tau.copy()
    tau[:, 0] = 0.0
    silent = replace(log, tau=tau, joints=(replace(log.joints[0], relative_rms=float("inf")), log.joints[1]))
    page = parsed(write_report(tmp_path / "r.html", estimate, verification=replace(verification, logs=(silent,))))
    assert "–" in page.text
    assert "NaN" not in page.data["data-torque-0-0"]


@pytest.mark.parametrize("library", ["plotly", "jinja2"])
def test_a_missing_library_names_the_extra_that_brings_it(
    tmp_path: Path, estimate: Estimate, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=rf"{library} is not installed.*tauhat\[report\]"):
        write_report(tmp_path / "r.html", estimate)
    assert list(tmp_path.iterdir()) == []


def test_a_report_that_cannot_be_written_leaves_nothing(tmp_path: Path, estimate: Estimate) -> None:
    with pytest.raises(OutputError):
        write_report(tmp_path / "absent" / "r.html", estimate)
    assert list(tmp_path.iterdir()) == []
