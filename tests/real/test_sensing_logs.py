"""The force sensor on measured logs: against a wrist sensor, pushes found, free motion left alone.

`benchmarks/sensing_real.py` says how forces are compared and how pushes are labelled. What is asserted is what was
reached, with a little room; the sensor is causal and no model was fitted to a log that is judged.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tauhat.estimation.estimate import Estimate
from tauhat.recordings import Recording
from tauhat.sensing import WrenchSolver, directions_named, observer_named
from tauhat.sensing.contact import ContactDetector
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import ContactThresholds
from tauhat.sensing.zero import zeroed

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")

pytestmark = [pytest.mark.real, pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")]


@pytest.fixture(scope="module")
def judge() -> ModuleType:
    """Return the benchmark, whose labels and comparisons are the tests' own."""
    sys.path.insert(0, BENCHMARKS)
    try:
        import sensing_real
    finally:
        sys.path.remove(BENCHMARKS)
    return sensing_real


@pytest.fixture(scope="module")
def arms(judge: ModuleType, real_data: Path) -> dict[str, Any]:
    for folder in ("ur5", "ur10e"):
        if not (real_data / folder).is_dir():
            pytest.skip(f"no folder {folder} in {real_data}")
    return judge.arms(real_data)


@pytest.fixture(scope="module")
def models(judge: ModuleType, arms: dict[str, Any]) -> Any:
    return judge.Ur5Models(arms["ur5"])


@pytest.fixture(scope="module")
def whole(models: Any) -> Estimate:
    return models.without()


@pytest.fixture(scope="module")
def thresholds(judge: ModuleType, models: Any, whole: Estimate) -> ContactThresholds:
    return judge.learnt([models.seen(name) for name in judge.SLOW_FREE], whole, ContactRules())


@pytest.fixture(scope="module")
def force_run(judge: ModuleType, arms: dict[str, Any]) -> tuple[Recording, Any]:
    log = arms["ur5"].log(judge.FORCE_RUN)
    return log, judge.wrist_of(arms["ur5"].folder / f"{judge.FORCE_RUN}.npz", log.t)


def test_the_force_follows_the_wrist_sensor(judge: ModuleType, whole: Estimate, force_run: Any) -> None:
    log, wrist = force_run
    found = judge.against_wrist(judge.sensed(whole, log), wrist)
    assert found["correlation"] >= 0.965
    assert found["rms"] <= 6.0
    assert abs(found["lag"]) <= 0.05
    assert all(0.7 < scale < 0.95 for scale in found["scales"])
    assert found["axis_apart_deg"] < 6.0
    plain = judge.against_wrist(judge.sensed(whole, log, cutoff=1.0), wrist)
    assert plain["correlation"] < found["correlation"]  # the comparison can tell a worse sensor


def test_the_force_less_its_zero_reaches_the_aim(
    judge: ModuleType, whole: Estimate, force_run: Any, thresholds: ContactThresholds
) -> None:
    log, wrist = force_run
    raw = judge.sensed(whole, log)
    zero = ContactDetector(thresholds=thresholds, step=raw.step).along(raw).zero
    solver = WrenchSolver(robot=whole.robot, directions=directions_named("force"))
    found = judge.against_wrist(zeroed(raw, zero, solver=solver), wrist)
    assert found["correlation"] >= 0.97
    assert found["rms"] <= 5.0


def test_a_step_of_torque_comes_through_in_time(judge: ModuleType, whole: Estimate, force_run: Any) -> None:
    times = judge.response(whole, force_run[0])
    assert times["t50"] <= 0.062
    assert times["t90"] <= 0.15
    slower = judge.response(whole, force_run[0], observer=observer_named("momentum", gain=10.0))
    assert slower["t90"] > 0.2


def test_every_push_that_the_wrist_sensor_saw_above_ten_newton_is_found(
    judge: ModuleType, whole: Estimate, force_run: Any, thresholds: ContactThresholds
) -> None:
    log, wrist = force_run
    pushes = judge.labelled(wrist.t, np.linalg.norm(wrist.force, axis=1), judge.LABEL_FORCE)
    found = judge.push_row(log.name, log, pushes, judge.contacts(thresholds, judge.sensed(whole, log)))
    assert (found["found"], found["pushes"]) == (6, 6)
    assert found["false"] <= 1
    assert found["delay_largest"] < 0.15


@pytest.mark.parametrize(
    ("name", "labels", "least"),
    [("No10_Standstill_WDist", "standing_labels", 5), ("No5_Acc_slow_w_disturbance", "cyclic_labels", 8)],
)
def test_pushes_by_hand_are_found(
    judge: ModuleType, arms: Any, whole: Estimate, thresholds: Any, name: str, labels: str, least: int
) -> None:
    log = arms["ur5"].log(f"Movement_{name}")
    pushes = getattr(judge, labels)(log)
    found = judge.push_row(name, log, pushes, judge.contacts(thresholds, judge.sensed(whole, log)))
    assert found["pushes"] <= least + 2
    assert found["found"] >= least
    assert found["false"] <= 1
    assert found["delay_median"] < 0.1


def test_free_motion_like_what_was_learnt_raises_hardly_an_alarm(
    judge: ModuleType, models: Any, whole: Estimate
) -> None:
    free = {name: models.seen(name) for name in judge.SLOW_FREE}
    rows = judge.half_rows(free, whole, ContactRules())
    assert sum(row["seconds"] for row in rows) > 120.0
    assert sum(row["alarms"] for row in rows) <= 3


def test_a_payload_is_told_from_hands_and_from_nothing(judge: ModuleType, arms: Any, models: Any) -> None:
    rows = judge.payload_rows(arms["ur5"], arms["ur10e"], models)
    assert [row["verdict"] for row in rows] == ["payload", "payload", *["no payload"] * 4]
    # 2.805 kg; with these torque constants every method finds a tenth more
    assert rows[0]["mass"] == pytest.approx(3.1, abs=0.2)


def test_the_pushes_of_the_ur10e_are_found(judge: ModuleType, arms: Any) -> None:
    found = judge.ur10e_contacts(arms["ur10e"])
    (row,) = [row for row in found["pushes"] if row["rules"] == "default"]
    assert (row["found"], row["pushes"]) == (4, 4)
    assert row["false"] == 0
