"""The model without products of inertia: fewer columns, exact where links are symmetric, with a gradient."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from sample_arms import chain, planar_arm, random_states, smooth_motion
from tauhat.dynamics import Inertia, Motion, TorqueModel, base_parameters, inverse_dynamics, motion_from_rows, regressor
from tauhat.dynamics.small_terms import without_small_terms
from tauhat.dynamics.terms.simplified import InertiaWithoutProducts
from tauhat.errors import ModelError
from tauhat.robots import load_robot

KEPT = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz")


def prediction(model: TorqueModel, motion: Motion, values: np.ndarray) -> np.ndarray:
    layout = model.layout()
    columns, _ = model.columns(motion, layout)
    weights = values[layout.parameters]
    rows = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
    return np.array([weights[part] @ columns[part] for part in rows])


def test_it_has_seven_parameters_a_link_and_the_regressors_columns():
    robot = chain(np.random.default_rng(0), "RPR")
    motion = motion_from_rows(*random_states(np.random.default_rng(1), 6, 3))
    term = InertiaWithoutProducts()
    assert [item.name for item in term.parameters(robot)] == [f"{symbol}_{k}" for k in (1, 2, 3) for symbol in KEPT]
    whole = regressor(robot, motion.q.T, motion.dq.T, motion.ddq.T)
    names = [item.name for item in Inertia().parameters(robot)]
    columns, state = term.columns(robot, motion, None)
    assert state is None
    for joint, (support, rows) in enumerate(zip(term.support(robot), columns, strict=True)):
        for index, row in zip(support, rows, strict=True):
            assert np.array_equal(row, whole[:, joint, names.index(term.parameters(robot)[index].name)])
    assert [support.size for support in term.support(robot)] == [21, 14, 7]


def test_links_without_products_are_predicted_exactly():
    robot = load_robot("two_link")
    assert not robot.inertia[:, [5, 7, 8]].any()
    states = random_states(np.random.default_rng(2), 20, 2)
    model = TorqueModel(robot=robot, terms=(InertiaWithoutProducts(),))
    values = robot.inertia[:, [0, 1, 2, 3, 4, 6, 9]].ravel()
    torque = prediction(model, motion_from_rows(*states), values)
    assert np.allclose(torque.T, inverse_dynamics(robot, *states), rtol=0, atol=1e-12)


def test_its_base_set_is_smaller_and_has_the_rank_of_the_columns_left():
    robot = load_robot("ur10e")
    simple = base_parameters(TorqueModel(robot=robot, terms=(InertiaWithoutProducts(),)))
    whole = base_parameters(TorqueModel(robot=robot, terms=(Inertia(),)))
    assert {name.split("_")[0] for name in simple.names} == set(KEPT)
    stacked = regressor(robot, *random_states(np.random.default_rng(6), 100, 6)).reshape(-1, 60)
    left = stacked[:, [10 * link + k for link in range(6) for k in (0, 1, 2, 3, 4, 6, 9)]]
    norms = np.linalg.norm(left, axis=0)
    assert simple.n_b == np.linalg.matrix_rank(left[:, norms > 1e-9] / norms[norms > 1e-9], tol=1e-7)
    assert simple.n_b < whole.n_b


def test_dropped_parameters_have_no_column():
    robot = planar_arm()
    term = InertiaWithoutProducts(dropped=("mz_1", "Ixx_2"))
    names = [item.name for item in term.parameters(robot)]
    assert len(names) == 12
    assert not {"mz_1", "Ixx_2"} & set(names)


def test_its_gradient_is_that_of_finite_differences():
    robot = chain(np.random.default_rng(3), "RPR")
    q, dq, ddq = (part.T.copy() for part in smooth_motion(3, np.arange(5) * 0.1))
    model = TorqueModel(robot=robot, terms=(InertiaWithoutProducts(dropped=("Ixx_3",)),))
    layout = model.layout()
    bars = np.random.default_rng(4).normal(size=(layout.parameters.size, 5))

    def score(*parts: np.ndarray) -> float:
        columns, _ = model.columns(Motion(q=parts[0], dq=parts[1], ddq=parts[2]), layout)
        return float(np.sum(bars * columns))

    gradient = model.pull(Motion(q=q, dq=dq, ddq=ddq), layout, bars)
    for which, found in enumerate(gradient):
        for joint in range(3):
            up, down = [part.copy() for part in (q, dq, ddq)], [part.copy() for part in (q, dq, ddq)]
            up[which][joint, 2] += 1e-6
            down[which][joint, 2] -= 1e-6
            assert found[joint, 2] == pytest.approx((score(*up) - score(*down)) / 2e-6, rel=1e-5, abs=1e-6)


def test_small_terms_are_those_whose_part_of_the_torque_is_small_on_every_joint():
    robot = load_robot("ur10e")
    term = without_small_terms(robot, part=0.02)
    whole = TorqueModel(robot=robot, terms=(InertiaWithoutProducts(),))
    simple = TorqueModel(robot=robot, terms=(term,))
    nominal = dict(zip([item.name for item in Inertia().parameters(robot)], robot.inertia.ravel(), strict=True))
    motion = motion_from_rows(*random_states(np.random.default_rng(5), 200, 6))
    parts = [
        prediction(model, motion, np.array([nominal[item.name] for item in model.parameters]))
        for model in (whole, simple)
    ]
    change = np.linalg.norm(parts[0] - parts[1], axis=1) / np.linalg.norm(parts[0], axis=1)
    assert simple.n_p < 0.8 * whole.n_p
    assert change.max() < 0.1
    assert not {"mx_2", "m_3", "mx_3"} & set(term.dropped)


def test_a_larger_part_drops_more():
    robot = load_robot("panda")
    counts = [len(without_small_terms(robot, part=part).dropped) for part in (0.0, 0.01, 0.1)]
    assert counts == sorted(counts)
    assert counts[0] < counts[1] < counts[2]


def test_settings_survive_plain_data():
    term = InertiaWithoutProducts(dropped=("mz_1",))
    assert InertiaWithoutProducts(dropped=list(asdict(term)["dropped"])) == term


def test_a_dropped_name_that_is_no_parameter_is_refused():
    with pytest.raises(ModelError, match=r"planar: a dropped parameter is not one of the links'; got mz_9"):
        InertiaWithoutProducts(dropped=("mz_9",)).parameters(planar_arm())


def test_small_terms_need_nominal_masses():
    arm = planar_arm()
    empty = replace(arm, joints=tuple(replace(joint, inertia=np.zeros(10)) for joint in arm.joints))
    with pytest.raises(ModelError, match="cannot be told without nominal masses"):
        without_small_terms(empty)


@pytest.mark.parametrize("part", [-0.1, 1.0, np.nan])
def test_a_part_that_is_no_part_is_refused(part):
    with pytest.raises(ModelError, match="out of range; expected 0 to 1"):
        without_small_terms(planar_arm(), part=part)
