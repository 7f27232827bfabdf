"""The report in a real browser: drawings appear, names stay text, nothing offers to upload a log."""

from __future__ import annotations

import re
import shutil
import subprocess
from html import unescape

import pytest
from hostile_names import HOSTILE_JOINT

from tauhat.estimation import Estimate
from tauhat.report import write_report
from tauhat.verification import Verification

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
SWITCHES = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
    "--virtual-time-budget=20000", "--dump-dom",
)  # fmt: skip


@pytest.fixture(scope="module")
def dom(tmp_path_factory: pytest.TempPathFactory, verified: tuple[Estimate, Verification]) -> str:
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        pytest.skip("no Chromium on this machine: the drawings were not looked at in a browser")
    folder = tmp_path_factory.mktemp("browser")
    estimate, verification = verified
    path = write_report(folder / "report.html", estimate, verification=verification)
    command = [browser, *SWITCHES, f"--user-data-dir={folder / 'profile'}", path.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


def visible(dom: str) -> str:
    """Return the document up to the drawings' data."""
    return dom.partition('<script type="application/json"')[0]


def drawings(dom: str) -> dict[str, str]:
    """Return for every place of a drawing the document from there to the next."""
    pieces = re.split(r'data-source="data-([a-z0-9-]+)"', visible(dom))
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


def test_open_drawings_are_rendered_and_folded_ones_wait(dom: str) -> None:
    rendered = {key for key, html in drawings(dom).items() if "main-svg" in html}
    assert rendered == {"torque-0-0", "torque-0-1", "time-0", "speed-0-0", "speed-0-1", "parameters"}


def test_lines_are_drawn_in_every_torque_drawing(dom: str) -> None:
    for joint in (0, 1):
        lines = re.findall(r'class="js-line"[^>]* d="M[^"]{200,}"', drawings(dom)[f"torque-0-{joint}"])
        assert len(lines) == 3


def test_a_hostile_name_is_drawn_as_text(dom: str) -> None:
    legends = re.findall(r'data-unformatted="([^"]*)"', drawings(dom)["time-0"])
    assert HOSTILE_JOINT in {unescape(unescape(text)) for text in legends}
    assert "alert(1)</script>" not in visible(dom)


def test_no_button_offers_to_upload_a_log(dom: str) -> None:
    buttons = set(re.findall(r'data-title="([^"]*)"', dom))
    assert "Download plot as a PNG" in buttons
    assert not [title for title in buttons if "hare" in title or "loud" in title]
