"""What the documents say holds: examples run, maps parse, commands, options and links exist, nothing is left out."""

from __future__ import annotations

import re
import runpy
import shlex
from pathlib import Path

import pytest
import typer

from documents import PAGES, ROOT, SHELLS, blocks, commands, made
from tauhat.cli.app import app
from tauhat.estimation import load_estimate
from tauhat.recordings import load_map

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
COMMANDS = typer.main.get_command(app).commands
BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def shown_commands(page: Path) -> list[list[str]]:
    """Return the words of every `tauhat ...` in shell blocks, run or not, and in inline code that names a command."""
    shown = [command.line for block in blocks(page) if block.language in SHELLS for command in commands(block)]
    inline = re.findall(r"`(tauhat [a-z]+(?: [^`]*)?)`", BLOCK.sub("", page.read_text(encoding="utf-8")))
    lines = [part.strip() for line in (*shown, *inline) for part in line.split("&&")]
    return [shlex.split(line)[1:] for line in lines if line.startswith("tauhat ")]


def test_there_are_examples_and_documents():
    assert len(EXAMPLES) >= 2
    assert len(PAGES) > 15


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_checks_a_number(path, capsys):
    assert "\nassert " in path.read_text(encoding="utf-8")
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out


def test_maps_of_the_examples_are_maps():
    maps = [path for path in (ROOT / "examples" / "real").glob("*.toml") if "[time]" in path.read_text()]
    assert len(maps) >= 8
    for path in maps:
        assert load_map(path).torque is not None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_shown_exist_with_these_options(page):
    for words in shown_commands(page):
        name, *rest = words
        if name.startswith("-"):
            continue
        assert name in COMMANDS, words
        known = {"--help", "-h"} | {option for parameter in COMMANDS[name].params for option in parameter.opts}
        options = {word for word in rest if re.match(r"--?[a-z]", word)}
        assert options <= known, words


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_and_option_is_documented(name):
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert f"## `tauhat {name}" in text
    assert f"tauhat {name}" in (ROOT / "README.md").read_text(encoding="utf-8")
    for parameter in COMMANDS[name].params:
        options = [option for option in parameter.opts if option.startswith("-")]
        assert not options or any(re.search(rf"{option}\b", text) for option in options), parameter.name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_inside_the_project_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), target


def test_every_finding_is_documented():
    source = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    codes = set(re.findall(r'(?:code=|_rows\()"([a-z_-]+)"', source)) | {"position_limit", "velocity_limit"}
    documented = set(re.findall(r"`([a-z_-]+)`", (ROOT / "docs" / "methods" / "checks.md").read_text(encoding="utf-8")))
    assert len(codes) > 25
    assert sorted(codes - documented) == []


def test_every_key_of_an_estimate_file_is_documented(tmp_path):
    made(tmp_path, "simulate", "two_link", "-o", "run.csv", "--seconds", 4, "--rate", 250)
    made(tmp_path, "identify", "two_link", "run.csv", "-o", "estimate.json")
    text = (ROOT / "docs" / "estimate-file.md").read_text(encoding="utf-8")
    data = load_estimate(tmp_path / "estimate.json").to_dict()
    keys = {*data, *data["fit"], *data["processing"], *data["inputs"][0], *data["base"], *data["parameters"][0]}
    keys |= {*data["model"], *data["model"]["robot"], *data["model"]["robot"]["joints"][0]}
    assert sorted(key for key in keys if f"`{key}`" not in text) == []
