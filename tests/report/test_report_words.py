"""Numbers, grades, intervals and advice: the words of the report."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t as student

from tauhat.estimation import Estimate
from tauhat.estimation.identify import DOUBTFUL_CONDITION
from tauhat.report.advice import next_steps, worst_joint
from tauhat.report.case import Case, pooled_relative_rms
from tauhat.report.formatting import number, percent, span, unit, value_and_half
from tauhat.report.grading import condition_grade, grade_of
from tauhat.report.uncertainty import relative_halves
from tauhat.verification import LogPrediction, Verification


@pytest.mark.parametrize(
    ("value", "half", "shown"),
    [
        (1.23456, 0.01234, ("1.235", "0.012")),
        (-12.3456, 1.9, ("-12.3", "1.9")),
        (1234.5, 120.0, ("1230", "120")),
        (0.5, 0.0, ("0.5", "0")),
        (1e9, 3.0, ("1e+09", "3")),
        (float("nan"), 1.0, ("–", "1")),
    ],
)
def test_a_value_is_shown_to_two_digits_of_its_interval(value: float, half: float, shown: tuple[str, str]) -> None:
    assert value_and_half(value, half) == shown


@given(st.floats(-1e5, 1e5), st.floats(1e-9, 1e5))
def test_rounding_for_display_moves_a_value_by_less_than_its_interval(value: float, half: float) -> None:
    shown, half_shown = value_and_half(value, half)
    assert abs(float(shown) - value) <= 0.06 * half + 1e-12
    assert float(half_shown) == pytest.approx(half, rel=0.06)


def test_numbers_are_short_and_missing_ones_are_dashes() -> None:
    assert [number(x) for x in (0.41633, 12345.6, 1e12, float("inf"))] == ["0.416", "12346", "1e+12", "–"]
    assert [percent(x) for x in (0.04512, 1.5, float("inf"))] == ["4.51 %", "150 %", "–"]
    assert [span(-1.0, 2.0), span(-np.inf, np.inf)] == ["-1 … 2", "unlimited"]
    assert unit("kg m^2") == "kg m²"


def test_grades_change_at_their_limits_and_what_is_no_number_is_poor() -> None:
    assert [grade_of(x).word for x in (0.049, 0.05, 0.1, 0.2, float("inf"), float("nan"))] == [
        "very good", "good", "fair", "poor", "poor", "poor",
    ]  # fmt: skip


def test_the_condition_number_is_graded_and_a_lost_rank_is_worse_than_any() -> None:
    assert [condition_grade(c, full_rank=True).word for c in (99.0, 100.0, DOUBTFUL_CONDITION)] == [
        "good",
        "fair",
        "doubtful",
    ]
    assert condition_grade(10.0, full_rank=False).word == "rank lost"


def test_intervals_are_those_of_students_t(estimate: Estimate) -> None:
    few = replace(estimate, degrees=5)
    np.testing.assert_allclose(few.half_intervals(), student.ppf(0.975, 5) * few.standard_errors)


def test_a_parameter_that_is_zero_has_an_infinite_relative_interval(estimate: Estimate) -> None:
    values = estimate.values.copy()
    values[0] = 0.0
    relative = relative_halves(replace(estimate, values=values))
    assert np.isinf(relative[0])
    assert np.isfinite(relative[1:]).all()


def _with_first_joint(log: LogPrediction, **facts: object) -> LogPrediction:
    return replace(log, joints=(replace(log.joints[0], relative_rms=0.5, **facts), *log.joints[1:]))


def _steps(estimate: Estimate, *logs: LogPrediction) -> str:
    verification = Verification(logs=logs, processing=estimate.processing) if logs else None
    return " ".join(next_steps(Case(estimate=estimate, verification=verification)))


def test_a_good_model_on_unseen_motion_gets_no_warning(verified: tuple[Estimate, Verification]) -> None:
    estimate, verification = verified
    assert _steps(estimate, *verification.logs).startswith("Nothing stands out")


def test_advice_names_a_weak_motion(estimate: Estimate) -> None:
    assert "condition number of 5e+03" in _steps(replace(estimate, condition=5e3))
    assert "determines only 3 of" in _steps(replace(estimate, rank=3))
    assert "motion" not in _steps(estimate).replace("motion_", "")


def test_advice_asks_for_unseen_recordings(estimate: Estimate, verification: Verification) -> None:
    log = verification.logs[1]
    assert "Verify the model on a recording that it was not fitted to" in _steps(estimate)
    assert "Verify on a recording of another motion" in _steps(estimate, replace(log, input=estimate.inputs[0]))


def test_advice_sees_a_model_that_does_not_transfer(estimate: Estimate, verification: Verification) -> None:
    log = verification.logs[1]
    far = replace(log, predicted=0.5 * log.tau)
    assert "The error on unseen motion (50 %)" in _steps(estimate, far)
    assert "The error on unseen motion" not in _steps(estimate, log)


SPREAD = {"by_speed": (1.0,) * 10, "by_time": (1.0,) * 10}


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"by_speed": (3.0, *(1.0,) * 9)}, "largest near standstill"),
        ({"by_speed": (*(1.0,) * 8, 3.0, 3.0)}, "grows with speed"),
        ({"by_time": (*(1.0,) * 7, 3.0, 3.0, 3.0)}, "grows over the recording"),
    ],
)
def test_advice_says_where_the_worst_joint_errs(
    estimate: Estimate, verification: Verification, facts: dict[str, object], words: str
) -> None:
    log = verification.logs[1]
    assert words in _steps(estimate, _with_first_joint(log, **(SPREAD | facts)))
    plain = _steps(estimate, _with_first_joint(log, **SPREAD))
    assert words not in plain
    assert "Look at j1" in plain


def test_the_worst_joint_is_not_blamed_when_the_motion_is_too_weak(
    estimate: Estimate, verification: Verification
) -> None:
    log = _with_first_joint(verification.logs[1], **SPREAD)
    assert "Look at j1" not in _steps(replace(estimate, condition=5e3), log)


def test_advice_sees_a_constant_error(estimate: Estimate, verification: Verification) -> None:
    log = verification.logs[1]
    shifted = _with_first_joint(replace(log, predicted=log.tau - 2.0), rms=2.0, **SPREAD)
    assert "nearly constant (+2 Nm)" in _steps(estimate, shifted)


def test_advice_sees_a_reversed_torque(estimate: Estimate) -> None:
    assert "Check the sign of the torque of j1, elbow" in _steps(replace(estimate, values=-estimate.values))
    assert "Check the sign" not in _steps(estimate)


def test_advice_does_not_let_unknown_parameters_pass_as_properties(estimate: Estimate) -> None:
    vague = replace(estimate, covariance=1e6 * estimate.covariance)
    assert "are not told apart from zero" in _steps(vague)
    assert "are not told apart from zero" not in _steps(estimate)


def test_the_worst_joint_is_the_one_with_the_largest_finite_relative_error(verification: Verification) -> None:
    log = verification.logs[1]
    silent = replace(log, joints=(replace(log.joints[0], relative_rms=float("inf")), log.joints[1]))
    assert worst_joint((silent,)) == (silent, 1)
    assert worst_joint(()) is None


def test_pooling_one_log_gives_its_own_relative_error(verification: Verification) -> None:
    log = verification.logs[0]
    assert pooled_relative_rms((log,)) == pytest.approx(log.relative_rms)
    assert pooled_relative_rms((log, log)) == pytest.approx(log.relative_rms)
