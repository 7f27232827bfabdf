"""Friction that warms up: the state against closed forms and SciPy, chunks, settings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sample_arms import planar_arm
from tauhat.dynamics import Motion, base_parameters, torque_model
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Facts, Thermal, ThermalMeasured
from tauhat.errors import ModelError

ROBOT = planar_arm()
STEP = 0.05
TIMES = (300.0, 120.0)
TERM = Thermal(times=TIMES, speeds=(2.0, 0.5), friction=((3.0, 2.0, -0.9, -0.7), (1.0, 0.0, 0.0, 0.0)))


def swing(seconds: float) -> Motion:
    t = np.arange(0.0, seconds, STEP)
    q = np.stack([np.sin(0.9 * t), 0.5 * np.cos(1.3 * t + 0.1)])
    dq = np.stack([0.9 * np.cos(0.9 * t), -0.65 * np.sin(1.3 * t + 0.1)])
    return Motion(q=q, dq=dq, ddq=np.zeros_like(q), step=STEP)


def running(speeds: tuple[float, float], seconds: float) -> Motion:
    t = np.arange(0.0, seconds, STEP)
    dq = np.array(speeds)[:, None] * np.ones_like(t)
    return Motion(q=dq * t, dq=dq, ddq=np.zeros_like(dq), step=STEP)


def warmth(term: Thermal, motion: Motion) -> np.ndarray:
    columns, _ = term.columns(ROBOT, motion, None)
    return np.stack([columns[joint][1] / motion.dq[joint] for joint in range(2)])


def test_a_joint_at_its_typical_speed_warms_to_one_with_its_time_constant():
    cold = replace(TERM, friction=())
    motion = running((2.0, 0.5), 900.0)
    t = STEP * np.arange(motion.n_t)
    for joint, time in enumerate(TIMES):
        assert warmth(cold, motion)[joint] == pytest.approx(1.0 - np.exp(-t / time), abs=1e-9)


def test_friction_that_falls_as_it_warms_heats_less_as_scipy_has_it():
    motion = swing(400.0)
    (a, b, da, db), v0 = TERM.friction[0], TERM.speeds[0]

    def slope(t: float, theta: np.ndarray) -> np.ndarray:
        v = abs(0.9 * np.cos(0.9 * t))
        power = (a + da * theta) * v + (b + db * theta) * v * v
        return (power / ((a + b * v0) * v0) - theta) / TIMES[0]

    t = STEP * np.arange(motion.n_t)
    expected = solve_ivp(slope, (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-8, atol=1e-10, max_step=0.5).y[0]
    fast = np.abs(motion.dq[0]) > 0.3
    assert warmth(TERM, motion)[0, fast] == pytest.approx(expected[fast], abs=2e-4 * expected.max())


def test_warmth_at_the_start_dies_away_with_the_time_constant():
    motion, cold = swing(200.0), replace(TERM, friction=())
    warm = replace(cold, initial=(0.7, -0.2))
    t = STEP * np.arange(motion.n_t)
    change = warmth(warm, motion) - warmth(cold, motion)
    for joint, start in enumerate((0.7, -0.2)):
        assert change[joint] == pytest.approx(start * np.exp(-t / TIMES[joint]), abs=1e-9)


def test_dry_friction_changes_with_the_direction_that_is_kept_at_rest():
    motion = swing(100.0)
    columns, _ = TERM.columns(ROBOT, motion, None)
    theta = warmth(TERM, motion)[0]
    moving = np.abs(motion.dq[0]) > 0.1
    assert columns[0][0, moving][100:] == pytest.approx((theta * np.sign(motion.dq[0]))[moving][100:], rel=1e-6)


@pytest.mark.parametrize("term", [TERM, ThermalMeasured(references=(30.0, 25.0))], ids=["state", "measured"])
def test_chunks_of_a_recording_give_the_columns_of_the_whole(term):
    motion = replace(swing(60.0), temperature=np.random.default_rng(0).uniform(20.0, 50.0, (2, 1200)))
    whole, _ = term.columns(ROBOT, motion, None)
    state, parts = None, []
    for start, stop in ((0, 1), (1, 400), (400, 1200)):
        columns, state = term.columns(ROBOT, motion.samples(start, stop), state)
        parts.append(columns)
    for joint in range(2):
        joined = np.concatenate([part[joint] for part in parts], axis=1)
        assert (joined == whole[joint]).all()


def test_measured_temperatures_take_the_place_of_the_state():
    temperature = np.stack([np.linspace(20.0, 45.0, 1200), np.full(1200, 31.0)])
    motion = replace(swing(60.0), temperature=temperature)
    columns, _ = ThermalMeasured(references=(20.0, 30.0)).columns(ROBOT, motion, None)
    assert columns[0][1] == pytest.approx((temperature[0] - 20.0) * motion.dq[0])
    assert columns[1][1] == pytest.approx(motion.dq[1])
    unknown, _ = ThermalMeasured().columns(ROBOT, swing(60.0), None)
    assert not unknown[0].any()


def test_recordings_tell_typical_speeds_and_mean_temperatures():
    facts = Facts(np.array([2.0, 0.0]), (), np.array([30.0, 40.0]))
    assert Thermal().candidates(facts) == (Thermal(speeds=(1.0, 0.5)),)
    assert TERM.candidates(facts) == (TERM,)
    assert ThermalMeasured().candidates(facts) == (ThermalMeasured(references=(30.0, 40.0)),)
    assert ThermalMeasured(references=(1.0, 2.0)).informed(facts) == ThermalMeasured(references=(1.0, 2.0))


@pytest.mark.parametrize("names", ["plain,thermal", "robust,thermal", "plain,thermal-measured"])
def test_slopes_are_base_parameters_of_their_own(names):
    model = torque_model(ROBOT, names)
    kept = {base_parameters(model).names[index] for index in base_parameters(model).independent}
    assert {"Hd_1", "Hd_2", "Hv_1", "Hv_2"} <= kept


def test_a_model_with_warmth_survives_its_file_form():
    model = TorqueModel(robot=ROBOT, terms=(*torque_model(ROBOT, "plain").terms, replace(TERM, initial=(0.1, 0.2))))
    back = TorqueModel.from_dict(model.to_dict())
    assert back.terms == model.terms
    assert back.fingerprint == model.fingerprint


def test_joints_without_the_term_have_no_columns():
    term = replace(TERM, joints=(False, True))
    columns, _ = term.columns(ROBOT, swing(5.0), None)
    assert columns[0].shape == (0, 100)
    assert [parameter.name for parameter in term.parameters(ROBOT)] == ["Hd_2", "Hv_2"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"times": (0.0, 1.0)}, "times must be positive"),
        ({"speeds": (0.0, 1.0)}, "typical speeds must be positive"),
        ({"initial": (np.nan, 0.0)}, "initial warmth must be finite"),
        ({"friction": ((1.0, 2.0), (1.0, 2.0))}, "four numbers a joint"),
    ],
)
def test_settings_that_mean_nothing_are_refused(changes, message):
    with pytest.raises(ModelError, match=message):
        replace(TERM, **changes)


@pytest.mark.parametrize("changes", [{"speeds": (1.0,)}, {"initial": (1.0,)}, {"times": (1.0,)}])
def test_settings_of_another_robot_are_refused(changes):
    with pytest.raises(ModelError, match="a joint is needed"):
        replace(TERM, **changes).columns(ROBOT, swing(1.0), None)


def test_references_are_checked():
    with pytest.raises(ModelError, match="references must be finite"):
        ThermalMeasured(references=(np.inf,))
    with pytest.raises(ModelError, match="a joint is needed"):
        ThermalMeasured(references=(20.0,)).columns(ROBOT, swing(1.0), None)


def test_both_forms_together_cannot_be_told_apart():
    with pytest.raises(ModelError, match="cannot be told apart from thermal"):
        torque_model(ROBOT, "plain,thermal,thermal-measured")
