"""Friction, springs and coupled motors in C are those of the model, also where they remember; compiled and compared."""

from __future__ import annotations

import ctypes
import re
from dataclasses import replace

import numpy as np
import pytest
from c_library import built, close, code_of, needs_compiler
from export_samples import estimate_of, every_value, states

from sample_arms import Truth, random_tree, smooth_motion
from tauhat.arrays import FloatArray
from tauhat.dynamics import TERMS, Term, TorqueModel
from tauhat.dynamics.terms import Coupling, CouplingDahl, Dahl, GasSpring, LoadCoulomb, LoadDahl
from tauhat.export import StandardParameters, ccode, model_parameters, standard_parameters
from tauhat.export.cfunctions import STEADY_WIDTH
from tauhat.export.friction import LAWS
from tauhat.robots import Robot, load_robot
from tauhat.robots.shared_motor import SharedMotor
from tauhat.simulation import perturbed

pytestmark = needs_compiler

MOTORS = (SharedMotor(3, 2, -0.7), SharedMotor(1, 0, 1.0))


def arm() -> Robot:
    return random_tree(np.random.default_rng(8), 4)


def model_with(*terms: Term) -> TorqueModel:
    return TorqueModel(robot=arm(), terms=(TERMS["inertia"](), TERMS["rotor"](), *terms))


def parameters_of(model: TorqueModel, *, seed: int = 0) -> tuple[FloatArray, StandardParameters]:
    standard = every_value(model, np.random.default_rng(seed))
    return standard, model_parameters(model, standard)


def other_inertia(robot: Robot) -> tuple[float, ...]:
    """Return rigid parameters of a load that are neither the nominal nor the identified ones."""
    return tuple(perturbed(robot, np.random.default_rng(77), spread=0.3).inertia.ravel())


def pointwise(key: str) -> Term:
    shape = (0.05, 0.1, 0.2, 0.15)
    form = LAWS[key]
    settings = {form.shape_field: shape} if form.shape_field else {}
    return TERMS[key](**settings, **({"inertia": other_inertia(arm())} if form.of_load else {}))


GAS = GasSpring(joint=1, distance=0.5, lever=0.2, angle=0.3, area=2e-3, volume=3e-3)
ELSEWHERE = [GAS, TERMS["spring"](), Coupling(motors=MOTORS, widths=(0.1, 0.2)), Coupling(motors=MOTORS)]
POINTWISE = [pointwise(key) for key, form in LAWS.items() if not form.lengths]
OTHERS = [LoadCoulomb(), TERMS["coulomb"](joints=(True, False, False, True)), *ELSEWHERE]


@pytest.mark.parametrize("term", [*POINTWISE, *OTHERS], ids=lambda term: term.key)
def test_every_term_of_the_moment_is_the_models_own(tmp_path, term):
    model = model_with(term)
    standard, parameters = parameters_of(model)
    q, dq, ddq = (np.vstack([part, np.zeros((1, 4))]) for part in states(model.robot, 25))
    dq *= 0.2
    call = built(tmp_path, model.robot, parameters)
    close(call("torque", q, dq, ddq), Truth(model, standard).torque(q, dq, ddq))
    assert "_step(" not in code_of(ccode(model.robot, parameters).text)


@pytest.mark.parametrize("term", [Dahl(scales=(0.5, 1.0, 2.0, 1.5)), LoadDahl(inertia=other_inertia(arm())), LoadDahl(),
                                  CouplingDahl(motors=MOTORS), CouplingDahl(motors=MOTORS, scales=(0.5, 3.0))],
                         ids=lambda term: term.key)  # fmt: skip
def test_every_term_with_a_memory_is_exact_step_by_step(tmp_path, term):
    model = model_with(term)
    standard, parameters = parameters_of(model)
    q, dq, ddq = motion_with_rest()
    call = built(tmp_path, model.robot, parameters)
    torque = Truth(model, standard).torque(q, dq, ddq)
    close(call("torque_step", q, dq, ddq), torque)
    close(call("friction_step", q, dq, ddq) + call("inverse_dynamics", q, dq, ddq), torque)


