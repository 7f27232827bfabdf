"""What free motion teaches: logs of other rates, error bars in the file of thresholds, and older files."""

from __future__ import annotations

import json
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from sensed_arms import frictionless, motion

from tauhat.dynamics import torque_model
from tauhat.errors import SensingError, TauhatWarning
from tauhat.estimation import identify, load_estimate
from tauhat.recordings import Recording
from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import ContactThresholds, load_contact_thresholds
from tauhat.sensing.free_logs import sensed_free, settled_seconds
from tauhat.sensing.free_motion import learnt_from_free_motion
from tauhat.sensing.learnt_error import LearntError, error_of
from tauhat.sensing.observers import observer_named
from tauhat.sensing.sensed_model import sensed_model
from tauhat.sensing.sensor import ForceSensor, force_sensor
from tauhat.sensing.threshold_learning import learn_contact_thresholds
from tauhat.sensing.wrench import WrenchSolver

MODEL = frictionless()
SENSOR = ForceSensor(model=MODEL, rate=125.0)


def free(rate: float, seconds: float = 12.0, seed: int = 3) -> Recording:
    """Return a motion whose torque is off by a slow error, the same at every rate."""
    q, tau = motion(MODEL.robot, seconds=seconds, rate=rate)
    t = np.arange(len(q)) / rate
    waves = np.random.default_rng(seed).uniform(0.3, 1.5, size=(2, MODEL.n_v))
    return Recording(t=t, q=q, tau=tau - np.sin(t[:, None] * waves[0] + waves[1]), joint_names=MODEL.robot.joint_names)


def quietly(sensor: ForceSensor, logs: list[Recording], **settings: object) -> ContactThresholds:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        return learn_contact_thresholds(sensor, logs, **settings)


def test_a_finer_log_is_thinned_to_what_the_judged_one_would_have_seen():
    fine, coarse = free(500.0), free(125.0)
    (found,), (expected,) = sensed_free(SENSOR, [fine]), sensed_free(SENSOR, [coarse])
    assert found.tau == pytest.approx(expected.tau, abs=1e-9)
    assert found.step == pytest.approx(0.008)


@pytest.mark.parametrize("rate", [75.0, 100.0, 180.0])
def test_limits_hardly_depend_on_the_rate_of_the_free_log(rate):
    same, other = (quietly(SENSOR, [free(each)]) for each in (125.0, rate))
    assert other.limits == pytest.approx(same.limits, rel=0.1)
    assert other.seconds.sum() == pytest.approx(same.seconds.sum(), rel=0.02)


def test_logs_of_two_rates_count_by_their_time():
    logs = [free(125.0, 12.0), free(62.5, 24.0, seed=4)]
    learnt = learnt_from_free_motion(SENSOR, logs)
    parts = sensed_free(SENSOR, logs)
    squares = sum(log.step * np.square(log.tau[log.settled]).sum(axis=0) for log in parts)
    assert learnt.model.rms == pytest.approx(np.sqrt(squares / settled_seconds(parts)))


def test_a_log_that_is_too_slow_is_refused_with_a_cutoff_that_fits_both():
    slow = free(15.0, 30.0)
    with pytest.raises(SensingError, match="too slow for the filter") as refused:
        sensed_free(SENSOR, [slow])
    cutoff = float(re.findall(r"--cutoff ([\d.]+)", str(refused.value))[0])
    assert 6.0 < cutoff <= 0.45 * 15.0
    assert sensed_free(ForceSensor(model=MODEL, rate=125.0, cutoff=cutoff), [slow])[0].n_t == slow.n_t


def test_the_file_gives_a_sensor_the_error_that_its_limits_count_in(tmp_path):
    learnt = learnt_from_free_motion(SENSOR, [free(125.0)])
    assert error_of(learnt).is_learnt
    assert not error_of(SENSOR).is_learnt
    thresholds = quietly(SENSOR, [free(125.0)], error=error_of(learnt))
    thresholds.save(tmp_path / "limits.json")
    again = load_contact_thresholds(tmp_path / "limits.json")
    assert again.to_dict() == thresholds.to_dict()
    taught, log = again.sensor_of(SENSOR), free(125.0, 5.0, seed=9)
    assert (taught.along(log).tau_std == learnt.along(log).tau_std).all()
    assert (taught.along(log).wrench == learnt.along(log).wrench).all()
    assert (taught.along(log).tau_std > SENSOR.along(log).tau_std)[-1].all()


def test_a_file_of_the_first_version_leaves_the_sensor_as_it_is(tmp_path):
    data = quietly(SENSOR, [free(125.0)]).to_dict()
    older = {key: value for key, value in data.items() if key not in {"error", "taken_off"}} | {"schema_version": 1}
    (tmp_path / "old.json").write_text(json.dumps(older), encoding="utf-8")
    found = load_contact_thresholds(tmp_path / "old.json")
    assert found.error is None
    assert found.taken_off == "nothing"
    assert found.sensor_of(SENSOR) is SENSOR
    assert found.limits.tolist() == data["limits"]


