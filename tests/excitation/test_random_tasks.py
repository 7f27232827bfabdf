"""Random tasks: programs inside all limits on a fine grid, or a refusal that names the place.

`benchmarks/task_designs.py --count 200` is the same with more tasks.
"""

from __future__ import annotations

import pytest
from task_benchmark import NO_EXCESS, Outcome, outcome, summary

pytest.importorskip("ruckig", reason="the extra `planner` is not installed")

SEEDS = range(200, 207)  # other tasks than those of the benchmark


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return [outcome(seed) for seed in SEEDS]


def test_designed_programs_keep_limits_and_their_points_the_region(outcomes: list[Outcome]):
    designed = [one for one in outcomes if not one.reason]
    assert len(designed) >= 3
    assert 0.5 < max(one.used for one in designed) <= 1.0 + NO_EXCESS
    assert max(one.outside for one in designed) < 1e-9
    assert max(one.late for one in designed) <= 1e-9


def test_refusals_name_the_stage_or_the_arm(outcomes: list[Outcome]):
    refused = [one.reason for one in outcomes if one.reason]
    assert refused
    assert all(reason.startswith(("stage s", "UR5e", "ur5e", "panda", "staubli")) for reason in refused), refused
    assert summary(outcomes)["designed"] + len(refused) == len(outcomes)
