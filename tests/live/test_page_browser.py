"""The live page in a browser: forces are seen to change, Zero arrives, a page that hangs or dies holds up nothing."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from devtools import Tab, browsing, find_browser

from tauhat.errors import LiveError
from tauhat.live import page_process
from tauhat.live.access import Access
from tauhat.live.feed import Snapshot
from tauhat.live.page_process import PageProcess, _deaf_to_interrupts, start_page
from tauhat.robots import load_robot
from tauhat.sensing.touch import Touch

pytest.importorskip("viser", reason="viser is not installed: there is no page")

TOKEN = "a-secret-of-24-letters-00"  # noqa: S105
Z_FORCE = "[...document.querySelectorAll('tr')].find(row => row.innerText.startsWith('z'))?.cells[1].innerText"
SETTLED = 0.02  # [s] between snapshots of the tests


def snapshot(
    t: float, *, force: float, contacts: tuple[Touch, ...] = (), spread: float = 1.0, stream: str = "arm"
) -> Snapshot:
    covariance = np.diag([1.0, 1.0, spread**2, 0.1, 0.1, 0.1])
    return Snapshot(
        stream=stream, t=t, q=np.array([0.3, 0.4, 0.0, -1.9, 0.0, 2.2, 0.5]), tau=np.arange(7.0), tau_std=np.ones(7),
        wrench=np.array([0.0, 0.0, force, 0.0, 0.0, 0.0]), covariance=covariance, contacts=contacts,
        counts={"taken": 1234, "late": 1},
    )  # fmt: skip


@pytest.fixture(scope="module")
def page() -> Iterator[PageProcess]:
    with closing(start_page(load_robot("panda"), port=0, access=Access(token=TOKEN))) as page:
        yield page


@pytest.fixture(scope="module")
def tab(page: PageProcess, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    browser = find_browser()
    if browser is None:
        pytest.skip("no Chromium on this machine: the live page was not looked at in a browser")
    with browsing(browser, tmp_path_factory.mktemp("browser") / "profile", size=(600, 500)) as tab:
        tab.command("Page.navigate", url=page.url)
        tab.until("document.body?.innerText.includes('waiting for the first sample')", seconds=30.0)
        yield tab


def shown(page: PageProcess, tab: Tab, script: str, *snapshots: Snapshot) -> str:
    """Show snapshots, the last again and again with time going on, until the page says what it should."""
    *first, last = snapshots
    for one in first:
        while not page.send(one):
            time.sleep(SETTLED)
    begin = time.monotonic()
    while time.monotonic() < begin + 30.0:
        page.send(last._replace(t=last.t + time.monotonic() - begin))
        if value := tab.evaluate(script):
            return str(value)
        time.sleep(SETTLED)
    raise AssertionError(f"never seen: {script}; the page says {tab.evaluate('document.body.innerText')!r}")


def test_the_token_leaves_the_address_and_scripts_do_not_see_the_cookie(tab):
    assert TOKEN not in tab.evaluate("location.href")
    assert tab.evaluate("document.cookie") == ""


def test_the_browser_sees_the_force_move(page, tab):
    seen = [
        shown(page, tab, f"(text => text?.startsWith('{start}') && text)({Z_FORCE})", snapshot(t, force=force))
        for t, force, start in ((1.0, 12.0, "+12.0"), (60.0, -34.5, "−34.5"))
    ]
    assert seen == ["+12.0 ± 2.0", "−34.5 ± 2.0"]
    assert "taken" in tab.evaluate("document.body.innerText")


def test_pressing_zero_arrives_in_the_server(page, tab):
    shown(page, tab, Z_FORCE, snapshot(120.0, force=5.0))
    page.commands()
    tab.press("Zero")
    until = time.monotonic() + 10.0
    asked: list[str] = []
    while not asked and time.monotonic() < until:
        asked = page.commands()
        time.sleep(SETTLED)
    assert asked == ["zero"]
    shown(page, tab, "document.body.innerText.includes('Zero was asked for')", snapshot(130.0, force=5.0))


def test_contacts_and_doubts_are_said(page, tab):
    touch = Touch(1, "<img src=x onerror=alert(1)>link6", 199.0, 200.0, 42.0, open=True)
    touched = snapshot(200.0, force=42.0, contacts=(touch,))
    script = "document.body.innerText.includes('onerror=alert(1)>link6') && document.body.innerText.includes('42.0')"
    shown(page, tab, script, touched)
    assert tab.evaluate("document.querySelectorAll('img[src=x]').length") == 0
    shown(
        page,
        tab,
        "document.body.innerText.includes('ended') && !document.body.innerText.includes('goes on')",
        snapshot(240.0, force=0.0, contacts=(touch._replace(open=False),)),
    )
    shown(
        page,
        tab,
        "document.body.innerText.includes('error bar too wide: ± 588 N along z')",
        snapshot(260.0, force=0.0, spread=300.0),
    )


def test_a_stream_that_ends_is_called_silent(page, tab):
    shown(page, tab, "document.querySelector('[data-state=live]') !== null", snapshot(300.0, force=1.0))
    assert "silent for" in tab.until("document.querySelector('[data-state=silent]')?.innerText")


def test_a_client_that_leaves_ends_its_stream_and_its_contact(page, tab):
    touch = Touch(2, "link5", 320.0, 320.0, 9.0, open=True)
    shown(page, tab, "document.body.innerText.includes('goes on')", snapshot(320.0, force=9.0, contacts=(touch,)))
    page.end("nobody")
    page.end("arm", (touch._replace(peak=77.7), touch._replace(number=3, link="link3")))
    assert "the stream has ended" in tab.until("document.querySelector('[data-state=ended]')?.innerText")
    tab.until("!document.body.innerText.includes('goes on')")
    tab.until("document.body.innerText.includes('77.7') && document.body.innerText.includes('link3')")
    shown(page, tab, "document.querySelector('[data-state=live]') !== null", snapshot(1.0, force=1.0, stream="again"))


def test_the_page_loads_nothing_that_its_headers_forbid(tab):
    assert [text for text in tab.complaints if "Content Security Policy" in text] == []


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="processes cannot be stopped here")
def test_a_page_that_hangs_holds_up_nobody(page):
    inner = page._process.pid
    os.kill(inner, signal.SIGSTOP)
    try:
        longest, taken = 0.0, 0
        for k in range(3000):
            begin = time.perf_counter()
            taken += page.send(snapshot(400.0 + k, force=1.0))
            longest = max(longest, time.perf_counter() - begin)
            time.sleep(1e-4)
    finally:
        os.kill(inner, signal.SIGCONT)
    assert taken <= 2  # what is under way fits the pipe
    assert longest < 0.5  # a pipe that is full would wait for as long as the page hangs


def test_snapshots_are_shown_thirty_times_a_second_at_most(page):
    until, taken = time.monotonic() + 1.0, 0
    while time.monotonic() < until:
        taken += page.send(snapshot(500.0, force=1.0))
    assert 1 <= taken <= 34


def test_a_page_that_died_is_no_error(tmp_path):
    with closing(start_page(load_robot("panda"), port=0)) as page:
        page._process.kill()
        page._process.join(timeout=10.0)
        assert not page.is_alive
        assert not page.send(snapshot(1.0, force=1.0))
        page.end("arm")
        assert page.commands() == []


def test_a_page_that_only_says_that_it_takes_what_it_is_shown_keeps_nobody_waiting(monkeypatch):
    seconds = itertools.count()
    monkeypatch.setattr(page_process, "time", SimpleNamespace(monotonic=lambda: float(next(seconds))))
    ours, theirs = multiprocessing.Pipe()
    page = PageProcess(SimpleNamespace(is_alive=lambda: True), ours, "")
    taken = []

    def show() -> None:
        for number in range(3000):
            theirs.send_bytes(b"taken")
            taken.append(page.send(snapshot(float(number), force=1.0)))

    shows = threading.Thread(target=show, daemon=True)
    shows.start()
    shows.join(timeout=20.0)
    assert not shows.is_alive()
    assert taken[:10] == [True] * 10
    assert not any(taken[-1000:])
    assert page.dropped == taken.count(False)
    ours.close()
    theirs.close()


def test_a_port_that_is_taken_is_said_in_one_line(page):
    port = int(page.url.split(":")[2].partition("/")[0])
    with pytest.raises(
        LiveError, match=rf"^page: 127.0.0.1, port {port}: .* cannot be used; got Address already in use; "
    ):
        start_page(load_robot("panda"), port=port)


PARENT = """
import time
from tauhat.live.page_process import start_page
from tauhat.robots import load_robot
from tauhat.sensing.touch import Touch
if __name__ == "__main__":
    page = start_page(load_robot("two_link"), port=0)
    print(page._process.pid, flush=True)
    time.sleep(60)
