"""Adaline and Hopfield-Tank: they settle where least squares is, say so, and say when they did not."""

from __future__ import annotations

import numpy as np
import pytest
from filter_problems import exact_problem, noisy_problem, true_values

from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.filters import Adaline, HopfieldTank, ParameterKalman
from tauhat.estimation.filters.recursions import scaled_rows


@pytest.mark.parametrize("method", [Adaline(tolerance=1e-5), HopfieldTank()])
def test_without_noise_recursions_find_the_truth(method):
    solution = method.fit_problem(exact_problem())
    assert "settled after" in solution.cause
    assert np.abs(solution.values - true_values()).max() < 0.01 * np.abs(true_values()).max()


def test_hopfield_ends_where_weighted_least_squares_does():
    problem = noisy_problem(2)
    found, expected = HopfieldTank().fit_problem(problem), ParameterKalman().fit_problem(problem)
    assert np.allclose(found.values, expected.values, atol=2e-3)


@pytest.mark.parametrize("seed", [0, 3])
def test_adaline_ends_inside_its_errors(seed):
    solution = Adaline().fit_problem(noisy_problem(seed))
    assert (np.abs(solution.values - true_values()) < 4.5 * np.sqrt(np.diag(solution.covariance))).all()


def test_one_step_of_adaline_with_mu_one_satisfies_its_row():
    rows = scaled_rows(exact_problem())
    values = Adaline().move(np.ones(rows.units.size), rows.matrix[7], rows.target[7], step=1.0)
    assert np.isclose(rows.matrix[7] @ values, rows.target[7])


def test_the_energy_of_the_neurons_never_rises():
    rows = scaled_rows(noisy_problem(0))
    n = rows.target.size
    gram, right = rows.matrix.T @ rows.matrix / n, rows.matrix.T @ rows.target / n
    method, neurons, size = HopfieldTank(), np.zeros(rows.units.size), 20.0 * np.sqrt(np.mean(rows.target**2))
    energies = []
    for _ in range(500):
        values = size * np.tanh(neurons)
        energies.append(0.5 * values @ gram @ values - right @ values)
        neurons = method.move(neurons, gram, right, size=size)
    assert (np.diff(energies) <= 0.0).all()
    assert energies[-1] < energies[0]


def test_a_motion_that_tells_parameters_badly_apart_leaves_adaline_behind_and_it_says_so():
    problem = noisy_problem(1)
    with pytest.warns(TauhatWarning, match="not settled after 200 passes"):
        slow = Adaline().fit_problem(problem)
    quick = HopfieldTank().fit_problem(problem)
    assert slow.condition > 20.0
    assert np.linalg.norm(slow.values - true_values()) > 3.0 * np.linalg.norm(quick.values - true_values())


def test_too_few_passes_are_told():
    with pytest.warns(TauhatWarning, match="not settled after 2 passes"):
        solution = Adaline(passes=2, tolerance=1e-9).fit_problem(noisy_problem(0))
    assert "passes" in solution.advice
    with pytest.warns(TauhatWarning, match="not settled after 3 passes"):
        HopfieldTank(passes=3, tolerance=1e-12).fit_problem(noisy_problem(0))


def test_a_box_that_is_too_small_is_told():
    with pytest.warns(TauhatWarning, match="met their box"):
        solution = HopfieldTank(box=0.05).fit_problem(noisy_problem(0))
    assert np.isfinite(solution.values).all()


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: Adaline(step=2.0), "step of least mean squares"),
        (lambda: Adaline(passes=0), "passes"),
        (lambda: HopfieldTank(box=0.0), "box"),
        (lambda: HopfieldTank(tolerance=1.0), "tolerance"),
    ],
)
def test_bad_settings_are_refused(act, words):
    with pytest.raises(ModelError, match=words):
        act()
