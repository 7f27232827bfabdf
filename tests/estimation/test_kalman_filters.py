"""Kalman filters: the textbook's in the linear case, both forms one filter, recovery, a stop when they diverge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from filter_problems import (
    POSITION_NOISE,
    TORQUE_NOISE,
    exact_problem,
    names,
    noisy,
    noisy_problem,
    problem_of,
    true_values,
    truth,
)

from sample_arms import Truth, chain, motion_from_rest
from tauhat.dynamics import TorqueModel, base_parameters, torque_model
from tauhat.dynamics.terms import Coupling, Inertia, RotorInertia, Viscous
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation import OrdinaryLeastSquares, WeightedLeastSquares
from tauhat.estimation.filters import (
    CentralDifference,
    CentralDifferenceKalman,
    Diffuse,
    Extended,
    FirstStretch,
    Given,
    InnovationTest,
    KalmanFilter,
    Nominal,
    ParameterKalman,
    PlainCovariance,
    SquareRoot,
    SquareRootCentralDifferenceKalman,
    SquareRootExtendedKalman,
    SquareRootUnscentedKalman,
    StateKalman,
    StateNoise,
    Unscented,
    UnscentedKalman,
)
from tauhat.estimation.filters.acceleration import point_accelerations
from tauhat.estimation.filters.outcome import residual_weights
from tauhat.estimation.filters.samples import row_samples
from tauhat.recordings.recording import Recording

SPREADINGS = (Extended(), Unscented(), CentralDifference())
FORMS = (PlainCovariance(), SquareRoot())
FILTERS = [KalmanFilter(spreading=spreading, form=form) for spreading in SPREADINGS for form in FORMS]
PAIRS = [
    (StateKalman, SquareRootExtendedKalman),
    (UnscentedKalman, SquareRootUnscentedKalman),
    (CentralDifferenceKalman, SquareRootCentralDifferenceKalman),
]
BOUND = 4.5  # standard errors that none of 13 parameters over the seeds may be off


def positive(rng: np.random.Generator, n: int) -> np.ndarray:
    root = rng.normal(size=(n, n))
    return root @ root.T + np.eye(n)


@pytest.mark.parametrize("kalman", FILTERS, ids=str)
def test_a_linear_step_is_the_textbooks(kalman):
    rng = np.random.default_rng(3)
    mean, covariance, measured = rng.normal(size=4), positive(rng, 4), rng.normal(size=2)
    F, H, q, r = rng.normal(size=(4, 4)), rng.normal(size=(2, 4)), positive(rng, 4), positive(rng, 2)
    belief = kalman.start(mean, covariance)
    belief = kalman.predict(belief, lambda points: points @ F.T, np.linalg.cholesky(q))
    ahead = F @ covariance @ F.T + q
    assert np.allclose(belief.mean, F @ mean)
    assert np.allclose(kalman.covariance(belief), ahead)
    after, innovation = kalman.correct(belief, lambda points: points @ H.T, measured, np.linalg.cholesky(r))
    spread = H @ ahead @ H.T + r
    gain = ahead @ H.T @ np.linalg.inv(spread)
    residual = measured - H @ F @ mean
    assert np.allclose(after.mean, F @ mean + gain @ residual)
    assert np.allclose(kalman.covariance(after), ahead - gain @ spread @ gain.T)
    assert np.isclose(innovation.surprise, residual @ np.linalg.inv(spread) @ residual / 2)


def test_sigma_points_and_differences_see_curvature_and_slopes_do_not():
    rng = np.random.default_rng(5)
    mean, covariance, bend = rng.normal(size=3), positive(rng, 3), positive(rng, 3)

    def bowl(points):
        return np.einsum("ki,ij,kj->k", points, bend, points)[:, None]

    root = np.linalg.cholesky(covariance)
    exact = mean @ bend @ mean + np.trace(bend @ covariance)
    assert np.isclose(Unscented().through(bowl, mean, root).mean[0], exact)
    assert np.isclose(CentralDifference().through(bowl, mean, root).mean[0], exact)
    assert np.isclose(Extended().through(bowl, mean, root).mean[0], mean @ bend @ mean)


@pytest.mark.parametrize("spreading", SPREADINGS, ids=str)
def test_the_columns_of_the_argument_are_a_root_of_its_covariance(spreading):
    covariance = positive(np.random.default_rng(1), 5)
    spread = spreading.through(np.sin, np.zeros(5), np.linalg.cholesky(covariance))
    assert np.allclose(spread.argument @ spread.argument.T, covariance)


@pytest.mark.parametrize("forgetting", [1.0, 0.995])
def test_the_filter_on_rows_is_recursive_least_squares(forgetting):
    problem = noisy_problem(0)
    n_b = problem.base.n_b
    _, weights = residual_weights(problem.evidence)
    samples = list(row_samples(problem))
    given = Given(values=(0.1,) * n_b, deviations=(2.0,) * n_b)
    information, right = np.eye(n_b) / 4.0, 0.1 * np.ones(n_b) / 4.0
    for sample in samples:
        scaled = weights[:, None] * sample.columns
        information = forgetting * information + scaled.T @ scaled
        right = forgetting * right + scaled.T @ (weights * sample.tau)
    expected = np.linalg.solve(information, right)
    for kalman in FILTERS:
        method = ParameterKalman(filter=kalman, beginning=given, forgetting=forgetting)
        assert np.allclose(method.fit_problem(problem).values, expected, rtol=1e-7, atol=1e-9), kalman


def test_from_a_diffuse_beginning_the_filter_ends_where_weighted_least_squares_does():
    problem = noisy_problem(1)
    solution = ParameterKalman().fit_problem(problem)
    _, weights = residual_weights(problem.evidence)
    rows = [(weights[:, None] * sample.columns, weights * sample.tau) for sample in row_samples(problem)]
    expected = np.linalg.lstsq(np.vstack([w for w, _ in rows]), np.concatenate([t for _, t in rows]))[0]
    assert np.allclose(solution.values, expected, rtol=1e-4, atol=1e-6)
    assert solution.cause == "last row reached"


@pytest.mark.parametrize(("plain", "root"), PAIRS)
def test_the_square_root_form_is_the_same_filter(plain, root):
    problem = noisy_problem(0, 4.0)
    one, other = plain().fit_problem(problem), root().fit_problem(problem)
    assert np.allclose(one.values, other.values, rtol=1e-6, atol=1e-8)
    assert np.allclose(one.covariance, other.covariance, rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize("method", [StateKalman(), SquareRootUnscentedKalman(), CentralDifferenceKalman()])
def test_state_filters_recover_the_parameters_inside_their_errors(method):
    for seed in range(3):
        solution = method.fit_problem(noisy_problem(seed))
        error = np.abs(solution.values - true_values()) / np.sqrt(np.diag(solution.covariance))
        assert error.max() < BOUND
        assert solution.cause == "last sample reached"


def test_a_state_filter_that_knows_its_noise_is_as_good_as_least_squares_on_the_same_stretch():
    noise = StateNoise(torque=(TORQUE_NOISE / 10**0.5,) * 2, position=(POSITION_NOISE,) * 2)
    for seed in range(3):
        problem = noisy_problem(seed)
        solution = SquareRootExtendedKalman(noise=noise).fit_problem(problem)
        rest = problem_of(*FirstStretch().of(problem).recordings)
        limit = 3.0 * np.sqrt(np.trace(WeightedLeastSquares(power=1.0).fit(rest.evidence).covariance))
        assert np.linalg.norm(solution.values - true_values()) < limit


def test_measured_velocities_are_measurements_where_the_processing_takes_them():
    recording = truth().recording(seconds=8.0, rate=500.0)
    rng = np.random.default_rng(8)
    noise = 1e-3 * rng.normal(size=recording.q.shape)
    logged = replace(noisy(recording, 8), dq=recording.dq + noise)
    problem = problem_of(logged)
    faster = replace(problem, processing=replace(problem.processing, velocity="velocity"))
    with_it, without = (StateKalman().fit_problem(item) for item in (faster, problem))
    assert not np.allclose(with_it.values, without.values, atol=1e-6)
    assert (np.abs(with_it.values - true_values()) < BOUND * np.sqrt(np.diag(with_it.covariance))).all()


def test_accelerations_undo_the_torque_of_the_truth():
    q, dq, ddq = motion_from_rest(2, np.arange(0.0, 4.0, 0.02), seed=4)
    model = truth().model
    forward = point_accelerations(model, base_parameters(model))
    found = forward.at(q, dq, truth().torque(q, dq, ddq), np.tile(true_values(), (q.shape[0], 1)))
    assert np.allclose(found, ddq, atol=1e-9)


def test_accelerations_undo_the_torque_of_an_arm_whose_motor_turns_with_two_joints():
    arm = chain(np.random.default_rng(7), "RRR")
    shared = Coupling(motors=((2, 1, -1.5),), widths=(0.2,))
    model = TorqueModel(robot=arm, terms=(Inertia(), RotorInertia(), Viscous(), shared))
    standard = np.concatenate([arm.inertia.ravel(), np.full(3, 0.8), np.full(3, 2.0), [0.2, 0.7, 1.1]])
    base = base_parameters(model)
    q, dq, ddq = motion_from_rest(3, np.arange(0.0, 4.0, 0.02), seed=4)
    torque = Truth(model, standard).torque(q, dq, ddq)
    found = point_accelerations(model, base).at(q, dq, torque, np.tile(base.projection @ standard, (q.shape[0], 1)))
    assert "Iam_3" in {base.names[index] for index in base.independent}
    assert np.allclose(found, ddq, atol=1e-9)


def test_a_filter_that_believes_a_wrong_beginning_is_stopped_by_its_innovations():
    wrong = Given(values=tuple(3.0 * true_values()), deviations=(1e-4,) * true_values().size)
    with pytest.warns(TauhatWarning, match="times as large as the filter expects"):
        solution = SquareRootExtendedKalman(beginning=wrong).fit_problem(noisy_problem(0))
    assert "diverged at" in solution.cause
    assert solution.advice
    assert np.isfinite(solution.values).all()
    assert np.isfinite(solution.covariance).all()


def test_a_filter_that_begins_with_no_robot_is_stopped():
    wrong = Given(values=tuple(-true_values()), deviations=(0.1,) * true_values().size)
    with pytest.warns(TauhatWarning, match="mass matrix is not positive definite"):
        solution = StateKalman(beginning=wrong).fit_problem(noisy_problem(0))
    assert np.isfinite(solution.values).all()


def test_the_plain_form_is_stopped_where_rounding_eats_its_covariance_and_the_root_form_is_not():
    far = Diffuse(size=1e9)
    with pytest.warns(TauhatWarning, match="covariance lost its positive definiteness"):
        ParameterKalman(filter=KalmanFilter(form=PlainCovariance()), beginning=far).fit_problem(exact_problem())
    solution = ParameterKalman(beginning=far).fit_problem(exact_problem())
    assert np.allclose(solution.values, true_values(), atol=1e-3)


def test_a_jump_of_the_torque_in_the_middle_is_noticed():
    recording = truth().recording(seconds=8.0, rate=500.0)
    torque = recording.tau.copy()
    torque[2500:] *= -1.0
    quiet = StateNoise(torque=(0.03, 0.03), position=(1e-4, 1e-4))
    method = SquareRootExtendedKalman(noise=quiet, test=InnovationTest(limit=20.0))
    with pytest.warns(TauhatWarning, match="diverged at"):
        solution = method.fit_problem(problem_of(replace(recording, tau=torque)))
    assert np.isfinite(solution.values).all()


def test_beginning_from_the_description_knows_its_inertia():
    problem = exact_problem()
    start = Nominal().of(problem)
    rigid = [k for k, name in enumerate(problem.base.names) if "_" in name and name[0] in "mI" and name[:2] != "Ia"]
    standard = np.zeros(problem.base.projection.shape[1])
    standard[rigid] = truth().standard[rigid]
    assert np.allclose(start.mean, problem.base.projection @ standard)
    assert (np.diag(start.covariance) > 0.0).all()


def test_the_first_stretch_is_not_filtered_again():
    problem = exact_problem()
    rest = FirstStretch(share=0.25).of(problem).recordings[0]
    assert rest.n_t == problem.recordings[0].n_t - problem.recordings[0].n_t // 4


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: Unscented(reach=0.0), "reach"),
        (lambda: CentralDifference(step=-1.0), "step"),
        (lambda: InnovationTest(limit=0.5), "innovation test"),
        (lambda: ParameterKalman(forgetting=1.1), "forgetting"),
        (lambda: StateKalman(rate=0.0), "rate"),
        (lambda: FirstStretch(share=1.0), "share"),
        (lambda: Diffuse(size=0.0), "size"),
        (lambda: Given(values=(1.0,), deviations=(1.0,)).of(exact_problem()), "do not fit"),
        (lambda: Given(values=(1.0,) * 13, deviations=(0.0,) * 13).of(exact_problem()), "not positive"),
        (lambda: StateNoise(torque=(1.0,)).chosen("torque", np.ones(2)), "noise of the torque"),
        (lambda: StateKalman().fit(exact_problem().evidence), "evidence is not enough"),
        (lambda: FirstStretch(share=1e-3).of(exact_problem()), "too short"),
    ],
)
def test_bad_settings_are_refused(act, words):
    with pytest.raises(ModelError, match=words):
        act()


def test_terms_with_a_memory_are_refused_by_state_filters():
    problem = exact_problem()
    model = torque_model(truth().model.robot, "inertia,rotor,viscous,dahl,offset")
    with pytest.raises(ModelError, match="dahl"):
        StateKalman().fit_problem(replace(problem, model=model))


def test_a_robot_without_masses_cannot_be_begun_from():
    problem = exact_problem()
    joints = tuple(replace(joint, inertia=np.zeros(10)) for joint in problem.model.robot.joints)
    bare = replace(problem, model=replace(problem.model, robot=replace(problem.model.robot, joints=joints)))
    with pytest.raises(ModelError, match="no masses"):
        Nominal().of(bare)


def test_too_short_a_log_is_refused_before_anything_is_filtered():
    recording = truth().recording(seconds=8.0, rate=500.0)
    short = Recording(t=recording.t[:40], q=recording.q[:40], tau=recording.tau[:40])
    problem = replace(exact_problem(), recordings=(short,))
    with pytest.raises(ModelError):
        StateKalman().fit_problem(problem)


def test_solve_alone_is_weighted_least_squares_for_what_settles_before():
    evidence = noisy_problem(0).evidence
    near = OrdinaryLeastSquares().solve(evidence).values
    assert np.allclose(StateKalman().solve(evidence).values, near, atol=0.05)


def test_a_wide_band_lets_torque_noise_raise_the_inertias():
    recording = truth().recording(seconds=8.0, rate=500.0)
    inertial = [names().index(name) for name in ("Izz_1", "Ia_2")]
    excess = {2.0: [], 40.0: []}
    for seed in range(3):
        rng = np.random.default_rng(seed)
        loud = replace(recording, tau=recording.tau + 0.6 * rng.normal(size=recording.q.shape))
        precise = replace(loud, q=recording.q + 1e-6 * rng.normal(size=recording.q.shape))
        for band, found in excess.items():
            method = SquareRootExtendedKalman(band=band, beginning=near_truth())
            found.append((method.fit_problem(problem_of(precise)).values - true_values())[inertial])
    wide, narrow = np.mean(excess[40.0], axis=0), np.mean(excess[2.0], axis=0)
    assert wide[0] > 0.05 * true_values()[inertial[0]]
    assert np.abs(narrow[0]) < 0.3 * wide[0]


def near_truth() -> Given:
    return Given(values=tuple(true_values()), deviations=tuple(0.1 * np.abs(true_values()) + 0.02))
