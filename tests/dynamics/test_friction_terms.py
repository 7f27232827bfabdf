"""Laws of friction against closed forms and an integrator, and what every law of friction must obey."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sample_arms import chain, planar_arm, smooth_motion
from tauhat.dynamics import TERMS, Motion, TorqueModel, base_parameters, inverse_dynamics, torque_model
from tauhat.dynamics.terms import (
    Asymmetric,
    Bank,
    Coulomb,
    CubeRoot,
    Dahl,
    Facts,
    Inertia,
    LoadCoulomb,
    LoadDahl,
    PolynomialFriction,
    Stribeck,
    Term,
    Viscous,
    ViscousAsymmetry,
)
from tauhat.dynamics.terms.friction import STRIBECK_SPEEDS
from tauhat.dynamics.terms.presliding import LENGTHS, SCALES, dahl_states
from tauhat.errors import ModelError
from tauhat.robots import Robot

AXIS = chain(np.random.default_rng(3), "R")
SLIDE = chain(np.random.default_rng(3), "P")
SPEEDS = st.floats(-20.0, 20.0, allow_nan=False)
STEPS = st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=30)


def at_speeds(term: Term, speeds: object, *, robot: Robot = AXIS) -> np.ndarray:
    """Return the columns of one joint at these speeds, (n_columns, n)."""
    dq = np.atleast_2d(np.asarray(speeds, dtype=float))
    columns, _ = term.columns(robot, Motion(q=np.zeros_like(dq), dq=dq, ddq=np.zeros_like(dq)), None)
    return columns[0]


def along(positions: object) -> np.ndarray:
    """Return the fine and the coarse Dahl state of one joint along positions, (2, n)."""
    q = np.atleast_2d(np.asarray(positions, dtype=float))
    columns, _ = Dahl().columns(AXIS, Motion(q=q, dq=np.zeros_like(q), ddq=np.zeros_like(q)), None)
    return columns[0]


V = np.array([-2.0, -0.3, -0.01, 0.0, 0.02, 0.7, 8.0])


@pytest.mark.parametrize(
    ("term", "expected"),
    [
        (CubeRoot(), [np.sign(V) * np.abs(V) ** (1 / 3)]),
        (ViscousAsymmetry(), [np.abs(V)]),
        (Asymmetric(), [V * (V > 0), V * (V < 0), V > 0, -1.0 * (V < 0)]),
        (
            Asymmetric(widths=(0.1,)),
            [V * (V > 0), V * (V < 0), np.tanh(V / 0.1) * (V > 0), np.tanh(V / 0.1) * (V < 0)],
        ),
        (Stribeck(speeds=(0.3,)), [np.exp(-((V / 0.3) ** 2)) * np.tanh(V / 0.03)]),
        (
            PolynomialFriction(speeds=(0.3,)),
            [
                np.tanh(V / 0.03),
                V,
                np.sign(V) * V**2,
                np.abs(V) ** 3 * np.sign(V),
                np.exp(-np.abs(V) / 0.3) * np.tanh(V / 0.03),
            ],
        ),
    ],
    ids=lambda value: getattr(value, "key", ""),
)
def test_a_law_has_the_columns_of_its_formula(term: Term, expected: list[np.ndarray]) -> None:
    assert np.allclose(at_speeds(term, V), np.array(expected, dtype=float), rtol=1e-12, atol=1e-100)


SHAPED = (Coulomb(widths=(0.01,)), Stribeck(speeds=(0.05,)), PolynomialFriction(speeds=(0.05,)))
ODD = (Viscous(), CubeRoot(), Coulomb(), *SHAPED)


@pytest.mark.parametrize("term", ODD, ids=lambda term: f"{term.key} {getattr(term, 'shape', '')}")
@given(speed=SPEEDS)
def test_friction_turns_round_with_the_speed_and_never_drives(term: Term, speed: float) -> None:
    forwards, backwards = at_speeds(term, speed), at_speeds(term, -speed)
    assert np.allclose(forwards, -backwards, rtol=1e-14, atol=0)
    assert (forwards * speed >= 0.0).all()


@given(speed=SPEEDS)
def test_directions_that_brake_alike_are_viscous_and_coulomb(speed: float) -> None:
    viscous_forwards, viscous_backwards, dry_forwards, dry_backwards = at_speeds(Asymmetric(widths=(0.01,)), speed)
    assert viscous_forwards + viscous_backwards == at_speeds(Viscous(), speed)
    assert dry_forwards + dry_backwards == at_speeds(Coulomb(widths=(0.01,)), speed)
    assert (np.array([viscous_forwards, viscous_backwards, dry_forwards, dry_backwards]) * speed >= 0.0).all()


def test_the_smooth_sign_has_its_width_at_zero_and_is_the_sign_far_from_it() -> None:
    width = 0.02
    tiny = at_speeds(Coulomb(widths=(width,)), [-1e-9, 0.0, 1e-9])[0]
    assert tiny / 1e-9 == pytest.approx([-1 / width, 0.0, 1 / width], rel=1e-6)
    assert at_speeds(Coulomb(widths=(width,)), [-1.0, 1.0])[0].tolist() == [-1.0, 1.0]


def test_every_law_is_finite_at_extreme_speeds_and_at_rest() -> None:
    extreme = [-1e6, -1e-300, 0.0, 1e-300, 1e6]
    for term in (*ODD, ViscousAsymmetry(), Asymmetric(), Asymmetric(widths=(1e-6,))):
        assert np.isfinite(at_speeds(term, extreme)).all()
        assert (at_speeds(term, [0.0]) == 0.0).all()


def test_a_motion_that_never_is_slow_sees_no_bump_but_no_zero_column_either() -> None:
    for term, row in ((Stribeck(speeds=(0.01,)), 0), (PolynomialFriction(speeds=(0.001,)), 4)):
        column = at_speeds(term, [2.0, 3.0])[row]
        assert (column > 0.0).all()
        assert column.max() < 1e-100


def test_dahl_states_are_those_of_the_differential_equation() -> None:
    t = np.linspace(0.0, 1.0, 401)  # turns round on samples: at 0.125, 0.375, ...
    size = 0.004

    def rate(time: float, z: np.ndarray) -> np.ndarray:
        speed = size * 4 * np.pi * np.cos(4 * np.pi * time)
        return (np.sign(speed) - z) * abs(speed) / np.array(LENGTHS)

    z, expected = np.zeros(2), [np.zeros(2)]
    for start, end in pairwise(t):
        z = solve_ivp(rate, (start, end), z, rtol=1e-9, atol=1e-11, method="Radau").y[:, -1]
        expected.append(z)
    found = along(size * np.sin(4 * np.pi * t))
    assert np.allclose(found, np.array(expected).T, rtol=0, atol=1e-6)
    assert np.abs(found[1]).max() < 0.95  # the coarse state is still turning round


@given(cuts=st.lists(st.floats(0.0, 1.0), max_size=20), length=st.floats(1e-6, 0.3), start=st.floats(-1.0, 1.0))
def test_a_dahl_step_is_exact_whatever_its_size(cuts: list[float], length: float, start: float) -> None:
    fine = 0.1 * np.array([0.0, *sorted(cuts), 1.0])[None]
    lengths, state = np.array([[length]]), np.array([[0.0, start]])
    stepped, _ = dahl_states(fine, lengths, state)
    whole, _ = dahl_states(fine[:, [0, -1]], lengths, state)
    assert stepped[0, 0, -1] == pytest.approx(whole[0, 0, -1], abs=1e-12)
    assert whole[0, 0, -1] == pytest.approx(1.0 + (start - 1.0) * np.exp(-0.1 / length), abs=1e-12)


@given(steps=STEPS)
def test_dahl_states_stay_between_minus_one_and_one_and_turn_round_with_the_motion(steps: list[float]) -> None:
    path = np.cumsum([0.0, *steps])
    states = along(path)
    assert (np.abs(states) <= 1.0).all()
    assert np.allclose(along(-path), -states, rtol=0, atol=1e-12)


@given(steps=STEPS)
def test_dahl_friction_gives_back_no_more_than_its_spring_holds(steps: list[float]) -> None:
    fine = np.interp(np.linspace(0, len(steps), 4000 * len(steps)), np.arange(len(steps) + 1), np.cumsum([0, *steps]))
    states = along(fine)
    work = np.cumsum(0.5 * (states[:, 1:] + states[:, :-1]) * np.diff(fine), axis=1)
    # At most x0 (-|z| - log(1 - |z|)) is stored, of which less than x0 (log 2 - 1/2) comes back before it turns round.
    assert (work >= -1e-3 * np.array(LENGTHS)[:, None]).all()


def test_dahl_states_hold_at_rest_what_they_were() -> None:
    path = np.concatenate([np.linspace(0.0, 0.002, 50), np.full(1000, 0.002)])
    states = along(path)
    assert np.array_equal(states[:, 49:], np.repeat(states[:, 49:50], 1001, axis=1))
    assert 0.1 < states[1, -1] < 0.9


def test_lengths_of_dahl_are_scaled_joint_by_joint() -> None:
    q = np.tile(np.linspace(0.0, 1e-3, 20), (2, 1))
    motion = Motion(q=q, dq=q, ddq=q)
    columns, _ = Dahl(scales=(1.0, 5.0)).columns(planar_arm(), motion, None)
    for joint, scale in enumerate((1.0, 5.0)):
        expected = 1.0 - np.exp(-q[0] / (scale * np.array(LENGTHS)[:, None]))
        assert np.allclose(columns[joint], expected, rtol=0, atol=1e-12)


def moving(n_t: int = 200) -> Motion:
    q, dq, ddq = smooth_motion(2, np.arange(n_t) * 0.01, seed=4)
    return Motion(q=0.01 * q.T, dq=0.01 * dq.T, ddq=0.01 * ddq.T, step=0.01)


STATEFUL = (
    Dahl(),
    LoadDahl(),
    LoadDahl(joints=(False, True)),
    Bank(forms=(Dahl(scales=(0.3, 1)), Dahl(scales=(1, 3)))),
)


@pytest.mark.parametrize("term", STATEFUL, ids=str)
@given(cuts=st.lists(st.integers(1, 199), max_size=5, unique=True))
def test_states_go_on_where_a_motion_is_cut(term: Term, cuts: list[int]) -> None:
    motion = moving()
    whole, _ = term.columns(planar_arm(), motion, None)
    parts, state = [], None
    for start, stop in pairwise([0, *sorted(cuts), 200]):
        columns, state = term.columns(planar_arm(), motion.samples(start, stop), state)
        parts.append(columns)
    for joint in range(2):
        assert np.array_equal(np.concatenate([part[joint] for part in parts], axis=1), whole[joint])


def test_a_state_given_in_is_left_as_it_was() -> None:
    _, state = Dahl().columns(planar_arm(), moving(), None)
    before = state.copy()
    Dahl().columns(planar_arm(), moving(), state)
    assert np.array_equal(state, before)


def test_load_friction_is_the_size_of_the_rigid_torque_times_the_friction_state() -> None:
    motion, robot = moving(), planar_arm()
    load = np.abs(inverse_dynamics(robot, motion.q.T, motion.dq.T, motion.ddq.T).T)
    bent, _ = dahl_states(motion.q, np.full((2, 1), LENGTHS[0]), None)
    for term, sign in ((LoadDahl(), bent[:, 0]), (LoadCoulomb(), np.sign(motion.dq))):
        columns, _ = term.columns(robot, motion, None)
        assert np.allclose(np.concatenate(columns), load * sign, rtol=0, atol=1e-12)


@pytest.mark.parametrize("term", [LoadDahl(), LoadCoulomb()], ids=lambda term: term.key)
def test_a_robot_without_masses_has_no_load_friction_until_a_fit_found_them(term: Term) -> None:
    robot = planar_arm()
    bare = replace(robot, joints=tuple(replace(joint, inertia=np.zeros(10)) for joint in robot.joints))
    blind, _ = term.columns(bare, moving(), None)
    seen, _ = term.after(robot.inertia).columns(bare, moving(), None)
    assert not np.any(blind)
    assert np.array_equal(seen, term.columns(robot, moving(), None)[0])
    model = TorqueModel(robot=bare, terms=(Inertia(), term))
    assert {"Fl_1", "Fl_2"} == {model.parameters[k].name for k in base_parameters(model).unidentifiable} & {
        "Fl_1",
        "Fl_2",
    }


def test_load_friction_needs_the_inertia_of_every_link() -> None:
    with pytest.raises(ModelError, match="load friction: inertia; expected 20 values, got 3"):
        LoadDahl(inertia=(1.0, 2.0, 3.0)).columns(planar_arm(), moving(), None)


@pytest.mark.parametrize(
    ("key", "turning", "sliding"),
    [
        ("cube-root", ["Nm (s/rad)^(1/3)"], ["N (s/m)^(1/3)"]),
        ("viscous-asymmetry", ["Nm s/rad"], ["N s/m"]),
        ("asymmetric", ["Nm s/rad", "Nm s/rad", "Nm", "Nm"], ["N s/m", "N s/m", "N", "N"]),
        ("stribeck", ["Nm"], ["N"]),
        (
            "polynomial",
            ["Nm", "Nm s/rad", "Nm (s/rad)^2", "Nm (s/rad)^3", "Nm"],
            ["N", "N s/m", "N (s/m)^2", "N (s/m)^3", "N"],
        ),
        ("dahl", ["Nm", "Nm"], ["N", "N"]),
        ("load-dahl", ["1"], ["1"]),
        ("load-coulomb", ["1"], ["1"]),
    ],
)  # fmt: skip
def test_units_are_those_of_a_turning_or_a_sliding_joint(key: str, turning: list[str], sliding: list[str]) -> None:
    assert [p.unit for p in torque_model(AXIS, key).parameters] == turning
    assert [p.unit for p in torque_model(SLIDE, key).parameters] == sliding


def test_every_dissipating_term_has_columns_that_vanish_at_rest() -> None:
    rest = Motion(q=np.full((2, 5), 0.3), dq=np.zeros((2, 5)), ddq=np.zeros((2, 5)))
    for key, kind in TERMS.items():
        if kind.dissipates and "coupling" not in key:
            columns, _ = kind().columns(planar_arm(), rest, None)
            assert not np.any(columns), key


def test_shapes_to_choose_from_are_parts_of_the_top_speed_or_scales() -> None:
    facts = Facts(np.array([2.0, 0.0]))
    speeds = [form.shape for form in Stribeck().candidates(facts)]
    assert speeds == [pytest.approx((2 * part, part)) for part in STRIBECK_SPEEDS]
    assert [form.shape for form in Dahl().candidates(facts)] == [(scale, scale) for scale in SCALES]
    assert Dahl(scales=(1.0, 2.0)).candidates(facts) == (Dahl(scales=(1.0, 2.0)),)


def test_a_mixture_takes_every_joints_own_pick() -> None:
    forms = [Stribeck(speeds=(k, 10.0 * k)) for k in (1.0, 2.0, 3.0)]
    assert forms[0].mixed(forms, [2, 0]) == Stribeck(speeds=(3.0, 10.0))


def test_joints_without_a_term_have_no_parameter_of_it() -> None:
    term = CubeRoot(joints=(False, True))
    assert [p.name for p in term.parameters(planar_arm())] == ["Fr_2"]
    columns, _ = term.columns(planar_arm(), moving(), None)
    assert [column.shape[0] for column in columns] == [0, 1]
    assert [support.tolist() for support in term.support(planar_arm())] == [[], [0]]


@pytest.mark.parametrize(
    ("joints", "match"),
    [((True,), "term cube-root: joints; expected 2 values, got 1"), ((0, 2), "expected true or false for each")],
)
def test_joints_that_do_not_fit_are_refused(joints: tuple[object, ...], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        CubeRoot(joints=joints).parameters(planar_arm())


@pytest.mark.parametrize(
    ("terms", "first", "second"),
    [
        ("polynomial,viscous,coulomb", "polynomial", "viscous, coulomb"),
        ("coulomb,polynomial", "polynomial", "coulomb"),
        ("stribeck,polynomial", "polynomial", "stribeck"),
        ("asymmetric,offset,coulomb,viscous", "asymmetric", "viscous, coulomb, offset"),
        ("asymmetric,viscous-asymmetry", "asymmetric", "viscous-asymmetry"),
        ("load-dahl,load-coulomb", "load-dahl", "load-coulomb"),
        ("coupling,coupling-dahl", "coupling-dahl", "coupling"),
        ("inertia,inertia-simple", "inertia-simple", "inertia"),
    ],
)
def test_a_term_beside_one_that_stands_for_it_is_refused_naming_both(terms: str, first: str, second: str) -> None:
    with pytest.raises(ModelError) as caught:
        torque_model(planar_arm(), terms)
    assert f"term {first} cannot be told apart from {second};" in str(caught.value)
    assert "\n" not in str(caught.value)


class Grease(Viscous):
    """A law of somebody's own that is viscous friction by another name."""

    key = "grease"
    symbols = ("Fg",)


