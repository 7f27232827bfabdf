"""Motors that turn with two joints: power is preserved, whatever the ratio."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sample_arms import chain, random_states
from tauhat.dynamics import Motion, TorqueModel, base_parameters, motion_from_rows, torque_model
from tauhat.dynamics.terms import Coupling, CouplingDahl, Facts, Inertia, RotorInertia, Viscous
from tauhat.dynamics.terms.presliding import LENGTHS, SCALES, dahl_states
from tauhat.errors import ModelError
from tauhat.robots.shared_motor import SharedMotor

WRIST = chain(np.random.default_rng(1), "RRR")
MOTION = motion_from_rows(*random_states(np.random.default_rng(2), 40, 3))
RATIOS = st.floats(-5.0, 5.0).filter(lambda ratio: abs(ratio) > 1e-3)


def torque(term: Coupling, values: dict[str, float], motion: Motion = MOTION) -> np.ndarray:
    """Return the term's torque for values by symbol, (n_v, n_t)."""
    columns, _ = term.columns(WRIST, motion, None)
    symbols = [parameter.symbol for parameter in term.parameters(WRIST)]
    found = np.zeros((3, motion.n_t))
    for joint, (rows, support) in enumerate(zip(columns, term.support(WRIST), strict=True)):
        for row, index in zip(rows, support, strict=True):
            found[joint] += values.get(symbols[index], 0.0) * row
    return found


@given(ratio=RATIOS)
def test_inertia_and_viscous_friction_are_those_of_a_motor_on_a_common_shaft(ratio: float) -> None:
    term = Coupling(motors=((2, 1, ratio),))
    arm = np.array([0.0, ratio, 1.0])
    inertia, viscous = 0.3, 0.7
    whole = np.outer(arm, arm)
    coupled = torque(term, {"Iam": inertia, "Fvm": viscous})
    own = np.diag(whole)[:, None] * (inertia * MOTION.ddq + viscous * MOTION.dq)  # in Ia and Fv of both joints
    assert np.allclose(coupled + own, whole @ (inertia * MOTION.ddq + viscous * MOTION.dq), rtol=0, atol=1e-12)


@pytest.mark.parametrize("widths", [(), (0.3,)])
@given(ratio=RATIOS)
def test_dry_friction_takes_the_power_of_the_motors_own_speed(widths: tuple[float, ...], ratio: float) -> None:
    found = torque(Coupling(motors=((2, 0, ratio),), widths=widths), {"Fsm": 1.0})
    along = MOTION.dq[2] + ratio * MOTION.dq[0]
    sign = np.tanh(along / widths[0]) if widths else np.sign(along)
    power = np.sum(found * MOTION.dq, axis=0)
    assert np.allclose(power, sign * along, rtol=0, atol=1e-12)
    assert (power >= 0.0).all()
    assert not found[1].any()


def test_presliding_follows_the_motors_own_path() -> None:
    q = 0.003 * np.cumsum(np.random.default_rng(0).normal(size=(3, 60)), axis=1)
    motion = Motion(q=q, dq=np.zeros_like(q), ddq=np.zeros_like(q))
    term = CouplingDahl(motors=((2, 1, -2.0),))
    fine, coarse = dahl_states((q[2] - 2.0 * q[1])[None], np.array([LENGTHS]), None)[0][0]
    found = torque(term, {"Fdm": 3.0, "Fem": 0.5}, motion)
    assert np.allclose(found[2], 3.0 * fine + 0.5 * coarse, rtol=0, atol=1e-12)
    assert np.allclose(found[1], -2.0 * found[2], rtol=0, atol=1e-12)


def test_each_motors_scale_stretches_its_own_lengths() -> None:
    q = 0.003 * np.cumsum(np.random.default_rng(0).normal(size=(3, 60)), axis=1)
    motion = Motion(q=q, dq=np.zeros_like(q), ddq=np.zeros_like(q))
    motors = ((2, 1, 1.0), (1, 0, 1.0))
    columns, _ = CouplingDahl(motors=motors, scales=(3.0, 0.5)).columns(WRIST, motion, None)
    for own, other, scale, rows in ((2, 1, 3.0, columns[2][2:4]), (1, 0, 0.5, columns[0][2:4])):
        bent = dahl_states((q[own] + q[other])[None], scale * np.array([LENGTHS]), None)[0][0]
        assert np.allclose(rows, bent, rtol=0, atol=1e-12)
    plain = CouplingDahl(motors=motors).columns(WRIST, motion, None)[0]
    ones = CouplingDahl(motors=motors, scales=(1.0, 1.0)).columns(WRIST, motion, None)[0]
    assert all(np.array_equal(a, b) for a, b in zip(plain, ones, strict=True))


