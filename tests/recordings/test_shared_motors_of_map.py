"""Which motors turn with two joints is read off the map's gear matrix, in joint units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauhat.recordings.logmap import Coupling
from tauhat.recordings.mapfile import load_map, parse_map
from tauhat.recordings.reading import read_recording
from tauhat.robots.shared_motor import SharedMotor

TX40 = Path(__file__).parents[2] / "examples" / "real" / "tx40.toml"
RATIOS = st.floats(0.5, 200.0).flatmap(lambda size: st.sampled_from([size, -size]))


def test_the_last_motor_of_the_tx40_turns_with_joints_5_and_6_alike() -> None:
    ((own, other, ratio),) = load_map(TX40).coupling.shared_motors()
    assert (own, other) == (5, 4)
    assert ratio == pytest.approx(1.0, rel=1e-12)


@given(own_gear=RATIOS, other_gear=RATIOS, extra=RATIOS)
def test_a_shared_motor_turns_by_its_joint_and_the_ratio_times_the_other(
    own_gear: float, other_gear: float, extra: float
) -> None:
    turns = np.array([[other_gear, 0.0], [extra, own_gear]])  # motors per joints
    (motor,) = Coupling(position=np.linalg.inv(turns)).shared_motors()
    assert motor[:2] == (1, 0)
    q = np.array([0.3, -0.8])
    assert own_gear * (q[motor.own] + motor.ratio * q[motor.other]) == pytest.approx((turns @ q)[1], rel=1e-9, abs=1e-9)


def test_a_differential_shares_both_of_its_motors() -> None:
    turns = np.array([[1.0, 1.0], [1.0, -1.0]])
    assert Coupling(position=np.linalg.inv(turns)).shared_motors() == (SharedMotor(0, 1, 1.0), SharedMotor(1, 0, -1.0))


@pytest.mark.parametrize("matrix", [None, np.diag([0.01, -0.02, 0.5]), np.eye(3)])
def test_gears_of_their_own_share_no_motor(matrix: np.ndarray | None) -> None:
    assert Coupling(position=matrix).shared_motors() == ()


def test_rounding_in_a_matrix_is_no_coupling() -> None:
    matrix = np.diag([0.01, 0.02]) + 1e-14
    assert Coupling(position=matrix).shared_motors() == ()


def test_motors_that_are_numbered_otherwise_than_joints_are_left_alone() -> None:
    assert Coupling(position=np.array([[0.0, 0.1], [0.2, 0.0]])).shared_motors() == ()


def test_a_recording_carries_the_shared_motors_of_its_map(tmp_path: Path) -> None:
    text = """
        [time]
        rate = 100.0
        [position]
        columns = ["a", "b"]
        [coupling]
        position = [[0.1, 0.0], [-0.05, 0.1]]
    """
    rows = np.random.default_rng(0).normal(size=(50, 2))
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="a,b", comments="")
    recording = read_recording(tmp_path / "run.csv", map=parse_map(text))
    (motor,) = recording.shared_motors
    assert motor == SharedMotor(1, 0, pytest.approx(0.5))
    assert recording.rows(0, 20).shared_motors == recording.shared_motors
