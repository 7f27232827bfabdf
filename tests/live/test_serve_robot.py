"""`tauhat serve --robot`: the server reads a Universal Robots arm itself, for the page and for clients that follow."""

from __future__ import annotations

import asyncio
import json
import pickle
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from played_arm import CONSTANTS, PLAYED, RATE, ROBOT, robot_at, rows, sensor
from rtde_stand_in import RtdeStandIn
from typer.testing import CliRunner

from tauhat.cli.app import app
from tauhat.dynamics import torque_model
from tauhat.errors import LiveError, SensingError
from tauhat.estimation import identify, load_estimate
from tauhat.live import Channels, Limits, LiveServer, Sender, Service, Snapshot
from tauhat.live.server import serve
from tauhat.recordings import Log, Recording
from tauhat.sensing import SensedLog, force_sensor

pytest.importorskip("rtde_receive", reason="ur_rtde cannot be installed here: no wheel for this platform")

PUSHED = dict(PLAYED, actual_current=PLAYED["actual_current"] + 0.3)
WORDS = ",".join(map(str, CONSTANTS))
KEEPING = """
import pickle, sys
place = sys.argv.pop(1)
from tauhat.cli.app import main
from tauhat.live import page_process, robot_channel

kept, shown, message = [], [], robot_channel._message

class Page:
    url = "http://127.0.0.1:1"
    def send(self, snapshot):
        shown.append(tuple(snapshot))
        return True
    def end(self, stream, contacts):
        pass
    def commands(self):
        return []
    def close(self):
        with open(place, "wb") as file:
            pickle.dump((kept, shown), file)

page_process.start_page = lambda *_, **__: Page()
robot_channel._message = lambda sample: kept.append(tuple(sample)) or message(sample)
main()
"""  # a page that keeps what it is shown, and every sample that was read, for whoever looks afterwards


@pytest.fixture(scope="module")
def estimate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("robot") / "estimate.json"
    log = Recording(
        t=PLAYED["timestamp"], q=PLAYED["actual_q"], tau=PLAYED["target_moment"], joint_names=ROBOT.joint_names
    )
    identify(torque_model(ROBOT, "inertia"), [log.rows(0, 3000)], cutoff=10.0).save(found)
    return found


def run_tauhat(*words: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "200"})
    return done.exit_code, done.stdout, done.stderr


def document_of(process: subprocess.Popen[str]) -> dict[str, Any]:
    assert process.stdout is not None
    lines = [process.stdout.readline()]
    while not lines[-1].startswith("}"):
        lines.append(process.stdout.readline())
    return json.loads("".join(lines))


def gathered(sender: Sender, count: int) -> list[dict[str, Any]]:
    """Return so many answers to the robot's samples, as they come to a client that follows."""
    answers, end = [], time.monotonic() + 20.0
    while len(answers) < count and time.monotonic() < end:
        answers += sender.answers(0.5)
    return answers


def states(sender: Sender) -> list[str]:
    return [notice["state"] for notice in sender.notices if notice["notice"] == "robot"]


def along(kept: list[tuple[float, np.ndarray, np.ndarray]], estimate: Path) -> SensedLog:
    t, q, tau = (np.array(values) for values in zip(*kept, strict=True))
    log = Log(t=t, q=q, tau=tau, joint_names=ROBOT.joint_names, units=("rad",) * 6)
    return force_sensor(load_estimate(estimate), rate=RATE).along(log)


