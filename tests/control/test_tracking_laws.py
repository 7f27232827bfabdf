"""PD, PD with feedforward and PID: the formulas, the limits of the integral, and their errors."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.control import PD, PID, PDFeedforward, PDGravity
from tauhat.errors import ArrayError

Q, DQ, Q_REF, DQ_REF = np.array([0.1, 0.2]), np.array([1.0, -1.0]), np.array([0.3, 0.1]), np.array([0.5, 0.5])
GAINS = {"kp": np.array([10.0, 100.0]), "kd": np.array([1.0, 2.0])}
ERRORS = np.array([2.0 - 0.5, -10.0 + 3.0])


def test_pd_torque_is_the_weighted_errors_within_its_limits():
    law = PD(**GAINS, torque_limit=np.array([np.inf, 5.0]))
    torque = law.torque(Q, DQ, q_ref=Q_REF, dq_ref=DQ_REF)
    np.testing.assert_allclose(torque, [ERRORS[0], -5.0], atol=1e-12)


def test_feedforward_of_a_model_is_added():
    ahead = np.array([4.0, -6.0])
    torque = PDFeedforward(**GAINS).torque(Q, DQ, q_ref=Q_REF, dq_ref=DQ_REF, model_torque=ahead)
    np.testing.assert_allclose(torque, ahead + ERRORS, atol=1e-12)
    np.testing.assert_allclose(
        torque, PDGravity(**GAINS).torque(Q, DQ, q_ref=Q_REF, dq_ref=DQ_REF, gravity_torque=ahead)
    )


def test_pid_sums_its_error_over_time():
    law = PID(**GAINS, ki=np.array([3.0, 0.0]))
    integral = np.zeros(2)
    for _ in range(10):
        integral, torque = law.step(integral, np.array([0.2, 0.1]), np.zeros(2), period=0.01)
    np.testing.assert_allclose(integral, [0.02, 0.01])
    np.testing.assert_allclose(torque, [10.0 * 0.2 + 3.0 * 0.018, 100.0 * 0.1])


def test_the_integral_stops_at_the_limit_and_returns_from_it():
    law = PID(kp=[10.0], kd=[0.0], ki=[1.0], torque_limit=1.0)
    integral = np.array([0.5])
    wound, torque = law.step(integral, np.array([1.0]), np.zeros(1), period=0.01)
    assert torque == 1.0
    assert wound == integral
    back, torque = law.step(np.array([50.0]), np.array([-1.0]), np.zeros(1), period=0.01)
    assert torque == 1.0
    assert back < 50.0


@pytest.mark.parametrize(
    ("law", "settings", "message"),
    [
        (PID, {"kp": [1.0], "kd": [1.0], "ki": [-1.0]}, "PID: a gain is negative"),
        (PID, {"kp": [1.0, 1.0], "kd": [1.0, 1.0], "ki": [1.0]}, "PID: ki has the wrong shape"),
        (PD, {"kp": [-1.0], "kd": [1.0]}, "PD: a gain is negative"),
        (PDFeedforward, {"kp": [1.0], "kd": [1.0], "torque_limit": 0.0}, "PDFeedforward, joint 1: a torque limit"),
        (PD, {"kp": [], "kd": []}, "PD: kp is empty; expected a gain a joint"),
    ],
)
def test_impossible_gains_are_refused(law, settings, message):
    with pytest.raises(ArrayError, match=message):
        law(**settings)
