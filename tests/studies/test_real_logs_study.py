"""The study of real logs on logs whose robot is simulated: its cases, its figures by hand, its rules, its words."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from tauhat.dynamics.named_model import named_model
from tauhat.errors import ModelError
from tauhat.estimation import estimator_named, identify
from tauhat.estimation.selecting import identify_selected
from tauhat.excitation import random_fourier
from tauhat.recordings import read_recording, write_recording
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings, SensorErrors, simulate
from tauhat.studies.comparison import Outcome
from tauhat.studies.real_logs import CaseFit, RealLogsStudy, load_cases, standings_of
from tauhat.studies.real_logs.case_file import check_logs
from tauhat.studies.real_logs.figures import Figures
from tauhat.studies.real_logs.standings import recommended
from tauhat.studies.study import StudyResult
from tauhat.verification import verify
from tauhat.workers import LocalWorkers

ALONE = LocalWorkers(count=1)
CUTOFF = 12.0
CASES = f"""
[[case]]
name = "first -> second"
robot = "two_link"
cutoff = {CUTOFF}
fit = [{{ log = "first.parquet", rows = "100:" }}]
judge = [{{ log = "second.csv" }}]
reference = [0.5]
aim = 0.01
expect = ["nothing"]
waits = "a gas spring"

[[case]]
name = "halves"
robot = "two_link"
map = "coupled.toml"
judge_map = "coupled.toml"
cutoff = {CUTOFF}
fit = [{{ log = "second.csv", rows = "0:500" }}]
judge = [{{ log = "second.csv", rows = "500:1000" }}]
reference = [1e-9]

