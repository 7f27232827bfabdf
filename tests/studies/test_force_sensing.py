"""The study of the virtual force sensor: pushes are what they say, figures are those of a sensor used by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tauhat.dynamics import torque_model
from tauhat.errors import ModelError, SensingError
from tauhat.estimation.identify import identify
from tauhat.robots import forward_kinematics, load_robot
from tauhat.sensing import OBSERVERS, ForceSensor, force_sensor
from tauhat.sensing.free_motion import learnt_from_free_motion
from tauhat.sensing.wrench import WrenchSolver, directions_named
from tauhat.studies.force_sensing import ForceSensingStudy
from tauhat.studies.force_sensing.chapters import chapters_of, summary_of
from tauhat.studies.force_sensing.findings import Findings
from tauhat.studies.force_sensing.scene import ContactScene, SceneSettings
from tauhat.workers import LocalWorkers

SMALL = SceneSettings(warm_up=20.0, time_constant=15.0, rate=100.0)


@pytest.fixture(scope="module")
def scene() -> ContactScene:
    return ContactScene(SMALL, 3)


@pytest.fixture(scope="module")
def sensor(scene: ContactScene) -> ForceSensor:
    estimate = identify(torque_model(scene.robot, "plain"), [scene.warm_up])
    return force_sensor(estimate, rate=SMALL.rate)


def test_the_torque_of_a_push_is_the_work_of_its_force(scene):
    log = scene.pushed("moving", "cold")
    pushed = np.linalg.norm(log.force, axis=1) > 0.0
    assert 0.1 < pushed.mean() < 0.6
    assert (log.torque[~pushed] == 0.0).all()
    # Virtual work: force times the tool's displacement is torque times that of the joints, here by differences.
    k = int(np.flatnonzero(pushed)[5])
    robot, h = load_robot("ur5e"), 1e-6
    q = log.recording.q[k]
    for joint in range(robot.n_v):
        ahead, behind = (
            forward_kinematics(robot, q + sign * h * np.eye(6)[joint], frame=robot.frames[-1].name).translation
            for sign in (1.0, -1.0)
        )
        expected = log.force[k] @ (ahead - behind) / (2.0 * h)
        assert log.torque[k, joint] == pytest.approx(expected, abs=0.02)  # encoder steps, and a control period


def test_friction_falls_as_the_arm_warms_up(scene):
    cold, warm = (next(iter(scene.in_air(warmth))) for warmth in ("cold", "warm"))
    assert cold.q.shape == warm.q.shape
    speed = np.gradient(cold.q, cold.t, axis=0)
    # Gravity and inertia are alike, so the torque along the motion differs by friction alone.
    along = [np.mean(log.tau * np.sign(speed) * (np.abs(speed) > 0.02), axis=0) for log in (cold, warm)]
    assert (along[1] < along[0])[[0, 1, 2]].all()


def test_free_motion_teaches_the_error_of_what_it_shows(scene, sensor):
    logs = list(scene.in_air("cold"))
    learnt = learnt_from_free_motion(sensor, logs)
    torques = np.concatenate([(sensed := sensor.along(log)).tau[sensed.settled] for log in logs])
    assert learnt.model.rms == pytest.approx(np.sqrt(np.mean(torques**2, axis=0)))
    assert (learnt.along(logs[0]).tau == sensor.along(logs[0]).tau).all()
    with pytest.raises(SensingError, match="too little free motion"):
        learnt_from_free_motion(sensor, [logs[0].rows(0, 300)])
    with pytest.raises(SensingError, match="too little free motion"):
        learnt_from_free_motion(sensor, [])


@pytest.fixture(scope="module")
def found() -> Findings:
    return ForceSensingStudy(seeds=1, first_seed=3, scene=SMALL, terms="plain").found(LocalWorkers(count=1))


def test_the_study_tries_every_observer_on_every_log(found):
    chapters = chapters_of(found)
    forces = chapters[1].tables[0]
    assert [row[0] for row in forces.rows] == list(OBSERVERS)
    for row in forces.rows:
        assert all(0.0 < value < 60.0 for value in row[1:])
    shares = np.array([row[1:] for row in chapters[2].tables[0].rows])
    assert ((shares > 50.0) & (shares <= 100.0)).all()
    for row in chapters[3].tables[0].rows:
        assert 0.0 < min(row[1:]) < max(row[1:]) <= 100.0
    ((_, without, with_warmth, ratio, _),) = chapters[4].tables[0].rows
    assert with_warmth < without
    assert ratio == pytest.approx(with_warmth / without)
    assert "1 arms" in summary_of(found)


def test_figures_are_those_of_a_sensor_used_by_hand(scene, sensor, found):
    (outcome,) = found.of("momentum", pace="moving", warmth="cold")
    logs = [log for warmth in ("cold", "warm") for log in scene.in_air(warmth)]
    solver = WrenchSolver(robot=scene.robot, directions=directions_named("force"))
    by_hand = learnt_from_free_motion(replace(sensor, wrench=solver), logs)
    log = scene.pushed("moving", "cold")
    sensed = by_hand.along(log.recording)
    assert sensed.rows.size == log.recording.n_t
    later = slice(156, None)  # 1.5 s and 0.06 s at 100 Hz
    error = np.linalg.norm(sensed.wrench[later, :3] - log.force[150:-6], axis=1)
    assert outcome.force_rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)
    assert outcome.force_95 == pytest.approx(np.quantile(error, 0.95), rel=1e-9)
    apart = replace(by_hand, wrench=replace(by_hand.solver, correlation=np.eye(6))).along(log.recording)
    without = np.linalg.norm(apart.wrench[later, :3] - log.force[150:-6], axis=1)
    assert outcome.apart_rms == pytest.approx(np.sqrt(np.mean(without**2)), rel=1e-6)
    assert outcome.apart_rms != outcome.force_rms


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seeds": 0}, "1 seed or more"),
        ({"robot": "panda"}, "poses of the work"),
        ({"directions": "up"}, "unknown directions"),
        ({"terms": "magic"}, "magic"),
    ],
)
def test_settings_that_mean_nothing_are_refused(changes, message):
    with pytest.raises((ModelError, SensingError), match=message):
        replace(ForceSensingStudy(scene=SMALL), **changes)
