"""The site builds without a warning, needs no network, and shows every public name."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from documents import ROOT

ROOMS = sorted(page.stem for page in (ROOT / "docs" / "api").glob("*.md") if page.stem != "index")
PACKAGES = {path.parent.name for path in (ROOT / "src" / "tauhat").glob("*/__init__.py")}
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
SWITCHES = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
    "--virtual-time-budget=10000", "--dump-dom",
)  # fmt: skip
LOADING = {"script": "src", "img": "src", "iframe": "src", "link": "href"}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the site, built as `make docs` does."""
    pytest.importorskip("mkdocs", reason="the site needs pip install 'tauhat[docs]'")
    folder = tmp_path_factory.mktemp("site") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    assert "WARNING" not in built.stderr
    return folder


class Loaded(HTMLParser):
    """Collects the addresses that a page loads by itself."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.addresses += [value for name, value in attrs if value and name == LOADING.get(tag)]


def test_the_site_has_every_page_and_loads_nothing_from_the_network(site: Path):
    pages = sorted(site.rglob("*.html"))
    sources = list((ROOT / "docs").rglob("*.md"))
    assert {page.relative_to(site).with_suffix("") for page in pages} - {Path("404")} == {
        source.relative_to(ROOT / "docs").with_suffix("") for source in sources
    }
    for page in pages:
        reader = Loaded()
        reader.feed(page.read_text(encoding="utf-8"))
        assert len(reader.addresses) > 4
        assert [address for address in reader.addresses if re.match(r"(https?:)?//", address)] == [], page
    styles = "".join(path.read_text(encoding="utf-8") for path in site.rglob("*.css"))
    assert re.findall(r"(?:url\(|@import )[\"']?https?:", styles) == []


def test_the_api_pages_show_every_public_name_with_its_fields(site: Path):
    assert {"estimation", "dynamics", "robots"} <= set(ROOMS) <= PACKAGES
    for room in ROOMS:
        page = (site / "api" / f"{room}.html").read_text(encoding="utf-8")
        names = importlib.import_module(f"tauhat.{room}").__all__
        assert [name for name in names if f'id="tauhat.{room}.{name}"' not in page] == [], room
        assert re.findall(r"<p>(\w+(?:, \w+)* : .*)", page) == [], f"{room}: fields that are not in a table"


def test_a_function_that_has_the_name_of_its_module_is_shown_as_a_function(site: Path):
    page = (site / "api" / "estimation.html").read_text(encoding="utf-8")
    shown = page[page.index('id="tauhat.estimation.identify"') :]
    assert "Return the model's base parameters identified from recordings" in shown[:6000]


def test_a_bar_in_the_code_of_a_table_is_a_bar(site: Path):
    page = (site / "methods" / "friction.html").read_text(encoding="utf-8")
    assert "<code>Fr |dq|^(1/3) sgn(dq)</code>" in page
    assert r"\|" not in page


def test_the_search_works_in_a_page_opened_from_disk(site: Path, tmp_path: Path):
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        pytest.skip("no Chromium on this machine: the search was not tried in a browser")
    address = f"{(site / 'index.html').as_uri()}?q=stribeck"
    command = [browser, *SWITCHES, f"--user-data-dir={tmp_path / 'profile'}", address]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    assert re.search(r"\d+ matching documents", dom)
    assert re.search(r'methods/friction\.html\?h=stribeck" class="md-search-result__link"', dom)
