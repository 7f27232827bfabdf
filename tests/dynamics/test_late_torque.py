"""A torque that comes late: a sampled controller with a delay is a linear difference equation, and moves like one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from tauhat.dynamics import TorqueModel
from tauhat.dynamics.simulated_arm import Followed, Gains, Stepping, follow, simulated_arm
from tauhat.dynamics.terms import Inertia, Viscous
from tauhat.robots import Joint, Robot

MASS, FRICTION, KP, KD = 3.0, 2.0, 200.0, 20.0
STEP, SUBSTEPS = 1e-2, 20  # between two samples [s], each of one period of the controller


def slider() -> TorqueModel:
    inertia = np.array([MASS, 0, 0, 0, 0, 0, 0, 0, 0, 0], dtype=np.float64)
    joint = Joint(name="slide", kind="prismatic", parent=-1, rotation=np.eye(3), translation=np.zeros(3),
                  axis=np.array([1.0, 0.0, 0.0]), inertia=inertia)  # fmt: skip
    return TorqueModel(robot=Robot(name="slider", joints=(joint,), gravity=np.zeros(3)), terms=(Inertia(), Viscous()))


def difference_equation(q_ref: np.ndarray, dq_ref: np.ndarray, delay: int) -> np.ndarray:
    """Return q under `u(k) = kp e(k) + kd de(k)` that acts from k + delay to k + delay + 1, exactly."""
    system = np.array([[0.0, 1.0, 0.0], [0.0, -FRICTION / MASS, 1.0 / MASS], [0.0, 0.0, 0.0]])
    passing = expm(STEP * system)
    state, found, late = np.array([q_ref[0], dq_ref[0]]), [], []
    for q, dq in zip(q_ref, dq_ref, strict=True):
        found.append(state[0])
        late.append(KP * (q - state[0]) + KD * (dq - state[1]))
        torque = late[max(len(late) - 1 - delay, 0)]
        state = passing[:2, :2] @ state + passing[:2, 2] * torque
    return np.array(found)


@pytest.mark.parametrize("method", ["leapfrog", "runge-kutta"])
@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_sliding_mass_under_a_late_torque_moves_as_its_difference_equation(method, delay):
    t = np.arange(0.0, 3.0, STEP)
    q, dq = 0.2 * np.sin(3.0 * t), 0.6 * np.cos(3.0 * t)
    model = slider()
    standard = np.zeros(model.n_p)
    standard[0], standard[10] = MASS, FRICTION
    gains = Gains(*(np.array([value]) for value in (KP, KD, 0.0, np.inf)))
    moved = follow(
        simulated_arm(model), standard, Followed(q[:, None], dq[:, None], np.zeros((t.size, 1))), gains=gains,
        start=np.array([q[:1], dq[:1]]), stepping=Stepping(STEP, SUBSTEPS, SUBSTEPS, method, delay),
    )  # fmt: skip
    expected = difference_equation(q, dq, delay)
    prompt = difference_equation(q, dq, 0)
    error = np.abs(moved.q[0] - expected).max()
    assert error < {"leapfrog": 5e-6, "runge-kutta": 1e-9}[method]
    assert delay == 0 or np.abs(expected - prompt).max() > 100 * error


def test_a_torque_that_is_not_held_is_never_late():
    t = np.arange(0.0, 1.0, STEP)
    q, dq = 0.2 * np.sin(3.0 * t)[:, None], 0.6 * np.cos(3.0 * t)[:, None]
    model = slider()
    standard = np.zeros(model.n_p)
    standard[0], standard[10] = MASS, FRICTION
    gains = Gains(*(np.array([value]) for value in (KP, KD, 0.0, np.inf)))
    asked = Followed(q, dq, np.zeros_like(q))
    moved = [
        follow(simulated_arm(model), standard, asked, gains=gains, start=np.array([q[0], dq[0]]),
               stepping=Stepping(STEP, SUBSTEPS, 0, "leapfrog", delay))
        for delay in (0, 2)
    ]  # fmt: skip
    np.testing.assert_array_equal(moved[0].q, moved[1].q)
