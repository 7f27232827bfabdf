"""Evidence adds up: factors hold all that least squares can learn, whatever the chunks and the order of merging."""

from __future__ import annotations

from functools import lru_cache, reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sample_arms import Truth, planar_truth
from tauhat.dynamics import BaseParameters, base_parameters, torque_model
from tauhat.errors import ModelError, RecordingError
from tauhat.estimation import Evidence, OrdinaryLeastSquares, WeightedLeastSquares, collect, collect_all
from tauhat.estimation.evidence import MOST_BLOCKS, evidence_from_rows
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.estimation.solution import joint_residuals, joint_torques, rank_and_condition
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
METHODS = (
    OrdinaryLeastSquares(),
    WeightedLeastSquares(),
    WeightedLeastSquares(power=1.0),
    OrdinaryLeastSquares(ridge=0.1),
)


@lru_cache
def truth() -> Truth:
    return planar_truth()


@lru_cache
def base() -> BaseParameters:
    return base_parameters(truth().model)


@lru_cache
def recording(seed: int, seconds: float = 8.0) -> Recording:
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(round(seconds * 200), 2)) * [0.5, 0.1]
    return truth().recording(seed=seed, seconds=seconds, noise=noise)


@lru_cache
def evidence(seed: int) -> Evidence:
    return collect(truth().model, base(), recording(seed), SETTINGS)


