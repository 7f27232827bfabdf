"""A payload comes back from a loaded and an unloaded run, inside its error bars, as a body that physics allows."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from loaded_arms import ABOUT, CENTRE, EMPTY, MASS, PAYLOAD, SETTINGS, carrying, measured

from sample_arms import Truth, motion_from_rest, random_inertia
from tauhat.dynamics import inverse_dynamics, torque_model
from tauhat.dynamics.terms import LoadCoulomb
from tauhat.errors import ModelError, RecordingError, TauhatWarning
from tauhat.estimation import Estimate, identify, load_estimate, payload_fit
from tauhat.estimation.payload import KnownPayload, Payload, identify_payload
from tauhat.estimation.payload_body import central_jacobian
from tauhat.estimation.physical_constraints import Box
from tauhat.estimation.pseudo_inertia import margins
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots import load_robot
from tauhat.robots.joint import central_inertia
from tauhat.verification import verify

LOADED = carrying(EMPTY)
SEEDS = range(40)


def weighed(seed: int = 0, *, size: float = 0.0, together: bool = False, known: KnownPayload | None = None) -> Payload:
    before = measured(EMPTY, seed=seed, size=size)
    estimate = identify(EMPTY.model, [before], processing=SETTINGS)
    after = measured(LOADED, seed=1000 + seed, size=size)
    return identify_payload(estimate, [after], unloaded=[before] if together else (), known=known)


@pytest.mark.parametrize("together", [False, True])
def test_a_payload_comes_back_from_clean_runs(together):
    payload = weighed(together=together)
    assert payload.body.mass == pytest.approx(MASS, rel=2e-3)
    assert np.allclose(payload.body.centre[:2], CENTRE[:2], atol=1e-3)
    assert payload.body.inertia[2, 2] == pytest.approx(ABOUT, rel=0.02)
    assert payload.relative_rms < 2e-3


@pytest.mark.parametrize("together", [False, True])
def test_95_percent_intervals_cover_mass_centre_and_inertia_at_that_rate(together):
    bodies = [weighed(seed, size=0.3, together=together).free_body for seed in SEEDS]
    found = np.array([[body.mass, *body.centre[:2], body.inertia[2, 2]] for body in bodies])
    halves = np.array([[body.mass_half, *body.centre_half[:2], body.inertia_half[2, 2]] for body in bodies])
    errors = found - [MASS, CENTRE[0], CENTRE[1], ABOUT]
    coverage = np.mean(np.abs(errors) < halves, axis=0)
    assert coverage.mean() >= 0.92
    assert coverage.min() >= 0.88
    assert (halves.mean(axis=0) < 3.0 * errors.std(axis=0)).all()  # and no wider than the rate needs


def test_error_bars_contain_what_the_estimate_did_not_know():
    before = measured(EMPTY, seed=0, size=0.3)
    after = measured(LOADED, seed=1000, size=0.3)
    estimate = identify(EMPTY.model, [before], processing=SETTINGS)
    certain = replace(estimate, covariance=np.zeros_like(estimate.covariance))
    whole, own = (identify_payload(one, [after]).body for one in (estimate, certain))
    assert whole.mass == own.mass
    assert whole.mass_half > 1.1 * own.mass_half


def test_what_moves_no_joint_is_not_called_visible():
    body = weighed(size=0.1).body
    assert body.centre_seen == (True, True, False)
    assert body.inertia_seen == ((False,) * 3, (False,) * 3, (False, False, True))
    plain = weighed(size=0.1).to_dict()
    assert plain["centre"][2] is None
    assert plain["inertia"][0] == [None, None, None]
    assert plain["inertia"][2][2] == pytest.approx(ABOUT, rel=0.2)


def test_an_inertia_that_the_noise_hides_is_not_called_visible():
    hidden = carrying(EMPTY, PAYLOAD * np.array([1.0] * 9 + [0.0]) + np.eye(10)[9] * (MASS * CENTRE @ CENTRE + 1e-4))
    before, after = measured(EMPTY, seed=0, size=1.0), measured(hidden, seed=1, size=1.0)
    body = identify_payload(identify(EMPTY.model, [before], processing=SETTINGS), [after]).body
    assert body.inertia_half[2, 2] > 1e-3
    assert not body.inertia_seen[2][2]
    assert body.centre_seen[:2] == (True, True)


def test_all_ten_parameters_come_back_on_a_spatial_arm():
    robot, payload = load_robot("ur5e"), random_inertia(np.random.default_rng(3))
    carrier = [*robot.joints[:-1], replace(robot.joints[-1], inertia=robot.joints[-1].inertia + payload)]
    t = np.arange(0.0, 20.0, 0.005)
    q, dq, ddq = motion_from_rest(6, t)
    empty, loaded = (
        Recording(t=t, q=q, tau=inverse_dynamics(arm, q, dq, ddq), joint_names=arm.joint_names)
        for arm in (robot, replace(robot, joints=tuple(carrier)))
    )
    estimate = identify(torque_model(robot, "inertia"), [empty], processing=SETTINGS)
    found = identify_payload(estimate, [loaded])
    assert np.allclose(found.free_values, payload, atol=5e-3 * payload[0])
    assert np.allclose(found.values, found.free_values, atol=1e-3)
    assert found.pure == (True,) * 10
    assert found.loaded.robot.inertia[-1] == pytest.approx(carrier[-1].inertia, abs=5e-3 * payload[0])


def with_load_friction() -> Truth:
    model = replace(EMPTY.model, terms=(*EMPTY.model.terms, LoadCoulomb(widths=(0.05, 0.08))))
    truth = Truth(model, np.append(EMPTY.standard, [0.15, 0.1]))
    inertia = truth.standard[:20].reshape(-1, 10)
    return Truth(replace(model, terms=tuple(term.after(inertia) for term in model.terms)), truth.standard)


def test_friction_that_grows_with_the_load_feels_the_payload(monkeypatch):
    truth = with_load_friction()
    estimate = identify(truth.model, [measured(truth, seed=0)], processing=SETTINGS)
    loaded = [measured(carrying(truth), seed=1)]
    payload = identify_payload(estimate, loaded)
    assert payload.body.mass == pytest.approx(MASS, rel=2e-3)
    assert payload.relative_rms < 0.01
    monkeypatch.setattr(payload_fit, "_PASSES", 1)  # the friction of the arm alone
    assert identify_payload(estimate, loaded).relative_rms > 0.05


def test_the_loaded_estimate_predicts_the_loaded_run_and_survives_its_file(tmp_path):
    payload = weighed(size=0.1, together=True)
    payload.loaded.save(tmp_path / "loaded.json")
    read = load_estimate(tmp_path / "loaded.json")
    other = carrying(EMPTY).recording(seed=7)
    assert verify(read, [other]).logs[0].relative_rms < 0.02
    assert verify(weighed_arm(), [other]).logs[0].relative_rms > 0.2
    expected = read.base.projection @ LOADED.standard
    assert (np.abs(read.values - expected) < 5.0 * read.standard_errors + 1e-3 * np.abs(expected).max()).all()
    assert np.array_equal(read.values, payload.loaded.values)


def weighed_arm() -> Estimate:
    return identify(EMPTY.model, [measured(EMPTY, seed=0, size=0.1)], processing=SETTINGS)


@pytest.mark.parametrize("together", [False, True])
def test_a_known_mass_is_kept_and_sharpens_the_rest(together):
    free = weighed(size=0.3, together=together)
    known = weighed(size=0.3, together=together, known=KnownPayload(mass=MASS))
    assert known.body.mass == pytest.approx(MASS, rel=3e-6)
    assert known.body.mass_half == 0.0
    assert known.body.centre_half[0] < free.body.centre_half[0]
    assert np.abs(known.body.centre[:2] - CENTRE[:2]).max() < 0.02


def test_the_physical_body_is_one_where_the_free_fit_is_none():
    """A point mass whose torque is made a little smaller about its own axis: no body has these moments."""
    impossible = PAYLOAD.copy()
    impossible[9] = MASS * CENTRE @ CENTRE - 0.05
    before = measured(EMPTY, seed=0, size=0.05)
    estimate = identify(EMPTY.model, [before], processing=SETTINGS)
    after = [measured(carrying(EMPTY, impossible), seed=1, size=0.05)]
    with pytest.warns(match="about its own z axis"):
        payload = identify_payload(estimate, after)
    assert central_inertia(payload.free_values)[2][2, 2] < -0.03
    assert margins(payload.values) >= 0.99e-6
    assert payload.relative_rms > payload.free_relative_rms
    assert not payload.body.inertia_seen[2][2]


def test_torque_that_no_payload_explains_warns_of_its_joint():
    estimate = identify(EMPTY.model, [measured(EMPTY, seed=0, size=0.1)], processing=SETTINGS)
    after = measured(LOADED, seed=1000, size=0.1)
    drag = 4.0 * np.tanh(np.gradient(after.q[:, 1], after.t) / 0.05)
    worn = replace(after, tau=after.tau + np.column_stack([np.zeros_like(drag), drag]))
    with pytest.warns(TauhatWarning, match=rf"\d % on {EMPTY.model.robot.joint_names[1]} are left.*--unloaded"):
        identify_payload(estimate, [worn])


def test_a_possible_body_does_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        weighed(size=0.05)


def test_the_centre_stays_in_its_box():
    box = Box(lower=np.array([0.0, -0.1, -0.1]), upper=np.array([0.4, 0.1, 0.1]))
    payload = weighed(size=0.05, known=KnownPayload(centre=box))
    assert payload.body.centre[0] <= 0.4 + 1e-6
    assert payload.free_body.centre[0] == pytest.approx(CENTRE[0], abs=0.02)


def test_a_mass_on_the_axis_of_the_only_joint_that_moves_it_is_refused():
    estimate = identify(EMPTY.model, [measured(EMPTY, seed=0)], processing=SETTINGS)
    with pytest.raises(ModelError, match="no joint feels the mass"):
        identify_payload(estimate, [measured(LOADED, seed=0)], known=KnownPayload(link="j1"))


def test_a_payload_may_hang_on_another_link():
    robot, box = load_robot("ur5e"), random_inertia(np.random.default_rng(4))
    joints = list(robot.joints)
    joints[2] = replace(joints[2], inertia=joints[2].inertia + box)
    t = np.arange(0.0, 20.0, 0.005)
    motion = motion_from_rest(6, t)
    empty, loaded = (
        Recording(t=t, q=motion[0], tau=inverse_dynamics(arm, *motion))
        for arm in (robot, replace(robot, joints=joints))
    )
    estimate = identify(torque_model(robot, "inertia"), [empty], processing=SETTINGS)
    found = identify_payload(estimate, [loaded], known=KnownPayload(link=robot.joint_names[2]))
    assert found.link == robot.joint_names[2]
    assert found.free_values[:4] == pytest.approx(box[:4], abs=5e-3 * box[0])


def test_derivatives_of_centre_and_inertia_are_those_of_finite_differences():
    values = random_inertia(np.random.default_rng(5))

    def central(ten):
        mass, centre, inertia = central_inertia(ten)
        return np.array([mass, *centre, *(inertia[a, b] for a, b in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)))])

    step = 1e-6
    columns = [(central(values + step * e) - central(values - step * e)) / (2 * step) for e in np.eye(10)]
    assert np.allclose(central_jacobian(values), np.array(columns).T, atol=1e-7)


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (KnownPayload(limit=0.5), "heavier than the limit"),
        (KnownPayload(link="j9"), "no such link"),
    ],
)
def test_what_cannot_be_is_refused(known, message):
    with pytest.raises(ModelError, match=message):
        weighed(known=known)


def test_facts_that_contradict_each_other_are_refused():
    with pytest.raises(ModelError, match="heavier than the limit"):
        KnownPayload(mass=3.0, limit=2.0)
    with pytest.raises(ModelError, match="must be positive"):
        KnownPayload(mass=-1.0)
    with pytest.raises(ModelError, match="must have a mass"):
        KnownPayload(limit=0.0)


def test_runs_that_are_mixed_up_are_refused():
    estimate = identify(LOADED.model, [measured(LOADED, seed=0)], processing=SETTINGS)
    with pytest.raises(ModelError, match="without mass"):
        identify_payload(estimate, [measured(EMPTY, seed=0)])


def test_recordings_of_another_arm_are_refused():
    estimate = identify(EMPTY.model, [measured(EMPTY, seed=0)], processing=SETTINGS)
    t = np.arange(0.0, 2.0, 0.01)
    with pytest.raises(RecordingError, match="does not fit the robot"):
        identify_payload(estimate, [Recording(t=t, q=np.zeros((t.size, 3)), tau=np.zeros((t.size, 3)))])
    with pytest.raises(ModelError, match="no recording"):
        identify_payload(estimate, [])


def test_a_model_without_links_cannot_carry():
    model = torque_model(EMPTY.model.robot, "viscous,offset")
    estimate = identify(model, [measured(EMPTY, seed=0)], processing=Processing(cutoff=10.0, motion_cutoff=30.0))
    with pytest.raises(ModelError, match="needs a model with whole links"):
        identify_payload(estimate, [measured(LOADED, seed=0)])
