"""Training a residual network, and switching it off where it does not help on data that it has not seen.

What a model of rigid bodies and friction leaves over may still depend on the motion: torque ripple, cable forces, a
gear that is stiffer one way. A small network of position, speed and acceleration learns that. It could just as well
learn one recording by heart. So it is judged before it is believed: every recording in turn (or every fifth of a single
one) is left out, model and network are fitted to the others, and the error on what was left out is compared joint by
joint with the model's alone. A joint keeps its correction when that error falls clearly; without such a joint there is
no network.

Source: Han, Wu, Liu, Xiong, "An iterative approach for accurate dynamic model identification of industrial robots",
2020 (network on the residual of hybrid least squares).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.blas import single_threaded
from tauhat.errors import MissingExtraError, ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.evidence import evidence_from_rows
from tauhat.estimation.least_squares import Estimator, WeightedLeastSquares, check_rows
from tauhat.estimation.residual_network import ResidualNetwork
from tauhat.estimation.rows import Rows, check_recordings, filtered_rows
from tauhat.recordings.processing import clock_step, stretches
from tauhat.recordings.recording import Recording

LEAST_GAIN = 0.02  # of a joint's error on unseen data, for its correction to be kept
_SURE = 2.0  # standard errors over the parts by which the gain must be above zero, too
_PARTS = 5  # stretches of time of a single recording
_MOST_ROWS = 20_000  # that a network is trained on


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkSettings:
    """How large a network is and how it is trained.

    hidden : sizes of the layers between
    penalty : of the squared weights; larger ones make smoother corrections
    passes : of the optimiser, at most
    seed : of the first weights
    """

    hidden: tuple[int, ...] = (12,)
    penalty: float = 100.0
    passes: int = 300
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.hidden or min(self.hidden) < 1 or self.passes < 1:
            raise ModelError("a network needs a hidden layer and a pass", got=f"{self.hidden}, {self.passes} passes")
        if not 0.0 <= self.penalty < np.inf:
            raise ModelError("the penalty of a network cannot be negative", got=self.penalty)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearnedResidual:
    """A network, or the finding that none helps.

    network : None where it is switched off
    gains : (n_v,) by what part the error on unseen data falls with the network, joint by joint
    uncertainty : (n_v,) standard errors of these over the parts
    parts : how many parts of the data were left out in turn
    whole : whether each was a whole recording
    words : what was decided and why
    """

    network: ResidualNetwork | None
    gains: FloatArray
    uncertainty: FloatArray
    parts: int
    whole: bool
    words: str

    def __post_init__(self) -> None:
        read_only(self.gains)
        read_only(self.uncertainty)


@single_threaded
def learn_residual(
    estimate: Estimate,
    recordings: Sequence[Recording],
    *,
    estimator: Estimator | None = None,
    settings: NetworkSettings | None = None,
) -> LearnedResidual:
    """Return a network for what the estimate leaves over on the recordings, if that predicts unseen data better.

    Parameters
    ----------
    recordings : that the estimate was fitted to; with several, whole ones are left out in turn
    estimator : fits the model to the parts that are not left out; weighted least squares by default

    Raises
    ------
    MissingExtraError
        when scikit-learn is not installed.
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when the parts that are not left out have no more rows than the model has parameters.
    """
    _require_library()
    check_recordings(estimate.model, recordings)
    chosen = settings or NetworkSettings()
    samples = [_samples(estimate, recording) for recording in recordings]
    whole = len(samples) > 1
    parts = samples if whole else list(_in_time(samples[0]))
    falls = _falls(estimate, parts, estimator or WeightedLeastSquares(), chosen)
    gains = 1.0 - np.exp(-falls.mean(axis=0))
    uncertainty = falls.std(axis=0, ddof=1) / np.sqrt(len(parts))
    kept = gains > np.maximum(LEAST_GAIN, _SURE * uncertainty)
    network = None
    if kept.any():
        trained = _trained(_joined(samples), estimate.values, chosen)
        network = replace(trained, size=np.where(kept, trained.size, 0.0))
    words = _words(estimate.robot.joint_names, gains, kept, len(parts), whole=whole)
    return LearnedResidual(
        network=network, gains=gains, uncertainty=uncertainty, parts=len(parts), whole=whole, words=words
    )


def unseen_error(estimate: Estimate, network: ResidualNetwork | None, recording: Recording) -> float:
    """Return the relative prediction error on a recording with the network's correction, all joints stacked."""
    samples = _samples(estimate, recording)
    error = samples.residual(estimate.values)
    if network is not None:
        error = error - samples.correction(network)
    return float(np.linalg.norm(error) / np.linalg.norm(samples.rows.tau))


class _Samples(NamedTuple):
    """Filtered rows of a recording and the motion at their times, (n, 3 n_v).

    places : per joint the base parameters of its columns, and the columns' rows
    """

    estimate: Estimate
    places: tuple[tuple[IntArray, slice], ...]
    rows: Rows
    motion: FloatArray

    def residual(self, values: FloatArray) -> FloatArray:
        """Return the torque less the model's, (n, n_v)."""
        predicted = [values[place] @ self.rows.columns[part] for place, part in self.places]
        return np.asarray((self.rows.tau - np.array(predicted)).T)

    def correction(self, network: ResidualNetwork) -> FloatArray:
        q, dq, ddq = np.split(self.motion, 3, axis=1)
        return network.torque(q, dq, ddq)

    def taken(self, part: IntArray | slice) -> _Samples:
        rows = self.rows
        picked = Rows(rows.t[part], rows.columns[:, part], rows.tau[:, part], rows.dq[:, part])
        return self._replace(rows=picked, motion=self.motion[part])