def test_the_floor_of_the_limits_does_not_rise_with_an_error_learnt_in_motion():
    rules = ContactRules(least=50.0)  # so that the floor decides everywhere
    plain = quietly(SENSOR, [free(125.0)], rules=rules)
    error = error_of(learnt_from_free_motion(SENSOR, [free(125.0)]))
    wide = quietly(SENSOR, [free(125.0)], rules=rules, error=error)
    assert wide.limits * error.sizes == pytest.approx(plain.limits * error_of(SENSOR).sizes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LearntError(rms=[1.0, 0.0], stretch=[1.0, 1.0], correlation=np.eye(2)), "learnt error"),
        (lambda: replace(quietly(SENSOR, [free(125.0)]), taken_off="everything"), "what thresholds are behind"),
        (
            lambda: replace(
                quietly(SENSOR, [free(125.0)]), error=LearntError(rms=[1.0], stretch=[1.0], correlation=np.eye(1))
            ),
            "error of contact thresholds",
        ),
        (
            lambda: quietly(SENSOR, [free(125.0)]).sensor_of(ForceSensor(model=frictionless("ur5e"), rate=125.0)),
            "thresholds of another robot",
        ),
    ],
)  # fmt: skip
def test_errors_that_do_not_fit_are_refused(make, message):
    with pytest.raises(SensingError, match=message):
        make()


@pytest.mark.parametrize(
    "changed",
    [
        {"observer": observer_named("kalman")},
        {"observer": observer_named("momentum", gain=40.0)},
        {"cutoff": 5.0},
    ],
)
def test_an_error_is_only_that_of_the_observer_and_filter_it_was_learnt_with(changed, tmp_path):
    quietly(SENSOR, [free(125.0)]).save(tmp_path / "limits.json")
    found = load_contact_thresholds(tmp_path / "limits.json")
    assert found.sensor_of(replace(SENSOR, rate=100.0)).rate == 100.0  # gain and filter are in seconds
    with pytest.raises(SensingError, match="--observer momentum --gain 20 --cutoff 10"):
        found.sensor_of(replace(SENSOR, **changed))
    data = json.loads((tmp_path / "limits.json").read_text(encoding="utf-8"))
    del data["error"]["settings"]
    (tmp_path / "limits.json").write_text(json.dumps(data), encoding="utf-8")
    unknown = load_contact_thresholds(tmp_path / "limits.json").sensor_of(replace(SENSOR, **changed))
    assert (unknown.model.rms == SENSOR.model.rms).all()


def test_thresholds_know_the_estimate_that_they_were_learnt_with(tmp_path):
    mine, other = (replace(SENSOR, model=replace(MODEL, estimate=name)) for name in ("mine", "other"))
    quietly(mine, [free(125.0)]).save(tmp_path / "limits.json")
    found = load_contact_thresholds(tmp_path / "limits.json")
    assert found.estimate == "mine"
    tooled = replace(mine, model=mine.model.carrying(np.array([1.0, *[0.0] * 9])))
    assert found.sensor_of(tooled).model.estimate == "mine"
    with pytest.raises(SensingError, match="thresholds of another estimate"):
        found.sensor_of(other)
    data = json.loads((tmp_path / "limits.json").read_text(encoding="utf-8"))
    del data["estimate"]
    (tmp_path / "limits.json").write_text(json.dumps(data), encoding="utf-8")
    with pytest.warns(TauhatWarning, match="do not say of which estimate"):
        load_contact_thresholds(tmp_path / "limits.json").sensor_of(other)


@pytest.mark.filterwarnings("ignore:scaled condition number")
def test_an_estimate_has_the_same_fingerprint_before_and_after_its_file(tmp_path):
    log, other = (free(125.0, 12.0, seed) for seed in (3, 4))
    model = torque_model(MODEL.robot, "inertia,viscous")
    estimate = identify(model, [log])
    estimate.save(tmp_path / "arm.json")
    name = sensed_model(estimate).estimate
    assert sensed_model(load_estimate(tmp_path / "arm.json")).estimate == name
    assert sensed_model(identify(model, [log])).estimate == name
    assert sensed_model(identify(model, [other])).estimate != name
    assert assumed_contact_thresholds(force_sensor(estimate, rate=125.0)).estimate == name


def test_the_zero_of_an_error_is_kept_in_the_file(tmp_path):
    quietly(SENSOR, [free(125.0)], error=error_of(SENSOR, zero="standing")).save(tmp_path / "limits.json")
    error = load_contact_thresholds(tmp_path / "limits.json").error
    assert error is not None
    assert error.zero == "standing"
    with pytest.raises(SensingError, match="zero of a learnt error"):
        replace(error, zero="sitting")


def test_a_solver_is_kept_when_an_error_is_put_on_its_sensor():
    solver = WrenchSolver(robot=MODEL.robot, axes="frame", largest=(50.0, 5.0))
    found = error_of(SENSOR).on(replace(SENSOR, wrench=solver)).solver
    assert (found.axes, found.largest, found.frame) == ("frame", (50.0, 5.0), solver.frame)