def motion_with_rest() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return reversals within a pre-sliding, ways of many of them, and standstill in between."""
    t = np.arange(0.0, 3.0, 0.01)
    q, dq, ddq = smooth_motion(4, t)
    q[100:150], dq[100:150], ddq[100:150] = q[100], 0.0, 0.0
    q[150:200] = q[100] + 2e-4 * np.sin(np.arange(50))[:, None]
    return q, dq, ddq


def everything(*, memory: bool) -> TorqueModel:
    """Return a model with links, rotors, springs, coupled motors and ten laws of friction."""
    keys = ["spring", "viscous", "cube-root", "viscous-asymmetry", "stribeck", "offset"]
    dry = ["dahl"] if memory else ["coulomb"]
    terms = [pointwise(key) for key in (*keys[1:], *dry)]
    load = LoadDahl(inertia=other_inertia(arm())) if memory else pointwise("load-coulomb")
    coupled = CouplingDahl(motors=MOTORS) if memory else Coupling(motors=MOTORS, widths=(0.1, 0.2))
    return model_with(TERMS["spring"](), GAS, coupled, *terms, load)


@pytest.mark.parametrize("memory", [False, True])
def test_mass_bias_and_friction_make_the_torque_of_the_whole_model(tmp_path, memory):
    model = everything(memory=memory)
    standard, parameters = parameters_of(model)
    q, dq, ddq = motion_with_rest()
    call = built(tmp_path, model.robot, parameters)
    mass, bias = call("mass_matrix", q), call("bias", q, dq)
    np.testing.assert_array_equal(mass, mass.transpose(0, 2, 1))
    friction = call("friction_step" if memory else "friction", q, dq, ddq)
    close(np.einsum("tjk,tk->tj", mass, ddq) + bias + friction, Truth(model, standard).torque(q, dq, ddq))
    close(call("bias", q, np.zeros_like(q)), call("gravity", q))


def test_the_robust_model_of_an_estimate_is_predicted_to_rounding(tmp_path):
    robot = load_robot("two_link")
    terms = ("inertia", "rotor", "viscous", "cube-root", "stribeck", "dahl", "load-dahl", "offset")
    shaped = {"stribeck": {"speeds": (0.1, 0.2)}, "dahl": {"scales": (0.3, 1.0)}}
    model = TorqueModel(robot=robot, terms=tuple(TERMS[key](**shaped.get(key, {})) for key in terms))
    estimate = estimate_of(model, every_value(model, np.random.default_rng(3)))
    motion = smooth_motion(2, np.arange(0.0, 4.0, 0.01))
    call = built(tmp_path, robot, standard_parameters(estimate))
    close(call("torque_step", *motion), estimate.predict(*motion))


@pytest.mark.parametrize("key", ["dahl", "load-dahl", "coupling-dahl"])
def test_without_states_the_gear_counts_as_bent_to_its_end(tmp_path, key):
    term = {"dahl": Dahl(), "load-dahl": LoadDahl(), "coupling-dahl": CouplingDahl(motors=MOTORS)}[key]
    model = model_with(term)
    standard, parameters = parameters_of(model)
    speed = np.array([0.3, -0.1, -0.5, 0.4])
    dq = np.tile(speed, (400, 1))
    q, ddq = np.cumsum(0.01 * dq, axis=0), np.zeros_like(dq)
    call = built(tmp_path, model.robot, parameters)
    long_after = Truth(model, standard).torque(q, dq, ddq)[-1:]
    np.testing.assert_allclose(call("torque", q[-1:], dq[-1:], ddq[-1:]), long_after, rtol=1e-12)
    rest = np.zeros((1, 4))
    np.testing.assert_array_equal(call("friction", rest, rest, rest), 0.0)


def test_the_smooth_sign_that_stands_for_the_states_has_the_stated_width(tmp_path):
    robot = load_robot("two_link")
    model = TorqueModel(robot=robot, terms=(TERMS["inertia"](), Dahl()))
    _, parameters = parameters_of(model)
    widths = STEADY_WIDTH * robot.velocity_limit
    dq, zero = np.array([[0.5, -1.0], [3.0, 0.1]]) * widths, np.zeros((2, 2))
    whole = parameters.law("dahl").coefficients.sum(axis=0)
    close(built(tmp_path, robot, parameters)("friction", zero, dq, zero), whole * np.tanh(dq / widths))
    assert " ".join(repr(float(width)) for width in widths) in ccode(robot, parameters).text.partition("*/")[0]


def test_a_step_may_be_written_over_any_argument_and_friction_is_zero_where_it_began(tmp_path):
    model = everything(memory=True)
    _, parameters = parameters_of(model)
    call = built(tmp_path, model.robot, parameters)
    q, dq, ddq = (part[:1] for part in states(model.robot))
    for name in ("torque", "torque_step"):
        expected = call(name, q, dq, ddq)
        library = ctypes.CDLL(str(next(tmp_path.glob("*.so"))))
        for over in range(3):
            copies = [part.copy() for part in (q, dq, ddq)]
            library.call_start(ctypes.c_void_p(q.ctypes.data))
            places = [ctypes.c_void_p(part.ctypes.data) for part in (*copies, copies[over])]
            getattr(library, f"call_{name}")(*places)
            np.testing.assert_array_equal(copies[over], expected)


def test_a_load_on_the_identified_links_costs_no_second_recursion():
    model = model_with(LoadCoulomb(widths=(0.1,) * 4))
    standard, parameters = parameters_of(model)
    (law,) = parameters.friction
    same = replace(parameters, friction=(replace(law, load=parameters.inertia),))
    texts = (ccode(model.robot, made).text for made in (parameters, same))
    first, second = (code_of(text).partition("tree_torque(")[2] for text in texts)
    forces_of_load = re.compile(r"\bl[fn]\d")
    assert forces_of_load.search(first)
    assert not forces_of_load.search(second)
    assert not np.array_equal(law.load, parameters.inertia)
    np.testing.assert_array_equal(law.load, model.robot.inertia)
    assert standard.size == model.n_p


def test_states_are_kept_for_what_has_a_memory_only():
    model = model_with(Dahl(joints=(True, False, False, True)), TERMS["viscous"]())
    standard, parameters = parameters_of(model)
    assert parameters.with_memory == ("dahl",)
    text = ccode(model.robot, parameters).text
    assert "double bent[4];" in text
    assert "friction_state" not in code_of(
        ccode(model.robot, replace(parameters, friction=parameters.friction[1:])).text
    )
    zeros = model_parameters(model, np.where(np.arange(model.n_p) < 44, standard, 0.0))
    assert zeros.with_memory == ()
    assert "friction_state" not in ccode(model.robot, zeros).text


def test_the_head_tells_how_to_keep_states_springs_motors_and_negative_rotors():
    model = everything(memory=True)
    _, parameters = parameters_of(model)
    turned = replace(parameters, rotor=np.array([0.1, -0.2, 0.3, 0.4]))
    head = ccode(model.robot, turned).text.partition("*/")[0]
    for text in (
        "Friction with a memory (dahl, load-dahl, coupling-dahl)", "tree_friction_start(&state, q);", "spring: Ks",
        "gas-spring: Gs", "q[3] + -0.7 q[2]: inertia", "Rotor inertia was identified as negative: j1.",
    ):  # fmt: skip
        assert text in head
