"""The polishing study: readings have the right sign, jobs are judged by the truth, figures are those of the jobs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tauhat.control.force import PolishTask
from tauhat.errors import ModelError, SimulationError
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.repeated import Repeated
from tauhat.robots import forward_kinematics, load_robot
from tauhat.sensing import force_sensor
from tauhat.simulation.contact import TIP, RunningCell, in_the_air, start_cell
from tauhat.studies.polishing import PolishingStudy, chapters, polishing_study, shift
from tauhat.studies.polishing.arm import Arm, ArmSettings, Scene
from tauhat.studies.polishing.calibration import STEADY, CalibrationSettings
from tauhat.studies.polishing.findings import Findings, finished, spread
from tauhat.studies.polishing.job import Job, JobLog
from tauhat.studies.polishing.readers import (
    ForceReader,
    LoadCellReading,
    ToolFriction,
    along_the_normal,
    of_three_forces,
)
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, NO_WARMTH, reading_of
from tauhat.studies.polishing.shift import ShiftSettings
from tauhat.studies.polishing.trials import Outcome, judged
from tauhat.studies.polishing.truth import AMBIENT, PlantSettings
from tauhat.studies.polishing.work import SHAPES, WorkSettings, postures_of
from tauhat.workers import LocalWorkers

SHORT = WorkSettings(task=PolishTask(half=0.02, force=30.0, settle=0.5), way_in=0.1)
SMALL = ArmSettings(calibration=CalibrationSettings(seconds=40.0), work=SHORT)


@pytest.fixture(scope="module")
def arm() -> Arm:
    robot = load_robot("ur10e")
    series = random_fourier(robot, period=20.0, harmonics=5, rng=np.random.default_rng(3))
    return Arm(SMALL, 0, "easy", Repeated(series=series, periods=2))


@pytest.fixture(scope="module")
def models(arm):
    return arm.calibrated()


def test_a_force_with_friction_against_the_feed_is_read_as_its_normal_part(arm, models):
    sensor = force_sensor(models.estimates[STEADY], rate=250.0)
    standing, forth, back = along_the_normal(sensor, TIP, ToolFriction(part=0.3))
    q = np.array(postures_of(arm.described)[0].seed)
    rotation = forward_kinematics(arm.robot, q, frame=TIP).rotation
    for way, solver in ((0.0, standing), (1.0, forth), (-1.0, back)):
        # The tip's z points into the workpiece, its x along the path; the workpiece pushes out and holds back.
        force = rotation @ np.array([-way * 0.3 * 20.0, 0.0, -20.0])
        jacobian, _ = solver.jacobian(q)
        found = solver.at(q, jacobian[:3].T @ force, np.full(6, 1e-6)).wrench
        assert found[2] == pytest.approx(-20.0, abs=1e-3)
        three = of_three_forces(sensor, TIP)[0].at(q, jacobian[:3].T @ force, np.full(6, 1e-6)).wrench
        np.testing.assert_allclose(three[:3], [-way * 6.0, 0.0, -20.0], atol=1e-3)


def test_the_virtual_sensor_reads_the_force_that_the_cell_presses_with(arm, models):
    scene = Scene(0, "flat", "warm")
    cell, job = arm.cell(scene, models.warm), arm.job(scene)
    reader, source = reading_of(NO_WARMTH, models.estimates, arm.air(scene, cell, job), cell)
    asked = replace(job, polisher=replace(job.polisher, source=source))
    log = asked.done_in(start_cell(cell, job.beginning, rng=arm.rng_of_run(scene)), reader)
    assert log.phase == "done"
    pressed, free = log.passing > 0.0, np.arange(len(log.t)) < 200
    assert np.mean(log.true[pressed]) == pytest.approx(30.0, abs=6.0)
    assert np.mean(log.read[pressed] - log.true[pressed]) == pytest.approx(0.0, abs=6.0)
    assert (log.true[free] == 0.0).all()
    assert np.abs(np.nanmean(log.read[free])) < 6.0


def test_on_a_load_cell_the_loop_holds_its_force_on_both_shapes(arm, models):
    for shape in SHAPES:
        scene = Scene(1, shape, "cold")
        cell, job = arm.cell(scene, models.warm), arm.job(scene)
        log = job.done_in(start_cell(cell, job.beginning, rng=arm.rng_of_run(scene)), LoadCellReading())
        outcome = judged(_blank(), log, 30.0)
        assert outcome.phase == "done"
        assert outcome.rms < 0.08, shape


def test_a_pass_in_air_is_taken_where_the_job_will_be(arm, models):
    scene = Scene(0, "flat", "cold")
    cell, job = arm.cell(scene, models.warm), arm.job(scene)
    air, high = arm.air(scene, cell, job), SHORT.limits.height
    assert air.progress[-1] == pytest.approx(2 * 2 * SHORT.task.half, rel=0.01)
    assert (np.diff(air.progress) >= 0.0).all()
    place = np.array(postures_of(arm.described)[0].place)
    tips = np.array([forward_kinematics(arm.robot, q, frame=TIP).translation for q in air.recording.q])
    above = tips[:, 2] - place[2]
    assert above.min() > 0.5 * high
    down = np.flatnonzero(air.down)
    seconds = high / job.polisher.limits.approach_speed
    assert down.size * job.polisher.period == pytest.approx(seconds, rel=0.05)
    wanted = np.linspace(2.0 * high, high, down.size)
    np.testing.assert_allclose(above[down], wanted, atol=1e-3)
    assert (air.progress[: down[-1] + 1] == 0.0).all()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Misled(ForceReader):
    """A reader whose drives have an offset that no model knows, one on the way down and another later."""

    inner: ForceReader
    offset: np.ndarray

    def start(self):
        return self.inner.start()

    def read(self, memory, sample, place):
        return self.inner.read(
            memory, sample._replace(tau=sample.tau + (1.0 if place.down else -0.7) * self.offset), place
        )


def test_what_the_same_job_shows_in_air_is_no_force_on_the_way_down_nor_in_the_passes(arm, models):
    scene, offset = Scene(0, "flat", "cold"), np.array([0.0, 9.0, 6.0, 0.0, 0.0, 0.0])
    cell, job = arm.cell(scene, models.warm), arm.job(scene)
    air = arm.air(scene, cell, job)
    offsets = np.where(air.down[:, None], offset, -0.7 * offset)
    seen = air._replace(recording=replace(air.recording, tau=air.recording.tau + offsets))
    deepest = []
    for name in (NO_WARMTH, f"{NO_WARMTH}, pass in air"):
        reader, source = reading_of(name, models.estimates, seen, cell)
        asked = replace(job, polisher=replace(job.polisher, source=source))
        running = start_cell(in_the_air(cell), job.beginning, rng=arm.rng_of_run(scene))
        log = asked.done_in(running, Misled(inner=reader, offset=offset))
        deepest.append(log.depth.max())
        felt = log.read[int(0.6 / job.polisher.period) : int(1.6 / job.polisher.period)]
    assert deepest[0] < -job.polisher.limits.misplaced, "contact is felt at once"
    assert deepest[1] >= job.polisher.limits.deepest, "none is felt at all"
    assert np.abs(felt).max() < job.polisher.contact.threshold
    reader, source = reading_of(f"{NO_WARMTH}, pass in air", models.estimates, seen, cell)
    asked = replace(job, polisher=replace(job.polisher, source=source))
    running = start_cell(cell, job.beginning, rng=arm.rng_of_run(scene))
    assert judged(_blank(), asked.done_in(running, Misled(inner=reader, offset=offset)), 30.0).rms < 0.1


def test_hard_arms_have_changed_since_the_calibration_and_easy_ones_have_not(arm):
    hard = Arm(SMALL, 0, "hard", arm.motion)
    scene = Scene(0, "flat", "cold")
    warm = np.full(6, 40.0)
    easy_cell, hard_cell = arm.cell(scene, warm), hard.cell(scene, warm)
    np.testing.assert_array_equal(easy_cell.truth.inertia, arm.truth.inertia)
    ratio = hard_cell.truth.inertia[:, 0] / hard.truth.inertia[:, 0]
    assert 0.002 < np.std(np.log(ratio)) < 0.06
    assert (hard_cell.sensors.torque_factor != hard.sensors.torque_factor).all()
    np.testing.assert_array_equal(easy_cell.truth.heat.initial, AMBIENT)
    np.testing.assert_array_equal(arm.cell(scene._replace(warmth="warm"), warm).truth.heat.initial, 40.0)


def test_a_job_is_judged_by_the_true_force_while_the_tool_is_fed():
    passing = np.array([0.0, 1.0, 1.0, 1.0, 0.0])
    true, read = np.array([0.0, 27.0, 30.0, 36.0, 90.0]), np.array([np.nan, 28.0, 30.0, 33.0, 0.0])
    log = JobLog(np.arange(5.0), np.zeros(5), np.zeros(5), passing, true, read, np.ones(5), "done", "")
    outcome = judged(_blank(), log, 30.0)
    assert outcome.rms == pytest.approx(np.sqrt((9.0 + 0.0 + 36.0) / 3.0) / 30.0)
    assert outcome.bias == pytest.approx(1.0 / 30.0)
    assert outcome.largest == 6.0
    assert outcome.read == pytest.approx(np.sqrt((1.0 + 9.0) / 3.0))
    assert outcome.inside == pytest.approx(2.0 / 3.0)
    stopped = judged(_blank(), log._replace(passing=np.zeros(5), phase="stopped", reason="contact_lost"), 30.0)
    assert np.isnan(stopped.rms)
    assert (stopped.phase, stopped.reason) == ("stopped", "contact_lost")


def test_jobs_that_were_given_up_are_counted_and_not_averaged():
    jobs = [
        replace(_blank(), rms=0.02, phase="done"),
        replace(_blank(), rms=0.5, phase="stopped", reason="force_limit"),
    ]
    assert spread(jobs).median == pytest.approx(2.0)
    assert finished(jobs) == "1 of 2 (force_limit)"
    assert np.isnan(spread(jobs[1:]).median)


def test_the_chapters_tell_the_figures_of_the_jobs():
    outcomes = [
        replace(_blank(), seed=seed, difficulty=difficulty, shape=shape, warmth=warmth, sensor=name, rms=rms, bias=0.0,
                read=1.0, inside=0.9, phase="done")
        for seed in range(2) for difficulty in ("easy", "hard") for shape in SHAPES for warmth in ("cold", "warm")
        for name, rms in (("with warmth", 0.031), (NO_WARMTH, 0.11), (f"{NO_WARMTH}, pass in air", 0.04),
                          (LOAD_CELL, 0.02), ("open loop", 0.6))
    ]  # fmt: skip
    found = Findings(arm=SMALL, outcomes=tuple(outcomes))
    assert "2 arms" in chapters.summary_of(found)
    assert "with warmth 3.1 % cold and 3.1 % warm" in chapters.summary_of(found)
    table = chapters.force_chapter(found).tables[0]
    row = dict(zip(table.header, next(row for row in table.rows if row[0] == NO_WARMTH), strict=True))
    assert row["cold: RMS [%]"] == pytest.approx(11.0)
    assert row["warm: done"] == "4 of 4"
    assert row["inside [%]"] == pytest.approx(90.0)
    flat = replace(_blank(), phase="done", bias=0.0)
    more = [
        replace(flat, warmth=warmth, sensor=name, rms=rms)
        for warmth in ("cold", "warm")
        for name, rms in (
            ("kalman", 0.047),
            ("with warmth, three forces", 0.028),
            ("with warmth, six components", 0.062),
        )
    ]
    others = chapters.others_chapter(replace(found, outcomes=(*outcomes, *more)))
    assert [row[0] for row in others.tables[0].rows][1:4] == [one.sensor for one in more[:3]]
    assert "Cold, observers by name lie between 4 and 4.7 %" in others.text[0]
    assert "for one direction 3.1 %, for three forces 2.8 %, for six components 6.2 %" in others.text[1]


def test_a_shift_that_fails_takes_no_other_chapter_with_it(monkeypatch):
    done = replace(_blank(), sensor=LOAD_CELL, rms=0.02, bias=0.0, phase="done")

    def tried(trial):
        if trial.seed == 1:
            raise SimulationError("the arm went unstable")
        return tuple(replace(done, shape=shape, warmth=warmth) for shape in SHAPES for warmth in ("cold", "warm")), ()

    def shift_of(trial):
        raise SimulationError("the tip went unstable")

    monkeypatch.setattr(polishing_study, "whole_room", lambda *_, **__: None)
    for function in (tried, shift_of):
        monkeypatch.setattr(polishing_study, function.__name__, function)
    study = PolishingStudy(seeds=2, first_seed=0, difficulties=("easy",), local=0, shifts=1, accidents=0)
    result = study.run(LocalWorkers(count=1))
    assert result.chapters[1].tables[0].rows[0][:2] == (LOAD_CELL, 2.0)
    assert result.chapters[-1].title == "A shift"
    assert "no jobs of a shift" in result.chapters[-1].text[0]
    arm_failed, shift_failed, chapter_failed = result.failures
    assert arm_failed == "2 of 2 arms failed: the arm went unstable"
    assert shift_failed == "1 of 1 shifts failed: the tip went unstable"
    assert chapter_failed in result.summary
    with pytest.raises(ModelError, match=r"no arm came through.*arm went unstable"):
        replace(study, seeds=1, first_seed=1).run(LocalWorkers(count=1))


def test_a_break_comes_in_the_middle_of_the_shift():
    usual = ShiftSettings()
    assert len(usual.times) == 17
    assert [hour for hour in usual.times if usual.rests(hour)] == [2.0, 2.25]
    assert [hour for hour in usual.times if usual.passes(hour)] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert all(map(replace(usual, anew=60.0).passes, usual.times))


def test_the_arm_comes_back_gently_from_where_a_job_was_given_up(arm, models, monkeypatch):
    scene = Scene(0, "flat", "cold")
    job = arm.job(scene)
    ended = JobLog(*(np.array([value]) for value in (9.0, 0.013, -0.004, 0.0, 0.0, 0.0, 1.0)), "stopped", "force_limit")
    cell = in_the_air(arm.cell(scene, models.warm))
    running = start_cell(cell, job.path.at(0.013, 0.0, -0.004, 0.0)[0], rng=arm.rng_of_run(scene))
    passed, advance = [running.reference], RunningCell.advance
    monkeypatch.setattr(RunningCell, "advance", lambda self, q, dq: passed.append(q) or advance(self, q, dq))
    job.come_back(running, ended)
    np.testing.assert_allclose(running.reference, job.beginning, atol=1e-6)
    farthest = np.abs(passed[0] - job.beginning).max()
    assert farthest > 0.01
    assert np.abs(np.diff(passed, axis=0)).max() < 0.05 * farthest, "no jump"
    moved = len(passed)
    job.come_back(running, ended._replace(s=np.array([-0.02]), depth=np.array([-job.polisher.limits.height])))
    assert len(passed) == moved, "it is there already"


def test_joints_warm_up_over_a_shift_and_cool_in_the_break(arm, models, monkeypatch):
    monkeypatch.setattr(shift, "SHOWN", {LOAD_CELL: shift.SHOWN[LOAD_CELL]._replace(anew=True)})
    monkeypatch.setattr(Arm, "calibrated", lambda _: models)  # a load cell needs none
    passes: list[float] = []
    begun: list[float] = []

    def noted(moments, act):
        return lambda job, cell, *reader: moments.append(cell.time) or act(job, cell, *reader)

    monkeypatch.setattr(Job, "in_air", noted(passes, Job.in_air))
    monkeypatch.setattr(Job, "done_in", noted(begun, Job.done_in))
    hours = ShiftSettings(hours=0.75, every=900.0, rest=(0.25, 0.5), anew=1800.0)
    done = shift.shift_of(shift.ShiftTrial(settings=SMALL, shift=hours, seed=0, motion=arm.motion))
    assert passes == pytest.approx([0.0, 0.0, 1800.0], abs=1e-6), "that of the beginning, and two taken anew"
    assert begun[1::2] == pytest.approx([900.0, 2700.0], abs=1e-6)
    assert [worked.hour for worked in done] == [0.0, 0.25, 0.5, 0.75]
    assert all(worked.outcome.phase == "done" for worked in done)
    cold, worked, rested, again = (job.temperature for job in done)
    assert cold == pytest.approx(AMBIENT, abs=0.5)
    assert worked > AMBIENT + 3.0
    assert rested < AMBIENT + 0.3 * (worked - AMBIENT)
    assert again > rested + 2.0


def test_what_makes_no_sense_is_refused():
    with pytest.raises(ModelError, match="1 seed or more"):
        PolishingStudy(seeds=0)
    with pytest.raises(ModelError, match="no places for a workpiece"):
        PolishingStudy(robot="panda")
    with pytest.raises(Exception, match="friction lost"):
        PlantSettings(lost=(0.5, 0.2))


def _blank() -> Outcome:
    return Outcome(seed=0, difficulty="easy", shape="flat", warmth="cold", sensor="x")
