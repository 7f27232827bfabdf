"""What goes wrong in a polishing job: the force stays bounded, and the job ends for the right reason."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from tauhat.control.force import CylindricalSurface, FlatSurface, PolishTask, Surface
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError, SimulationError, TauhatWarning
from tauhat.estimation.identify import identify
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.repeated import Repeated
from tauhat.robots import load_robot
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.running_cell import CellSample
from tauhat.simulation.contact.workpiece import height
from tauhat.studies.polishing.arm import Arm, ArmSettings, Calibrated, Scene
from tauhat.studies.polishing.calibration import THERMAL, CalibrationSettings, calibration_log
from tauhat.studies.polishing.incident_chapter import incident_chapter
from tauhat.studies.polishing.incidents import MovedSurface, OtherSkin, SoftSpot
from tauhat.studies.polishing.known_incidents import INCIDENTS, OF_THE_SAMPLES
from tauhat.studies.polishing.meeting import Bench, Healthy, Met, bench_of, met, short_work
from tauhat.studies.polishing.readers import NoReading, Place
from tauhat.studies.polishing.sample_faults import Frozen, Lost, Scattered
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, WITH_WARMTH
from tauhat.studies.polishing.work import WorkSettings

LIMIT, FORCE, PRESS_SPEED, PERIOD = 60.0, 30.0, 5e-3, 0.004
BY_NAME = {incident.name: incident for incident in INCIDENTS}
WITH_LOAD_CELL = (
    "samples freeze, stamps go on",
    "torque is not a number",
    "torque of the other sign on the way down",
    "no samples for 60 ms",
    "workpiece rises by 1 in 5",
)
STILL, FED = Place(0.0, 0.0), Place(1.0, 0.0)


@pytest.fixture(scope="module")
def arm() -> Arm:
    """Return an arm whose job lasts five seconds: what is slow is not what goes wrong."""
    work = WorkSettings(task=PolishTask(settle=0.1, force_rate=100.0, acceleration=2.0), way_in=0.2)
    settings = ArmSettings(work=work, calibration=CalibrationSettings(seconds=40.0, rate=100.0), timestep=1e-3)
    series = random_fourier(load_robot("ur10e"), rng=np.random.default_rng(5), period=10.0, harmonics=5)
    return Arm(short_work(settings), 0, "easy", Repeated(series=series, periods=4))


@pytest.fixture(scope="module")
def models(arm: Arm) -> Calibrated:
    """Return the model with warmth alone, from forty seconds."""
    settings = arm.settings.calibration
    truth = Cell(robot=arm.described, parameters=arm.truth, tool=arm.settings.tool).truth_with_tip
    log, warm = calibration_log(
        arm.described, truth, arm.motion, sensors=arm.sensors, settings=settings, rng=np.random.default_rng(1)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # forty seconds leave doubts
        estimate = identify(torque_model(arm.robot, settings.terms(THERMAL)), [log])
    return Calibrated({THERMAL: estimate}, warm)


@pytest.fixture(scope="module")
def bench(arm: Arm, models: Calibrated) -> Bench:
    return soon_begun(bench_of(arm, Scene(0, "flat", "warm"), models, WITH_WARMTH))


def soon_begun(bench: Bench) -> Bench:
    return replace(bench, cell=replace(bench.cell, settle=0.2))


@pytest.fixture(scope="module")
def healthy(bench: Bench) -> Healthy:
    return bench.healthy()


@pytest.fixture(scope="module")
def load_cell(arm: Arm, models: Calibrated) -> Bench:
    return soon_begun(bench_of(arm, Scene(0, "flat", "warm"), models, LOAD_CELL))


def check(found: Met) -> None:
    """Assert what has to hold of every job in which something goes wrong."""
    assert found.reason in found.ends
    assert found.phase == ("stopped" if found.reason else "done")
    assert found.largest <= found.bound
    assert found.left == 0.0
    assert found.depth <= found.deepest
    if found.reason:
        assert found.blind <= found.notice
        assert 0.0 <= found.seconds < 6.0
    assert found.safe


@pytest.mark.parametrize("incident", INCIDENTS, ids=lambda incident: incident.name)
def test_force_stays_bounded_and_the_job_ends_for_the_right_reason(bench, healthy, incident):
    found = met(bench, healthy, incident)
    check(found)
    if incident in OF_THE_SAMPLES:
        assert found.largest < LIMIT  # nothing but the tool's own way makes the force grow


def test_the_same_holds_on_a_load_cell(load_cell):
    healthy = load_cell.healthy()
    for incident in map(BY_NAME.__getitem__, WITH_LOAD_CELL):
        check(met(load_cell, healthy, incident))


def test_a_steep_rise_takes_the_force_to_its_limit_and_little_further(bench, healthy):
    found = met(bench, healthy, BY_NAME["workpiece rises by 1 in 5"])
    assert found.reason == "force_limit"
    assert found.largest > 0.9 * LIMIT  # the rise is steep enough to need the limit
    stiffness = 1.0 / (1.0 / 1e4 + 1.0 / 1e5)
    speed = PRESS_SPEED + np.sin(0.2) * 0.05
    late = PERIOD + bench.reader.lag + 2.0 / (2.0 * np.pi * 10.0)
    assert found.bound == pytest.approx(LIMIT + 3.0 * healthy.std + stiffness * speed * late)
    assert bench.reader.lag == pytest.approx(0.05 + 0.23 / 10.0, abs=1e-3)


def test_frozen_samples_would_go_unnoticed_by_the_readings_alone(bench, healthy):
    frozen = BY_NAME["samples freeze, stamps go on"]
    trusting = replace(bench, reader=replace(bench.reader, still_after=10**9))
    found = met(trusting, healthy, frozen)
    assert found.blind > bench.notice
    assert not found.noticed
    assert found.reason not in frozen.ends


def test_until_an_incident_begins_nothing_differs(bench, healthy):
    begins = healthy.begins["pass"]
    before, _ = bench.run(bench.cell, bench.reader)
    after, _ = bench.run(bench.cell, Lost(name="", ends=("",)).reader(bench.reader, begins))
    count = int(np.searchsorted(before.t, begins))
    for name in ("t", "depth", "true", "read", "std"):
        np.testing.assert_array_equal(getattr(before, name)[:count], getattr(after, name)[:count])
    assert np.isfinite(before.read[count])
    assert np.isnan(after.read[count:]).all()


def test_a_job_that_fails_without_an_incident_is_refused(bench):
    with pytest.raises(SimulationError, match=r"fails before anything goes wrong.*reading_missing"):
        replace(bench, reader=NoReading()).healthy()


def sample(t: float, q: np.ndarray, tau: np.ndarray) -> CellSample:
    zero = np.zeros(3)
    return CellSample(t, q, tau, 0.0, zero, 0.0, zero, contact=False, temperature=np.zeros(6), fresh=True)


def samples_in_air(bench: Bench, count: int) -> list[CellSample]:
    """Return samples of a standing arm with noise on the torque."""
    rng = np.random.default_rng(1)
    q = bench.job.beginning
    return [sample(PERIOD * k, q, 10.0 + 0.1 * rng.standard_normal(6)) for k in range(count)]


def readings(reader, samples: list[CellSample], place: Place = STILL) -> list:
    memory, found = reader.start(), []
    for one in samples:
        memory, reading = reader.read(memory, one, place)
        found.append(reading)
    return found


def test_good_samples_read_as_without_the_stream(bench):
    samples = samples_in_air(bench, 150)
    streamed, bare = readings(bench.reader, samples), readings(bench.reader.sensed, samples)
    assert bare[-1] is not None
    for ours, theirs in zip(streamed, bare, strict=True):
        assert theirs is None or ours == theirs  # the bare reader is silent while the sensor settles
    # while it settles, error bars say so
    assert streamed[0].std > 5.0 * FORCE
    assert streamed[-1].std < FORCE


def test_samples_that_are_none_give_no_reading(bench):
    good = samples_in_air(bench, 120)
    q, tau, t = good[100].q, good[100].tau, good[100].t
    bad = [
        sample(t, q, np.full(6, np.nan)),
        sample(t, q, np.full(6, 1e12)),
        sample(np.inf, q, tau),
        sample(good[99].t, q, tau),
        sample(good[50].t, q, tau),
    ]
    for one in bad:
        found = readings(bench.reader, [*good[:100], one, *good[101:]])
        assert [k for k, reading in enumerate(found) if reading is None] == [100]


def test_samples_that_stand_still_give_no_reading(bench):
    good, limit = samples_in_air(bench, 130), bench.reader.still_after
    held = [*good[:100], *(one._replace(tau=good[99].tau) for one in good[100:120]), *good[120:]]
    found = readings(bench.reader, held)
    assert [k for k, reading in enumerate(found) if reading is None] == list(range(99 + limit, 120))
    # positions that stand still are no fault of an arm that stands
    assert None not in readings(bench.reader, good)
    assert None in readings(bench.reader, good, FED)


def test_a_position_that_stood_while_the_tool_was_fed_is_not_believed_when_the_feed_stops(bench):
    samples, limit = samples_in_air(bench, 60), bench.reader.still_after
    memory = bench.reader.start()
    for k, one in enumerate(samples):
        memory, reading = bench.reader.read(memory, one, FED if k <= limit else STILL)
        assert (reading is None) == (k >= limit)
    moved = samples[-1].q + 1e-6
    _, reading = bench.reader.read(memory, sample(PERIOD * len(samples), moved, samples[0].tau), STILL)
    assert reading is not None


def test_a_stream_of_another_rate_ends(bench):
    slow = [one._replace(t=1.5 * one.t) for one in samples_in_air(bench, 300)]
    found = readings(bench.reader, slow)
    assert found[0] is not None
    assert found[150:] == [None] * 150


def test_a_soft_spot_lets_the_tip_come_up_in_even_steps():
    cell = SoftSpot(name="", ends=("",), length=2e-3, edge=6e-3).cell(Cell(robot=load_robot("ur10e")), flat())
    regions, tool = cell.material.regions, cell.tool.stiffness
    assert (regions[0].start, regions[0].end) == (0.0, 2e-3)
    sunk = np.array([tool / (tool + region.stiffness) for region in regions[1:]])
    steps = np.diff(np.array([1.0, *sunk, tool / (tool + cell.material.stiffness)]))
    assert steps == pytest.approx(np.full(steps.size, steps[0]))
    assert [region.end for region in regions[:-1]] == [region.start for region in regions[1:]]
    assert regions[-1].end == pytest.approx(8e-3)


def test_another_skin_multiplies_the_force_of_a_pressed_tool():
    incident = OtherSkin(name="", ends=("",), before=2e4, behind=1e5)
    plain = Cell(robot=load_robot("ur10e"))
    material = incident.cell(plain, flat()).material
    forces = [1e-3 / (1.0 / plain.tool.stiffness + 1.0 / material.stiffness_at(s)) for s in (-0.01, 0.01)]
    assert incident.jump(plain) == pytest.approx(forces[1] / forces[0])


def flat() -> Surface:
    return FlatSurface(place=np.array([0.5, 0.0, 0.2]), rotation=np.eye(3), half=0.04)


@pytest.mark.parametrize("believed", [flat(), CylindricalSurface(place=np.zeros(3), rotation=np.eye(3), radius=0.4)])
def test_a_workpiece_is_moved_from_where_it_is_believed(believed):
    incident = MovedSurface(name="", ends=("",), raised=2e-3, tilted=0.1)
    real = incident.cell(Cell(robot=load_robot("ur10e"), surface=flat()), believed).surface
    assert height(believed, real.points(np.zeros(1))[0]) == pytest.approx(2e-3)
    fallen = [height(believed, point) for point in real.points(np.array([-0.02, 0.02]))]
    assert fallen[1] - fallen[0] == pytest.approx(-0.04 * np.sin(0.1), rel=0.1)


def test_faults_take_turns_and_end():
    fault = Scattered(name="", ends=("",), width=1.0, bad=2, good=3, count=8)
    assert [fault.spoils(number) for number in range(-1, 12)] == [False, *[True, True, False, False, False] * 1,
        True, True, False, False, False, False, False]  # fmt: skip
    assert Frozen(name="", ends=("",)).spoils(10**6)


def example(name: str, **changes) -> Met:
    blank = Met(
        name=name, sensor="s", warmth="cold", largest=40.0, bound=70.0, left=0.0, phase="stopped",
        reason="reading_missing", ends=("reading_missing",), seconds=0.2, blind=0.03, notice=0.1, depth=1e-3,
        deepest=8e-3,
    )  # fmt: skip
    return replace(blank, **changes)


@pytest.mark.parametrize(
    "change",
    [{"largest": 71.0}, {"left": 1.0}, {"phase": "pass"}, {"reason": "untrusted"}, {"blind": 0.2}, {"depth": 9e-3},
     {"reason": "", "phase": "done"}],
)  # fmt: skip
def test_each_broken_promise_is_unsafe(change):
    assert example("a").safe
    assert not example("a", **change).safe


def test_the_chapter_counts_what_it_is_given():
    done = example("b", phase="done", reason="", ends=("",), seconds=np.nan, largest=45.0, blind=0.5)
    found = [example("a"), done, example("c", seconds=0.4, largest=80.0)]
    chapter = incident_chapter(found)
    assert "2 of 3 jobs" in chapter.text[0]
    assert "80 N (c, s)" in chapter.text[0]
    assert "not safe: c (s, cold)" in chapter.text[0]
    assert "1 jobs were done to their end and 2 given up, these 0.2 to 0.4 s" in chapter.text[1]
    assert "no more than 0.03 s" in chapter.text[1]
    assert [row[0] for row in chapter.tables[0].rows] == ["a", "b", "c"]
    assert "not safe" not in incident_chapter(found[:2]).text[0]
    assert incident_chapter([done]).text[1] == "All 1 jobs were done to their end."
    with pytest.raises(ModelError, match="no incidents"):
        incident_chapter([])
