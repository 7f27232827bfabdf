"""Designing for what is still uncertain: prior information from motions and from estimates, and payload columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tauhat.dynamics import base_parameters, torque_model
from tauhat.errors import ExcitationError
from tauhat.excitation import DesignSettings, FourierSpace, design, motion_limits, random_points
from tauhat.excitation.criteria import ConditionNumber, DOptimal
from tauhat.excitation.gradient import polish
from tauhat.excitation.information import Knowledge, after_evidence, after_motions, information, payload_information
from tauhat.robots import load_robot


def two_link_space() -> FourierSpace:
    return FourierSpace(limits=motion_limits(load_robot("two_link")), period=5.0, harmonics=3)


def names_of(facts):
    return tuple(facts.model.parameters[index].name for index in facts.columns)


def test_information_adds_up_over_motions():
    facts, space = information(torque_model(load_robot("two_link"))), two_link_space()
    grid = space.grid(100)
    motions = [grid.motion(x) for x in random_points(space, 3, np.random.default_rng(0))]
    after = after_motions(facts, motions[:2])
    assert np.allclose(after.matrix(motions[2]), sum(facts.matrix(motion) for motion in motions))
    assert np.allclose(after_motions(after, motions[2:]).prior, after.matrix(motions[2]))


def test_covariance_of_an_estimate_is_information_of_its_rows():
    """A white-noise estimate from N rows of a motion knows exactly what that motion gives N rows of."""
    facts, space = information(torque_model(load_robot("two_link"))), two_link_space()
    motion = space.grid(200).motion(random_points(space, 1, np.random.default_rng(1))[0])
    noise = np.array([0.3, 0.1])
    weighted = information(facts.model, torque_noise=noise)
    unscaled = weighted.matrix(motion) * np.outer(facts.scales, facts.scales)
    covariance = np.linalg.inv(200 * unscaled)
    known = Knowledge(names=names_of(facts), covariance=covariance, torque_noise=noise, rows_per_second=40.0)
    after = after_evidence(facts, known, seconds=5.0)
    assert np.allclose(after.prior, weighted.matrix(motion), rtol=1e-6)
    assert np.allclose(after.matrix(motion), 2 * weighted.matrix(motion), rtol=1e-6)


def test_what_another_model_does_not_have_counts_as_unknown():
    facts = information(torque_model(load_robot("two_link"), "inertia,viscous,coulomb"))
    names = names_of(facts)
    known = Knowledge(
        names=("Fd_1", *names[:-1]), covariance=np.diag(np.arange(1.0, facts.n + 1)), torque_noise=np.ones(2),
        rows_per_second=1.0,
    )  # fmt: skip
    prior = after_evidence(facts, known, seconds=1.0).prior
    expected = np.append(1.0 / (np.arange(2.0, facts.n + 1) * facts.scales[:-1] ** 2), 0.0)
    assert np.allclose(prior, np.diag(expected), rtol=1e-9, atol=0)


def test_the_second_motion_looks_where_the_first_did_not():
    facts, space = information(torque_model(load_robot("two_link"), "inertia,viscous,offset")), two_link_space()
    start = random_points(space, 2, np.random.default_rng(2))
    grid = space.grid(200)
    first = grid.motion(start[0])
    blind, _ = polish(facts, space, start[1], criterion=DOptimal())
    aware, _ = polish(after_motions(facts, [first]), space, blind, criterion=DOptimal())
    together = [DOptimal().evaluate(after_motions(facts, [first]).matrix(grid.motion(x)))[0] for x in (blind, aware)]
    assert together[1] <= together[0] + 1e-6


def test_prior_enters_the_gradient():
    facts, space = information(torque_model(load_robot("two_link"), "inertia,viscous")), two_link_space()
    grid = space.grid(60)
    x, other = random_points(space, 2, np.random.default_rng(3))
    after = after_motions(facts, [grid.motion(other)])
    direction = np.random.default_rng(4).normal(size=space.shape)

    def value(step: float) -> float:
        return ConditionNumber().evaluate(after.matrix(grid.motion(x + step * direction)))[0]

    _, gradient = after.evaluate(grid.motion(x), ConditionNumber())
    expected = (8 * (value(1e-4) - value(-1e-4)) - (value(2e-4) - value(-2e-4))) / 12e-4
    assert (grid.pull(gradient) * direction).sum() == pytest.approx(expected, rel=1e-6)


def test_an_estimate_that_knows_nothing_of_the_model_is_refused():
    facts = information(torque_model(load_robot("two_link"), "inertia"))
    with pytest.raises(ExcitationError, match="knows no parameter of this model"):
        after_evidence(
            facts, Knowledge(names=("nothing",), covariance=np.eye(1), torque_noise=np.ones(2), rows_per_second=1.0),
            seconds=10.0,
        )  # fmt: skip
    with pytest.raises(ExcitationError, match="must be positive"):
        Knowledge(names=("nothing",), covariance=np.eye(1), torque_noise=np.zeros(2), rows_per_second=1.0)


def test_a_payload_motion_sees_all_ten_parameters_of_the_last_link():
    robot = load_robot("ur5e")
    model = torque_model(robot, "inertia")
    facts = payload_information(model)
    assert [model.parameters[index].joint for index in facts.columns] == [5] * 10
    assert base_parameters(model).n_b == 36  # of which far fewer than ten are of the last link alone
    planar = payload_information(torque_model(load_robot("two_link"), "inertia"))
    names = {planar.model.parameters[index].symbol for index in planar.columns}
    assert len(names) == 4  # a planar arm feels mass, two first moments and one inertia
    with pytest.raises(ExcitationError, match="no inertia of a last link"):
        payload_information(torque_model(robot, "viscous"))


SHORT = DesignSettings(period=5.0, harmonics=3)


def test_the_figures_of_a_later_design_count_the_earlier_ones():
    robot = load_robot("two_link")
    first = design(robot, rng=np.random.default_rng(0), settings=SHORT)
    assert first.mean_error_before == np.inf
    settings = replace(SHORT, earlier=(first.trajectory,))
    second = design(robot, rng=np.random.default_rng(1), settings=settings)
    assert second.mean_error_before == pytest.approx(first.mean_error, rel=1e-2)  # on grids of one offset
    grid, facts = two_link_space().grid(2000), information(torque_model(robot))
    space = grid.space
    both = sum(facts.matrix(grid.motion(space.point(found.trajectory))) for found in (first, second))
    assert second.log_det == pytest.approx(np.linalg.slogdet(both)[1], abs=0.1)
    same = design(robot, rng=np.random.default_rng(0), settings=settings)
    assert max(second.log_det, same.log_det) > first.log_det + facts.n * np.log(2)  # than the first run twice


def test_an_earlier_motion_of_another_period_is_refused():
    robot = load_robot("two_link")
    first = design(robot, rng=np.random.default_rng(0), settings=SHORT)
    with pytest.raises(ExcitationError, match="another period"):
        DesignSettings(period=6.0, earlier=(first.trajectory,))


def test_a_motion_designed_for_a_payload_sees_it_better_than_one_for_the_whole_arm():
    robot = load_robot("ur5e")
    whole, payload = (
        design(robot, rng=np.random.default_rng(0), settings=replace(SHORT, counted=counted), terms="inertia")
        for counted in (information, payload_information)
    )
    facts = payload_information(torque_model(robot, "inertia"))
    grid = FourierSpace(limits=motion_limits(robot), period=5.0, harmonics=3).grid(1000)
    spectra = [
        np.linalg.eigvalsh(facts.matrix(grid.motion(grid.space.point(found.trajectory)))) for found in (whole, payload)
    ]
    conditions = [np.sqrt(spectrum[-1] / spectrum[0]) for spectrum in spectra]
    assert payload.condition == pytest.approx(conditions[1], rel=1e-3)
    assert conditions[1] < conditions[0]
