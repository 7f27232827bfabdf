"""Local against global calibration: figures of a hand run, nothing judged is fitted, words that follow the figures."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tauhat.dynamics.model import torque_model
from tauhat.errors import ExcitationError, ModelError, SimulationError
from tauhat.estimation import identify
from tauhat.excitation.task_design import BLOCKS
from tauhat.recordings.recording import Recording
from tauhat.report.study_page import write_study
from tauhat.robots import load_robot
from tauhat.robots.inverse_kinematics import FrameKinematics
from tauhat.studies.local_global import LocalGlobalStudy, arms
from tauhat.studies.local_global.arms import JUDGED, Arm, ArmFigures, Plant, TorqueError, figures_of
from tauhat.studies.local_global.chapters import friction_chapter
from tauhat.studies.local_global.conclusions import COLD, ELSEWHERE, WARM, conclusions, summary, verdict
from tauhat.studies.local_global.findings import FITS, Findings
from tauhat.studies.local_global.motions import GLOBAL, Designs
from tauhat.studies.local_global.task import HOMES, Polishing
from tauhat.studies.registry import study_named
from tauhat.studies.study import StudyResult
from tauhat.verification import verify
from tauhat.workers import LocalWorkers

pytest.importorskip("pymoo", reason="the extra `genetic` is not installed")
KIND = "load-coulomb"


@pytest.fixture(scope="module")
def study() -> LocalGlobalStudy:
    return LocalGlobalStudy.quick()


@pytest.fixture(scope="module")
def found(study: LocalGlobalStudy) -> Findings:
    return study.found(LocalWorkers(count=1))


@pytest.fixture(scope="module")
def first(study: LocalGlobalStudy, found: Findings) -> Arm:
    return study.arms(found.motions)[0]


@pytest.fixture(scope="module")
def logs(first: Arm) -> dict[str, Recording]:
    return first.logs()


def with_errors(found: Findings, local: float, other: float, *, count: int = 10) -> Findings:
    """Return findings of many arms whose local model has one error everywhere, and all other models another."""
    errors = {
        (fit, judged): TorqueError(local if fit == "local" else other, (0.1,) * 6) for fit in FITS for judged in JUDGED
    }
    arm = replace(found.arms[KIND][0], errors=errors)
    return replace(found, frictions=(KIND,), arms={KIND: (arm,) * count})


@pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")  # so short a motion is weak
@pytest.mark.parametrize("fit", FITS)
def test_the_figures_are_those_of_a_hand_run(fit, study, found, first, logs):
    fitted = [logs[name] for name in found.motions.fits[fit]]
    estimate = identify(torque_model(first.robot, study.terms), fitted, cutoff=study.cutoff)
    figures = found.arms[KIND][0]
    assert figures.fitted[fit] == pytest.approx(estimate.relative_rms)
    for judged in JUDGED:
        log = verify(estimate, [logs[judged]]).logs[0]
        error = log.tau - log.predicted
        assert figures.errors[fit, judged].relative == pytest.approx(np.linalg.norm(error) / np.linalg.norm(log.tau))
        np.testing.assert_allclose(figures.errors[fit, judged].joints, np.sqrt(np.mean(error**2, axis=0)), rtol=1e-9)


def test_no_model_sees_a_log_that_it_is_judged_on(first, found, logs, monkeypatch):
    seen: list[set[str]] = []

    def noting(model, recordings, **settings):
        seen.append({recording.name for recording in recordings})
        return identify(model, recordings, **settings)

    monkeypatch.setattr(arms, "identify", noting)
    monkeypatch.setattr(Arm, "logs", lambda _: logs)
    first.figures()
    assert seen == [set(found.motions.fits[fit]) for fit in FITS]
    assert not set.union(*seen) & set(JUDGED)
    assert set(logs) == set.union(*seen) | set(JUDGED)


def test_the_same_seed_gives_the_same_figures_and_another_seed_others(first, found):
    mine, other = found.arms[KIND]
    assert figures_of(replace(first)) == mine
    assert other != mine


def test_all_models_get_equally_long_motions_and_the_one_of_both_gets_two(study, found):
    seconds = study.designs.seconds
    for fit in FITS:
        assert found.motions.seconds(fit) == pytest.approx(2.0 * seconds if fit == "both" else seconds)


def test_warm_runs_begin_warmer_and_the_cold_one_does_not(study, logs):
    first_rows = {name: log.temperature[0] for name, log in logs.items() if log.temperature is not None}
    assert set(first_rows) == set(logs)
    cold = first_rows.pop(COLD)
    for warm in first_rows.values():
        np.testing.assert_allclose(warm - cold, study.plant.warm_up, atol=0.1)


@pytest.mark.parametrize("name", sorted(HOMES))
def test_the_path_is_passed_in_its_region_at_its_speed_with_the_tool_held(name):
    robot, work = load_robot(name), Polishing()
    path, region = work.path(robot), work.region(robot)
    t = np.linspace(0.0, path.duration, 4001)
    tool = FrameKinematics(robot, "tool")
    places = [tool.at(q) for q in path.sample(t).q]
    points = np.array([place.translation for place in places])
    assert region.outside(points).max() == 0.0
    assert np.ptp(points[:, 2]) < 1e-3 + np.ptp(np.array([pose.translation[2] for pose in region.poses]))
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(t)
    assert 0.99 * work.speed < speed.max() < 1.01 * work.speed
    assert max(np.abs(place.rotation - places[0].rotation).max() for place in places) < 1e-6


def test_more_logs_never_make_a_block_less_sure(found):
    both = found.blocks["both"]
    for block in BLOCKS:
        assert both[block].error < min(found.blocks["local"][block].error, found.blocks[GLOBAL][block].error)
        assert all(found.blocks[fit][block].condition >= 1.0 for fit in FITS)


def test_quartiles_wins_and_ratios_are_over_the_arms(found):
    arm = found.arms[KIND][0]
    errors = ((0.02, 0.04), (0.03, 0.03), (0.09, 0.06))
    several: list[ArmFigures] = []
    for local, other in errors:
        own = {**arm.errors, ("local", WARM): TorqueError(local, (0.0,) * 6)}
        several.append(replace(arm, errors={**own, (GLOBAL, WARM): TorqueError(other, (0.0,) * 6)}))
    three = replace(found, arms={KIND: tuple(several)})
    assert three.quartiles("local", WARM) == pytest.approx((0.025, 0.03, 0.06))
    assert three.ratio("local", GLOBAL, WARM) == pytest.approx((0.75, 1.0, 1.25))
    assert three.wins("local", GLOBAL, WARM) == 1


def test_the_words_turn_with_the_figures(found):
    better, worse = with_errors(found, 0.02, 0.04), with_errors(found, 0.04, 0.02)
    assert "predicts torque better there than the global one: 2 % against 4 %" in summary(better)
    assert "predicts torque worse there than the global one: 4 % against 2 %" in summary(worse)
    assert "smaller on 10 of 10 arms, median ratio 0.5" in summary(better)
    assert "Elsewhere the local model must not be used" in summary(worse)
    assert "does not predict torque clearly better" in summary(found)
    assert "With cold joints it does better" in conclusions(better).text[1]


def test_few_arms_are_no_proof(found):
    assert verdict(with_errors(found, 0.02, 0.04, count=5), "local", GLOBAL, WARM) == "no clear difference"
    assert verdict(with_errors(found, 0.02, 0.04, count=6), "local", GLOBAL, WARM) == "better"


def test_other_friction_stands_beside_the_first(found):
    kinds = (KIND, "plain")
    two = replace(found, frictions=kinds, arms={KIND: found.arms[KIND], "plain": found.arms[KIND][::-1]})
    rows = friction_chapter(two).tables[0].rows
    assert [(row[0], row[1]) for row in rows] == [(kind, judged) for kind in kinds for judged in JUDGED]
    assert "friction is plain instead of load-coulomb" in conclusions(two).text[-1]


def test_the_page_has_every_chapter_and_the_numbers_are_plain_data(study, found, tmp_path):
    chapters = study.chapters(found)
    result = StudyResult(name="n", title="t", summary=summary(found), chapters=chapters, settings=study.described())
    page = write_study(tmp_path / "page.html", result).read_text()
    assert all(chapter.title in page for chapter in chapters)
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["settings"]["designs"]["stages"]["fast"]


def test_a_motion_elsewhere_belongs_to_its_arm(study, found, logs):
    other = study.arms(found.motions)[1].logs()
    assert np.abs(logs[ELSEWHERE].q[0] - other[ELSEWHERE].q[0]).max() > 0.1
    np.testing.assert_allclose(logs[WARM].q[0], other[WARM].q[0], atol=0.02)


def test_the_command_line_chooses_arm_and_seeds():
    chosen = study_named("local-global", {"robot": "staubli_tx40", "seeds": 3})
    assert chosen == LocalGlobalStudy(robot="staubli_tx40", seeds=3)


@pytest.mark.parametrize(
    ("made", "error", "message"),
    [
        (lambda: LocalGlobalStudy(seeds=0), ModelError, "local-global: arms of the study; expected 1 seed or more"),
        (lambda: LocalGlobalStudy(cutoff=0.0), ModelError, "local-global: setting cutoff; expected above zero"),
        (lambda: LocalGlobalStudy(terms="none"), ModelError, "none"),
        (lambda: Polishing(passes=0), ModelError, "polishing path: passes; expected at least 1, got 0"),
        (lambda: Polishing(speed=0.0), ModelError, "polishing path: speed; expected above zero"),
        (lambda: Polishing().home_of(load_robot("two_link")), ModelError, "no position over the surface; expected crs"),
        (lambda: Polishing(home=(0.0, 1.0)).path(load_robot("ur5e")), ModelError, "expected 6 joints, got 2"),
        (lambda: Polishing(length=2.0).path(load_robot("ur5e")), ExcitationError, "move 1"),
        (lambda: Plant(gap=-1.0), SimulationError, "backlash of the plant; expected at least 0"),
        (lambda: Plant(warm_up=-1.0), SimulationError, "warm-up of the plant; expected 0 to 100 K"),
        (lambda: Designs(whole=Designs().stages[:1]), ModelError, "lengths of designs .* expected the same"),
    ],
)
def test_settings_that_make_no_sense_are_refused(made, error, message):
    with pytest.raises(error, match=message):
        made()
