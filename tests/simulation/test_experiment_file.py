"""`experiment.toml`: everything it says is done, and everything wrong in it is named in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tauhat.control import PID
from tauhat.dynamics import torque_model
from tauhat.errors import SimulationError
from tauhat.estimation import identify
from tauhat.excitation import DesignSettings, design
from tauhat.recordings import write_recording
from tauhat.robots import load_robot
from tauhat.simulation import PRESETS, experiment_file, sensor_preset
from tauhat.simulation.experiment_file import is_experiment, load_experiment
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment

Plan = Callable[[str], PlannedExperiment]
SHORT = 'robot = "two_link"\n[motion]\nkind = "random"\nseconds = 2\n'


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    """Load text as an experiment's file."""

    def load(text: str) -> PlannedExperiment:
        path = tmp_path / "experiment.toml"
        path.write_text(text, encoding="utf-8")
        return load_experiment(path)

    return load


def test_the_example_of_the_documentation_is_read_and_says_what_it_says(plan: Plan, tmp_path: Path) -> None:
    text = (experiment_file.__doc__ or "").split("\n\n", 1)[1]
    (tmp_path / "limits.toml").write_text("[torque]\nfraction = 0.8\n", encoding="utf-8")
    found = plan(text)
    assert (found.robot.name, found.seed, found.robot_seed, found.friction) == ("ur5e", 1, 7, "stribeck")
    assert found.elasticity is not None
    assert found.elasticity.joints == (0,)
    assert found.heat is not None
    assert found.heat.initial.tolist() == [25.0] * 6
    (gripper,) = found.attached
    assert (gripper.name, gripper.mass, gripper.joint) == ("gripper", 1.2, 5)
    assert found.motion.limits is not None
    assert (found.settings.encoder.side, found.settings.encoder.velocity) == ("motor", "differenced")
    sensors = found.settings.sensors
    assert np.all(np.asarray(sensors.torque_noise) == 0.2)
    assert (sensors.torque_side, sensors.lost_samples) == ("link", sensor_preset("cobot", found.robot).lost_samples)
    assert [ripple.turns for ripple in sensors.ripples] == ["motor"]
    assert found.log == tmp_path / "run.parquet"


def test_the_least_that_an_experiment_says_is_its_robot(plan: Plan) -> None:
    found = plan('robot = "two_link"')
    assert found.motion.kind == "designed"
    assert (found.settings.sample_rate, found.settings.control_rate) == (500.0, 2000.0)
    assert found.sensors == "own"
    assert not found.attached


def test_an_experiment_runs_as_its_seeds_say(plan: Plan) -> None:
    first, again = plan(SHORT).run(), plan(SHORT).run()
    np.testing.assert_array_equal(first.recording.tau, again.recording.tau)
    other_noise = plan(f"seed = 1\n{SHORT}").run()
    np.testing.assert_array_equal(other_noise.truth.parameters.inertia, first.truth.parameters.inertia)
    assert not np.array_equal(other_noise.recording.tau, first.recording.tau)
    other_robot = plan(f"robot_seed = 1\n{SHORT}").run()
    assert not np.array_equal(other_robot.truth.parameters.inertia, first.truth.parameters.inertia)


def test_lost_samples_leave_rows_out_whose_truth_is_known(plan: Plan) -> None:
    done = plan(f"{SHORT}[sensors]\nlost_samples = 0.1\n").run()
    log, truth = done.recording, done.truth
    assert 0.85 * len(truth.tau) < log.n_t < 0.95 * len(truth.tau)
    np.testing.assert_array_equal(log.tau, truth.tau[done.rows])
    np.testing.assert_array_equal(log.t, truth.reference.t[done.rows])


def test_a_torque_sensor_on_the_link_does_not_see_friction_and_rotor(plan: Plan) -> None:
    done = plan(f'{SHORT}[sensors]\ntorque_side = "link"\n').run()
    truth = done.truth
    parameters = truth.parameters
    taken = parameters.rotor * truth.ddq + parameters.viscous * truth.dq + parameters.offset + truth.coulomb_torque
    np.testing.assert_allclose(done.recording.tau, truth.tau - taken, atol=1e-9)


def test_a_controller_and_a_motion_file_are_used(plan: Plan, tmp_path: Path) -> None:
    robot = load_robot("two_link")
    found = design(robot, rng=np.random.default_rng(0), settings=DesignSettings(period=3.0))
    write_recording(found.recording(rate=100.0, joint_names=robot.joint_names), tmp_path / "motion.parquet")
    text = (
        'robot = "two_link"\n[motion]\nfile = "motion.parquet"\n[controller]\nkind = "pid"\nkp = 800\nkd = [40, 20]\n'
    )
    planned = plan(f"{text}ki = {{ joint_1 = 5.0, joint_2 = 2.0 }}\n")
    law = planned.settings.controller
    assert isinstance(law, PID)
    assert (law.kd.tolist(), law.ki.tolist()) == ([40.0, 20.0], [5.0, 2.0])
    assert law.torque_limit.tolist() == robot.effort_limit.tolist()
    assert planned.motion.duration == pytest.approx(3.0, abs=0.011)


