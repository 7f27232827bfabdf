"""The adjoint of the regressor against sixth-order finite differences, on random trees."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.dynamics import Coulomb, Motion, torque_model
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError
from tauhat.robots import Joint, Robot

STENCIL = ((1 / 60, 3), (-3 / 20, 2), (3 / 4, 1), (-3 / 4, -1), (3 / 20, -2), (-1 / 60, -3))
STEP = 1e-2


def random_tree(n_v: int, seed: int) -> Robot:
    rng = np.random.default_rng(seed)
    joints = []
    for index in range(n_v):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        axis = rng.normal(size=3)
        joints.append(
            Joint(
                name=f"j{index}",
                kind="prismatic" if rng.random() < 0.35 else "revolute",
                parent=int(rng.integers(-1, index)) if index else -1,
                rotation=turn * np.sign(np.linalg.det(turn)),
                translation=rng.normal(size=3),
                axis=axis / np.linalg.norm(axis),
            )
        )
    return Robot(name="tree", joints=tuple(joints))


def scalar(model: TorqueModel, parts: list[np.ndarray], weights: np.ndarray) -> np.ndarray:
    """Return sum(weights * columns) of every sample."""
    motion = Motion(q=parts[0], dq=parts[1], ddq=parts[2])
    columns, _ = model.columns(motion, model.layout())
    return (weights * columns).sum(axis=0)


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_any_sum_of_columns_is_that_of_finite_differences(seed):
    robot = random_tree(1 + seed % 6, seed)
    widths = tuple(np.linspace(0.5, 1.0, robot.n_v))
    model = torque_model(robot).with_term(Coulomb(widths=widths))
    rng = np.random.default_rng(seed)
    parts = list(rng.normal(size=(3, robot.n_v, 67)))
    weights = rng.normal(size=(model.layout().parameters.size, 67))
    gradient = model.pull(Motion(q=parts[0], dq=parts[1], ddq=parts[2]), model.layout(), weights)
    for which, found in enumerate(gradient):
        for joint in range(robot.n_v):
            expected = np.zeros(67)
            for weight, steps in STENCIL:
                moved = [part.copy() for part in parts]
                moved[which][joint] += steps * STEP
                expected += weight * scalar(model, moved, weights) / STEP
            tolerance = 1e-7 if which == 1 else 1e-10  # the smooth sign bends sharply for a stencil this wide
            assert np.allclose(found[joint], expected, atol=tolerance * max(1.0, np.abs(expected).max()))


def test_inertial_columns_alone_agree_to_1e_10():
    robot = random_tree(6, 11)
    model = torque_model(robot, "inertia")
    rng = np.random.default_rng(0)
    parts = list(rng.normal(size=(3, 6, 64)))
    weights = rng.normal(size=(model.layout().parameters.size, 64))
    gradient = model.pull(Motion(q=parts[0], dq=parts[1], ddq=parts[2]), model.layout(), weights)
    direction = rng.normal(size=(3, 6, 64))
    expected = np.zeros(64)
    for weight, steps in STENCIL:
        moved = [part + steps * STEP * step for part, step in zip(parts, direction, strict=True)]
        expected += weight * scalar(model, moved, weights) / STEP
    found = sum((step * part).sum(axis=0) for step, part in zip(direction, gradient, strict=True))
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_a_term_without_gradient_is_named():
    model = torque_model(random_tree(2, 0), "inertia")
    motion = Motion(q=np.zeros((2, 3)), dq=np.zeros((2, 3)), ddq=np.zeros((2, 3)))
    term = model.terms[0]
    with pytest.raises(ModelError, match="columns of term inertia have no gradient"):
        super(type(term), term).pull(model.robot, motion, (), model.pull(motion, model.layout(), np.zeros((30, 3))))