def _samples(estimate: Estimate, recording: Recording) -> _Samples:
    model, base = estimate.model, estimate.base
    layout = model.layout(base.independent)
    place = np.full(len(base.names), -1)
    place[base.independent] = np.arange(base.n_b)
    parts = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
    pieces = list(filtered_rows(model, layout, recording, estimate.processing))
    if not pieces:
        raise ModelError("no row of the recording is left to learn from", where=recording.name)
    rows = Rows(*(np.concatenate(arrays, axis=-1) for arrays in zip(*pieces, strict=True)))
    places = tuple((place[layout.parameters[part]], part) for part in parts)
    samples = _Samples(estimate, places, rows, _motion_at(estimate, recording, rows.t))
    stride = -(-rows.t.size // _MOST_ROWS)
    return samples.taken(slice(None, None, stride))


def _motion_at(estimate: Estimate, recording: Recording, times: FloatArray) -> FloatArray:
    """Return q, dq, ddq at ticks of the recording's clock, (n, 3 n_v)."""
    step, found = clock_step(recording), []
    for stretch in stretches(recording, estimate.processing):
        inside = (times > stretch.t[0] - 0.5 * step) & (times < stretch.t[-1] + 0.5 * step)
        index = np.round((times[inside] - stretch.t[0]) / step).astype(np.intp)
        found.append(np.concatenate([stretch.q, stretch.dq, stretch.ddq])[:, index])
    return np.ascontiguousarray(np.concatenate(found, axis=1).T)


def _in_time(samples: _Samples) -> Iterator[_Samples]:
    rows = samples.rows.t.size
    if rows < _PARTS:
        raise ModelError("too few rows to leave some of them out", expected=f">= {_PARTS}", got=rows)
    for part in np.array_split(np.arange(rows), _PARTS):
        yield samples.taken(part)


def _joined(parts: Sequence[_Samples]) -> _Samples:
    rows = Rows(*(np.concatenate(arrays, axis=-1) for arrays in zip(*(part.rows for part in parts), strict=True)))
    return parts[0]._replace(rows=rows, motion=np.concatenate([part.motion for part in parts]))


def _falls(
    estimate: Estimate, parts: Sequence[_Samples], estimator: Estimator, settings: NetworkSettings
) -> FloatArray:
    """Return by how much the logarithm of each joint's error falls on each part that is left out, (n_parts, n_v)."""
    falls = []
    for index, part in enumerate(parts):
        others = _joined([other for number, other in enumerate(parts) if number != index])
        layout = estimate.model.layout(estimate.base.independent)
        evidence = evidence_from_rows(layout, estimate.base, [others.rows], most_blocks=1)
        check_rows(evidence)
        values = estimator.solve(evidence).values
        network = _trained(others, values, settings)
        before = part.residual(values)
        after = before - part.correction(network)
        falls.append(np.log(_rms(before)) - np.log(_rms(after)))
    return np.array(falls)


def _rms(error: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.sqrt(np.mean(error**2, axis=0)), np.finfo(float).tiny))


def _trained(samples: _Samples, values: FloatArray, settings: NetworkSettings) -> ResidualNetwork:
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPRegressor

    residual = samples.residual(values)
    centre, scale = samples.motion.mean(axis=0), samples.motion.std(axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    inputs = (samples.motion - centre) / scale
    size = _rms(residual)
    network = MLPRegressor(
        hidden_layer_sizes=settings.hidden,
        activation="tanh",
        solver="lbfgs",
        alpha=settings.penalty,
        max_iter=settings.passes,
        random_state=settings.seed,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # stopped early is smoother, and judged all the same
        network.fit(inputs, np.squeeze(residual / size, axis=1) if size.size == 1 else residual / size)
    return ResidualNetwork(
        weights=tuple(network.coefs_),
        biases=tuple(network.intercepts_),
        centre=centre,
        scale=scale,
        lowest=inputs.min(axis=0),
        highest=inputs.max(axis=0),
        size=size,
    )


def _require_library() -> None:
    try:
        import sklearn  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("scikit-learn", "learning") from error


def _words(names: tuple[str, ...], gains: FloatArray, kept: FloatArray, parts: int, *, whole: bool) -> str:
    unseen = f"{parts} left-out {'recordings' if whole else 'stretches of the one recording'}"
    if not kept.any():
        best = f"best {names[int(gains.argmax())]} by {100 * gains.max():.1f} %"
        return f"switched off: on {unseen} no joint's error falls clearly, {best}"
    helped = ", ".join(f"{names[joint]} {100 * gains[joint]:.0f} %" for joint in np.flatnonzero(kept))
    return f"kept on {int(kept.sum())} of {kept.size} joints ({helped} less error on {unseen})"
