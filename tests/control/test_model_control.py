"""Controllers that know a model: against Pinocchio, closed forms, and the equations they promise."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sample_arms import PLANAR, planar_arm, planar_truth, random_states, random_tree, smooth_motion
from tauhat.control import (
    ComputedTorque,
    ControlSample,
    JointState,
    ModelFeedforward,
    ModelTorque,
    PDFeedforward,
    computed_torque,
    model_torque,
    nominal_torque,
)
from tauhat.dynamics import TorqueModel, motion_from_rows, torque_model
from tauhat.dynamics.terms import Coupling, CouplingDahl, Dahl, GasSpring, Inertia, RotorInertia, Thermal, Viscous
from tauhat.errors import ArrayError, ModelError
from tauhat.estimation import identify
from tauhat.estimation.identified_torque import identified_torque
from tauhat.robots import load_robot, pinocchio_model

ARM = planar_arm()
TRUTH = planar_truth()


def sample_at(q, dq, q_ref, dq_ref, ddq_ref, *, period=1e-3):
    still = np.zeros_like(q)
    return ControlSample(0.0, period, q, dq, q_ref, dq_ref, ddq_ref, still, still)


def planar_torque(q, dq, ddq):
    """Return the textbook's torque of the planar arm with gravity along -y, written out."""
    (m1, l1, r1, i1), (m2, _, r2, i2) = PLANAR
    g, c2, s2 = 9.81, np.cos(q[1]), np.sin(q[1])
    far, middle = i2 + m2 * r2**2, m2 * l1 * r2
    mass = np.array(
        [[i1 + m1 * r1**2 + m2 * l1**2 + far + 2 * middle * c2, far + middle * c2], [far + middle * c2, far]]
    )
    whirl = middle * s2 * np.array([-dq[1] * (2 * dq[0] + dq[1]), dq[0] ** 2])
    tip = m2 * g * r2 * np.cos(q[0] + q[1])
    return mass @ ddq + whirl + np.array([(m1 * r1 + m2 * l1) * g * np.cos(q[0]) + tip, tip])


