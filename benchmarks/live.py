"""Latency of `tauhat serve` on loopback: samples of seven joints at 1 kHz over each channel, page shown or not.

    python benchmarks/live.py [--seconds N] [--page] [--browser] [--quick] [--json]

The server runs in a process of its own, a Panda with contact detection, as `tauhat serve` sets it up. The client sends
one sample a millisecond and takes the time from before it is sent until its answer has been read. Aim: 99.9 % within
5 ms. On a machine that does other work both processes wait for their turn; `own` is how late the client itself was with
a sample at that quantile, which no server can undercut. `--page`: the page's process runs and is fed; `--browser`: it is
also open in a headless Chromium, which draws it on the same cores. `--realtime` (needs the right to) shows what is left
when other programs are not waited for.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from sensing import arm, motion
from tauhat.live import Channels, Feed, Limits, Service, serve
from tauhat.live.connection import Connection, connect
from tauhat.live.priority import take_realtime_priority
from tauhat.sensing import ForceSensor, assumed_contact_thresholds

RATE, N_V = 1000.0, 7
QUANTILES = (0.5, 0.99, 0.999, 1.0)
CHANNELS = ("websocket", "udp", "pipe")
BROWSER = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--remote-debugging-port=0",
)  # fmt: skip


def serve_here(folder: Path, *, with_page: bool, limits: Limits, realtime: bool = False) -> None:
    """Be the server, until a signal comes."""
    page = None
    sensor = ForceSensor(model=arm("panda"), rate=RATE)
    if with_page:
        from tauhat.live.page_process import start_page

        page = start_page(sensor.model.robot, frame=str(sensor.solver.frame), port=0)
    if realtime:
        take_realtime_priority()
    thresholds = assumed_contact_thresholds(sensor)
    service = Service(sensor=sensor, thresholds=thresholds, feed=Feed(page), limits=limits)
    channels = Channels(websocket=0, udp=0, pipe=folder / "samples")
    urls = {} if page is None else {"page": page.url}
    serve(service, channels, started=lambda addresses: print(json.dumps({**addresses, **urls}), flush=True))


@contextmanager
def server(*options: str, script: str = __file__) -> Iterator[tuple[dict[str, str], subprocess.Popen[str]]]:
    """Run a server in a process of its own; yield its addresses and the process."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, script, "--serve", folder, *options]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            try:
                yield json.loads(process.stdout.readline()), process
            finally:
                process.terminate()
                process.wait(timeout=20.0)


@contextmanager
def browser(url: str) -> Iterator[None]:
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        sys.exit("no Chromium here: leave out --browser")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [found, *BROWSER, f"--user-data-dir={profile}", "--window-size=1300,900", url]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(8.0)
        try:
            yield
        finally:
            process.terminate()
            process.wait(timeout=10.0)


def samples(n_t: int) -> list[str]:
    q, tau = motion(n_t, N_V)
    return [json.dumps({"t": k / RATE, "q": q[k].tolist(), "tau": tau[k].tolist()}) for k in range(n_t)]


def place(text: str) -> int:
    """Return which sample an answer answers, -1 for a notice."""
    return round(float(text[6 : text.index(",")]) * RATE) if text.startswith('{"t": ') else -1


def measured(connection: Connection, texts: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the latency of every answer [s], and how late every sample was sent [s]."""
    n_t = len(texts)
    sent, heard = np.full(n_t, np.nan), np.full(n_t, np.nan)
    start = time.perf_counter() + 0.01
    due, k, last = start, 0, 0.0
    while np.isnan(heard[-1]) and time.perf_counter() - last < 3.0 + due:
        now = time.perf_counter()
        if k < n_t and now >= due:
            sent[k] = now
            connection.send(texts[k])
            k, due = k + 1, start + (k + 1) / RATE
            continue
        found = connection.exchange(due - now if k < n_t else 0.5)
        now = time.perf_counter()
        for text in found:
            if (which := place(text)) >= 0:
                heard[which] = now
    return heard - sent, sent - (start + np.arange(n_t) / RATE)


def report(addresses: dict[str, str], seconds: float) -> dict[str, Any]:
    texts, found = samples(int(seconds * RATE)), {}
    gc.collect()
    gc.freeze()
    gc.disable()
    for channel in CHANNELS:
        connection = connect(addresses[channel])
        measured(connection, [text.replace('"t": ', '"t": -1000', 1) for text in texts[:1]])  # greeting, first use
        connection.close()
        connection = connect(addresses[channel])
        latency, late = measured(connection, texts)
        connection.close()
        answered = np.isfinite(latency)
        found[channel] = {
            "samples": len(texts), "answered": int(answered.sum()),
            "latency_us": (1e6 * np.quantile(latency[answered], QUANTILES)).round(1).tolist(),
            "own_us": (1e6 * np.quantile(late, QUANTILES)).round(1).tolist(),
            "within_5_ms": float((latency[answered] <= 5e-3).mean()),
        }  # fmt: skip
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="over each channel")
    parser.add_argument("--page", action="store_true", help="with the page's process")
    parser.add_argument("--browser", action="store_true", help="with the page open in Chromium")
    parser.add_argument("--realtime", action="store_true", help="server and client at real-time priority, the page not")
    parser.add_argument("--quick", action="store_true", help="10 s over each channel")
    parser.add_argument("--json", action="store_true", help="one JSON document")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve is not None:
        serve_here(options.serve, with_page=options.page, limits=Limits(), realtime=options.realtime)
        return
    seconds = 10.0 if options.quick else options.seconds
    shown = options.page or options.browser
    flags = [name for name, wanted in (("--page", shown), ("--realtime", options.realtime)) if wanted]
    with server(*flags) as (addresses, process), browser(addresses["page"]) if options.browser else nullcontext():
        if options.realtime:
            take_realtime_priority()
        found = report(addresses, seconds)
        ticks = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    result = {
        "seconds": seconds, "page": shown, "browser": options.browser, "realtime": options.realtime,
        "channels": found, "server_processor_s": sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK"),
    }  # fmt: skip
    if options.json:
        print(json.dumps(result, indent=1))
        return
    print(
        f"{'1 kHz, 7 joints':12} {'answered':>16} {'median us':>10} {'99 %':>8} {'99.9 %':>8} {'largest':>9}   own 99.9 %"
    )
    for channel, row in found.items():
        numbers = " ".join(f"{value:{width}.0f}" for value, width in zip(row["latency_us"], (10, 8, 8, 9), strict=True))
        print(f"{channel:15} {row['answered']:>7}/{row['samples']:<7} {numbers} {row['own_us'][2]:12.0f}")


if __name__ == "__main__":
    main()