def test_scales_are_open_until_given_and_shape_dry_friction_alone() -> None:
    facts = Facts(np.ones(3), (SharedMotor(2, 1, 1.0),))
    forms = CouplingDahl().candidates(facts)
    assert [form.shape for form in forms] == [(scale,) for scale in SCALES]
    assert {form.motors for form in forms} == {facts.shared_motors}
    assert CouplingDahl().informed(facts).shape == ()
    given_scale = CouplingDahl(motors=((2, 1, 1.0),), widths=(0.1,), scales=(2.0,))
    assert given_scale.candidates(facts) == (given_scale,)
    pair = CouplingDahl(motors=((2, 1, 1.0), (1, 0, 2.0)), scales=(1.0, 2.0))
    assert pair.shaping(WRIST).tolist() == [-1, -1, 0, 0, -1, -1, 1, 1]
    assert pair.shaped_joints(WRIST) == {0: 2, 1: 1}


@pytest.mark.parametrize(("scales", "match"), [((0.0,), "must be positive"), ((1.0, 1.0), "expected 1 values, got 2")])
def test_scales_must_fit_the_motors(scales: tuple[float, ...], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        CouplingDahl(motors=((2, 1, 1.0),), scales=scales).columns(WRIST, MOTION, None)


@given(cuts=st.lists(st.integers(1, 39), max_size=4, unique=True))
def test_its_states_go_on_where_a_motion_is_cut(cuts: list[int]) -> None:
    term = CouplingDahl(motors=((2, 1, 1.0), (1, 0, -1.0)))
    whole, _ = term.columns(WRIST, MOTION, None)
    parts, state = [], None
    for start, stop in pairwise([0, *sorted(cuts), 40]):
        columns, state = term.columns(WRIST, MOTION.samples(start, stop), state)
        parts.append(columns)
    for joint in range(3):
        assert np.array_equal(np.concatenate([part[joint] for part in parts], axis=1), whole[joint])


def test_two_motors_on_one_joint_keep_their_columns_apart() -> None:
    term = Coupling(motors=((2, 1, 1.0), (1, 0, 2.0)))
    assert [p.name for p in term.parameters(WRIST)] == ["Iam_3", "Fvm_3", "Fsm_3", "Iam_2", "Fvm_2", "Fsm_2"]
    assert [support.tolist() for support in term.support(WRIST)] == [[3, 4, 5], [0, 1, 2, 3, 4, 5], [0, 1, 2]]
    columns, _ = term.columns(WRIST, MOTION, None)
    assert np.array_equal(columns[1][0], MOTION.ddq[2])
    assert np.array_equal(columns[1][3], 2.0 * MOTION.ddq[0])


def test_coupling_is_told_from_the_joints_own_drives() -> None:
    term = Coupling(motors=((2, 1, 1.0),), widths=(0.01,))
    model = TorqueModel(robot=WRIST, terms=(Inertia(), RotorInertia(), Viscous(), term))
    base = base_parameters(model)
    assert {"Iam_3", "Fvm_3", "Fsm_3", "Ia_2", "Ia_3"} <= {base.names[k] for k in base.independent}


def test_motors_and_widths_come_from_the_recordings() -> None:
    facts = Facts(np.array([1.0, 2.0, 3.0]), (SharedMotor(2, 1, -0.5),))
    (term,) = Coupling().candidates(facts)
    assert term.motors == (SharedMotor(2, 1, -0.5),)
    assert term.widths == pytest.approx((0.01 * (3.0 + 0.5 * 2.0),))


def test_given_motors_stay() -> None:
    term = Coupling(motors=((2, 0, 1.0),), widths=(0.5,))
    assert term.candidates(Facts(np.ones(3), (SharedMotor(2, 1, 1.0),))) == (term,)


def test_a_log_whose_motors_turn_with_one_joint_each_has_no_coupling_to_find() -> None:
    with pytest.raises(ModelError, match=r"term coupling: no motor turns with two joints; .*\[coupling\] section"):
        Coupling().candidates(Facts(np.ones(3)))


@pytest.mark.parametrize("motor", [(1, 1, 1.0), (1, 2, 0.0), (1, 2, np.inf), (1, 2, np.nan)])
def test_a_motor_needs_two_joints_and_a_ratio(motor: tuple[int, int, float]) -> None:
    with pytest.raises(ModelError, match="turns with two different joints, at a ratio that is not zero"):
        Coupling(motors=(motor,))


def test_a_motor_of_a_joint_that_is_not_there_is_refused() -> None:
    with pytest.raises(ModelError, match="no such joint; expected 0 to 2"):
        Coupling(motors=((3, 1, 1.0),)).parameters(WRIST)


@pytest.mark.parametrize(("widths", "match"), [((0.0,), "must be positive"), ((0.1, 0.1), "expected 1 values, got 2")])
def test_widths_must_fit_the_motors(widths: tuple[float, ...], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        Coupling(motors=((2, 1, 1.0),), widths=widths).columns(WRIST, MOTION, None)


def test_units_follow_the_joint_that_the_motor_drives() -> None:
    slide = chain(np.random.default_rng(1), "RP")
    units = [p.unit for p in Coupling(motors=((1, 0, 1.0),)).parameters(slide)]
    assert units == ["kg", "N s/m", "N"]


def test_it_survives_plain_data() -> None:
    model = TorqueModel(robot=WRIST, terms=(Inertia(), Coupling(motors=((2, 1, 1.5),), widths=(0.1,))))
    assert TorqueModel.from_dict(model.to_dict()).terms == model.terms
    assert torque_model(WRIST, "coupling").parameters == ()
