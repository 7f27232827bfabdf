# ruff: noqa: ARG002 (the terms here take what every term takes)
"""The Term interface carries what models need: states along a recording, loads of a pass before, coupled joints."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sample_arms import planar_arm, planar_truth, smooth_motion
from tauhat.dynamics import Inertia, Motion, Parameter, Term, TorqueModel, Viscous, base_parameters, inverse_dynamics
from tauhat.dynamics.terms import LoadCoulomb
from tauhat.estimation.rows import filtered_rows
from tauhat.recordings.processing import Processing


@dataclass(frozen=True, slots=True, kw_only=True)
class BristleFriction(Term):
    """Dahl-like: a bristle that follows the motion and saturates, `dz = dq (1 - sign(dq) z / reach) dt`."""

    key: ClassVar[str] = "bristle"
    stateful: ClassVar[bool] = True
    reach: float = 0.05

    def parameters(self, robot):
        return tuple(Parameter(symbol="Fb", joint=joint, unit="Nm") for joint in range(robot.n_v))

    def support(self, robot):
        return tuple(np.array([joint]) for joint in range(robot.n_v))

    def columns(self, robot, motion, state):
        z = np.zeros(motion.n_v) if state is None else state
        path = np.empty((motion.n_v, motion.n_t))
        for k in range(motion.n_t):
            moved = motion.dq[:, k] * motion.step
            z = (z + moved) / (1.0 + np.abs(moved) / self.reach)
            path[:, k] = z / self.reach
        return tuple(path[joint : joint + 1] for joint in range(motion.n_v)), z


@dataclass(frozen=True, slots=True, kw_only=True)
class WristCoupling(Term):
    """One parameter that loads two joints: a friction on the sum of their speeds."""

    key: ClassVar[str] = "coupling"

    def parameters(self, robot):
        return (Parameter(symbol="Fm", joint=1, unit="Nm s/rad"),)

    def support(self, robot):
        return (np.array([0]), np.array([0]))

    def columns(self, robot, motion, state):
        together = motion.dq.sum(axis=0, keepdims=True)
        return (together, together), state


def smooth_stretch(n_t: int) -> Motion:
    q, dq, ddq = smooth_motion(2, np.arange(n_t) * 0.005)
    return Motion(q=q.T.copy(), dq=dq.T.copy(), ddq=ddq.T.copy(), step=0.005)


MODEL = TorqueModel(
    robot=planar_arm(), terms=(Inertia(), BristleFriction(), LoadCoulomb(widths=(0.05, 0.05)), WristCoupling())
)


@settings(max_examples=15)
@given(cuts=st.lists(st.integers(1, 299), max_size=6, unique=True))
def test_columns_are_the_same_however_the_motion_is_cut(cuts):
    motion, layout = smooth_stretch(300), MODEL.layout()
    whole, last = MODEL.columns(motion, layout)
    parts, states = [], None
    bounds = [0, *sorted(cuts), 300]
    for start, stop in pairwise(bounds):
        columns, states = MODEL.columns(motion.samples(start, stop), layout, states)
        parts.append(columns)
    assert np.allclose(np.concatenate(parts, axis=1), whole, rtol=0, atol=1e-12)
    assert np.array_equal(states[1], last[1])


def test_forgetting_the_state_would_be_noticed():
    motion, layout = smooth_stretch(300), MODEL.layout()
    whole, _ = MODEL.columns(motion, layout)
    fresh, _ = MODEL.columns(motion.samples(150, 300), layout)
    assert np.abs(fresh - whole[:, 150:]).max() > 0.1


def test_iterated_columns_take_the_load_of_the_parameters_that_the_last_pass_found():
    motion, layout = smooth_stretch(50), MODEL.layout()
    found = 1.3 * planar_arm().inertia
    later = MODEL.with_term(MODEL.terms[2].after(found))
    sign = np.tanh(motion.dq / 0.05)
    for model, inertia in ((MODEL, None), (later, found)):
        columns, _ = model.columns(motion, layout)
        load = inverse_dynamics(planar_arm(), motion.q.T, motion.dq.T, motion.ddq.T, inertia=inertia).T
        rows = np.flatnonzero(np.isin(layout.parameters, [22, 23]))
        assert np.allclose(columns[rows], np.abs(load) * sign, rtol=0, atol=1e-12)


def test_a_coupling_parameter_has_a_row_in_both_joints():
    motion, layout = smooth_stretch(50), MODEL.layout()
    columns, _ = MODEL.columns(motion, layout)
    rows = np.flatnonzero(layout.parameters == 24)
    assert [rows[0] < layout.bounds[1], rows[1] >= layout.bounds[1]] == [True, True]
    assert np.array_equal(columns[rows], np.tile(motion.dq.sum(axis=0), (2, 1)))


@pytest.mark.parametrize("chunk", [50, 333, 1024, 10_000])
def test_filtered_rows_are_the_same_whatever_the_chunk(chunk):
    recording = planar_truth().recording(seconds=8.0)
    processing = Processing(cutoff=8.0, motion_cutoff=24.0)
    layout = MODEL.layout()
    reference = list(filtered_rows(MODEL, layout, recording, processing, chunk=700))
    pieces = list(filtered_rows(MODEL, layout, recording, processing, chunk=chunk))
    for name in ("t", "columns", "tau", "dq"):
        first = np.concatenate([getattr(piece, name) for piece in reference], axis=-1)
        second = np.concatenate([getattr(piece, name) for piece in pieces], axis=-1)
        assert first.shape == second.shape
        assert np.allclose(first, second, rtol=0, atol=1e-12 * max(1.0, np.abs(first).max()))
    bristle = np.isin(layout.parameters, [20, 21])
    assert np.abs(np.concatenate([piece.columns for piece in pieces], axis=1)[bristle]).max() > 0.5


def test_coupling_is_identifiable_beside_the_joints_own_friction():
    model = TorqueModel(robot=planar_arm(), terms=(Viscous(), WristCoupling()))
    assert base_parameters(model).n_b == 3


def test_stateful_and_iterated_parameters_are_identifiable():
    base = base_parameters(MODEL)
    kept = {base.names[index] for index in base.independent}
    assert {"Fb_1", "Fb_2", "Fl_1", "Fl_2", "Fm_2"} <= kept
