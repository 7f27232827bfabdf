"""The page about a motion: trajectories between limits, singular values, how well each parameter is seen."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hostile_names import HOSTILE_JOINT

from sample_arms import planar_truth
from tauhat.dynamics import torque_model
from tauhat.dynamics.motion import Motion
from tauhat.errors import ExcitationError
from tauhat.excitation import FourierSeries, SampledMotion, information, motion_limits, random_fourier
from tauhat.report import write_motion_report, write_report
from tauhat.report.motion_case import MotionCase, motion_case
from tauhat.robots import Robot


@pytest.fixture(scope="module")
def arm() -> Robot:
    return planar_truth().model.robot


@pytest.fixture(scope="module")
def series(arm: Robot) -> FourierSeries:
    return random_fourier(arm, period=8.0, harmonics=4, rng=np.random.default_rng(3))


@pytest.fixture(scope="module")
def case(arm: Robot, series: FourierSeries) -> MotionCase:
    return motion_case(arm, series, counted=information(torque_model(arm, "inertia,viscous,coulomb")))


def test_singular_values_and_deviations_are_those_of_the_stacked_scaled_regressor(arm, series, case):
    facts = information(torque_model(arm, "inertia,viscous,coulomb"))
    samples = series.sample(np.arange(2000) * (8.0 / 2000))
    motion = Motion(q=samples.q.T.copy(), dq=samples.dq.T.copy(), ddq=samples.ddq.T.copy())
    rows, _ = facts.model.columns(motion, facts.layout)
    stacked = np.zeros((2, 2000, facts.model.n_p))
    for joint in range(2):
        part = facts.layout.of_joint(joint)
        stacked[joint][:, facts.layout.parameters[part]] = rows[part].T
    scaled = stacked.reshape(-1, facts.model.n_p)[:, facts.columns] / facts.scales / np.sqrt(2000)
    assert np.allclose(case.singular, np.linalg.svd(scaled, compute_uv=False))
    assert np.allclose(case.deviations, np.linalg.norm(np.linalg.pinv(scaled), axis=1))


def test_used_parts_touch_a_limit_less_the_margin_and_no_more(case):
    used = case.used()
    assert used.shape == (2, 3)
    assert 0.9 < used.max() <= 0.95 + 1e-12


def test_the_page_holds_a_drawing_a_joint_between_its_limits(tmp_path: Path, arm, series):
    margins = {"position": 0.2, "table <b>": 0.1}
    text = write_motion_report(tmp_path / "m.html", arm, series, margins=margins).read_text(encoding="utf-8")
    data = dict(re.findall(r'id="data-([a-z0-9-]+)">(.*?)</script>', text, re.DOTALL))
    assert set(data) == {"joint-0", "joint-1", "seen", "spectrum"}
    lines = [shape["y0"] for shape in json.loads(data["joint-1"])["layout"]["shapes"]]
    limits = motion_limits(arm)
    assert lines[:4] == [limits.lower[1], limits.upper[1], -limits.velocity[1], limits.velocity[1]]
    assert "table &lt;b&gt;" in text
    assert "table <b>" not in text


def test_the_page_says_that_a_motion_comes_to_rest_only_where_it_does(tmp_path: Path, arm, series):
    whole = write_motion_report(tmp_path / "m.html", arm, series).read_text(encoding="utf-8")
    assert "starts and ends at rest, and may be repeated" in whole
    t = np.linspace(0.0, 5.0, 200)  # of a period of eight seconds
    cut = SampledMotion(samples=series.sample(t))
    text = write_motion_report(tmp_path / "m.html", arm, cut).read_text(encoding="utf-8")
    assert "may be repeated" not in text
    assert "does not start and end at rest" in text


def test_a_report_on_an_estimate_takes_the_motion_in(tmp_path: Path, verified):
    estimate, verification = verified
    motion = random_fourier(estimate.robot, period=6.0, harmonics=3, rng=np.random.default_rng(0))
    plain = write_report(tmp_path / "r.html", estimate, verification=verification).read_text(encoding="utf-8")
    text = write_report(tmp_path / "m.html", estimate, verification=verification, motion=motion).read_text(
        encoding="utf-8"
    )
    keys = re.findall(r'id="data-([a-z0-9-]+)"', text)
    assert len(keys) == len(set(keys))
    assert set(keys) - set(re.findall(r'id="data-([a-z0-9-]+)"', plain)) == {"joint-0", "joint-1", "seen", "spectrum"}
    assert f"shows {estimate.base.n_b} parameters" in text
    assert HOSTILE_JOINT not in text


def test_hostile_joint_names_stay_text(tmp_path: Path, verified):
    robot = verified[0].robot
    series = random_fourier(robot, period=6.0, harmonics=3, rng=np.random.default_rng(0))
    text = write_motion_report(tmp_path / "m.html", robot, series).read_text(encoding="utf-8")
    assert HOSTILE_JOINT not in text


def test_a_motion_that_leaves_a_parameter_out_is_refused(tmp_path: Path, arm):
    free = np.zeros((2, 4))
    free[0, 0] = 0.3
    still = FourierSeries.from_free(free, offset=np.zeros(2), period=4.0)
    with pytest.raises(ExcitationError, match="without excitation"):
        write_motion_report(tmp_path / "m.html", arm, still)
    assert not list(tmp_path.iterdir())
