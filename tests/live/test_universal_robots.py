"""A Universal Robots arm live: `ur_rtde` itself against a stand-in that speaks the published protocol."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest
from played_arm import CONSTANTS, CURRENTS, PLAYED, RATE, ROBOT, START, robot_at, rows, sensor
from rtde_stand_in import PORT, RtdeStandIn
from typer.testing import CliRunner

from tauhat.cli.app import app
from tauhat.dynamics import torque_model
from tauhat.errors import LiveError, MapError, MissingExtraError, OutputError, SensingError
from tauhat.estimation import identify
from tauhat.live.clients import Clients
from tauhat.live.current_map import CurrentMap
from tauhat.live.robot_channel import stream_robot
from tauhat.live.robot_log import record
from tauhat.live.rtde_greeting import greet
from tauhat.live.service import Service
from tauhat.live.universal_robots import LiveSample, RobotLink, UniversalRobot, sensed
from tauhat.recordings import Log, Recording, parse_map, read_recording
from tauhat.verification import verify

pytest.importorskip("rtde_receive", reason="ur_rtde cannot be installed here: no wheel for this platform")


def samples(stand_in: RtdeStandIn, count: int, **settings: object) -> tuple[list[LiveSample], object]:
    with robot_at(stand_in, **settings).connect() as link:
        return list(islice((sample for sample in link if sample is not None), count)), link


def test_position_and_current_are_of_one_cycle_and_bit_equal_to_what_the_controller_sent():
    with RtdeStandIn(PLAYED) as stand_in, robot_at(stand_in).connect() as link:
        cycles = list(islice(filter(None, link.cycles()), 200))
    t = np.array([cycle.t for cycle in cycles])
    sent = rows(t)
    assert (t == PLAYED["timestamp"][sent]).all()
    assert (np.diff(t) > 0).all()
    for name, variable in (
        ("q", "actual_q"), ("current", "actual_current"), ("target_current", "target_current"),
        ("target_moment", "target_moment"), ("temperature", "joint_temperatures"),
    ):  # fmt: skip
        assert (np.array([getattr(cycle, name) for cycle in cycles]) == PLAYED[variable][sent]).all(), name
    assert link.counts.taken == 200
    assert link.counts.lost == sent[-1] - sent[0] + 1 - 200
    assert link.counts.lost < 200
    assert link.controller.version == "5.15.2"
    assert struct.unpack(">d", stand_in.asked[-2][1][:8]) == (RATE,)


def test_torque_is_current_times_the_constants_of_the_map_with_its_signs_and_offsets():
    text = """
    [time]
    column = "t"
    [position]
    columns = "q_{1..6}"
    sign = [1, 1, 1, 1, 1, -1]
    offset = [0, -1.5, 0, 0, 0, 0]
    [torque]
    columns = "i_{1..6}"
    unit = "A"
    gain = [10.0, 10.7, 8.5, 9.0, 9.5, 10.1]
    sign = -1
    """
    currents = CurrentMap(log_map=parse_map(text))
    q, current = np.arange(1.0, 7.0), np.arange(6.0, 0.0, -1.0)
    position, torque = currents.joint_side(q, current)
    assert (position == q * [1, 1, 1, 1, 1, -1] + [0, -1.5, 0, 0, 0, 0]).all()
    assert (torque == -current * [10.0, 10.7, 8.5, 9.0, 9.5, 10.1]).all()
    again = CurrentMap(log_map=parse_map(currents.text())).joint_side(q, current)
    assert (again[0] == position).all()
    assert (again[1] == torque).all()


@pytest.mark.parametrize(
    ("torque", "message"),
    [
        ("", "no torque constants"),
        ('[torque]\ncolumns = "t_{1..6}"\nunit = "Nm"', "no torque constants"),
        ('[torque]\ncolumns = "t_{1..6}"\nunit = "Nm"\ngain = 1.0', "another unit"),
        ('[torque]\ncolumns = "t_{1..6}"\nunit = "A"\ngain = 1.0\ndelay_samples = 1', "cannot be shifted"),
        ('[torque]\ncolumns = "t_{1..6}"\nunit = "A"\ngain = [1.0, 2.0]', "wrong number of values"),
        ('[torque]\ncolumns = "t_{1..6}"\nunit = "A"\ngain = 1.0\n[joints]\nnames = ["a"]', "another robot"),
    ],
)
def test_a_map_without_torque_constants_for_currents_is_refused_by_name(torque, message):
    text = f'[time]\ncolumn = "t"\n[position]\ncolumns = "q_{{1..6}}"\n{torque}\n'
    with pytest.raises(MapError, match=message):
        CurrentMap(log_map=parse_map(text))


def test_what_is_sensed_live_is_what_is_sensed_along_a_log_of_the_same_samples():
    pushed = dict(PLAYED, actual_current=PLAYED["actual_current"] + 0.3)
    force = sensor(RATE)
    force.advance(force.start(), np.zeros(6), np.zeros(6))  # compiled before the robot begins to speak
    with RtdeStandIn(pushed, faults={120: "disconnect"}, absent=0.3) as stand_in, robot_at(stand_in).connect() as link:
        kept: list[LiveSample] = []

        def passing() -> Iterator[LiveSample | None]:
            for sample in link:
                kept.extend([sample] if sample is not None else [])
                yield sample

        told = list(islice(sensed(force, passing()), 500))
    t, q, tau = (np.array(values) for values in zip(*kept, strict=True))
    along = force.along(Log(t=t, q=q, tau=tau, joint_names=ROBOT.joint_names, units=("rad",) * 6))
    assert along.counts.restarts >= 1
    assert (np.array([answer.tau for _, answer in told]) == along.tau).all()
    assert (np.array([answer.wrench for _, answer in told]) == along.wrench).all()
    assert np.abs(along.tau[along.settled]).max() > 1.0  # the push is there


def test_a_sensor_of_another_rate_is_refused():
    with (
        RtdeStandIn(PLAYED) as stand_in,
        robot_at(stand_in).connect() as link,
        pytest.raises(SensingError, match="samples of another rate"),
    ):
        list(islice(sensed(sensor(125.0), link), 300))


@pytest.mark.parametrize("fault", ["disconnect", "garbage", "silence"])
def test_a_connection_that_breaks_is_counted_and_made_anew_on_the_same_clock(fault):
    with RtdeStandIn(PLAYED, faults={60: fault}, absent=0.6) as stand_in:
        found, link = samples(stand_in, 120)
    assert (link.counts.disconnects, link.counts.reconnects) == (1, 1)
    assert link.counts.taken == 120
    t = np.array([sample.t for sample in found])
    assert (np.diff(t) > 0).all()
    assert (np.array([sample.q for sample in found]) == PLAYED["actual_q"][rows(t)]).all()
    assert np.diff(t).max() > 0.1  # the hole is not closed


def test_silence_is_noticed_when_it_has_lasted_as_long_as_it_may():
    """`ur_rtde` itself waits three seconds for a controller that is silent, before its connection can be let go."""
    with RtdeStandIn(PLAYED, faults={200: "silence"}) as stand_in, robot_at(stand_in, silence=0.6).connect() as link:
        heard = time.monotonic()
        for sample in link:
            if sample is None:
                break
            heard = time.monotonic()
        assert 0.5 < time.monotonic() - heard < 2.5


def test_a_package_that_comes_twice_or_late_breaks_nothing():
    with RtdeStandIn(PLAYED, faults={30: "repeat", 50: "late"}) as stand_in:
        found, link = samples(stand_in, 100)
    assert (np.diff([sample.t for sample in found]) > 0).all()
    assert link.counts.disconnects == 0


@pytest.mark.parametrize(
    ("variable", "value", "state"),
    [
        ("safety_status_bits", 1 << 2 | 1 << 10, "protective stop"),
        ("safety_status_bits", 1 << 6 | 1 << 7, "robot emergency stop, emergency stop"),
        ("robot_mode", 5, "idle, brakes engaged"),
    ],
)
def test_a_robot_that_is_stopped_is_named_and_its_cycles_are_no_samples(variable, value, state):
    states = np.full(len(PLAYED["timestamp"]), 7 if variable == "robot_mode" else 1)
    states[100:200] = value
    seen = set()
    with RtdeStandIn({**PLAYED, variable: states}) as stand_in, robot_at(stand_in).connect() as link:
        taken = []
        for sample in link:
            seen.add(link.state)
            taken.extend([sample] if sample is not None else [])
            if taken and taken[-1].t > PLAYED["timestamp"][250]:
                break
    assert seen == {"running", state}
    sent = rows(np.array([sample.t for sample in taken]))
    assert not ((sent >= 100) & (sent < 200)).any()
    assert 1 <= link.counts.stopped <= 100


def test_numbers_that_are_none_are_counted_and_left_out():
    broken = PLAYED["actual_current"].copy()
    broken[20:70, 3] = np.nan
    with RtdeStandIn({**PLAYED, "actual_current": broken}) as stand_in:
        found, link = samples(stand_in, 150)
    assert all(np.isfinite(sample.tau).all() for sample in found)
    assert 1 <= link.counts.not_finite <= 50


def test_a_robot_that_stays_away_is_an_error_that_says_so():
    faults, message = {40: "disconnect"}, "the robot is gone; expected back within 0.6 s"
    with RtdeStandIn(PLAYED, faults=faults, absent=60.0) as stand_in, pytest.raises(LiveError, match=message):
        samples(stand_in, 1000, patience=0.6)


def test_nobody_there_is_one_line_within_five_seconds():
    began = time.monotonic()
    with pytest.raises(LiveError, match=r"no connection to the robot.*refused") as refusal:
        UniversalRobot(address="ur://127.251.251.251", currents=CURRENTS).connect()
    assert time.monotonic() - began < 5.0
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("answer", "message"),
    [(b"SSH-2.0-OpenSSH_9.6\r\n" * 9, "does not speak RTDE"), (b"", "does not speak RTDE"), (None, "no answer")],
)
def test_what_is_no_controller_is_named(answer, message):
    with socket.socket() as listener:
        listener.bind(("127.251.251.252", PORT))
        listener.listen()

        def serve() -> None:
            link, _ = listener.accept()
            with link:
                if answer is None:
                    time.sleep(0.6)
                elif answer:
                    link.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(LiveError, match=message):
            greet("127.251.251.252", ("timestamp",), timeout=0.4)
        thread.join()


@pytest.mark.parametrize(
    ("settings", "wanted", "message"),
    [
        ({"protocols": (1,), "version": (3, 2, 0, 1)}, RATE, r"RTDE protocol 2; got software 3\.2\.0"),
        ({"missing": ("joint_temperatures",)}, RATE, "does not tell joint_temperatures"),
        ({"version": (3, 15, 8, 1)}, RATE, "expected 125 Hz over a whole number"),
        ({}, 300.0, "expected 500 Hz over a whole number"),
    ],
)
def test_a_controller_that_is_too_old_or_has_no_such_rate_is_refused_by_name(settings, wanted, message):
    with RtdeStandIn(PLAYED, **settings) as stand_in, pytest.raises(LiveError, match=message):
        robot_at(stand_in, rate=wanted).connect()


def test_the_rate_is_the_controllers_own_when_none_is_asked_for():
    for version, rate in (((3, 15, 8, 1), 125.0), ((5, 15, 2, 0), 500.0)):
        with RtdeStandIn(PLAYED, version=version) as stand_in, robot_at(stand_in, rate=None).connect() as link:
            assert link.rate == rate


@pytest.mark.parametrize("address", ["", "ur://", "-x", "a\nb"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(LiveError, match="not an address"):
        UniversalRobot(address=address, currents=CURRENTS)


def test_without_ur_rtde_the_extra_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"tauhat\[universal-robots\]"):
        UniversalRobot(address="127.0.0.1", currents=CURRENTS).connect()


def test_the_reader_ends_with_whoever_started_it():
    code = (
        "import os, sys; from tauhat.live.universal_robots import UniversalRobot;"
        "from tauhat.live.current_map import map_of_constants;"
        "link = UniversalRobot(address=sys.argv[1], currents=map_of_constants([10.0]), rate=125.0).connect();"
        "next(iter(link)); print(link._reader.pid, flush=True); os._exit(0)"
    )
    with RtdeStandIn(PLAYED) as stand_in:
        done = subprocess.run(
            [sys.executable, "-c", code, stand_in.address], capture_output=True, text=True, check=True
        )
        deadline = time.monotonic() + 5.0
        while time.monotonic() < deadline and _runs(int(done.stdout)):
            time.sleep(0.05)
        assert not _runs(int(done.stdout))


def _runs(pid: int) -> bool:
    done = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False)
    return bool(done.stdout.strip()) and not done.stdout.strip().startswith("Z")


def test_a_recording_reads_back_bit_by_bit_and_identifies_the_arm(tmp_path):
    log = tmp_path / "run.parquet"
    with RtdeStandIn(PLAYED) as stand_in:
        written = record(robot_at(stand_in), 3.0, log)
    assert written.end == "time"
    recording = read_recording(log)
    sent = rows(recording.t)
    assert recording.n_t == written.n_t == written.counts.taken
    assert (recording.q == PLAYED["actual_q"][sent]).all()
    assert (recording.tau == CURRENTS.joint_side(recording.q[0], np.ones(6))[1] * PLAYED["actual_current"][sent]).all()
    assert (recording.temperature == PLAYED["joint_temperatures"][sent]).all()
    estimate = identify(torque_model(ROBOT, "inertia"), [recording], cutoff=10.0)
    unseen = Recording(
        t=PLAYED["timestamp"][3000:], q=PLAYED["actual_q"][3000:], tau=PLAYED["target_moment"][3000:],
        joint_names=ROBOT.joint_names,
    )  # fmt: skip
    assert verify(estimate, [unseen]).logs[0].relative_rms < 0.01


def test_a_recording_of_a_robot_that_is_lost_keeps_what_came(tmp_path):
    with RtdeStandIn(PLAYED, faults={400: "disconnect"}, absent=60.0) as stand_in:
        written = record(robot_at(stand_in, patience=0.6), 20.0, tmp_path / "run.csv")
    assert written.end.startswith("the robot is gone")
    assert 16 <= read_recording(tmp_path / "run.csv").n_t == written.n_t <= 400


def test_a_recording_ends_where_the_controllers_clock_starts_anew(tmp_path):
    stamps = PLAYED["timestamp"].copy()
    stamps[100:] -= START
    with RtdeStandIn({**PLAYED, "timestamp": stamps}, faults={100: "disconnect"}) as stand_in:
        written = record(robot_at(stand_in), 20.0, tmp_path / "run.parquet")
    assert "started anew" in written.end
    assert read_recording(tmp_path / "run.parquet").t[0] >= START


def test_a_recording_that_would_overwrite_its_map_or_has_no_samples_is_refused(tmp_path):
    stopped = dict(PLAYED, robot_mode=np.full(len(PLAYED["timestamp"]), 3))
    with RtdeStandIn(stopped) as stand_in:
        with pytest.raises(LiveError, match=r"too little to write.*power off"):
            record(robot_at(stand_in), 0.5, tmp_path / "run.parquet")
        (tmp_path / "run.map.toml").write_text("")
        with pytest.raises(OutputError, match="would overwrite"):
            record(robot_at(stand_in), 0.5, tmp_path / "run.parquet", inputs=[tmp_path / "run.map.toml"])
        with pytest.raises(LiveError, match="length of a recording"):
            record(robot_at(stand_in), 0.0, tmp_path / "other.parquet")


def command(*words: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "80"})
    return done.exit_code, done.stdout, done.stderr


def test_the_command_records_and_prints_one_json_document(tmp_path):
    log, constants = tmp_path / "run.parquet", ",".join(map(str, CONSTANTS))
    with RtdeStandIn(PLAYED) as stand_in:
        words = [f"ur://{stand_in.address}", "-o", log, "--seconds", 0.5, "--rate", 500, "--constants", constants]
        code, printed, _ = command("record", *words, "--json")
        document = json.loads(printed)
        assert code == 0
        assert document["n_t"] == read_recording(log).n_t
        assert document["counts"]["taken"] == document["n_t"]
        assert document["map"] == str(tmp_path / "run.map.toml")
        code, printed, _ = command("record", *words[:-2], "--map", document["map"], "-o", tmp_path / "again.parquet")
        assert code == 0
        assert f"Theirmap:{tmp_path / 'again.map.toml'}" in "".join(printed.split())  # long paths are broken


def test_the_command_refuses_in_one_line_what_it_cannot_record(tmp_path):
    log = tmp_path / "run.parquet"
    for words, code, message in (
        (["ur://127.251.251.251"], 1, "no torque constants: a controller tells currents, not torques; give --map"),
        (["ur://127.251.251.251", "--constants", "10"], 1, "no connection to the robot"),
        (["ur://127.251.251.251", "--constants", "ten"], 2, "not numbers with commas between"),
        (["ur://127.251.251.251", "--constants", "10", "--map", "m.toml"], 2, "not together with --map"),
        (["ros://127.251.251.251", "--constants", "10"], 2, "not a robot that can be recorded"),
    ):
        left, printed, error = command("record", *words, "-o", log)
        assert (left, printed) == (code, "")
        assert message in " ".join(error.replace("│", " ").split())
    assert not log.exists()


async def taken_by_a_server(link: RobotLink, count: int) -> dict[str, int]:
    """Return the server's totals when it has taken so many samples of a robot, or refused it."""
    clients = Clients(Service(sensor=sensor(RATE)))
    clients.service.warm_up()
    task = asyncio.create_task(stream_robot(link, clients))
    while not any(client.session.counts["taken"] >= count for client in clients._clients):
        await asyncio.sleep(0.02)
        if task.done():
            await task
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    return dict(clients.totals)