def test_page_and_followers_get_what_the_sensor_finds_along_a_log_of_the_same_samples(estimate: Path, tmp_path: Path):
    """Through the command, with a connection that breaks and is made anew."""
    with RtdeStandIn(PUSHED, absent=0.3) as stand_in:
        words = [tmp_path / "kept", "serve", estimate, "--robot", f"ur://{stand_in.address}", "--constants", WORDS]
        command = [sys.executable, "-c", KEEPING, *map(str, [*words, "--pipe", tmp_path / "s", "--json"])]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            document = document_of(process)
            with Sender(document["pipe"]) as follower:
                follower.command("follow")
                answers = gathered(follower, 200)
                stand_in.faults[int(rows(np.array(answers[-1]["t"]))) + 500] = "disconnect"
                while states(follower)[-2:] != ["disconnected", "running"]:
                    answers += gathered(follower, 1)
                answers += gathered(follower, 200)
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=15.0)
    assert process.returncode == 0, errors
    assert (document["rate"], document["source"]) == (RATE, f"ur://{stand_in.address}")
    assert re.fullmatch(r"done: 2 clients, \d+ taken.*, [1-9] restarts?.*\n", errors)
    kept, shown = pickle.loads((tmp_path / "kept").read_bytes())  # noqa: S301
    wanted = along(kept, estimate)
    place = {t: row for row, t in enumerate(wanted.t.tolist())}
    snapshots = [Snapshot(*values) for values in shown]
    assert len(snapshots) > 20
    assert {snapshot.stream for snapshot in snapshots} == {"robot 1"}
    found = [place[snapshot.t] for snapshot in snapshots]
    assert (np.array([snapshot.wrench for snapshot in snapshots]) == wanted.wrench[found]).all()
    assert (np.array([snapshot.tau for snapshot in snapshots]) == wanted.tau[found]).all()
    assert np.abs(wanted.tau[wanted.settled]).max() > 1.0  # the push is there
    found = [place[answer["t"]] for answer in answers]
    assert found == list(range(found[0], found[0] + len(found)))
    np.testing.assert_allclose([answer["wrench"] for answer in answers], wanted.wrench[found], rtol=1e-5)
    assert (follower.notices[0]["notice"], follower.notices[0]["robot"]) == ("follow", document["source"])


def served(channels: Channels, service: Service, wait: Callable[[LiveServer], Any]) -> Any:
    """Return what is found while a server runs that may not stop before."""

    async def run() -> Any:
        async with LiveServer(service, channels) as server:
            ended = asyncio.Event()
            looking = asyncio.create_task(asyncio.to_thread(wait, server))
            looking.add_done_callback(lambda _: ended.set())
            await server.until(ended)
            return await looking

    return asyncio.run(run())


def test_a_client_follows_over_a_connection_however_silent_and_not_over_udp(tmp_path: Path):
    def look(server: LiveServer) -> tuple[list[dict[str, Any]], dict[str, Any]]:
        with Sender(server.addresses["udp"]) as datagrams:
            datagrams.command("follow")
            while not datagrams.notices:
                assert datagrams.answers(0.5) == []
            with Sender(server.addresses["websocket"]) as follower:
                follower.command("follow")
                return gathered(follower, 700), datagrams.notices[0]

    service = Service(sensor=sensor(RATE), limits=Limits(idle=0.6))
    with RtdeStandIn(PUSHED) as stand_in:
        channels = Channels(websocket=0, udp=0, robot=robot_at(stand_in))
        answers, refused = served(channels, service, look)
    assert len(answers) >= 700  # 1.4 s
    assert refused == {"notice": "follow", "robot": None, "state": None}


def test_a_followers_zero_is_the_robots_and_all_that_follow_are_told(tmp_path: Path):
    """Who sends samples of its own zeroes these."""

    def zeros(sender: Sender) -> list[Any]:
        end = time.monotonic() + 10.0
        while not (found := [one["tau_ext"] for one in sender.notices if one["notice"] == "zero"]):
            assert time.monotonic() < end
            sender.answers(0.5)
        return found

    def look(server: LiveServer) -> tuple[Any, ...]:
        address = server.addresses["pipe"]
        with Sender(address) as own, Sender(address) as asking, Sender(address) as beside:
            own.command("zero")
            assert zeros(own) == [None]
            for sender in (own, asking, beside):
                sender.command("follow")
            before = gathered(asking, 400)[-1]["tau_ext"]
            own.send(0.0, [0.0] * 6, [0.0] * 6)
            own.command("zero")
            still = [answer["tau_ext"] for answer in gathered(beside, 200)]
            asking.command("zero")
            return before, zeros(asking), zeros(beside), still, gathered(asking, 100)[60]["tau_ext"]

    standing = {name: np.repeat(values[:1], len(values), axis=0) for name, values in PUSHED.items()}
    with RtdeStandIn(standing | {"timestamp": PUSHED["timestamp"]}) as stand_in:
        found = served(Channels(pipe=tmp_path / "s", robot=robot_at(stand_in)), Service(sensor=sensor(RATE)), look)
    before, *told, still, after = found
    assert np.abs(before).max() > 2.0
    np.testing.assert_allclose(still[-1], before, rtol=0.05)
    for zero in told:
        (taken_off,) = zero
        np.testing.assert_allclose(taken_off, before, rtol=0.05)
    assert np.abs(after).max() < 0.05 * np.abs(before).max()