"""


def test_the_page_dies_with_its_server(tmp_path):
    script = tmp_path / "server.py"
    script.write_text(PARENT)
    server = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    inner = int(server.stdout.readline())
    server.kill()
    server.wait(timeout=10.0)
    server.stdout.close()
    until = time.monotonic() + 10.0
    while _runs(inner) and time.monotonic() < until:
        time.sleep(0.05)
    assert not _runs(inner)


QUIET = """
from tauhat.live.page_process import start_page
from tauhat.robots import load_robot
from tauhat.sensing.touch import Touch
if __name__ == "__main__":
    page = start_page(load_robot("two_link"), port=0)
    print("said", flush=True)
"""


def test_the_page_says_nothing_on_the_servers_output_and_leaves_nothing_behind(tmp_path, monkeypatch):
    (tmp_path / "own").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "own"))
    script = tmp_path / "server.py"
    script.write_text(QUIET)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60.0, check=True)
    assert (done.stdout, done.stderr) == ("said\n", "")
    assert [place.name for place in (tmp_path / "own").iterdir() if place.name.startswith("tauhat-")] == []


def test_ctrl_c_is_the_servers_from_the_pages_first_moment():
    """While it still loads its libraries, an interrupt would end it with twenty lines about them."""
    told = [sys.executable, "-c", "import signal; print(signal.getsignal(signal.SIGINT).name)"]
    before = signal.getsignal(signal.SIGINT)
    with _deaf_to_interrupts():
        process = subprocess.Popen(told, stdout=subprocess.PIPE, text=True)
    assert signal.getsignal(signal.SIGINT) is before
    assert process.communicate(timeout=20.0)[0] == "SIG_IGN\n"


def _runs(process: int) -> bool:
    """Whether a process runs; one that ended and is not yet reaped does not."""
    try:
        told = Path(f"/proc/{process}/stat").read_text(encoding="ascii")
    except FileNotFoundError:
        return False
    return told.rpartition(")")[2].split()[0] not in "ZX"
