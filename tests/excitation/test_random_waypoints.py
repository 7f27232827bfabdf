"""Forty random programs of moves: a motion that keeps its limits ten times finer, or a refusal that names the move.

`benchmarks/waypoints.py --count 200` is the same with more programs.
"""

from __future__ import annotations

import pytest
from waypoint_benchmark import NO_EXCESS, Outcome, outcome

pytest.importorskip("ruckig", reason="the extra `planner` is not installed")

SEEDS = range(200, 240)  # other programs than those of the benchmark


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return [outcome(seed) for seed in SEEDS]


def worst(outcomes: list[Outcome], name: str) -> float:
    found = [one.measured[name] for one in outcomes if name in one.measured]
    assert len(found) >= 10
    return max(found)


@pytest.mark.parametrize("limit", ["speed", "acceleration", "jerk"])
def test_limits_hold_on_a_grid_ten_times_finer_and_are_used(outcomes: list[Outcome], limit: str):
    assert 0.99 < worst(outcomes, limit) <= 1.0 + NO_EXCESS


def test_positions_stay_in_range_and_zones_are_kept(outcomes: list[Outcome]):
    assert worst(outcomes, "range") <= 1e-9
    assert worst(outcomes, "out of the zone [m]") <= 1e-9


def test_velocity_and_acceleration_integrate_exactly_to_position_and_velocity(outcomes: list[Outcome]):
    assert worst(outcomes, "q is not the integral of dq") < 1e-10
    assert worst(outcomes, "dq is not the integral of ddq [1/s]") < 1e-9


def test_nothing_jumps_and_nothing_runs_backwards(outcomes: list[Outcome]):
    assert worst(outcomes, "jump of q") < 1e-10
    assert worst(outcomes, "jump of dq") < 1e-9
    assert worst(outcomes, "jump of ddq") < 1e-7
    assert worst(outcomes, "backward [1/s]") < 1e-9


def test_the_tool_stays_on_its_lines(outcomes: list[Outcome]):
    assert worst(outcomes, "off the line [m]") < 1e-11


def test_some_programs_are_slowed_and_every_refusal_names_the_move(outcomes: list[Outcome]):
    assert sum(one.slowed > 0 for one in outcomes) >= 10
    refused = [one.reason for one in outcomes if one.reason]
    assert 1 <= len(refused) <= 15
    assert [one.reason for one in outcomes if not one.named] == []
