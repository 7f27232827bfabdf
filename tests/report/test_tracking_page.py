"""The page of the model in motion: every figure in its table, hostile names as text, failures told."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tauhat.errors import ModelError
from tauhat.report.sections.tracking import best_of_each, forward, tracking
from tauhat.report.tracking_page import write_tracking_report
from tauhat.verification.motion_forward import ForwardMotion, ForwardRun
from tauhat.verification.motion_tracking import TrackingComparison, TrackingRun

NAMES = ("first", "<b>second</b>")
T = np.linspace(0.0, 2.0, 201)
MOTION = np.column_stack([np.sin(T), np.cos(T)])


def tracked(name, knows, size, failure=""):
    error = size * np.column_stack([np.sin(9 * T), np.sin(7 * T)])
    rms = np.sqrt(np.mean(error**2, axis=0))
    return TrackingRun(
        name=name, knows=knows, rms=rms, worst=np.abs(error).max(axis=0), effort=rms, error=error, failure=failure
    )


COMPARISON = TrackingComparison(
    robot="arm",
    bandwidth=5.0,
    names=NAMES,
    units=("rad", "m"),
    t=T,
    reference=MOTION,
    runs=(
        tracked("PD", "none", 1e-2),
        tracked("worse", "nominal", 9e-3),
        tracked("better", "nominal", 2e-3),
        tracked("identified", "identified", 1e-4),
        tracked("<i>wild</i>", "identified", np.nan, failure="the robot went <unstable>"),
    ),
)


def redone(model, way, size, failure=""):
    off = np.full(2, size)
    return ForwardRun(model=model, way=way, rms=off, worst=off, torque_rms=3 * off, q=MOTION + off, failure=failure)


FORWARD = ForwardMotion(
    log="<log>",
    known=False,
    tether=1.0,
    names=NAMES,
    units=("rad", "m"),
    t=T,
    q=MOTION,
    runs=(
        redone("identified", "followed", 1e-4),
        redone("identified", "driven", 2e-4),
        redone("nominal", "driven", np.nan, failure="no robot <moves>"),
    ),
)


def test_the_table_has_every_controller_with_its_error_or_its_failure():
    html = " ".join(str(tracking(COMPARISON).html).split())
    assert html.count('<th scope="row">') == 5
    assert f'<td class="number">{1e3 * COMPARISON.run("better").rms[0]:.3g}</td>' in html
    assert "the robot went &lt;unstable&gt;" in html
    assert "<b>second</b>" not in html
    assert "[mrad]" in html
    assert "[mm]" in html


def test_trajectories_are_those_of_the_best_controller_of_each_knowledge():
    assert [run.name for run in best_of_each(COMPARISON)] == ["PD", "better", "identified"]
    section = tracking(COMPARISON)
    drawn = json.loads(section.plots[1].json)["data"]
    assert [trace["name"] for trace in drawn] == ["reference", *2 * ["PD", "better", "identified"]]
    assert len(section.plots) == 3


def test_bars_leave_out_what_failed_and_use_a_logarithmic_axis():
    bars = json.loads(tracking(COMPARISON).plots[0].json)
    assert [trace["name"] for trace in bars["data"]] == ["PD", "worse", "better", "identified"]
    axis = bars["layout"]["yaxis"]
    assert axis["type"] == "log"
    assert axis["ticktext"] == [f"{mark:g}" for mark in axis["tickvals"]]


def test_a_recording_done_again_shows_both_ways_and_what_could_not_be_simulated():
    section = forward(FORWARD)
    html = " ".join(str(section.html).split())
    assert "&lt;log&gt;" in html
    assert "a law tuned to each simulated robot" in html
    assert "own law and reference" in str(forward(replace(FORWARD, known=True)).html)
    assert "no robot &lt;moves&gt;" in html
    assert "0.2<br><small>torque 0.0006 Nm</small>" in html
    drawn = json.loads(section.plots[0].json)["data"]
    assert [trace["name"] for trace in drawn] == ["measured", "identified", "identified"]


def test_the_page_is_one_file_with_both_chapters_and_something_to_show(tmp_path):
    path = write_tracking_report(tmp_path / "page.html", tracking=COMPARISON, forward=FORWARD)
    text = path.read_text(encoding="utf-8")
    assert text.index('id="tracking"') < text.index('id="forward"')
    assert "http-equiv" in text
    with pytest.raises(ModelError, match="nothing to show"):
        write_tracking_report(tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()
