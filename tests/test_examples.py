"""What the documents show works: examples and Python blocks run, maps parse, commands and links exist."""

from __future__ import annotations

import re
import runpy
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from tauhat.cli.app import app
from tauhat.dynamics import load_model
from tauhat.errors import ExcitationError
from tauhat.estimation import load_estimate
from tauhat.estimation.constraints_file import load_constraints
from tauhat.excitation.limits.limits_file import parse_limits
from tauhat.recordings import load_map, parse_map
from tauhat.robots import load_robot, robot_from_dh

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")])
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
COMMANDS = typer.main.get_command(app).commands
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[str]:
    return [text for found, text in BLOCK.findall(page.read_text(encoding="utf-8")) if found == language]


def pages_with(language: str) -> list[Path]:
    return [page for page in PAGES if blocks(page, language)]


def shown_commands(page: Path) -> list[list[str]]:
    """Return the words of every `tauhat ...` in shell blocks and in inline code that names a command."""
    text = page.read_text(encoding="utf-8")
    shell = [part for block in blocks(page, "bash") for line in block.splitlines() for part in line.split("&&")]
    inline = re.findall(r"`(tauhat [a-z]+(?: [^`]*)?)`", BLOCK.sub("", text))
    lines = [*(part.strip() for part in shell), *inline]
    return [shlex.split(line)[1:] for line in lines if line.startswith("tauhat ")]


def made(*words: object) -> None:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.stderr


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with what the documents' Python blocks read."""
    folder = tmp_path_factory.mktemp("documents")
    (folder / "tauhat-demo").mkdir()
    for seed, name in enumerate(("identification", "verification")):
        log = folder / "tauhat-demo" / f"{name}.parquet"
        made("simulate", "ur5e", "-o", log, "--seconds", 6, "--rate", 250, "--spread", 0, "--seed", seed)
    log = folder / "run.csv"
    made("simulate", "two_link", "-o", log, "--seconds", 4, "--rate", 250)
    made("identify", "two_link", log, "-o", folder / "estimate.json")
    return folder


def test_there_are_examples_and_documents():
    assert len(EXAMPLES) >= 2
    assert len(PAGES) > 15


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_checks_a_number(path, capsys):
    assert "\nassert " in path.read_text(encoding="utf-8")
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out


@pytest.mark.parametrize("page", pages_with("python"), ids=lambda page: page.stem)
def test_python_blocks_of_documents_run(page, workshop, monkeypatch, capsys):
    monkeypatch.chdir(workshop)
    for block in blocks(page, "python"):
        exec(compile(block, str(page), "exec"), {"__name__": "__main__"})  # noqa: S102
        assert capsys.readouterr().out


def test_the_readmes_model_predicts_unseen_motion_and_its_file_loads(workshop, monkeypatch):
    monkeypatch.chdir(workshop)
    (block,) = blocks(ROOT / "README.md", "python")
    names: dict[str, object] = {}
    exec(compile(block, "README.md", "exec"), names)  # noqa: S102
    assert names["unseen"].relative_rms < 0.05
    assert load_estimate("tauhat-demo/ur5e.json").values.tolist() == names["estimate"].values.tolist()


def test_the_base_parameters_shown_are_those_printed(capsys):
    (block,) = blocks(ROOT / "docs" / "methods" / "base-parameters.md", "python")
    exec(compile(block, "base-parameters.md", "exec"), {})  # noqa: S102
    assert capsys.readouterr().out.strip() == block.rpartition("  # ")[2].strip()


@pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")  # capsules of the limits page lie on other links
@pytest.mark.parametrize("page", pages_with("toml"), ids=lambda page: page.stem)
def test_maps_and_tables_shown_are_such(page, tmp_path):
    shown = tmp_path / "shown.toml"
    for block in blocks(page, "toml"):
        shown.write_text(block)
        if "[[term]]" in block:
            assert len(load_model(shown, load_robot("ur5e")).parameters) > 100
            continue
        if "[[link]]" in block:
            assert load_constraints(shown).links[0].joint == "elbow_joint"
            continue
        if "[[joints]]" in block:
            assert robot_from_dh(block).joint_names == ("shoulder", "elbow")
            continue
        if "[collision]" in block:
            with pytest.raises(ExcitationError, match=r"fixture\.stl"):  # the one thing that the page does not have
                parse_limits(block, load_robot("ur5e"))
            whole = block[: block.index("[[meshes]]")]
            kept = parse_limits(whole, load_robot("ur5e"))
            assert len(kept.others) >= 4
            assert kept.home is not None
            continue
        log_map = parse_map(block)
        assert len(log_map.position.columns) == len(log_map.torque.columns) == 6


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


def test_every_key_of_an_estimate_file_is_documented(workshop):
    text = (ROOT / "docs" / "estimate-file.md").read_text(encoding="utf-8")
    data = load_estimate(workshop / "estimate.json").to_dict()
    keys = {*data, *data["fit"], *data["processing"], *data["inputs"][0], *data["base"], *data["parameters"][0]}
    keys |= {*data["model"], *data["model"]["robot"], *data["model"]["robot"]["joints"][0]}
    assert sorted(key for key in keys if f"`{key}`" not in text) == []
