"""Workers that read logs where they are give the estimate that one process gives that has read them all."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

from sample_arms import planar_arm, planar_truth
from tauhat.cluster import ClusterWorkers
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError, RecordingError, TauhatWarning
from tauhat.estimation import (
    ESTIMATORS,
    EssentialLeastSquares,
    Estimate,
    HuberLeastSquares,
    OrdinaryLeastSquares,
    PhysicalConstraints,
    PriorLeastSquares,
    TotalLeastSquares,
    WeightedLeastSquares,
    identify,
    identify_files,
    survey_logs,
)
from tauhat.estimation.many_logs import check_evidence_alone
from tauhat.estimation.tuning import MOST_SAMPLES, sampled_rows
from tauhat.recordings import LogSource, Processing, write_recording
from tauhat.workers import LocalWorkers
from two_workers import LosingWorkers, cluster_of

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
ROBUST = torque_model(planar_arm(), "robust")
COUNT = 5  # merged as a tree, (12)(34) 5, they are not merged in a row
HERE = LocalWorkers(count=1)


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> tuple[LogSource, ...]:
    folder = tmp_path_factory.mktemp("logs")
    paths = [folder / f"run-{seed}.parquet" for seed in range(COUNT)]
    for seed, path in enumerate(paths):
        seconds = 5.0 + 0.5 * seed
        noise = np.random.default_rng(seed).normal(size=(round(200 * seconds), 2)) * [0.4, 0.2]
        write_recording(TRUTH.recording(seed=seed, seconds=seconds, noise=noise), path)
    return tuple(LogSource(path=path) for path in paths)


@pytest.fixture(scope="module")
def workers() -> Iterator[ClusterWorkers]:
    with cluster_of(2) as address:
        yield ClusterWorkers(address=address)


def assert_same(one: Estimate, other: Estimate, *, tolerance: float = 1e-9) -> None:
    assert one.model.fingerprint == other.model.fingerprint
    assert (one.processing, one.inputs, one.estimator) == (other.processing, other.inputs, other.estimator)
    assert (one.rank, one.degrees, one.passes) == (other.rank, other.degrees, other.passes)
    for name in ("values", "covariance", "joint_rms", "torque_rms", "top_speeds"):
        ours, theirs = getattr(one, name), getattr(other, name)
        assert np.abs(ours - theirs).max() <= tolerance * np.abs(ours).max(), name


def test_a_cluster_gives_the_estimate_of_one_process_also_where_passes_follow_each_other(sources, workers):
    recordings = [source.read() for source in sources]
    here = identify(ROBUST, recordings)
    assert any(term.iterated and term.joints != (False, False) for term in here.model.terms)
    assert_same(identify_files(ROBUST, survey_logs(sources, workers=workers)), here)


def test_workers_killed_while_they_read_and_collect_change_nothing(sources, workers, tmp_path):
    losing = LosingWorkers(workers, tmp_path)
    found = identify_files(TRUTH.model, survey_logs(sources, workers=losing), processing=SETTINGS)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map", "reduce"]
    assert_same(found, identify(TRUTH.model, [source.read() for source in sources], processing=SETTINGS))


@pytest.mark.parametrize(
    "estimator",
    [
        OrdinaryLeastSquares(),
        WeightedLeastSquares(power=1.0),
        TotalLeastSquares(),
        PriorLeastSquares(),
        EssentialLeastSquares(),
    ],
    ids=lambda method: method.key,
)
def test_every_method_on_evidence_gives_the_same(sources, estimator):
    logs = survey_logs(sources[:2], workers=HERE)
    recordings = [source.read() for source in sources[:2]]
    found = identify_files(TRUTH.model, logs, estimator=estimator, processing=SETTINGS)
    assert_same(found, identify(TRUTH.model, recordings, estimator=estimator, processing=SETTINGS))


def test_physical_constraints_and_a_cutoff_are_taken_along(sources):
    logs = survey_logs(sources[:2], workers=HERE)
    choices = {"cutoff": 8.0, "constraints": PhysicalConstraints()}
    found = identify_files(TRUTH.model, logs, **choices)
    assert found.processing.cutoff == 8.0
    here = identify(TRUTH.model, [source.read() for source in sources[:2]], **choices)
    assert_same(found, here)
    assert np.allclose(found.standard, here.standard, rtol=0, atol=1e-9)


def test_window_map_and_period_travel_with_the_log(sources, tmp_path):
    (tmp_path / "half.toml").write_text(
        '[time]\ncolumn = "t"\n[position]\ncolumns = ["q_1", "q_2"]\nunit = "rad"\n'
        '[torque]\ncolumns = ["tau_1", "tau_2"]\nunit = "Nm"\ngain = 0.5\n'
    )
    whole, source = sources[0].read(), replace(sources[0], map=tmp_path / "half.toml", rows=(100, 900))
    part = source.read()
    assert part.n_t == 800
    assert np.allclose(part.tau, 0.5 * whole.tau[100:900])
    assert replace(sources[0], period=1.5).read().duration == pytest.approx(1.5, abs=0.02)


def test_methods_that_read_every_row_are_refused_by_name(sources):
    with pytest.raises(ModelError, match=r"irls-huber reads every row .* expected ols, wls, .*; take one of these"):
        identify_files(TRUTH.model, survey_logs(sources, workers=HERE), estimator=HuberLeastSquares())
    with pytest.raises(ModelError, match="irls-huber reads every row"):
        check_evidence_alone(EssentialLeastSquares(inner=HuberLeastSquares()))
    kept = set()
    for key, method in ESTIMATORS.items():
        try:
            check_evidence_alone(method())
        except ModelError:
            continue
        kept.add(key)
    assert kept == {"ols", "wls", "tls", "ridge", "prior"}


def test_what_cannot_be_read_is_named_whoever_reads_it(sources, workers, tmp_path):
    for readers in (HERE, workers):
        with pytest.raises(RecordingError, match=r"missing\.parquet"):
            survey_logs([*sources, LogSource(path=tmp_path / "missing.parquet")], workers=readers)
    with pytest.raises(ModelError, match="no recording"):
        survey_logs([], workers=HERE)


def test_logs_of_another_robot_are_refused(sources, tmp_path):
    one = TRUTH.recording(seconds=5.0)
    write_recording(replace(one, q=one.q[:, :1], dq=None, tau=one.tau[:, :1], joint_names=()), tmp_path / "one.parquet")
    with pytest.raises(
        RecordingError, match=r"one: the logs are not of one robot; expected 2 joints, as in run-0, got 1"
    ):
        survey_logs([sources[0], LogSource(path=tmp_path / "one.parquet")], workers=HERE)
    with pytest.raises(RecordingError, match=r"one: the logs do not fit the robot; expected 2 joints"):
        identify_files(TRUTH.model, survey_logs([LogSource(path=tmp_path / "one.parquet")], workers=HERE))


def test_doubts_about_a_log_come_home_once(sources, workers, tmp_path):
    lines = Path(tmp_path / "twice.csv")
    run = sources[0].read()
    rows = np.column_stack([run.t, run.q, run.tau])
    rows = np.insert(rows, 50, rows[50], axis=0)
    np.savetxt(lines, rows, delimiter=",", header="t,q_1,q_2,tau_1,tau_2", comments="", fmt="%.17g")
    with pytest.warns(TauhatWarning, match=r"twice\.csv: 1 exact duplicate rows dropped") as caught:
        logs = survey_logs([LogSource(path=lines), sources[1]], workers=workers)
    assert len(caught) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        identify_files(TRUTH.model, replace(logs, workers=HERE), processing=SETTINGS)


def test_the_sample_has_a_share_of_each_log_and_of_many_twenty():
    assert sampled_rows([3000, 4000]) == {0: 3000, 1: 4000}
    assert sampled_rows([30_000, 10_000]) == {0: 15_000, 1: 5000}
    many = sampled_rows([5000] * 1000)
    assert len(many) == 20
    assert {0, 999} <= set(many)
    assert sum(many.values()) <= MOST_SAMPLES
    assert sampled_rows([500, 60_000])[0] == 500


def test_error_bars_do_not_depend_on_the_order_in_which_logs_are_named(sources):
    recordings = [source.read() for source in sources]
    expected = identify(TRUTH.model, recordings, processing=SETTINGS)
    for order in ([4, 2, 0, 1, 3], [3, 4, 1, 0, 2]):
        other = identify(TRUTH.model, [recordings[place] for place in order], processing=SETTINGS)
        assert_same(replace(other, inputs=expected.inputs), expected)
