"""Terms by hand: every column, its parameter's name, unit and bound, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from sample_arms import chain, planar_arm, random_states
from tauhat.dynamics import (
    PLAIN_TERMS,
    Coulomb,
    Inertia,
    Motion,
    Offset,
    RotorInertia,
    TorqueModel,
    Viscous,
    inverse_dynamics,
    motion_from_rows,
    regressor,
    torque_model,
)
from tauhat.dynamics.terms import Facts
from tauhat.dynamics.terms.friction import WIDTHS
from tauhat.errors import ModelError

Q = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
DQ = np.array([[-1.0, 0.0, 0.02], [0.5, -0.001, 2.0]])
DDQ = np.array([[3.0, 0.0, -1.0], [0.0, 1.0, 7.0]])
MOTION = Motion(q=Q, dq=DQ, ddq=DDQ)


def own_columns(term):
    columns, state = term.columns(planar_arm(), MOTION, None)
    assert state is None
    assert [column.shape for column in columns] == [(1, 3), (1, 3)]
    return np.concatenate(columns)


@pytest.mark.parametrize(
    ("term", "expected"),
    [
        (RotorInertia(), DDQ),
        (Viscous(), DQ),
        (Offset(), np.ones((2, 3))),
        (Coulomb(), [[-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]]),
        (Coulomb(widths=(0.5, 0.01)), np.tanh([[-2.0, 0.0, 0.04], [50.0, -0.1, 200.0]])),
    ],
)
def test_joint_terms_have_the_columns_of_their_formula(term, expected):
    assert np.allclose(own_columns(term), expected, rtol=0, atol=1e-15)


def test_inertia_has_the_regressors_columns_joint_by_joint():
    robot = planar_arm()
    whole = regressor(robot, Q.T, DQ.T, DDQ.T)
    columns, _ = Inertia().columns(robot, MOTION, None)
    assert np.array_equal(columns[0], whole[:, 0].T)
    assert np.array_equal(columns[1], whole[:, 1, 10:].T)
    assert [support.tolist() for support in Inertia().support(robot)] == [list(range(20)), list(range(10, 20))]


@pytest.mark.parametrize(
    ("key", "symbol", "turning", "sliding", "lower"),
    [
        ("rotor", "Ia", "kg m^2", "kg", 0.0),
        ("viscous", "Fv", "Nm s/rad", "N s/m", 0.0),
        ("coulomb", "Fc", "Nm", "N", 0.0),
        ("offset", "To", "Nm", "N", -np.inf),
    ],
)
def test_parameters_carry_symbol_joint_unit_and_bound(key, symbol, turning, sliding, lower):
    robot = chain(np.random.default_rng(0), "RP")
    parameters = torque_model(robot, key).parameters
    assert [p.name for p in parameters] == [f"{symbol}_1", f"{symbol}_2"]
    assert [p.unit for p in parameters] == [turning, sliding]
    assert [p.lower for p in parameters] == [lower, lower]


def test_masses_and_moments_cannot_be_negative_but_products_and_centres_can():
    bounds = {p.symbol: p.lower for p in torque_model(planar_arm(), "inertia").parameters}
    assert {symbol for symbol, lower in bounds.items() if lower == 0.0} == {"m", "Ixx", "Iyy", "Izz"}


def test_coulomb_widths_to_choose_from_are_parts_of_the_top_speeds():
    forms = Coulomb().candidates(Facts(np.array([2.0, 3.0, 0.0])))
    assert [form.widths for form in forms] == [pytest.approx((2 * part, 3 * part, part)) for part in WIDTHS]
    assert list(WIDTHS) == sorted(WIDTHS)


def test_given_coulomb_widths_stay():
    term = Coulomb(widths=(0.5, 0.6))
    assert term.candidates(Facts(np.array([2.0, 3.0]))) == (term,)


@pytest.mark.parametrize("term", [Inertia(), RotorInertia(), Viscous(), Offset()])
def test_other_terms_leave_no_choice(term):
    assert term.candidates(Facts(np.array([2.0, 3.0]))) == (term,)


def test_a_term_is_replaced_by_one_of_its_kind_alone():
    before = torque_model(planar_arm())
    after = before.with_term(Coulomb(widths=(0.1, 0.2)))
    assert [term.key for term in after.terms] == list(PLAIN_TERMS)
    assert [a.key for a, b in zip(before.terms, after.terms, strict=True) if a != b] == ["coulomb"]


@pytest.mark.parametrize("width", [0.0, -0.1, np.inf, np.nan])
def test_a_width_that_is_not_positive_is_refused(width):
    with pytest.raises(ModelError, match="must be positive"):
        Coulomb(widths=(0.1, width))


def test_a_width_for_every_joint_is_needed():
    with pytest.raises(ModelError, match="one of the widths a joint is needed; expected 2, got 3"):
        Coulomb(widths=(0.1, 0.1, 0.1)).columns(planar_arm(), MOTION, None)


def test_whole_model_predicts_rigid_torque_plus_friction():
    robot = chain(np.random.default_rng(1), "RPR")
    model = torque_model(robot)
    q, dq, ddq = random_states(np.random.default_rng(2), 30, 3)
    friction = np.random.default_rng(3).uniform(0.1, 1.0, (4, 3))
    standard = np.concatenate([robot.inertia.ravel(), friction.ravel()])
    layout = model.layout()
    columns, _ = model.columns(motion_from_rows(q, dq, ddq), layout)
    weights = standard[layout.parameters]
    rows = [layout.of_joint(joint) for joint in range(3)]
    predicted = np.array([weights[part] @ columns[part] for part in rows]).T
    rotor, viscous, coulomb, offset = friction
    expected = inverse_dynamics(robot, q, dq, ddq) + rotor * ddq + viscous * dq + coulomb * np.sign(dq) + offset
    assert np.allclose(predicted, expected, rtol=0, atol=1e-12)


def test_layout_of_kept_parameters_picks_their_rows_from_the_whole():
    model = torque_model(chain(np.random.default_rng(4), "RRR"))
    motion = motion_from_rows(*random_states(np.random.default_rng(5), 10, 3))
    whole_layout = model.layout()
    whole, _ = model.columns(motion, whole_layout)
    kept = np.array([3, 11, 25, 29, 30, 32, 35, 41])
    layout = model.layout(kept)
    picked, _ = model.columns(motion, layout)
    for joint in range(3):
        rows, all_rows = layout.of_joint(joint), whole_layout.of_joint(joint)
        wanted = np.isin(whole_layout.parameters[all_rows], kept)
        assert np.array_equal(layout.parameters[rows], whole_layout.parameters[all_rows][wanted])
        assert np.array_equal(picked[rows], whole[all_rows][wanted])


def test_terms_are_named_in_one_string_with_spaces_allowed():
    assert [term.key for term in torque_model(planar_arm(), "inertia, viscous").terms] == ["inertia", "viscous"]


def test_an_unknown_term_is_refused_with_the_known_ones():
    with pytest.raises(ModelError, match=r"unknown term; expected plain, robust, inertia, .*, got friction"):
        torque_model(planar_arm(), "inertia,friction")


def test_a_term_given_twice_is_refused():
    with pytest.raises(ModelError, match="a term is given twice; got viscous, viscous"):
        torque_model(planar_arm(), "viscous,viscous")


def test_a_model_without_terms_is_refused():
    with pytest.raises(ModelError, match="at least one term"):
        TorqueModel(robot=planar_arm(), terms=())


def test_model_survives_plain_data():
    model = TorqueModel(robot=planar_arm(), terms=(Inertia(), Coulomb(widths=(0.1, 1 / 3))))
    again = TorqueModel.from_dict(model.to_dict())
    assert again.terms == model.terms
    assert again.robot.fingerprint == model.robot.fingerprint


def test_plain_data_with_an_unknown_term_or_setting_is_refused():
    data = torque_model(planar_arm(), "viscous").to_dict()
    with pytest.raises(ModelError, match="unknown term"):
        TorqueModel.from_dict({**data, "terms": [{"term": "magic"}]})
    with pytest.raises(ModelError, match="term viscous has other settings in this version; got slope"):
        TorqueModel.from_dict({**data, "terms": [{"term": "viscous", "slope": 1.0}]})
