"""`tauhat serve`: one command from an estimate to answers; it ends cleanly when it is told to."""

from __future__ import annotations

import json
import runpy
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_server import TOKEN, running
from typer.testing import CliRunner, Result

from tauhat.cli.app import app
from tauhat.cli.commands.serve import _called
from tauhat.estimation import load_estimate
from tauhat.live import Sender, Service
from tauhat.recordings import read_recording, write_columns
from tauhat.sensing import force_sensor

RATE = 250
ROOT = Path(__file__).parents[2]


def run_tauhat(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "80"})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a log of a two-link arm, and its estimate."""
    found = tmp_path_factory.mktemp("serve")
    assert (
        run_tauhat("simulate", "two_link", "-o", found / "log.parquet", "--seconds", 4, "--rate", RATE).exit_code == 0
    )
    assert run_tauhat("identify", "two_link", found / "log.parquet", "-o", found / "estimate.json").exit_code == 0
    return found


def test_samples_are_answered_until_sigterm_and_nothing_is_left_behind(folder: Path):
    words = ["serve", folder / "estimate.json", "--rate", RATE, "--websocket", 0, "--pipe", folder / "s", "--no-page"]
    command = [sys.executable, "-m", "tauhat", *map(str, words), "--json"]
    log = read_recording(folder / "log.parquet").rows(0, 200)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline()]
        while not lines[-1].startswith("}"):
            lines.append(process.stdout.readline())
        document: dict[str, Any] = json.loads("".join(lines))
        for channel in ("websocket", "pipe"):
            with Sender(document[channel]) as sender:
                answers = list(sender.replay(log, speed=np.inf))
                assert len(answers) == 200
                assert answers[-1]["contact"] in {True, False}
        with Sender(document["websocket"]) as staying:
            staying.command("counts")
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=10.0)
    assert process.returncode == 0
    assert errors == "done: 3 clients, 400 taken\n"
    assert not (folder / "s").exists()
    assert document["robot"] == "two_link"


@pytest.mark.parametrize(
    ("name", "count", "words"),
    [
        ("clients", 1, "client"),
        ("clients", 2, "clients"),
        ("restarts", 1, "restart"),
        ("turned_away", 1, "turned away"),
        ("unknown_datagrams", 1, "unknown datagram"),
    ],
)
def test_one_is_told_in_the_singular(name: str, count: int, words: str):
    assert _called(name, count) == words


def test_a_client_that_leaves_without_reading_ends_nothing(folder: Path):
    """Its answers are written to a socket that nobody reads: a reader of standard output that leaves ends a program."""
    words = ["serve", folder / "estimate.json", "--rate", RATE, "--pipe", folder / "left", "--no-page", "--json"]
    sample = json.dumps({"t": 0.0, "q": [0.0, 0.0], "tau": [0.0, 0.0]}).encode() + b"\n"
    command = [sys.executable, "-m", "tauhat", *map(str, words)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        while process.stdout.readline() != "}\n":
            assert process.poll() is None
        for _ in range(4):  # of the eight who may be there at a time
            with socket.socket(socket.AF_UNIX) as leaving:
                leaving.connect(str(folder / "left"))
                leaving.sendall(50 * sample)
        with Sender(f"unix:{folder / 'left'}") as staying:
            answers = list(staying.replay(read_recording(folder / "log.parquet").rows(0, 50), speed=np.inf))
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=10.0)
    assert len(answers) == 50
    assert process.returncode == 0


def test_the_example_replays_a_log(folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    log = read_recording(folder / "log.parquet")
    columns = {"clock": log.t} | {f"{name}{j}": getattr(log, name)[:, j] for name in ("q", "tau") for j in (0, 1)}
    write_columns(columns, folder / "other.csv")
    (folder / "names.toml").write_text(
        '[time]\ncolumn = "clock"\n[position]\ncolumns = "q{0..1}"\n[torque]\ncolumns = "tau{0..1}"\n'
    )
    service = Service(sensor=force_sensor(load_estimate(folder / "estimate.json"), rate=RATE))
    with running(folder, service=service) as served:
        for name, *more in (["log.parquet"], ["other.csv", "--map", str(folder / "names.toml")]):
            words = [served.addresses["udp"], str(folder / name), "--speed", "inf", *more]
            monkeypatch.setattr(sys, "argv", ["replay.py", *words])
            runpy.run_path(str(ROOT / "examples" / "live" / "replay.py"), run_name="__main__")
    log_line, other_line = capsys.readouterr().out.splitlines()
    assert log_line.startswith(f"{log.n_t} of {log.n_t} samples answered, largest force ")
    assert other_line == log_line


def test_other_machines_are_not_let_in_without_a_token(folder: Path):
    words = ("serve", folder / "estimate.json", "--rate", RATE, "--no-page")
    refused = run_tauhat(*words, "--host", "0.0.0.0")  # noqa: S104
    assert refused.exit_code == 1
    assert refused.stderr.startswith("error: host 0.0.0.0: other machines could connect, and there is no token")
    secret = folder / "token"
    secret.write_text(TOKEN)
    secret.chmod(0o644)
    assert "others may read the token" in run_tauhat(*words, "--token-file", secret).stderr


def test_more_samples_a_second_than_a_client_may_send_are_refused(folder: Path):
    refused = run_tauhat("serve", folder / "estimate.json", "--rate", "1e9", "--no-page")
    assert refused.exit_code == 2
    assert "4000 samples a second, not 1e+09" in " ".join(refused.stderr.replace("│", " ").split())


def test_what_cannot_be_served_is_an_error_in_a_line(folder: Path):
    absent = run_tauhat("serve", folder / "absent.json", "--rate", RATE, "--no-page")
    assert (absent.exit_code, absent.stderr.count("\n")) == (1, 1)
    (folder / "notes.txt").write_text("mine")
    taken = run_tauhat("serve", folder / "estimate.json", "--rate", RATE, "--no-page", "--pipe", folder / "notes.txt")
    assert (taken.exit_code, taken.stderr.count("\n")) == (1, 1)
    assert "no socket is not replaced" in taken.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--zero", "air:log.parquet"), "nobody says when"),
        (("--map", "map.toml"), "needs --robot or --free"),
        (("--alarms", "2"), "needs --free"),
        (("--constants", "10"), "needs --robot"),
        (("--page", "0"), "no port of it"),
    ],
)
def test_options_that_nothing_would_heed_are_refused(folder: Path, words: tuple[str, ...], message: str):
    refused = run_tauhat("serve", folder / "estimate.json", "--rate", RATE, "--no-page", *words)
    assert refused.exit_code == 2
    assert message in " ".join(refused.stderr.replace("│", " ").split())


def test_a_standing_zero_is_off_what_clients_are_told(folder: Path):
    log = read_recording(folder / "log.parquet").rows(0, 500)
    held = replace(log, q=np.repeat(log.q[:1], 500, axis=0), dq=None, tau=np.repeat(log.tau[:1] + 3.0, 500, axis=0))
    words = ["serve", folder / "estimate.json", "--rate", RATE, "--pipe", folder / "zero", "--no-page", "--json"]
    command = [sys.executable, "-m", "tauhat", *map(str, words), "--zero", "standing:0.3"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        while process.stdout.readline() != "}\n":
            assert process.poll() is None
        with Sender(f"unix:{folder / 'zero'}") as sender:
            answers = list(sender.replay(held, speed=np.inf))
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=10.0)
    assert min(map(abs, answers[40]["tau_ext"])) > 1.0
    assert max(map(abs, answers[-1]["tau_ext"])) < 0.05