def test_the_example_of_the_page_about_live_follows_and_zeroes(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    page = (Path(__file__).parents[2] / "docs" / "live.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    example = next(text for text in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "def follow" in text)
    exec(example, names)  # noqa: S102
    assert "nobody answers" in capsys.readouterr().out

    def look(server: LiveServer) -> None:
        names["follow"](server.addresses["pipe"], 50)

    with RtdeStandIn(PUSHED) as stand_in:
        served(Channels(pipe=tmp_path / "s", robot=robot_at(stand_in)), Service(sensor=sensor(RATE)), look)
    *answers, notices = capsys.readouterr().out.splitlines()
    assert len(answers) >= 50
    assert "'notice': 'follow'" in notices
    assert "'notice': 'zero'" in notices


def test_a_robot_that_stays_away_ends_the_server_with_its_error_and_followers_are_told(tmp_path: Path):
    told: list[str] = []

    def follow(server: LiveServer) -> None:
        with Sender(server.addresses["pipe"]) as sender:
            sender.command("follow")
            while True:
                try:
                    sender.answers(0.5)
                except LiveError:
                    told.extend(states(sender))
                    return

    faults = {100: "disconnect"}
    with RtdeStandIn(PLAYED, faults=faults, absent=60.0) as stand_in:
        channels = Channels(pipe=tmp_path / "s", robot=robot_at(stand_in, patience=0.6))
        with pytest.raises(LiveError, match=r"the robot is gone; expected back within 0\.6 s"):
            served(channels, Service(sensor=sensor(RATE)), follow)
    assert told[-2] == "disconnected"
    assert "the robot is gone" in told[-1]


def test_a_server_whose_robot_is_refused_or_gone_ends_by_itself():
    with (
        RtdeStandIn(PLAYED) as stand_in,
        pytest.raises(SensingError, match=r"ur://.*another rate.*expected 100 Hz.*got 500 Hz"),
    ):
        serve(Service(sensor=sensor(100.0)), Channels(robot=robot_at(stand_in)), started=len)
    with RtdeStandIn(PLAYED) as stand_in:
        channels = Channels(robot=robot_at(stand_in))
    with pytest.raises(LiveError, match="no connection to the robot"):
        serve(Service(sensor=sensor(RATE)), channels, started=len)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--robot", "ur://127.251.251.251"], 1, "no torque constants: a controller tells currents, not torques"),
        (["--robot", "ur://127.251.251.251", "--constants", "10"], 1, "no connection to the robot"),
        (["--robot", "ros://127.0.0.1", "--constants", "10"], 2, "not a robot that can be read"),
        (["--rate", "500", "--constants", "10"], 2, "needs --robot"),
        ([], 2, "needed without --robot"),
    ],
)
def test_what_cannot_be_read_is_refused_before_anything_is_served(estimate: Path, words, code, message):
    left, printed, error = run_tauhat("serve", estimate, "--no-page", *words)
    assert (left, printed) == (code, "")
    assert message in " ".join(error.replace("│", " ").split())


def test_a_robot_without_the_rate_is_refused_by_name_and_no_channel_at_all_is_none(estimate: Path):
    with RtdeStandIn(PLAYED) as stand_in:
        words = ["--robot", f"ur://{stand_in.address}", "--constants", WORDS, "--rate", 300, "--no-page"]
        left, _, error = run_tauhat("serve", estimate, *words)
    assert left == 1
    assert "a rate that the controller does not have" in error
    with pytest.raises(LiveError, match="a pipe or a robot"):
        Channels()
