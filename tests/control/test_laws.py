"""PD with gravity feedforward: the formula, its limits, its batches and its errors."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.control import PDGravity
from tauhat.errors import ArrayError


def test_torque_is_gravity_plus_weighted_errors() -> None:
    law = PDGravity(kp=np.array([10.0, 100.0]), kd=np.array([1.0, 2.0]))
    torque = law.torque(
        np.array([0.1, 0.2]),
        np.array([1.0, -1.0]),
        q_ref=np.array([0.3, 0.1]),
        dq_ref=np.array([0.5, 0.5]),
        gravity_torque=np.array([5.0, -7.0]),
    )
    np.testing.assert_allclose(torque, [5.0 + 2.0 - 0.5, -7.0 - 10.0 + 3.0], atol=1e-12)


def test_torque_is_clipped_to_its_limits_on_both_sides() -> None:
    law = PDGravity(kp=np.full(3, 1e3), kd=np.zeros(3), torque_limit=np.array([5.0, 6.0, np.inf]))
    zero = np.zeros(3)
    torque = law.torque(zero, zero, q_ref=np.array([1.0, -1.0, 1.0]), dq_ref=zero, gravity_torque=zero)
    np.testing.assert_array_equal(torque, [5.0, -6.0, 1e3])


def test_a_batch_of_states_gives_what_single_states_give() -> None:
    rng = np.random.default_rng(0)
    law = PDGravity(kp=rng.uniform(size=4), kd=rng.uniform(size=4), torque_limit=np.full(4, 0.7))
    q, dq, q_ref, dq_ref, gravity = rng.standard_normal((5, 20, 4))
    batch = law.torque(q, dq, q_ref=q_ref, dq_ref=dq_ref, gravity_torque=gravity)
    for k in range(20):
        single = law.torque(q[k], dq[k], q_ref=q_ref[k], dq_ref=dq_ref[k], gravity_torque=gravity[k])
        np.testing.assert_array_equal(batch[k], single)


def test_gains_are_copied_and_read_only() -> None:
    kp = np.ones(2)
    law = PDGravity(kp=kp, kd=kp)
    kp[0] = 5.0
    assert law.kp[0] == 1.0
    for array in (law.kp, law.kd, law.torque_limit):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 2.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"kp": [1.0], "kd": [-1.0]}, "gain is negative"),
        ({"kp": [1.0, 2.0], "kd": [1.0]}, "kd has the wrong shape"),
        ({"kp": [np.inf], "kd": [1.0]}, "kp is not finite"),
        ({"kp": [1.0], "kd": [1.0], "torque_limit": [1.0, 2.0]}, "torque_limit has the wrong shape"),
        ({"kp": [1.0, 1.0], "kd": [1.0, 1.0], "torque_limit": [1.0, 0.0]}, "joint 2: a torque limit is not positive"),
        ({"kp": [1.0], "kd": [1.0], "torque_limit": [np.nan]}, "a torque limit is not positive"),
    ],
)
def test_impossible_settings_are_refused(settings: dict[str, list[float]], message: str) -> None:
    with pytest.raises(ArrayError, match=message):
        PDGravity(**{name: np.array(value) for name, value in settings.items()})
