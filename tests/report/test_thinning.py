from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tauhat.report import thinned, thinned_cloud

lengths = st.integers(1, 5000)
budgets = st.integers(8, 300)
seeds = st.integers(0, 2**16)


@given(lengths, budgets, seeds)
def test_thinning_stays_within_its_budget_and_in_order(n: int, most: int, seed: int) -> None:
    kept = thinned(np.random.default_rng(seed).normal(size=n), most=most)
    assert kept.size <= most
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == n - 1


@given(lengths, budgets, seeds)
def test_the_extremes_survive_thinning(n: int, most: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=n)
    kept = values[thinned(values, most=most)]
    assert kept.max() == values.max()
    assert kept.min() == values.min()


@given(st.integers(100, 5000), budgets, st.data())
def test_a_spike_of_one_sample_survives_wherever_it_is(n: int, most: int, data: st.DataObject) -> None:
    spike = data.draw(st.integers(0, n - 1))
    sign = data.draw(st.sampled_from([-1.0, 1.0]))
    values = np.zeros(n)
    values[spike] = sign
    assert spike in thinned(values, most=most)


@given(st.integers(1, 3000), st.integers(8, 100))
def test_every_stretch_between_kept_samples_lies_within_its_neighbourhood(n: int, most: int) -> None:
    values = np.cumsum(np.random.default_rng(n).normal(size=n))
    kept = thinned(values, most=most)
    width = 2 * (2 * n // most + 2)  # two buckets: one holds the sample, the neighbours hold what is drawn around it
    for k in range(0, n, max(1, n // 50)):
        near = kept[np.abs(kept - k) <= width]
        assert values[near].min() <= values[k] <= values[near].max()


def test_a_short_series_is_kept_whole() -> None:
    assert thinned(np.arange(50.0), most=50).tolist() == list(range(50))
    assert thinned_cloud(np.arange(50.0), np.ones(50), most=50).tolist() == list(range(50))


@given(st.integers(100, 5000), budgets, seeds)
def test_a_thinned_cloud_keeps_outliers_and_its_bulk(n: int, most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=n), rng.normal(size=n)
    kept = thinned_cloud(x, y, most=most)
    assert kept.size <= max(most, 8)
    assert np.unique(kept).size == kept.size
    assert {int(y.argmax()), int(y.argmin()), int(x.argmax()), int(x.argmin())} <= set(kept.tolist())
    even = np.linspace(0, n - 1, most // 2).astype(int)
    assert n <= most or set(even.tolist()) <= set(kept.tolist())
