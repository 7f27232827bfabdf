"""Forty random limit files: a motion that Pinocchio and coal find feasible ten times finer, or a named reason.

`benchmarks/limit_files.py --count 200` is the same with more files.
"""

from __future__ import annotations

import pytest
from limit_benchmark import NO_EXCESS, Outcome, outcome, summary


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return [outcome(seed) for seed in range(40)]


def test_every_motion_is_feasible_on_a_grid_ten_times_finer(outcomes: list[Outcome]) -> None:
    made = [found for found in outcomes if not found.reason]
    assert len(made) >= 15
    assert sum(len(found.left) > 3 for found in made) >= 10, "most keep limits of several joints"
    assert [(found.seed, found.left) for found in made if min(found.left.values()) < NO_EXCESS] == []


def test_every_refusal_is_one_line_that_names_a_limit_or_a_joint(outcomes: list[Outcome]) -> None:
    refused = [found for found in outcomes if found.reason]
    assert len(refused) >= 8
    assert [found.reason for found in refused if not found.named] == []
    assert len(summary(outcomes)["reasons"]) >= 4
