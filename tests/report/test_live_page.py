"""What the live page draws and says: ellipsoids hold 95 %, scales do not flicker, contacts have a begin and an end."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.stats import chi2, norm

from tauhat.report.arm_scene import outward
from tauhat.report.contact_log import ContactLog
from tauhat.report.force_marks import (
    SURE_IN_SPACE,
    SURE_ON_LINE,
    direction_text,
    error_ellipsoid,
    full_scale,
)
from tauhat.report.live_panel import contacts_html, counts_html, joints_html, size_of_force, status_html, wrench_html
from tauhat.report.live_plots import SPAN, History, force_columns, torque_columns
from tauhat.sensing.touch import Touch

COVARIANCE = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -2.0], [0.5, -2.0, 16.0]])


def test_the_factors_are_those_of_95_percent():
    assert pytest.approx(np.sqrt(chi2.ppf(0.95, 3)), rel=1e-4) == SURE_IN_SPACE
    assert pytest.approx(norm.ppf(0.975), rel=1e-5) == SURE_ON_LINE


def test_the_ellipsoid_holds_95_percent_of_normal_errors():
    found = error_ellipsoid(COVARIANCE, largest=np.inf)
    errors = np.random.default_rng(3).multivariate_normal(np.zeros(3), COVARIANCE, size=40_000)
    inside = (((errors @ found.axes) / found.half) ** 2).sum(axis=1) < 1.0
    assert inside.mean() == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / 40_000))
    assert np.allclose(found.axes @ np.diag((found.half / SURE_IN_SPACE) ** 2) @ found.axes.T, COVARIANCE)
    assert np.linalg.det(found.axes) == pytest.approx(1.0)
    assert len(found.cut) == 0


def test_a_hidden_direction_is_cut_off_and_named():
    found = error_ellipsoid(np.diag([1.0, 9e4, 0.0]), largest=50.0)
    assert found.widest == pytest.approx(300.0 * SURE_IN_SPACE)
    assert found.drawn.max() == 50.0
    assert found.drawn.min() > 0.0  # a direction without error is drawn flat, not turned inside out
    assert [direction_text(one) for one in found.cut] == ["y"]


def test_directions_beside_the_axes_are_told_in_numbers():
    assert direction_text(np.array([0.0, -1.0, 0.0])) == "y"
    assert direction_text(np.array([-0.6, 0.0, -0.8])) == "(+0.6, +0.0, +0.8)"
    assert direction_text(np.array([0.706, 0.706, -0.04])) == "(+0.7, +0.7, +0.0)"


def test_a_figure_of_one_direction_has_the_error_bar_of_one_direction():
    covariance = np.diag([1.0, 9.0, 4.0])
    found = error_ellipsoid(covariance, largest=np.inf)
    wrench = np.array([0.0, 5.0, 0.0, 0.0, 0.0, 0.0])
    assert direction_text(found.axes[:, -1]) == "y"
    assert found.bar == pytest.approx(size_of_force(wrench, np.diag([1.0, 9.0, 4.0, 1.0, 1.0, 1.0]))[1])
    assert found.bar == pytest.approx(norm.ppf(0.975) * 3.0, rel=1e-5)


def test_one_is_counted_in_the_singular():
    told = counts_html({"taken": 1, "restarts": 1, "dropped": 2, "late": 1})
    for words in ("1 sample taken", "1 restart<", "2 answers dropped", "1 late"):
        assert words in told
    assert "12 345 samples taken" in counts_html({"taken": 12345})


@given(value=st.floats(1e-3, 1e6), current=st.floats(0.0, 1e6))
def test_a_scale_holds_its_value_and_wastes_little(value: float, current: float):
    scale = full_scale(value, least=1.0, current=current)
    assert scale >= max(value, 1.0) * (1.0 - 1e-9)
    assert scale <= max(value, 1.0) / 0.35 * (1.0 + 1e-9)
    assert full_scale(value, least=1.0, current=scale) == scale


def test_a_value_at_a_step_does_not_make_its_scale_flicker():
    scale, seen = 0.0, []
    for value in (1.9, 2.1, 1.9, 2.1, 1.9, 1.0):
        scale = full_scale(value, least=1.0, current=scale)
        seen.append(scale)
    assert seen == [2.0, 5.0, 5.0, 5.0, 5.0, 1.0]


def test_a_contact_is_one_row_whatever_its_link_and_ends_with_its_stream():
    log = ContactLog()
    first = Touch(1, "a", 0.1, 0.1, 2.0, open=True)
    over = first._replace(link="c", end=0.4, peak=5.0, open=False)
    second, third = Touch(2, "b", 0.5, 0.6, 3.0, open=True), Touch(4, "b", 0.8, 0.9, 3.0, open=True)
    for newest in (first, first._replace(link="c", end=0.3, peak=5.0), over, over):
        log.see(newest)
    assert log.contacts == (over,)
    log.see(second)
    log.see(third)  # the second's end was not shown, nor anything of the third
    assert log.contacts == (third, second._replace(open=False), over)
    log.end()
    assert log.contacts[0] == third._replace(open=False)
    for number in range(5, 200):
        log.see(third._replace(number=number))
    assert len(log.contacts) == 50


def test_the_history_spans_its_seconds_and_is_bounded():
    history = History(2)
    assert history.table.shape == (9, 2)
    for k in range(3000):
        history.add(k / 100, np.array([k / 100, 0.0, 0.0]), np.ones(3), np.array([1.0, -1.0]))
    table = history.table
    assert table[0, -1] == 0.0
    assert -SPAN <= table[0, 0] < -SPAN + 0.2
    assert np.allclose(np.diff(table[0]), 0.05, atol=0.011)
    assert np.allclose(table[1] - table[0], table[1, -1])
    middle, high, low = force_columns(table)[1:4]
    assert np.allclose(high - middle, SURE_ON_LINE)
    assert np.allclose(middle - low, SURE_ON_LINE)
    assert [column[0] for column in torque_columns(table)[1:]] == [1.0, -1.0]
    assert history.largest_force() == table[1].max()


def test_a_stream_that_begins_anew_forgets_its_history():
    history = History(1)
    for t in (10.0, 11.0, 0.5):
        history.add(t, np.array([t, 0.0, 0.0]), np.zeros(3), np.zeros(1))
    assert history.largest_force() == 0.5


def test_the_size_of_a_force_has_the_error_along_it():
    wrench, covariance = np.array([0.0, 3.0, 4.0, 0.0, 0.0, 0.0]), np.zeros((6, 6))
    covariance[:3, :3] = COVARIANCE
    along = np.array([0.0, 0.6, 0.8])
    assert size_of_force(wrench, covariance) == pytest.approx((5.0, 1.95996 * np.sqrt(along @ COVARIANCE @ along)))
    _, bar = size_of_force(np.zeros(6), covariance)
    assert bar == pytest.approx(1.95996 * np.sqrt(np.linalg.eigvalsh(COVARIANCE)[-1]))


def test_forces_are_told_with_units_and_error_bars():
    told = wrench_html(
        np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3]), np.diag([1.0, 4.0, 9e6, 0.01, 0.01, 0.01]), axes="frame"
    )
    for words in (
        "axes of the frame",
        "force [N]",
        "moment [Nm]",
        "+1.0 ± 2.0",
        "−2.0 ± 3.9",
        "+3.0 ± 5880",
        "−0.30 ± 0.20",
    ):
        assert words in told
    assert "−0.0 " not in wrench_html(np.full(6, -1e-3), np.eye(6), axes="frame")


@pytest.mark.parametrize("name", ["<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "a" * 500])
def test_names_from_outside_stay_text_and_short(name):
    for told in (
        contacts_html([Touch(1, name, 0.0, 0.0, 1.0, open=True)]),
        joints_html([name], np.ones(1), np.ones(1)),
        status_html("live", "live", name),
    ):
        assert name not in told
        assert "<script" not in told
        assert "<img" not in told


def test_the_faces_of_a_hull_show_their_outside():
    corners = np.random.default_rng(5).normal(size=(30, 3)) + 7.0
    faces = outward(corners, ConvexHull(corners).simplices)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    volume = float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)  # the divergence theorem
    assert volume == pytest.approx(ConvexHull(corners).volume)