def dense(*recordings: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the stacked regressor, torque and joint of every row."""
    layout = truth().model.layout(base().independent)
    place = np.full(truth().model.n_p, -1)
    place[base().independent] = np.arange(base().n_b)
    matrices, torques, joints = [], [], []
    for rows in (rows for item in recordings for rows in filtered_rows(truth().model, layout, item, SETTINGS)):
        for joint in range(2):
            part = layout.of_joint(joint)
            matrix = np.zeros((rows.t.size, base().n_b))
            matrix[:, place[layout.parameters[part]]] = rows.columns[part].T
            matrices.append(matrix)
            torques.append(rows.tau[joint])
            joints.append(np.full(rows.t.size, joint))
    return np.vstack(matrices), np.concatenate(torques), np.concatenate(joints)


def close(first: np.ndarray, second: np.ndarray) -> bool:
    return np.abs(first - second).max() <= 1e-10 * np.abs(second).max()


def test_ordinary_least_squares_is_lstsq_on_all_rows():
    matrix, torque, _ = dense(recording(0), recording(1))
    expected = np.linalg.lstsq(matrix, torque, rcond=None)[0]
    both = collect_all(truth().model, base(), [recording(0), recording(1)], SETTINGS)
    assert close(OrdinaryLeastSquares().fit(both).values, expected)


@pytest.mark.parametrize("power", [0.5, 1.0])
def test_weighted_least_squares_is_reweighted_lstsq_on_all_rows(power):
    matrix, torque, joint = dense(recording(0))
    weights = np.ones(2)
    for _ in range(4):
        rows = weights[joint]
        values = np.linalg.lstsq(matrix * rows[:, None], torque * rows, rcond=None)[0]
        error = (matrix @ values - torque) ** 2
        weights = np.array([np.sqrt(error[joint == k].mean()) for k in range(2)]) ** -power
    solution = WeightedLeastSquares(power=power, passes=3).fit(evidence(0))
    assert close(solution.values, values)
    assert solution.weights[1] > 1.5 * solution.weights[0]


def test_ridge_is_tikhonov_on_columns_of_unit_norm():
    matrix, torque, _ = dense(recording(0))
    scale = np.linalg.norm(matrix, axis=0)
    padded = np.vstack([matrix / scale, 0.3 * np.eye(base().n_b)])
    expected = np.linalg.lstsq(padded, np.concatenate([torque, np.zeros(base().n_b)]), rcond=None)[0] / scale
    assert close(OrdinaryLeastSquares(ridge=0.3).fit(evidence(0)).values, expected)


def test_residuals_torques_and_condition_are_those_of_all_rows():
    matrix, torque, joint = dense(recording(0))
    values = np.random.default_rng(0).normal(size=base().n_b)
    error = (matrix @ values - torque) ** 2
    assert close(joint_residuals(evidence(0), values), np.sqrt([error[joint == k].mean() for k in range(2)]))
    assert close(joint_torques(evidence(0)), np.sqrt([(torque[joint == k] ** 2).mean() for k in range(2)]))
    rank, condition = rank_and_condition(evidence(0), np.ones(2))
    assert rank == base().n_b
    assert condition == pytest.approx(np.linalg.cond(matrix / np.linalg.norm(matrix, axis=0)), rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_merging_does_not_depend_on_order_or_grouping(method):
    a, b, c = (evidence(seed) for seed in range(3))
    reference = method.fit(a.merged(b).merged(c)).values
    for other in (a.merged(b.merged(c)), c.merged(a).merged(b), b.merged(c.merged(a))):
        assert other.n_t == a.n_t + b.n_t + c.n_t
        assert close(method.fit(other).values, reference)


@settings(max_examples=10)
@given(chunk=st.integers(20, 3000))
def test_evidence_is_the_same_whatever_the_chunk(chunk):
    ours = collect(truth().model, base(), recording(0), SETTINGS, chunk=chunk)
    assert [block.n_t for block in ours.blocks] == [block.n_t for block in evidence(0).blocks]
    for method in METHODS:
        assert close(method.fit(ours).values, method.fit(evidence(0)).values)
        assert np.allclose(method.fit(ours).covariance, method.fit(evidence(0)).covariance, rtol=1e-6)


def test_factors_keep_the_gram_matrix_of_their_rows():
    layout = truth().model.layout(base().independent)
    pieces = list(filtered_rows(truth().model, layout, recording(0), SETTINGS))
    for joint, factor in enumerate(evidence(0).total.factors):
        part = layout.of_joint(joint)
        rows = np.vstack([np.column_stack([piece.columns[part].T, piece.tau[joint]]) for piece in pieces])
        assert factor.shape[0] <= factor.shape[1] == rows.shape[1]
        assert np.allclose(factor.T @ factor, rows.T @ rows, rtol=0, atol=1e-10 * np.abs(rows.T @ rows).max())


def stream(n_pieces: int, size: int):
    layout = truth().model.layout(base().independent)
    rng = np.random.default_rng(0)
    for k in range(n_pieces):
        t = 0.1 * np.arange(k * size, (k + 1) * size)
        yield Rows(t, rng.normal(size=(layout.parameters.size, size)), *rng.normal(size=(2, 2, size)))


@pytest.mark.parametrize(("n_pieces", "size"), [(1, 3), (1, 700), (40, 97), (300, 500)])
def test_memory_does_not_grow_with_the_stream(n_pieces, size):
    layout = truth().model.layout(base().independent)
    ours = evidence_from_rows(layout, base(), stream(n_pieces, size))
    assert ours.n_t == n_pieces * size
    assert len(ours.blocks) <= MOST_BLOCKS
    assert all(factor.shape[0] <= factor.shape[1] for block in ours.blocks for factor in block.factors)


@pytest.mark.parametrize(("n_pieces", "size"), [(1, 700), (40, 97), (300, 500)])
def test_blocks_of_time_are_about_equally_long(n_pieces, size):
    layout = truth().model.layout(base().independent)
    lengths = [block.n_t for block in evidence_from_rows(layout, base(), stream(n_pieces, size)).blocks]
    assert len(lengths) >= MOST_BLOCKS // 2
    assert len(set(lengths[:-1])) == 1
    assert 0.5 * lengths[0] <= lengths[-1] <= 1.5 * lengths[0]


def test_many_recordings_keep_the_number_of_blocks_bounded():
    many = reduce(Evidence.merged, [evidence(seed) for seed in range(4)] * 3)
    assert len(many.blocks) <= MOST_BLOCKS
    assert many.n_t == 3 * sum(evidence(seed).n_t for seed in range(4))
    assert many.recordings == ("run 0", "run 1", "run 2", "run 3") * 3


def test_evidence_of_different_models_is_not_merged():
    other = torque_model(truth().model.robot, "inertia,viscous")
    foreign = collect(other, base_parameters(other), recording(0), SETTINGS)
    with pytest.raises(ModelError, match="evidence of different models cannot be merged"):
        evidence(0).merged(foreign)


def test_no_rows_give_no_evidence():
    layout = truth().model.layout(base().independent)
    with pytest.raises(ModelError, match=r"^run 7: no row of the recording is left"):
        evidence_from_rows(layout, base(), iter(()), name="run 7")


def test_a_recording_of_another_number_of_joints_is_refused():
    t = np.arange(100) * 0.01
    three = Recording(t=t, q=np.ones((100, 3)), tau=np.ones((100, 3)), name="three")
    with pytest.raises(
        RecordingError, match=r"three: the log does not fit the robot; expected 2 joints \(j1, j2\), got 3"
    ):
        collect(truth().model, base(), three, SETTINGS)
