"""The documents' fenced blocks: what they are, and running them in the order of their page.

A fence says more in braces after its language, which is not shown: `{not-run reason="..."}` for what no test can run,
`{exit="1"}` where the last command ends with an error. `title="NAME"` names the file that the block is, for later ones.
"""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tauhat.cli.app import app
from tauhat.dynamics import load_model
from tauhat.estimation.constraints_file import load_constraints
from tauhat.excitation import load_limits
from tauhat.excitation.task_design import load_task
from tauhat.project import load_project
from tauhat.recordings import LogSource, load_map, write_columns
from tauhat.recordings.mapfile import expand_columns
from tauhat.robots import Robot, builtin_names, load_robot, robot_from_dh
from tauhat.simulation.controller_file import load_closed_loop
from tauhat.simulation.experiment_file import load_experiment
from tauhat.studies.real_logs import load_cases

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")])
SHELLS = ("bash", "console", "sh")
RUN = (*SHELLS, "json", "python", "toml")
SHOWN = ("text",)  # what is printed or written elsewhere
PROGRAMS = ("cat", "cp", "mkdir", "sed")  # beside `tauhat`
COLUMNS = 90  # of the terminal that the outputs shown were printed on
_FENCE = re.compile(r"^( *)```([^\n]*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_OPTION = re.compile(r"([\w-]+)(?:=\"([^\"]*)\")?")
_SNIPPET = re.compile(r'^--8<-- "(.+)"$', re.MULTILINE)
_NUMBER = re.compile(r"[-+±]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A fenced block of a page.

    snippet : the project's file that it shows, or nothing
    """

    page: Path
    line: int
    language: str
    options: Mapping[str, str]
    text: str
    snippet: str = ""

    @property
    def runs(self) -> bool:
        return self.language in RUN and "not-run" not in self.options

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks(page: Path) -> list[Block]:
    """Return all fenced blocks of a page."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _FENCE.finditer(text):
        indent, info, body = match.groups()
        language, _, rest = info.strip().partition(" ")
        options = dict(_OPTION.findall(rest.strip("{}")))
        snippet = _SNIPPET.search(body)
        found.append(
            Block(
                page=page,
                line=text[: match.start()].count("\n") + 1,
                language=language,
                options=options,
                text=(ROOT / snippet[1]).read_text(encoding="utf-8") if snippet else _outdented(body, len(indent)),
                snippet=snippet[1] if snippet else "",
            )
        )
    return found


def _outdented(body: str, width: int) -> str:
    return "".join(line[width:] for line in body.splitlines(keepends=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A line for the shell and what the page shows below it."""

    line: str
    shown: str = ""


def commands(block: Block) -> list[Command]:
    """Return the commands of a shell block; in `console` they begin with `$`, and the rest is what they print."""
    text = block.text.replace("\\\n", "")
    if block.language != "console":
        return [Command(line=line) for line in text.splitlines() if line.strip() and not line.startswith("#")]
    before, *parts = re.split(r"^\$ ", text, flags=re.MULTILINE)
    assert not before.strip(), f"{block}: a console block begins with its command, after `$ `"
    pairs = (part.partition("\n") for part in parts)
    return [Command(line=line, shown=shown) for line, _, shown in pairs]


@dataclass(frozen=True, slots=True)
class Workbench:
    """Runs blocks in a folder, the Python ones in one namespace."""

    folder: Path
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})

    def run(self, block: Block) -> Iterator[tuple[Command, str]]:
        """Run a block; yield commands and what they printed."""
        title = block.options.get("title")
        if title:
            (self.folder / title).write_text(block.text, encoding="utf-8")
        if block.language == "python":
            yield Command(line=str(block)), self._run_python(block)
        elif block.language == "toml":
            check_toml(block, self.folder)
        elif block.language == "json":
            json.loads(block.text)
        else:
            yield from self._run_commands(block)

    def _run_commands(self, block: Block) -> Iterator[tuple[Command, str]]:
        *before, last = commands(block)
        exit_codes = [0] * len(before) + [int(block.options.get("exit", "0"))]
        for command, expected in zip([*before, last], exit_codes, strict=True):
            code, printed = shell(command.line, self.folder, where=str(block))
            assert code == expected, f"{block}: {command.line}: exit code {code}\n{printed}"
            yield command, printed

    def _run_python(self, block: Block) -> str:
        printed = StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
            patch.chdir(self.folder)
            exec(compile(block.text, str(block), "exec"), self.names)  # noqa: S102
        assert printed.getvalue(), f"{block} prints nothing"
        return printed.getvalue()


def shell(line: str, folder: Path, *, where: str = "") -> tuple[int, str]:
    """Return exit code and output of a line: `tauhat` runs in this process, the few other known programs in bash."""
    printed = ""
    for part in line.split("&&"):
        words = shlex.split(part, comments=True)
        if words[0] == "tauhat":
            assert not {"|", ">", "<", ";"} & set(words), f"{where}: {line}: split it, or mark the block {{not-run}}"
            code, text = tauhat(words[1:], folder)
        else:
            assert words[0] in PROGRAMS, (
                f"{where}: {line}: no test runs {words[0]}; mark the block {{not-run reason=..}}"
            )
            done = subprocess.run(["bash", "-ec", part], cwd=folder, capture_output=True, text=True, check=False)
            code, text = done.returncode, done.stdout + done.stderr
        printed += text
        if code:
            return code, printed
    return 0, printed


def tauhat(words: list[str], folder: Path) -> tuple[int, str]:
    """Return exit code and output of a command, run in a folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        result = CliRunner().invoke(app, words, env={"COLUMNS": str(COLUMNS)})
    return result.exit_code, result.output


def made(folder: Path, *words: object) -> None:
    """Run a command of `tauhat` that has to work."""
    code, printed = tauhat([str(word) for word in words], folder)
    assert code == 0, printed


def check_toml(block: Block, folder: Path) -> None:
    """Read a TOML block with what reads such files."""
    data = tomllib.loads(block.text)
    kinds = [kind for kind, marks in TOML_KINDS.items() if marks(data)]
    assert len(kinds) == 1, f"{block}: read as {kinds or 'nothing'}; tests/documents.py knows {', '.join(TOML_KINDS)}"
    path = folder / "shown.toml"
    path.write_text(block.text, encoding="utf-8")
    TOML_READERS[kinds[0]](path)


TOML_KINDS: Mapping[str, Callable[[dict[str, Any]], bool]] = {
    "robot": lambda data: isinstance(data.get("joints"), list),
    "map": lambda data: "time" in data and "position" in data,
    "model": lambda data: "term" in data,
    "cases": lambda data: "case" in data,
    "constraints": lambda data: "link" in data or "pull" in data,
    "controller": lambda data: "kind" in data and "reference" in data,
    "experiment": lambda data: isinstance(data.get("robot"), str) and "joints" not in data,
    "project": lambda data: isinstance(data.get("robot"), dict),
    "task": lambda data: "region" in data,
    "limits": lambda data: bool({"collision", "tool", "start", "planes", "boxes"} & set(data)),
}
TOML_READERS: Mapping[str, Callable[[Path], object]] = {
    "robot": lambda path: robot_from_dh(path.read_text(encoding="utf-8")),
    "map": load_map,
    "model": lambda path: load_model(path, arm_of(path)),
    "cases": load_cases,
    "constraints": load_constraints,
    "controller": lambda path: read_controller(path),
    "experiment": load_experiment,
    "project": load_project,
    "task": lambda path: load_task(path, load_robot("ur5e")),
    "limits": lambda path: load_limits(path, load_robot("ur5e")),
}


def read_controller(path: Path) -> None:
    """Read a controller of the two-link arm, on a log that has the columns of its reference."""
    t = np.arange(0.0, 1.0, 1e-2)
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    tables = [table for table in data["reference"].values() if isinstance(table, dict)]
    asked = [name for table in tables for name in expand_columns(table["columns"], str(path))]
    log = path.with_name("asked.csv")
    write_columns({"t": t, **{str(name): np.sin(t) for name in (*asked, "q_1", "q_2", "tau_1", "tau_2")}}, log)
    load_closed_loop(path, load_robot("two_link"), [LogSource(path=log)])


def arm_of(model: Path) -> Robot:
    """Return the first built-in robot that has the joints which a model file names."""
    terms = tomllib.loads(model.read_text(encoding="utf-8"))["term"]
    joints = {str(joint) for term in terms for joint in (term.get("joints") or [term.get("joint")]) if joint}
    return next(
        robot for robot in map(load_robot, builtin_names()) if joints <= set(robot.joint_names) and robot.n_v > 5
    )


def difference(shown: str, printed: str, *, tolerance: float = 0.02) -> str:
    """Return where an output differs from the one shown, or nothing. A shown line `...` stands for any lines.

    Numbers agree to the tolerance or to two units of the last digit shown; spaces and where lines break do not count.
    """
    rest = printed.split()
    pieces = [piece.split() for piece in re.split(r"^\.\.\.$", shown, flags=re.MULTILINE)]
    for number, words in enumerate(pieces):
        start = (
            0 if number == 0 else next((k for k in range(len(rest)) if _alike(words[:6], rest[k:], tolerance)), None)
        )
        if start is None:
            return f"not printed: {' '.join(words[:6])}"
        rest = rest[start:]
        for wanted, got in zip_longest(words, rest[: len(words)], fillvalue=""):
            if not _same_word(wanted, got, tolerance):
                return f"{wanted!r} is shown, {got!r} is printed"
        rest = rest[len(words) :]
    return f"also printed: {' '.join(rest[:6])}" if rest and pieces[-1] else ""


def _alike(words: list[str], printed: list[str], tolerance: float) -> bool:
    return len(printed) >= len(words) and all(map(lambda a, b: _same_word(a, b, tolerance), words, printed))


def _same_word(wanted: str, got: str, tolerance: float) -> bool:
    if _NUMBER.sub("0", wanted) != _NUMBER.sub("0", got):
        return False
    pairs = zip(_NUMBER.findall(wanted), _NUMBER.findall(got), strict=True)
    return all(_same_number(a.lstrip("±"), b.lstrip("±"), tolerance) for a, b in pairs)


def _same_number(wanted: str, got: str, tolerance: float) -> bool:
    digits = len(wanted.partition("e")[0].partition(".")[2])
    allowed = max(tolerance * abs(float(wanted)), 2.0 * 10.0**-digits if digits else 0.0)
    return abs(float(wanted) - float(got)) <= allowed


def differences(page: Path, bench: Workbench) -> Iterator[str]:
    """Run a page; yield what is printed otherwise than it shows."""
    last = ""
    for block in blocks(page):
        if block.language == "text":
            yield difference(block.text, last)
        for command, printed in bench.run(block) if block.runs else ():
            last = printed
            if block.language == "console":
                yield difference(command.shown, printed)