def test_scaled_presets_are_named_by_their_scale(plan: Plan) -> None:
    found = plan('robot = "two_link"\n[sensors]\npreset = "cobot"\nscale = 2\n')
    assert found.sensors == "cobot x 2"
    preset = sensor_preset("cobot", found.robot)
    np.testing.assert_allclose(found.settings.sensors.torque_noise, 2.0 * np.asarray(preset.torque_noise))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot = 'two_link'\nspeed = 1", r"unknown key; got speed; did you mean seed or robot_seed"),
        ("seed = 1", "a key is missing; expected robot"),
        ("robot = 'two_lik.urdf'", "two_lik.urdf"),
        ("robot = 'two_link'\nseed = -1", "seed is not a whole number >= 0; got -1"),
        ("robot = 'two_link'\n[truth]\nfriction = 'sticky'", "unknown kind of friction; expected plain, coulomb"),
        ("robot = 'two_link'\n[truth]\nspread = 2", "spread of the truth; expected 0 to 0.5, got 2.0"),
        ("robot = 'two_link'\n[truth.elasticity]\njoints = ['elbow']\nstiffness = 1", "unknown joint; got elbow"),
        ("robot = 'two_link'\n[truth.elasticity]\njoints = 1\nstiffness = 1", "joints is not a list of names"),
        ("robot = 'two_link'\n[truth.elasticity]\nstiffness = -1", "stiffness must be above zero; got -1.0"),
        ("robot = 'two_link'\n[truth.heat]\ntime_constant = 0", "time_constant must be above zero"),
        ("robot = 'two_link'\n[[truth.attached]]\nmass = 1", "a key is missing; expected centre"),
        ("robot = 'two_link'\n[motion]\nkind = 'wild'", "unknown kind; expected designed | random, got wild"),
        ("robot = 'two_link'\n[motion]\nseconds = 0", "length of the motion; expected 0.5 to 3600 s, got 0 s"),
        ("robot = 'two_link'\n[motion]\nfile = 'm.csv'\nseconds = 2", "a motion file has its own length"),
        ("robot = 'two_link'\n[motion]\nfile = 'm.csv'", "m.csv"),
        ("robot = 'two_link'\n[controller]\nkp = 1", "a tuned controller has no kp"),
        ("robot = 'two_link'\n[controller]\nkind = 'pd'\nkp = 1\nkd = 1\nki = 1", "a pd controller has no ki"),
        (
            "robot = 'two_link'\n[controller]\nkind = 'pd'\nkp = { joint_1 = 1 }",
            "kp needs a value for every joint; expected joint_2",
        ),
        ("robot = 'two_link'\n[controller]\nrate = 0", "rate of the controller; expected > 0, got 0.0"),
        ("robot = 'two_link'\n[log]\nrate = -1", "rate of the log; expected a positive number, got -1.0"),
        ("robot = 'two_link'\n[encoder]\nside = 'base'", "unknown side; expected link | motor, got base"),
        ("robot = 'two_link'\n[sensors]\npreset = 'best'", "unknown sensors; got best"),
        ("robot = 'two_link'\n[sensors]\ntorque_noize = 1", "unknown key; got torque_noize; did you mean torque_noise"),
        ("robot = 'two_link'\n[sensors]\nlost_samples = 1", "lost_samples; expected a share"),
        ("robot = 'two_link'\n[sensors]\nscale = -1", "scale of sensor errors"),
        ("robot = 'two_link'\n[[sensors.ripples]]\namplitude = 1", "a key is missing; expected order"),
        ("robot = 'two_link'\n[log]\nrate = 1e6", "absurdly long log"),
        ("robot = [", "not valid TOML"),
    ],
)
def test_a_fault_is_named_in_one_line_with_the_file(plan: Plan, text: str, message: str) -> None:
    with pytest.raises(SimulationError, match=re.escape(message)) as told:
        plan(text)
    assert "experiment.toml" in str(told.value)
    assert "\n" not in str(told.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=r"none\.toml"):
        load_experiment(tmp_path / "none.toml")


def test_an_experiment_is_told_from_a_robot(tmp_path: Path) -> None:
    experiment, robot, broken = (tmp_path / name for name in ("e.toml", "r.toml", "b.toml"))
    experiment.write_text(SHORT, encoding="utf-8")
    robot.write_text('name = "arm"\n[[joints]]\nname = "a"\n', encoding="utf-8")
    broken.write_text("robot = [", encoding="utf-8")
    assert is_experiment(experiment)
    assert [is_experiment(path) for path in (robot, broken, tmp_path / "none.toml", "ur5e")] == [False] * 4


def test_a_project_is_told_from_an_experiment(plan: Plan) -> None:
    project = '[robot]\nsource = "two_link"\n[record]\nkind = "simulate"\n'
    with pytest.raises(SimulationError, match="a project, not an experiment; go its way with tauhat run"):
        plan(project)


def test_a_random_motion_refuses_limits_that_it_would_not_keep(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "limits.toml").write_text("[torque]\nfraction = 0.8\n", encoding="utf-8")
    with pytest.raises(SimulationError, match="a random motion keeps no further limits"):
        plan(f'{SHORT}limits = "limits.toml"\n')
    with pytest.raises(SimulationError, match="unknown kind of motion"):
        MotionPlan(kind="wild")  # type: ignore[arg-type]


@pytest.mark.parametrize(("seconds", "periods"), [(4.0, 1), (10.0, 1), (20.0, 2), (26.0, 3)])
def test_a_long_designed_motion_repeats_a_period_of_about_ten_seconds(seconds: float, periods: int) -> None:
    planned = MotionPlan(seconds=seconds)
    assert planned.periods == periods
    assert planned.periods * planned.period == pytest.approx(seconds)


@pytest.mark.filterwarnings("ignore:friction is negative")  # there is none behind the gear: its sign is chance
@pytest.mark.parametrize("name", PRESETS)
def test_logs_of_typical_sensors_are_read_by_identify(plan: Plan, name: str) -> None:
    done = plan(f'{SHORT.replace("seconds = 2", "seconds = 6")}[sensors]\npreset = "{name}"\n').run()
    estimate = identify(torque_model(load_robot("two_link")), [done.recording])
    assert estimate.relative_rms < 0.2
