"""The whole rehearsal: its parts hang together, its words follow its figures, and its page shows every chapter."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tauhat.errors import ModelError
from tauhat.excitation import motion_limits
from tauhat.report.study_page import write_study
from tauhat.robots import load_robot
from tauhat.simulation import AttachedBody, ExperimentSettings
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.studies.study import StudyResult
from tauhat.studies.whole_rehearsal import WholeRehearsalStudy
from tauhat.studies.whole_rehearsal.chapters import chapters_of
from tauhat.studies.whole_rehearsal.conclusions import conclusions, summary_of
from tauhat.studies.whole_rehearsal.findings import JUDGED, Findings, modelled
from tauhat.studies.whole_rehearsal.scene import UNSEEN, Scene, staged
from tauhat.workers import LocalWorkers

pytest.importorskip("optuna", reason="the extra `tuning` is not installed")
BODY = AttachedBody(name="payload", mass=1.0, centre=np.array([0.1, 0.0, 0.0]))


@pytest.fixture(scope="module")
def found() -> Findings:
    return WholeRehearsalStudy.quick().found(LocalWorkers(count=1))


def scene_of(friction: str = "plain", robot_seed: int = 1) -> Scene:
    """Return the scene of an arm with perfect sensors."""
    experiment = PlannedExperiment(
        robot=load_robot("two_link"),
        friction=friction,
        motion=MotionPlan(seconds=3.0, starts=1),
        settings=ExperimentSettings(sample_rate=250.0, settle=0.2),
        robot_seed=robot_seed,
    )
    return staged(experiment, BODY, unseen_seconds=4.0, poses=1)


def answer(found: Findings, question: str) -> tuple[str, str]:
    """Return figure and conclusion of the line whose question has these words."""
    (row,) = [row for row in conclusions(found).tables[0].rows if question in str(row[0])]
    return str(row[1]), str(row[2])


def test_the_identified_model_makes_the_robot_follow_better_and_explains_the_loaded_log(found):
    assert found.tracked("feedforward, identified") < 0.8 * found.tracked("feedforward, nominal")
    assert found.payload.found < 0.3 * found.payload.ignored
    assert found.pooled.final < 0.1
    assert all(joint.poses for joint in found.static.joints)


def test_the_error_budget_makes_the_whole(found):
    budget = found.budget
    assert sum(share.share for share in budget.shares) + budget.floor + budget.rest == pytest.approx(1.0)
    assert found.budget_settings.motions.fitted is found.scene.motions["designed"]


def test_the_payload_line_turns_when_another_mass_was_known(found):
    figure, so = answer(found, "weigh")
    assert f"{found.payload.numbers[0].found:.4g}" in figure
    assert (so == "yes") == bool(found.payload.numbers[0].inside)
    mass = replace(found.payload.numbers[0], known=3.0)
    heavier = replace(found, payload=replace(found.payload, numbers=(mass, *found.payload.numbers[1:])))
    assert "calibrate" in answer(heavier, "weigh")[1]


def test_the_tracking_line_turns_when_both_models_change_places(found):
    assert answer(found, "follow")[1].startswith("yes")
    other = {"feedforward, nominal": "feedforward, identified", "feedforward, identified": "feedforward, nominal"}
    runs = tuple(replace(run, name=other.get(run.name, run.name)) for run in found.tracking.runs)
    swapped = replace(found, tracking=replace(found.tracking, runs=runs))
    assert answer(swapped, "follow")[1] == "no better than the description"


def test_named_terms_that_do_not_pay_are_told_and_left_out(found):
    models = replace(found.models, named=("spring",), failure="worse than before")
    refused = replace(found, models=models)
    assert models.added == ()
    assert answer(refused, "residuals") == ("spring", "not taken: worse than before")
    taken = replace(found, models=replace(models, failure="", verified=models.final_verified))
    assert answer(taken, "residuals")[1] == "not worth it"


def test_the_gains_line_turns_with_the_error_of_the_tuned_gains(found):
    before = found.tuning.unseen_before
    half = replace(found, tuning=replace(found.tuning, unseen_after=replace(before, error=0.5 * before.error)))
    assert answer(half, "gains") == (
        f"50 % of the error gone after {found.tuning.costs.size} trials, on an unseen motion",
        "yes",
    )
    same = replace(found, tuning=replace(found.tuning, unseen_after=before))
    assert answer(same, "gains")[1] == "not in so few"


def test_the_page_has_every_chapter_and_the_numbers_are_plain_data(found, tmp_path):
    chapters = chapters_of(found)
    result = StudyResult(name="n", title="t", summary=summary_of(found), chapters=chapters, settings={})
    page = write_study(tmp_path / "page.html", result).read_text()
    assert all(chapter.title in page for chapter in chapters)
    assert [chapter.title.split(".")[0] for chapter in chapters[1:]] == [str(number) for number in range(1, 11)]
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["summary"] == result.summary


def test_a_term_that_the_residual_names_is_added_and_pays_on_motions_that_were_not_searched():
    scene = scene_of("spring")
    fitted, unseen = scene.run("designed"), tuple(scene.run(name) for name in UNSEEN)
    models = modelled(scene, fitted.recording, unseen, terms="plain", estimator="wls")
    assert "spring" in models.added
    for name in JUDGED:
        place = UNSEEN.index(name)
        assert models.log(name).relative_rms < 0.5 * models.verified.logs[place].relative_rms


def test_unseen_motions_keep_the_limits_and_last_as_long_as_they_should():
    scene = scene_of()
    limits = motion_limits(scene.robot)
    for name in UNSEEN:
        motion = scene.motions[name]
        samples = motion.sample(np.linspace(0.0, motion.duration, 2000))
        assert 4.0 <= motion.duration < 12.0
        assert ((samples.q >= limits.lower) & (samples.q <= limits.upper)).all()
        assert (np.abs(samples.dq) <= limits.velocity).all()
        assert (np.abs(samples.ddq) <= limits.acceleration).all()


def test_a_scene_follows_from_its_robot_seed():
    first, again, other = scene_of(), scene_of(), scene_of(robot_seed=2)
    np.testing.assert_array_equal(first.truth.inertia, again.truth.inertia)
    np.testing.assert_array_equal(first.run("task path").recording.tau, again.run("task path").recording.tau)
    assert np.abs(first.truth.inertia - other.truth.inertia).max() > 0.0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"poses": 0}, "whole rehearsal: poses; expected at least 1, got 0"),
        ({"seeds": 0}, "whole rehearsal: seeds; expected at least 1, got 0"),
        ({"unseen_seconds": 0.5}, "whole rehearsal: unseen_seconds; expected 1 to 600 s, got 0.5"),
        ({"terms": "none"}, "none"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changed, message):
    with pytest.raises(ModelError, match=message):
        WholeRehearsalStudy(**changed)