def test_a_robot_is_a_client_of_the_server_like_any_other():
    with RtdeStandIn(PLAYED) as stand_in:
        link = robot_at(stand_in).connect()
        totals = asyncio.run(taken_by_a_server(link, 150))
    assert totals["clients"] == 1
    assert 150 <= totals["taken"] <= link.counts.taken
    assert totals["malformed"] == totals["late"] == totals["not_finite"] == 0


def test_a_robot_of_which_most_cycles_are_lost_is_not_of_another_rate():
    """Steps of five and two periods in turn: only the controller can say that it has 500 Hz."""
    told = np.arange(len(PLAYED["timestamp"])) % 7
    lossy = {name: values[(told == 0) | (told == 5)] for name, values in PLAYED.items()}
    with RtdeStandIn(lossy) as stand_in:
        link = robot_at(stand_in).connect()
        assert asyncio.run(taken_by_a_server(link, 250))["taken"] >= 250
        assert link.counts.lost > 500
    with RtdeStandIn(lossy) as stand_in, robot_at(stand_in).connect() as link:
        assert len(list(islice(sensed(sensor(RATE), link), 250))) == 250


def test_a_robot_that_the_server_loses_or_refuses_is_an_error():
    async def served(link: RobotLink, rate: float) -> None:
        await stream_robot(link, Clients(Service(sensor=sensor(rate))))

    faults = {60: "disconnect"}
    with RtdeStandIn(PLAYED, faults=faults, absent=60.0) as stand_in, pytest.raises(LiveError, match="robot is gone"):
        asyncio.run(served(robot_at(stand_in, patience=0.5).connect(), RATE))
    message = r"ur://.*another rate.*got 500 Hz"
    with RtdeStandIn(PLAYED) as stand_in, pytest.raises(SensingError, match=message):
        asyncio.run(served(robot_at(stand_in).connect(), 100.0))
