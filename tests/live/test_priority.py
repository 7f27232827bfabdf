"""Real-time priority: the server's alone, and refused in a line where the system does not grant it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tauhat.cli.app import app
from tauhat.errors import LiveError
from tauhat.live.priority import take_realtime_priority

if not hasattr(os, "SCHED_FIFO"):
    pytest.skip("this system has no real-time priority", allow_module_level=True)


def in_a_thread() -> int | str:
    """Return the scheduler of a thread that has asked for real-time priority, or why it did not get it."""
    found: list[int | str] = []

    def hurry() -> None:
        try:
            take_realtime_priority()
        except LiveError as error:
            found.append(str(error))
        else:
            found.append(os.sched_getscheduler(0))

    thread = threading.Thread(target=hurry)
    thread.start()
    thread.join(10.0)
    return found[0]


def refused(*_: object) -> None:
    raise PermissionError(1, "Operation not permitted")


def test_a_thread_gets_it_or_is_told_why_and_no_other_does():
    found = in_a_thread()
    assert found == os.SCHED_FIFO or "not granted" in str(found)
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_where_it_is_not_granted_the_error_says_what_is_missing(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    with pytest.raises(LiveError, match="not granted; got Operation not permitted; allow it"):
        take_realtime_priority()
    monkeypatch.delattr(os, "sched_setscheduler")
    with pytest.raises(LiveError, match="this operating system"):
        take_realtime_priority()


def test_the_server_has_it_and_its_page_has_not(tmp_path: Path):
    if in_a_thread() != os.SCHED_FIFO:
        pytest.skip("this user may not take real-time priority; the refusal is tested above")
    log, estimate = tmp_path / "log.parquet", tmp_path / "estimate.json"
    made = ("simulate", "two_link", "-o", log, "--seconds", 2, "--rate", 250)
    for words in (made, ("identify", "two_link", log, "-o", estimate)):
        assert CliRunner().invoke(app, [str(word) for word in words]).exit_code == 0
    command = [
        sys.executable,
        "-m",
        "tauhat",
        "serve",
        estimate,
        "--rate",
        "250",
        "--page",
        "0",
        "--realtime",
        "--json",
    ]
    with subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline()]
        while not lines[-1].startswith("}"):
            lines.append(process.stdout.readline())
        assert json.loads("".join(lines))["page"].startswith("http")
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        server, pages = os.sched_getscheduler(process.pid), [os.sched_getscheduler(int(child)) for child in children]
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=30.0)
    assert server == os.SCHED_FIFO
    assert pages
    assert set(pages) == {os.SCHED_OTHER}
