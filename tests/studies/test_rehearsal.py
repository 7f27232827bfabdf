"""The rehearsal: its errors follow its sensors and lengths, its answer is the cheapest, and its words its figures."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tauhat.errors import ModelError, SimulationError
from tauhat.excitation import motion_limits
from tauhat.robots import load_robot
from tauhat.simulation import ElasticJoints, ExperimentSettings, SensorErrors
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.studies.rehearsal import NamedSensors, RehearsalStudy, sensors_named
from tauhat.studies.rehearsal.cells import best, cells_of, cheapest
from tauhat.studies.rehearsal.chapters import chapters_of, summary_of
from tauhat.studies.rehearsal.findings import Findings
from tauhat.studies.rehearsal.rehearsal_study import unseen_motion
from tauhat.studies.rehearsal.trials import Outcome
from tauhat.workers import LocalWorkers

HERE = LocalWorkers(count=1)
NOISY = NamedSensors(name="noisy", errors=SensorErrors(torque_noise=3.0))
FINE = NamedSensors(name="fine", errors=SensorErrors(torque_noise=0.01))


def study(**options: Any) -> RehearsalStudy:
    """Return a small rehearsal of the two-link arm."""
    robot = load_robot("two_link")
    settings = ExperimentSettings(sample_rate=200.0, settle=0.2)
    experiment = PlannedExperiment(robot=robot, settings=settings, motion=MotionPlan(seconds=4.0, starts=1))
    usual = {"experiment": experiment, "seeds": 2, "terms": "plain", "lengths": (2.0, 16.0), "sensors": (NOISY, FINE)}
    return RehearsalStudy(**{**usual, **options})


@pytest.fixture(scope="module")
def found() -> Findings:
    return study(target=0.05).findings(HERE)


def outcome(seed: int, seconds: float, sensors: str, error: float, **options: Any) -> Outcome:
    return Outcome(seed=seed, seconds=seconds, sensors=sensors, error=error, joints=(error, error), **options)


def grid(errors: dict[tuple[str, float], list[float]]) -> tuple[Outcome, ...]:
    return tuple(
        outcome(seed, seconds, sensors, error, as_sensed=error, on_log=error, inside=1.0, condition=5.0)
        for (sensors, seconds), row in errors.items()
        for seed, error in enumerate(row)
    )


def test_noise_and_short_motions_make_the_error_larger(found: Findings) -> None:
    error = {(cell.sensors, cell.seconds): cell.error for cell in found.cells}
    assert error["noisy", 2.0] > 2.0 * error["noisy", 16.0]
    assert error["noisy", 16.0] > 1.5 * error["fine", 16.0]
    assert error["fine", 16.0] < 0.03
    assert all(not outcome.failure for outcome in found.outcomes)


def test_a_robot_says_the_same_whatever_else_is_tried_and_wherever_it_is_done(found: Findings) -> None:
    class Elsewhere(LocalWorkers):
        """Workers that get their work as pickles."""

        def map(self, function: Any, items: Any) -> Iterator[Any]:
            for item in items:
                away, sent = pickle.loads(pickle.dumps((function, item)))  # noqa: S301
                yield pickle.loads(pickle.dumps(away(sent)))  # noqa: S301

    (alone,) = study(seeds=1, lengths=(2.0,), sensors=(FINE,)).findings(Elsewhere(count=1)).outcomes
    (among,) = [o for o in found.outcomes if (o.seed, o.seconds, o.sensors) == (0, 2.0, "fine")]
    assert alone == among


def test_a_wrong_torque_factor_is_the_error_and_nothing_as_sensed() -> None:
    wrong = NamedSensors(name="wrong", errors=SensorErrors(torque_factor=1.2, torque_offset=[1.0, -1.0]))
    right = NamedSensors(name="right", errors=SensorErrors())
    outcomes = study(seeds=1, lengths=(8.0,), sensors=(wrong, right)).findings(HERE).outcomes
    by_name = {o.sensors: o for o in outcomes}
    assert by_name["wrong"].error == pytest.approx(0.2, abs=0.06)
    assert by_name["wrong"].as_sensed == pytest.approx(by_name["right"].error, abs=0.01)
    assert by_name["right"].as_sensed == by_name["right"].error


def test_torque_sensors_on_links_are_judged_by_the_torque_of_links() -> None:
    link = NamedSensors(name="link", errors=SensorErrors(torque_side="link"))
    (seen,) = study(seeds=1, lengths=(8.0,), sensors=(link,)).findings(HERE).outcomes
    assert seen.error < 0.01
    assert seen.inside > 0.5


def test_an_elastic_robot_is_rehearsed() -> None:
    gears = ElasticJoints(joints=(0,), stiffness=np.array([2e3]), damping=np.array([5.0]))
    experiment = replace(study().experiment, elasticity=gears)
    (seen,) = study(experiment=experiment, seeds=1, lengths=(4.0,), sensors=(FINE,)).findings(HERE).outcomes
    assert not seen.failure
    assert seen.error < 0.3


def test_what_cannot_be_simulated_is_a_failure_with_its_words_and_not_the_end() -> None:
    gears = ElasticJoints(joints=(0,), stiffness=np.array([2e9]), damping=np.array([0.0]), gap=np.array([1e-3]))
    experiment = replace(study().experiment, elasticity=gears)
    result = study(experiment=experiment, seeds=1, lengths=(2.0,), sensors=(FINE,)).run(HERE)
    assert "teeth are too stiff" in result.summary
    assert result.summary.startswith("No model could be identified")


def test_a_jitter_that_the_rate_does_not_allow_fails_for_these_sensors_alone() -> None:
    jumpy = NamedSensors(name="jumpy", errors=SensorErrors(sampling_jitter=1e-2))
    outcomes = study(seeds=1, lengths=(4.0,), sensors=(jumpy, FINE)).findings(HERE).outcomes
    assert [bool(o.failure) for o in outcomes] == [True, False]
    assert "overtake each other" in outcomes[0].failure


def test_what_check_says_of_the_first_log_is_told() -> None:
    lossy = NamedSensors(name="lossy", errors=SensorErrors(lost_samples=0.05, lost_run=4.0))
    outcomes = study(seeds=1, lengths=(4.0,), sensors=(lossy,)).findings(HERE).outcomes
    assert any(doubt.startswith("check: uneven clock") for doubt in outcomes[0].doubts)
    assert any("gaps in time" in doubt for doubt in outcomes[0].doubts)


def test_the_cheapest_has_the_worst_sensors_that_will_do_and_then_the_shortest_motion() -> None:
    cells = cells_of(
        grid(
            {
                ("bad", 40.0): [0.09, 0.2],
                ("bad", 5.0): [0.2, 0.2],
                ("middle", 10.0): [0.06, 0.3],
                ("middle", 40.0): [0.04, 0.045],
                ("middle", 20.0): [0.04, 0.045],
                ("good", 5.0): [0.01, 0.01],
            }
        )
    )
    assert [(cell.sensors, cell.seconds) for cell in cells][:3] == [("bad", 5.0), ("bad", 40.0), ("middle", 10.0)]
    chosen = cheapest(cells, 0.05)
    assert chosen is not None
    assert (chosen.sensors, chosen.seconds) == ("middle", 20.0)
    assert cheapest(cells, 0.005) is None
    assert best(cells) == cells[-1]


def test_nine_of_ten_robots_must_be_within_the_target_and_all_give_a_model() -> None:
    (cell,) = cells_of(grid({("s", 5.0): [0.01] * 18 + [0.5] * 2}))
    assert not cell.meets(0.05)
    (cell,) = cells_of(grid({("s", 5.0): [0.01] * 19 + [0.5]}))
    assert cell.meets(0.05)
    failed = (*grid({("s", 5.0): [0.01] * 19}), Outcome(seed=19, seconds=5.0, sensors="s", failure="no"))
    (cell,) = cells_of(failed)
    assert (cell.models, cell.robots, cell.meets(0.05)) == (19, 20, False)


def test_words_and_tables_follow_the_figures(found: Findings) -> None:
    answer = found.answer
    assert answer is not None
    assert f"for 5 %, {answer.seconds:g} s of motion with {answer.sensors} sensors will do" in summary_of(found)
    assert "nothing that was tried stays within 0.01 %" in summary_of(replace(found, target=1e-4))


@pytest.mark.parametrize(
    ("robots", "words"),
    [
        (1, "3 % (one robot)."),
        (2, "3 % (median of 2 robots)."),
        (5, "3 % (median of 5 robots; eight of ten are at 3 to 3 %)."),
    ],
)
def test_tenths_are_told_of_enough_robots_alone(found: Findings, robots: int, words: str) -> None:
    outcomes = grid({("fine", 2.0): robots * [0.03]})
    assert words in summary_of(replace(found, outcomes=outcomes, target=None))
    marks = [row[-1] for row in chapters_of(found)[0].tables[0].rows]
    assert marks.count("cheapest") == 1
    assert [bool(mark) for mark in marks] == [cell.meets(0.05) for cell in found.cells]
    plain = replace(found, target=None)
    assert len(chapters_of(plain)[0].tables[0].header) == len(chapters_of(found)[0].tables[0].header) - 1
    assert [chapter.title for chapter in chapters_of(plain)][-1] == "What was done"


def test_constant_errors_of_the_sensors_are_told_where_they_are_most_of_the_error(found: Findings) -> None:
    outcomes = grid({("s", 5.0): [0.1]})
    told = replace(outcomes[0], as_sensed=0.02)
    assert "without these the model is off by 2 %" in summary_of(replace(found, outcomes=(told,), target=None))
    noise = replace(outcomes[0], as_sensed=0.09)
    assert "factors and offsets" not in summary_of(replace(found, outcomes=(noise,), target=None))


def test_a_motion_is_designed_once_for_each_period(found: Findings) -> None:
    assert sorted(found.designs) == [2.0, 8.0]
    assert [outcome.seconds for outcome in found.outcomes if outcome.seed == 0] == [2.0, 2.0, 16.0, 16.0]


def test_the_unseen_motion_keeps_the_joint_limits() -> None:
    for name in ("two_link", "ur5e", "panda"):
        robot = load_robot(name)
        limits, motion = motion_limits(robot), unseen_motion(robot, np.random.default_rng(3))
        assert 10.0 <= motion.duration < 30.0
        samples = motion.sample(np.linspace(0.0, motion.duration, 2001))
        assert (samples.q >= limits.lower).all()
        assert (samples.q <= limits.upper).all()
        assert (np.abs(samples.dq) <= limits.velocity).all()
        assert (np.abs(samples.ddq) <= limits.acceleration).all()


def test_sensors_by_name_come_worst_first_each_with_every_scale() -> None:
    experiment = study().experiment
    named = sensors_named(("cobot", "low-cost"), (1.0, 4.0), experiment)
    assert [sensors.name for sensors in named] == ["low-cost x 4", "low-cost", "cobot x 4", "cobot"]
    (own,) = sensors_named((), (2.0,), replace(experiment, sensors="mine"))
    assert own.name == "mine x 2"
    with pytest.raises(SimulationError, match="unknown sensors"):
        sensors_named(("best",), (1.0,), experiment)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"seeds": 0}, "rehearsal: robots; expected at least 1"),
        ({"target": 1.5}, "rehearsal: target; expected above 0 and below 100 %, got 150 %"),
        ({"terms": "magic"}, "magic"),
        ({"estimator": "magic"}, "unknown estimator"),
        ({"sensors": (FINE, FINE)}, "rehearsal: sensors; expected none twice"),
    ],
)
def test_impossible_settings_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        study(**options)


def test_lengths_that_no_motion_has_are_refused() -> None:
    with pytest.raises(SimulationError, match="length of the motion"):
        study(lengths=(0.1,))
    given = unseen_motion(load_robot("two_link"), np.random.default_rng(0))
    experiment = replace(study().experiment, motion=MotionPlan(given=given))
    with pytest.raises(ModelError, match="a given motion has one length"):
        study(experiment=experiment)
    assert study(experiment=experiment, lengths=()).lengths == (given.duration,)