def test_terms_whose_columns_are_the_same_are_refused_naming_both_and_the_joint() -> None:
    model = TorqueModel(robot=planar_arm(), terms=(Inertia(), Viscous(), Grease(joints=(False, True))))
    expected = "terms viscous and grease cannot be told apart on j2; leave out viscous or grease"
    with pytest.raises(ModelError, match=expected):
        base_parameters(model)


def test_a_rotor_or_an_offset_that_a_link_takes_up_is_no_error() -> None:
    turning = base_parameters(torque_model(planar_arm(), "inertia,rotor,viscous"))
    assert "Ia_1" in {turning.names[index] for index in turning.dependent}
    upright = replace(SLIDE, gravity=-9.81 * SLIDE.joints[0].rotation @ SLIDE.joints[0].axis)
    lifting = base_parameters(torque_model(upright, "inertia,rotor,viscous,coulomb,offset"))
    assert "To_1" in {lifting.names[index] for index in lifting.dependent}


@pytest.mark.parametrize("robot", [AXIS, SLIDE, planar_arm()], ids=["one turning joint", "one slide", "planar arm"])
@pytest.mark.parametrize(
    "terms", ["robust", "robust,coulomb,spring,viscous-asymmetry", "inertia,rotor,polynomial,offset"]
)
def test_friction_of_every_joint_is_identifiable(robot: Robot, terms: str) -> None:
    model = torque_model(robot, terms)
    base = base_parameters(model)
    missing = {base.names[k] for k in (*base.dependent, *base.unidentifiable)}
    assert not {name for name in missing if name[0] in "Fk"}


def test_friction_of_a_slow_joint_beside_fast_ones_is_not_taken_for_rounding() -> None:
    robot = planar_arm()
    slow, fast = robot.joints
    joints = (
        replace(slow, limits=replace(slow.limits, velocity=0.05)),
        replace(fast, limits=replace(fast.limits, velocity=30.0)),
    )
    base = base_parameters(torque_model(replace(robot, joints=joints), "inertia,polynomial"))
    assert {"k1_1", "k2_1", "k3_1"} <= {base.names[k] for k in base.independent}
