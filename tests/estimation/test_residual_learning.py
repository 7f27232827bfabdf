"""A network on the residual: kept where it predicts unseen data better, switched off where it does not."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from rough_logs import SETTINGS, TRUTH, run, white
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

from tauhat.errors import EstimateError, MissingExtraError, ModelError
from tauhat.estimation import (
    Estimate,
    LearnedResidual,
    NetworkSettings,
    ResidualNetwork,
    identify,
    learn_residual,
    unseen_error,
)
from tauhat.estimation.residual_learning import _samples, _trained
from tauhat.recordings import Recording
from tauhat.verification import verify


def with_ripple(recording: Recording) -> Recording:
    """Return the recording with a torque of position on the first joint that no term has."""
    extra = 0.8 * np.sin(2.5 * recording.q[:, :1]) * np.array([[1.0, 0.0]])
    return replace(recording, tau=recording.tau + extra)


def rippled(seed: int) -> Recording:
    return with_ripple(run(seed, noise=white(seed, size=0.1)))


def learned(recordings: list[Recording]) -> tuple[Estimate, LearnedResidual]:
    estimate = identify(TRUTH.model, recordings, processing=SETTINGS)
    return estimate, learn_residual(estimate, recordings, settings=NetworkSettings(penalty=10.0))


def test_what_the_model_lacks_is_learned_on_the_joint_that_lacks_it():
    estimate, found = learned([rippled(seed) for seed in range(4)])
    assert found.network is not None
    assert found.whole
    assert found.parts == 4
    assert found.network.size[0] > 0.0
    assert found.words.startswith("kept on ")
    assert "j1" in found.words
    before, after = (unseen_error(estimate, network, rippled(7)) for network in (None, found.network))
    assert after < 0.9 * before


def test_noise_is_not_learned():
    for seed in range(3):
        estimate, found = learned([run(seed), run(seed + 10)])
        assert found.network is None
        assert found.words.startswith("switched off: on 2 left-out recordings no joint's error falls clearly")
        assert unseen_error(estimate, found.network, run(20)) == unseen_error(estimate, None, run(20))


def test_one_recording_is_judged_in_stretches_of_time():
    _, found = learned([run(0)])
    assert found.parts == 5
    assert not found.whole
    assert "5 left-out stretches of the one recording" in found.words


def test_without_network_the_error_is_that_of_verification():
    estimate = identify(TRUTH.model, [run(0)], processing=SETTINGS)
    assert unseen_error(estimate, None, run(1)) == pytest.approx(verify(estimate, [run(1)]).logs[0].relative_rms)


def some_network(n_v: int = 2) -> ResidualNetwork:
    rng = np.random.default_rng(0)
    return ResidualNetwork(
        weights=(rng.normal(size=(3 * n_v, 4)), rng.normal(size=(4, n_v))),
        biases=(rng.normal(size=4), rng.normal(size=n_v)),
        centre=np.zeros(3 * n_v),
        scale=np.ones(3 * n_v),
        lowest=np.full(3 * n_v, -2.0),
        highest=np.full(3 * n_v, 2.0),
        size=np.ones(n_v),
    )


@pytest.mark.parametrize("joints", [1, 2])
def test_plain_arrays_predict_what_scikit_learn_predicts(joints):
    rng = np.random.default_rng(1)
    inputs, outputs = rng.normal(size=(200, 3 * joints)), rng.normal(size=(200, joints))
    other = MLPRegressor(hidden_layer_sizes=(5, 3), activation="tanh", solver="lbfgs", max_iter=20, random_state=0)
    with pytest.warns(ConvergenceWarning):
        other.fit(inputs, outputs[:, 0] if joints == 1 else outputs)
    network = replace(
        some_network(joints),
        weights=tuple(other.coefs_),
        biases=tuple(other.intercepts_),
        lowest=np.full(3 * joints, -9.0),
        highest=np.full(3 * joints, 9.0),
    )
    ours = network.torque(*np.split(inputs, 3, axis=1))
    np.testing.assert_allclose(ours, other.predict(inputs).reshape(-1, joints), rtol=1e-12, atol=1e-12)


def test_a_stored_network_predicts_the_same():
    network = some_network()
    again = ResidualNetwork.from_dict(json.loads(json.dumps(network.to_dict())))
    motion = np.random.default_rng(2).normal(size=(3, 50, 2))
    assert np.array_equal(again.torque(*motion), network.torque(*motion))


def test_outside_what_it_saw_the_correction_stays_at_the_edge():
    network = some_network()
    edge = network.torque(*np.full((3, 1, 2), 2.0))
    assert np.array_equal(network.torque(*np.full((3, 1, 2), 100.0)), edge)
    silent = replace(network, size=np.array([0.0, 1.0]))
    assert silent.torque(*np.full((3, 4, 2), 1.0))[:, 0].tolist() == [0.0] * 4


def test_training_sees_the_motion_at_the_times_of_its_rows():
    estimate = identify(TRUTH.model, [run(0)], processing=SETTINGS)
    samples = _samples(estimate, run(0))
    recording = run(0)
    expected = np.column_stack([np.interp(samples.rows.t, recording.t, column) for column in recording.q.T])
    np.testing.assert_allclose(samples.motion[:, :2], expected, atol=2e-3)
    np.testing.assert_allclose(samples.motion[:, 2:4], samples.rows.dq.T, atol=0.15)


def test_the_same_settings_train_the_same_network():
    estimate = identify(TRUTH.model, [run(0)], processing=SETTINGS)
    samples = _samples(estimate, run(0))
    nets = [_trained(samples, estimate.values, NetworkSettings(passes=20)) for _ in range(2)]
    assert all(np.array_equal(a, b) for a, b in zip(nets[0].weights, nets[1].weights, strict=True))


def test_a_missing_library_names_its_extra(monkeypatch):
    estimate = identify(TRUTH.model, [run(0)], processing=SETTINGS)
    monkeypatch.setitem(sys.modules, "sklearn", None)
    with pytest.raises(MissingExtraError, match=r"scikit-learn is not installed; pip install 'tauhat\[learning\]'"):
        learn_residual(estimate, [run(0)])


@pytest.mark.parametrize(
    "settings", [{"hidden": ()}, {"hidden": (0,)}, {"passes": 0}, {"penalty": -1.0}, {"penalty": np.nan}]
)
def test_settings_out_of_range_are_refused(settings):
    with pytest.raises(ModelError, match="network"):
        NetworkSettings(**settings)


def test_layers_that_do_not_fit_are_refused():
    network = some_network()
    with pytest.raises(EstimateError, match="layers of the network do not fit"):
        replace(network, weights=(network.weights[0],), biases=(network.biases[0],))
    with pytest.raises(EstimateError, match="not positive"):
        replace(network, scale=np.zeros(6))
