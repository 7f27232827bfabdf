"""How far the gear of a shared motor bends before it slides is told by the recordings, and its error bars know it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_arms import SETTINGS, rough_truth, slow_and_fast

from sample_arms import Truth, chain
from tauhat.dynamics import Motion
from tauhat.dynamics.terms import CouplingDahl, Dahl
from tauhat.estimation import identify
from tauhat.estimation.shape_uncertainty import ShapeSlope

MOTOR = ((1, 0, 1.0),)
DRY = {"Fv": 0.6, "Fc": (1.5, 0.8), "Iam": 0.05, "Fvm": 0.2, "Fdm": 1.0, "Fem": 0.7}


def geared(scale: float) -> Truth:
    return rough_truth(CouplingDahl(motors=MOTOR, scales=(scale,)), keys="inertia,rotor,viscous,coulomb", **DRY)


@pytest.mark.parametrize("scale", [0.5, 1.4, 2.5])
def test_the_length_of_a_shared_motor_comes_back_and_its_friction_with_it(scale: float) -> None:
    truth = geared(scale)
    model = truth.model.with_term(CouplingDahl(motors=MOTOR))
    recordings = [
        slow_and_fast(truth, seed=0, noise=0.02),
        slow_and_fast(truth, seed=50, noise=0.02, part=0.2),
    ]
    estimate = identify(model, recordings, processing=SETTINGS)
    (term,) = (own for own in estimate.model.terms if isinstance(own, CouplingDahl))
    assert term.scales == pytest.approx((scale,), rel=0.1)
    names = [estimate.base.names[index] for index in estimate.base.independent]
    error = np.abs(estimate.values - estimate.base.projection @ truth.standard)
    for name in ("Fdm_2", "Fem_2"):
        assert error[names.index(name)] < min(0.1, 2.0 * estimate.half_intervals()[names.index(name)])


def test_error_bars_know_that_the_length_was_chosen() -> None:
    truth = geared(1.4)
    recordings = [slow_and_fast(truth, seed=1, noise=0.1)]
    chosen = identify(truth.model.with_term(CouplingDahl(motors=MOTOR)), recordings, processing=SETTINGS)
    fixed = replace(chosen, covariance=_with_known_shapes(chosen, recordings))
    place = [chosen.base.names[index] for index in chosen.base.independent].index("Fdm_2")
    assert chosen.standard_errors[place] > 1.3 * fixed.standard_errors[place]


def _with_known_shapes(estimate, recordings) -> np.ndarray:
    from tauhat.estimation import WeightedLeastSquares
    from tauhat.estimation.evidence import collect_all

    evidence = collect_all(estimate.model, estimate.base, recordings, estimate.processing)
    return WeightedLeastSquares().fit(evidence).covariance


def test_slopes_of_motors_that_share_a_joint_are_those_of_each_scale_alone() -> None:
    wrist = chain(np.random.default_rng(1), "RRR")
    q = 0.002 * np.cumsum(np.random.default_rng(0).normal(size=(3, 80)), axis=1)
    motion = Motion(q=q, dq=np.zeros_like(q), ddq=np.zeros_like(q))
    term = CouplingDahl(motors=((2, 1, 1.0), (1, 0, -2.0)), scales=(1.0, 3.0))
    values = np.array([0.0, 0.0, 2.0, 0.5, 0.0, 0.0, 1.0, 1.5])
    slope = ShapeSlope(term=term, coefficients=tuple(values))
    assert [parameter.joint for parameter in slope.parameters(wrist)] == [2, 1]
    columns, _ = slope.columns(wrist, motion, None)
    for value, scales in enumerate(((1.05, 3.0), (1.0, 3.15))):
        lower = tuple(own**2 / new for own, new in zip(term.scales, scales, strict=True))
        change = _torque(replace(term, scales=scales), wrist, motion, values)
        change -= _torque(replace(term, scales=lower), wrist, motion, values)
        for joint, support in enumerate(slope.support(wrist)):
            rows = columns[joint][support == value].sum(axis=0) if (support == value).any() else np.zeros(80)
            assert np.allclose(rows, change[joint] / (2.0 * np.log(1.05)), rtol=0, atol=1e-12)


def _torque(term: CouplingDahl, robot, motion: Motion, values: np.ndarray) -> np.ndarray:
    columns, _ = term.columns(robot, motion, None)
    return np.array([values[own] @ rows for own, rows in zip(term.support(robot), columns, strict=True)])


def test_a_joint_term_has_a_slope_on_each_of_its_joints() -> None:
    wrist = chain(np.random.default_rng(1), "RRR")
    term = Dahl(scales=(1.0, 2.0, 3.0), joints=(True, False, True))
    slope = ShapeSlope(term=term, coefficients=(1.0, 0.5, 0.7, 0.2))
    assert [parameter.name for parameter in slope.parameters(wrist)] == ["dln_1", "dln_3"]
    assert [support.tolist() for support in slope.support(wrist)] == [[0], [], [1]]