@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 7))
def test_rigid_torque_of_any_tree_at_one_state_is_pinocchios(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    model = pinocchio_model(robot)
    rotor = rng.uniform(0.05, 1.0, n_v)
    model.armature[:] = rotor
    torque = ModelTorque(robot=robot, inertia=robot.inertia, rotor=rotor)
    q, dq, ddq = (rows[0] for rows in random_states(rng, 1, n_v))
    _, ours = torque.step(torque.start(q), JointState(q, dq, ddq))
    oracle = pinocchio.rnea(model, model.createData(), q, dq, ddq)
    np.testing.assert_allclose(ours, oracle, atol=1e-10 * max(1.0, np.abs(oracle).max()))


def test_torque_of_the_description_has_its_friction_and_rotors():
    robot = load_robot("ur5e")
    q, dq, ddq = (rows.T[:, 0] for rows in np.random.default_rng(1).uniform(0.5, 1.0, (3, 1, 6)))
    torque = nominal_torque(robot)
    _, ours = torque.step(torque.start(q), JointState(q, dq, ddq))
    model = pinocchio_model(robot)
    drives = [(j.rotor_inertia, j.viscous, j.coulomb) for j in robot.joints]
    rotor, viscous, coulomb = np.array(drives).T
    model.armature[:] = rotor
    links = pinocchio.rnea(model, model.createData(), q, dq, ddq)
    np.testing.assert_allclose(ours, links + viscous * dq + coulomb, rtol=1e-12)
    assert viscous.min() > 0.0


def test_an_identified_torque_along_a_motion_is_the_estimates_own_prediction():
    terms = "inertia,rotor,viscous,cube-root,dahl,offset"
    recording = TRUTH.recording(seconds=8.0)
    estimate = identify(torque_model(ARM, terms), [recording])
    t = np.arange(0.0, 3.0, 0.005)
    motion = smooth_motion(2, t, seed=5)
    np.testing.assert_allclose(identified_torque(estimate).along(*motion), estimate.predict(*motion), atol=1e-9)


@pytest.mark.parametrize("coupling", [Coupling, CouplingDahl])
def test_torque_with_a_gas_spring_and_a_shared_motor_is_regressor_times_parameters(coupling):
    spring = GasSpring(joint=1, distance=0.8, lever=0.2, angle=0.1, area=1e-3, volume=1e-3)
    shape = {"widths": (0.3,)} if coupling is Coupling else {"scales": (30.0,)}
    shared = coupling(motors=((1, 0, -1.7),), **shape)
    model = TorqueModel(robot=ARM, terms=(Inertia(), RotorInertia(), Viscous(), spring, shared))
    standard = np.random.default_rng(6).uniform(0.2, 1.0, model.n_p)
    q, dq, ddq = smooth_motion(2, np.arange(0.0, 3.0, 0.01), seed=5)
    columns, layout = model.columns(motion_from_rows(q, dq, ddq), model.layout())[0], model.layout()
    rows = [layout.of_joint(joint) for joint in range(2)]
    expected = np.array([standard[layout.parameters[part]] @ columns[part] for part in rows]).T
    assert np.abs(expected).max() > 10.0
    np.testing.assert_allclose(model_torque(model, standard).along(q, dq, ddq), expected, atol=1e-9)


def test_pre_sliding_friction_builds_up_over_its_length_and_turns_round_as_dahl_says():
    model = TorqueModel(robot=ARM, terms=(Dahl(),))
    torque = model_torque(model, np.array([2.0, 0.0, 0.0, 0.0]))  # Fd of the first joint over 1e-4 rad
    still = np.zeros(2)
    memory = torque.start(still)
    way = np.array([5e-5, 1e-4, 2e-3, 2e-3, 2e-3 - 1e-4])
    found = []
    for position in way:
        place = np.array([position, 0.0])
        memory, tau = torque.step(memory, JointState(place, still, still))
        found.append(tau[0])
    forwards = 1.0 - np.exp(-way[:3] / 1e-4)
    back = -1.0 + (forwards[-1] + 1.0) * np.exp(-1.0)
    np.testing.assert_allclose(found, 2.0 * np.array([*forwards, forwards[-1], back]), rtol=1e-12)


def test_a_step_changes_no_memory_that_it_is_handed():
    torque = model_torque(TorqueModel(robot=ARM, terms=(Dahl(),)), np.ones(4))
    memory = torque.start(np.zeros(2))
    moved = JointState(np.ones(2), np.zeros(2), np.zeros(2))
    first, second = (torque.step(memory, moved)[1] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(memory.bent, np.zeros(4))


def test_feedforward_adds_the_models_torque_at_the_reference_to_a_pd():
    rng = np.random.default_rng(3)
    q, dq, q_ref, dq_ref, ddq_ref = rng.normal(size=(5, 2))
    law = PDFeedforward(kp=[10.0, 20.0], kd=[1.0, 2.0])
    controller = ModelFeedforward(torque=nominal_torque(ARM), law=law)
    shown = sample_at(q, dq, q_ref, dq_ref, ddq_ref)
    _, tau = controller.step(controller.start(shown), shown)
    feedback = np.array([10.0, 20.0]) * (q_ref - q) + np.array([1.0, 2.0]) * (dq_ref - dq)
    np.testing.assert_allclose(tau, planar_torque(q_ref, dq_ref, ddq_ref) + feedback, rtol=1e-12)


def test_computed_torque_with_the_true_model_leaves_a_linear_error_on_every_joint():
    """Pinocchio's accelerations under the law obey `dde + kd de + kp e = 0`, however joints are coupled."""
    rng = np.random.default_rng(4)
    robot = random_tree(rng, 6)
    model = pinocchio_model(robot)
    controller = computed_torque(ModelTorque(robot=robot, inertia=robot.inertia, rotor=np.zeros(6)), bandwidth=2.0)
    for _ in range(20):
        q, dq, q_ref, dq_ref, ddq_ref = rng.normal(size=(5, 6))
        shown = sample_at(q, dq, q_ref, dq_ref, ddq_ref)
        _, tau = controller.step(controller.start(shown), shown)
        ddq = pinocchio.aba(model, model.createData(), q, dq, tau)
        left = (ddq_ref - ddq) + controller.kd * (dq_ref - dq) + controller.kp * (q_ref - q)
        np.testing.assert_allclose(left, 0.0, atol=1e-7 * np.abs(ddq).max())


def test_friction_of_computed_torque_is_that_of_the_reference():
    torque = model_torque(torque_model(ARM, "inertia,viscous"), np.concatenate([ARM.inertia.ravel(), [3.0, 4.0]]))
    q, dq, ddq = np.random.default_rng(5).normal(size=(3, 2))
    controller = ComputedTorque(torque=torque, kp=np.zeros(2), kd=np.zeros(2))
    shown = sample_at(q, np.array([0.5, -0.5]), q + 0.1, dq, ddq)
    _, tau = controller.step(controller.start(shown), shown)
    np.testing.assert_allclose(tau, planar_torque(q, np.array([0.5, -0.5]), ddq) + [3.0, 4.0] * dq, rtol=1e-12)


@pytest.mark.parametrize("kind", ["feedforward", "computed"])
def test_torques_stop_at_their_limits(kind):
    limit = np.array([0.5, np.inf])
    if kind == "feedforward":
        law = PDFeedforward(kp=[1e3, 1e3], kd=[0.0, 0.0], torque_limit=limit)
        controller = ModelFeedforward(torque=nominal_torque(ARM), law=law)
    else:
        controller = computed_torque(nominal_torque(ARM), bandwidth=5.0, torque_limit=limit)
    q = np.array([-1.0, -1.0])
    shown = sample_at(q, np.zeros(2), q + 1.0, np.zeros(2), np.zeros(2))
    _, tau = controller.step(controller.start(shown), shown)
    assert tau[0] == 0.5
    assert tau[1] > 10.0


def test_what_does_not_fit_is_refused():
    torque = nominal_torque(ARM)
    with pytest.raises(ModelError, match="the law does not fit the model; expected 2 joints, got 1"):
        ModelFeedforward(torque=torque, law=PDFeedforward(kp=[1.0], kd=[1.0]))
    with pytest.raises(ArrayError, match="computed torque: kp is negative; got -1"):
        ComputedTorque(torque=torque, kp=[1.0, -1.0], kd=[1.0, 1.0])
    with pytest.raises(ModelError, match="bandwidth of computed torque; expected a positive number, got 0"):
        computed_torque(torque, bandwidth=0.0)
    with pytest.raises(ModelError, match="elements of a model torque"):
        ModelTorque(robot=ARM, inertia=ARM.inertia, rotor=np.zeros(2), elements=np.zeros(3))
    with pytest.raises(ArrayError, match="model torque: rotor inertia is not symmetric"):
        ModelTorque(robot=ARM, inertia=ARM.inertia, rotor=np.array([[1.0, 0.1], [0.2, 1.0]]))
    model = TorqueModel(robot=ARM, terms=(Thermal(),))
    with pytest.raises(ModelError, match="term thermal cannot be simulated"):
        model_torque(model, np.zeros(model.n_p))