[[case]]
name = "fit only"
robot = "two_link"
cutoff = {CUTOFF}
fit = [{{ log = "first.parquet" }}, {{ log = "second.csv" }}]
judge = [{{ log = "first.parquet" }}, {{ log = "second.csv", rows = ":700" }}]
"""
COUPLED = """
[time]
column = "t"
[position]
columns = ["q_1", "q_2"]
[torque]
columns = ["tau_1", "tau_2"]
[coupling]
position = [[1.0, 0.0], [-1.0, 1.0]]
"""
ESTIMATORS = ("wls", "tls", "didim", "cloe")


@dataclass(frozen=True)
class Place:
    """Where the file of cases and its logs are."""

    cases: Path
    data: Path


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    folder, data = tmp_path_factory.mktemp("cases"), tmp_path_factory.mktemp("data")
    robot = load_robot("two_link")
    settings = ExperimentSettings(sample_rate=250.0, sensors=SensorErrors(torque_noise=0.02))
    for seed, name in enumerate(("first.parquet", "second.csv")):
        rng = np.random.default_rng(seed)
        motion = random_fourier(robot, period=4.0, harmonics=4, rng=rng)
        write_recording(simulate(robot, motion, rng=rng, settings=settings).recording, data / name)
    (folder / "cases.toml").write_text(CASES, encoding="utf-8")
    (folder / "coupled.toml").write_text(COUPLED, encoding="utf-8")
    return Place(folder / "cases.toml", data)


@pytest.fixture(scope="module")
def study(place: Place) -> RealLogsStudy:
    return RealLogsStudy(cases=place.cases, data=place.data, estimators=ESTIMATORS, models=("plain",))


@pytest.fixture(scope="module")
def fits(study: RealLogsStudy) -> tuple[CaseFit, ...]:
    return study.fits(load_cases(study.cases, data=study.data), ALONE)


@pytest.fixture(scope="module")
def story(study: RealLogsStudy, fits: tuple[CaseFit, ...]) -> StudyResult:
    return study.result(load_cases(study.cases, data=study.data), fits)


def fit_of(fits: tuple[CaseFit, ...], case: str, estimator: str) -> CaseFit:
    return next(fit for fit in fits if fit.case == case and fit.outcome.estimator == estimator)


def made(
    case: str, estimator: str, error: float, *, failure: str = "", doubt: str = "", seconds: float = 1.0
) -> CaseFit:
    unseen = () if failure else (error,)
    outcome = Outcome(
        model="robust", estimator=estimator, unseen=unseen, moving=unseen, failure=failure, processor_seconds=seconds
    )
    return CaseFit(case=case, outcome=outcome, doubt=doubt)


def rows_of(story: StudyResult, title: str) -> list[tuple[object, ...]]:
    return [row for chapter in story.chapters for table in chapter.tables if table.title == title for row in table.rows]


def test_a_case_holds_what_its_table_says(place: Place):
    first, halves, seen = load_cases(place.cases, data=place.data)
    assert (first.name, first.robot, first.cutoff) == ("first -> second", "two_link", CUTOFF)
    assert (first.reference, first.aim, first.expect, first.waits) == ((0.5,), 0.01, ("nothing",), "a gas spring")
    assert [(log.path, log.map, log.rows) for log in first.fit] == [(place.data / "first.parquet", None, (100, None))]
    assert halves.judge[0].map == place.cases.parent / "coupled.toml"
    assert (halves.reference, halves.aim) == ((1e-9,), None)
    assert [case.unseen for case in (first, halves, seen)] == [True, True, False]


def test_robots_and_maps_beside_the_cases_come_before_those_beside_the_logs(tmp_path: Path):
    data = tmp_path / "data"
    data.mkdir()
    text = CASES.replace('"two_link"', '"arm.urdf"').replace("first.parquet", "sub/first.parquet")
    (tmp_path / "cases.toml").write_text(text, encoding="utf-8")
    (data / "arm.urdf").touch()
    assert load_cases(tmp_path / "cases.toml", data=data)[0].robot == str(data / "arm.urdf")
    (tmp_path / "arm.urdf").touch()
    first = load_cases(tmp_path / "cases.toml", data=data)[0]
    assert first.robot == str(tmp_path / "arm.urdf")
    assert first.fit[0].path == data / "sub" / "first.parquet"
    assert load_cases(tmp_path / "cases.toml")[0].fit[0].path == tmp_path / "sub" / "first.parquet"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("aim = 0.01", "aims = 0.01", r"case 1 \(first -> second\): unknown key; got aims; did you mean aim"),
        ("aim = 0.01", 'aim = "small"', "aim is not a number"),
        ("aim = 0.01", "aim = -1", "aim is not positive"),
        ("reference = [0.5]", "reference = [0.5, 0.4]", "reference has the wrong form; expected 1 numbers"),
        ("reference = [0.5]", "reference = [0.0]", "reference is not positive"),
        (f"cutoff = {CUTOFF}", "", "a key is missing; expected cutoff"),
        (f"cutoff = {CUTOFF}", "cutoff = 0", "cutoff is not positive"),
        ('robot = "two_link"', "", "a key is missing; expected robot"),
        ('robot = "two_link"', "robot = 3", "robot is not a text"),
        ('robot = "two_link"', r'robot = "\u0000.urdf"', "robot is not a file name"),
        ('name = "first -> second"', "", "case 1: a key is missing; expected name"),
        ('name = "first -> second"', 'name = "halves"', "two cases of one name; got halves"),
        ('judge = [{ log = "second.csv" }]', "", r"judge names no logs; expected \[\{ log"),
        ('judge = [{ log = "second.csv" }]', "judge = []", r"judge names no logs; .* got \[\]"),
        ('judge = [{ log = "second.csv" }]', 'judge = "second.csv"', "judge names no logs"),
        ('judge = [{ log = "second.csv" }]', 'judge = [{ rows = "1:" }]', "judge 1: a key is missing; expected log"),
        ('"second.csv" }]', '"second.csv", row = "1:" }]', "judge 1: unknown key; got row; did you mean rows"),
        ('rows = "100:"', 'rows = "100"', "fit 1: not a window of rows; expected FROM:TO"),
        ('rows = "100:"', "rows = 100", "rows is not a text"),
        ('expect = ["nothing"]', 'expect = "nothing"', "expect is not a list of texts"),
        ('waits = "a gas spring"', "waits = true", "waits is not a text"),
        ("[[case]]", "[[cases]]", "unknown key; got cases; did you mean case"),
        (CASES, "", r"cases.toml: no cases; expected \[\[case\]\]"),
        (CASES, "case = 3", "case is not a list of tables"),
        (CASES, "case =", "not valid TOML"),
    ],
)
def test_a_file_of_cases_that_means_nothing_is_refused(tmp_path: Path, old: str, new: str, message: str):
    (tmp_path / "cases.toml").write_text(CASES.replace(old, new, 1 if old != "[[case]]" else -1), encoding="utf-8")
    with pytest.raises(ModelError, match=message) as caught:
        load_cases(tmp_path / "cases.toml")
    assert "cases.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_of_cases_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(ModelError, match=r"nowhere\.toml: no such file"):
        load_cases(tmp_path / "nowhere.toml")


def test_a_log_that_is_not_there_is_named_with_its_case_before_any_work(place: Place, tmp_path: Path):
    study = RealLogsStudy(cases=place.cases, data=tmp_path)
    with pytest.raises(ModelError, match=r"first -> second: .*first\.parquet: no such file; .*--data"):
        study.run(ALONE)
    check_logs(load_cases(place.cases, data=place.data))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"estimators": ("magic",)}, "unknown estimator"),
        ({"estimators": ()}, "estimators; expected at least one"),
        ({"models": ("plain", "plain")}, "models; expected at least one, none twice, got plain, plain"),
        ({"models": ("inertia",)}, r"unknown model; expected plain, robust, auto or a \.toml file"),
    ],
)
def test_settings_that_mean_nothing_are_refused(place: Place, changes: dict[str, tuple[str, ...]], message: str):
    with pytest.raises(ModelError, match=message):
        RealLogsStudy(cases=place.cases, **changes)


@pytest.mark.parametrize("estimator", ["wls", "didim"])
def test_the_table_says_what_identify_and_verify_say_by_hand(place: Place, story: StudyResult, estimator: str):
    fitted = read_recording(place.data / "first.parquet", rows=(100, None))
    judged = read_recording(place.data / "second.csv")
    model = named_model(load_robot("two_link"), "plain")
    estimate = identify(model, [fitted], estimator=estimator_named(estimator), cutoff=CUTOFF)
    (log,) = verify(estimate, [judged]).logs
    (row,) = [row for row in rows_of(story, "first -> second") if row[1] == estimator]
    expected = [100.0 * value for value in (log.relative_rms, log.moving_relative_rms, estimate.relative_rms)]
    assert row[0] == "plain"
    assert row[2:5] == pytest.approx(expected, rel=1e-9)
    assert row[5] == estimate.passes
    assert str(row[7]).startswith(estimate.cause.partition(":")[0])


def test_auto_is_the_choice_by_cross_validation(place: Place):
    study = RealLogsStudy(cases=place.cases, data=place.data, estimators=("wls",), models=("auto",))
    case = load_cases(place.cases, data=place.data)[0]
    (fit,) = study.fits([case], ALONE)
    fitted, judged = (read_recording(place.data / "first.parquet", rows=(100, None)),), case.judge[0].read()
    estimate = identify_selected(named_model(load_robot("two_link"), "auto"), fitted, cutoff=CUTOFF)
    assert fit.error == pytest.approx(verify(estimate, [judged]).logs[0].relative_rms, rel=1e-9)


def test_several_judged_logs_count_as_their_mean(fits: tuple[CaseFit, ...]):
    fit = fit_of(fits, "fit only", "wls")
    assert len(fit.outcome.unseen) == 2
    assert fit.error == pytest.approx(sum(fit.outcome.unseen) / 2)


def test_a_method_that_needs_the_controller_is_refused_in_a_row(fits: tuple[CaseFit, ...], story: StudyResult):
    refused = fit_of(fits, "halves", "cloe")
    assert "controller" in refused.loss
    assert not fit_of(fits, "halves", "wls").loss
    (row,) = [row for row in rows_of(story, "halves") if row[1] == "cloe"]
    assert row[-1] == "refused"
    assert ("halves", "cloe", "plain", refused.loss) in rows_of(story, "Fits that did not end well")
    assert "cloe" in story.summary.partition("fits did not end well: ")[2]


def test_logs_that_do_not_fit_the_robot_are_rows_of_every_estimator(study: RealLogsStudy, place: Place):
    wrong = replace(load_cases(place.cases, data=place.data)[0], robot="ur5e")
    found = study.fits([wrong], ALONE)
    assert [fit.outcome.estimator for fit in found] == list(ESTIMATORS)
    assert all(fit.outcome.failure for fit in found)
    assert "No pair of model and estimator ended well" in study.result([wrong], found).summary


def test_one_process_and_two_find_the_same(study: RealLogsStudy, fits: tuple[CaseFit, ...]):
    cases = load_cases(study.cases, data=study.data)[:2]
    found = replace(study, estimators=("wls",)).fits(cases, LocalWorkers(count=2))
    alone = [fit_of(fits, case.name, "wls") for case in cases]
    assert [fit.outcome.unseen for fit in found] == [fit.outcome.unseen for fit in alone]


def test_a_case_that_is_judged_on_its_fitted_rows_is_shown_and_not_counted(
    study: RealLogsStudy, fits: tuple[CaseFit, ...], story: StudyResult
):
    figures = Figures.of(load_cases(study.cases, data=study.data), fits)
    assert {row.cases for row in figures.standings} == {2}
    assert len(rows_of(story, "fit only")) == len(ESTIMATORS)
    assert figures.above_reference() == ("halves",)


def test_the_story_is_plain_data_and_draws_only_what_ended_well(story: StudyResult):
    json.dumps(story.to_dict(), allow_nan=False)
    assert [row[:2] for row in rows_of(story, "Names")] == [
        ("model", "plain"),
        *(("estimator", key) for key in ESTIMATORS),
    ]
    bars, points = story.chapters[1].charts
    assert [series.name for series in bars.series] == ["reference", "plain, wls"]
    series = {one.name: one for one in points.series}
    assert "cloe" not in series or np.isnan(series["cloe"].y).all()
    assert series["didim"].y[series["didim"].x.index("first -> second")] >= 1.0


def test_within_two_per_cent_of_the_best_counts_and_what_lies_beyond_does_not():
    fits = [made("p", "wls", 0.0102), made("p", "ols", 0.01), made("q", "wls", 0.02), made("q", "ols", 0.0205)]
    weighted, ordinary = standings_of(fits)
    assert (weighted.best, weighted.close, ordinary.best, ordinary.close) == (1, 2, 1, 1)  # 1.025 is too much
    assert weighted.ratio == pytest.approx(np.sqrt(1.02))
    assert (weighted.worst, weighted.worst_case) == (pytest.approx(1.02), "p")
    assert weighted.median == pytest.approx(0.0151)
    assert recommended((ordinary, weighted)) == weighted


def test_a_default_must_have_ended_well_on_every_case():
    bad = [made("q", "tls", np.inf, failure="refused"), made("q", "tls", 0.01, doubt="diverged"), made("q", "tls", 1.5)]
    for lost in bad:
        assert lost.loss
        fits = [made("p", "wls", 0.02), made("p", "tls", 0.01), made("q", "wls", 0.02), lost]
        rows = standings_of(fits)
        assert [row.ended for row in rows] == [2, 1]
        assert recommended(rows) == rows[0]
        assert recommended(rows[1:]) is None


def test_between_equals_the_smaller_ratio_and_then_the_time_decides():
    slow, quick = standings_of([made("p", "wls", 0.01, seconds=2.0), made("p", "ols", 0.01)])
    assert recommended((slow, quick)) == quick
    fits = [made("p", "wls", 0.01), made("p", "ols", 0.02), made("q", "wls", 0.03), made("q", "ols", 0.01)]
    assert recommended(standings_of(fits)) == standings_of(fits)[1]


def test_words_follow_from_the_figures(study: RealLogsStudy, place: Place):
    cases = load_cases(place.cases, data=place.data)[:2]
    names = [case.name for case in cases]
    fits = [made(names[0], "wls", 0.02), made(names[0], "ols", 0.01), made(names[1], "wls", 0.02)]
    result = study.result(cases, [*fits, made(names[1], "ols", 0.0201)])
    assert "By the rule the default is robust with ols: within 2 % of the best on 2 of 2 cases" in result.summary
    assert "robust with wls: within 2 % of the best on 1 of 2 cases, the best on 1" in result.summary
    assert "at worst 2.00 times as far off (first -> second)" in result.summary
    assert "All 4 fits ended well." in result.summary
    words = " ".join(result.chapters[1].text)
    assert "On halves all are within 2 %" in words
    assert "None is as good as the reference on halves." in words
    assert "the largest error of all estimators that ended well is 1.50 times the least" in words  # of 2 and 1.005
    # Without the first case wls is 0.5 % better and both are close: the ratio decides.
    assert "Leaving out one case after the other, the rule takes robust with wls once, robust with ols once." in words
