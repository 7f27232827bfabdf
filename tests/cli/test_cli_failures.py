"""Bad input: one line on standard error, exit status 1, nothing written. Usage errors: exit status 2."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_workshop import Tauhat, Workshop
from typer.testing import Result

from tauhat.cli.reporting import one_line_reports
from tauhat.errors import TauhatWarning

ENTITY_BOMB = """<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<robot name="&b;"><link name="l"/></robot>"""


def refused(result: Result) -> str:
    assert result.exit_code == 1, result.stdout + result.stderr
    assert result.stdout == ""
    lines = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("error: ")
    return lines[0]


def rows_of(workshop: Workshop) -> list[str]:
    return workshop.text_log.read_text().splitlines()


def with_cell(rows: list[str], row: int, column: int, cell: str) -> list[str]:
    cells = rows[row].split(",")
    cells[column] = cell
    return [*rows[:row], ",".join(cells), *rows[row + 1 :]]


BROKEN = {
    "empty": lambda _: [],
    "header only": lambda rows: rows[:1],
    "one row": lambda rows: rows[:2],
    "nan": lambda rows: with_cell(rows, 50, 1, "nan"),
    "time going back": lambda rows: with_cell(rows, 50, 0, "0.0"),
    "text in numbers": lambda rows: with_cell(rows, 50, 2, "oops"),
    "row cut short": lambda rows: [*rows[:50], rows[50].split(",")[0], *rows[51:]],
    "1e154": lambda rows: with_cell(rows, 50, 3, "1e154"),
    "three joints": lambda _: [
        "t,q_1,q_2,q_3,tau_1,tau_2,tau_3",
        *(f"{k / 100},0,{k},1,0,{k},2" for k in range(99)),
    ],
    "one joint": lambda _: ["t,q_1,tau_1", *(f"{k / 100},{k},{k}" for k in range(99))],
}


@pytest.mark.parametrize("broken", BROKEN.values(), ids=BROKEN.keys())
def test_a_broken_log_is_refused_in_one_line_and_nothing_is_written(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path, broken
) -> None:
    log, path = tmp_path / "broken.csv", tmp_path / "e.json"
    log.write_text("\n".join(broken(rows_of(workshop))))
    assert "broken" in refused(tauhat("identify", "two_link", log, "-o", path, "--json"))
    assert "broken" in refused(tauhat("verify", workshop.estimate, log, "--json"))
    assert "broken" in refused(tauhat("report", workshop.estimate, log, "-o", tmp_path / "r.html"))
    assert [file.name for file in tmp_path.iterdir()] == ["broken.csv"]


def test_check_lists_what_is_wrong_and_exits_with_one(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("\n".join(with_cell(rows_of(workshop), 50, 1, "nan")))
    result = tauhat("check", log, "--robot", "two_link", "--json")
    assert result.exit_code == 1
    assert result.stderr == ""
    (checked,) = json.loads(result.stdout)["logs"]
    assert not checked["usable"]
    assert checked["findings"][0]["severity"] == "error"


def test_check_says_in_words_that_a_log_of_another_robot_cannot_be_used(tauhat: Tauhat, workshop: Workshop) -> None:
    result = tauhat("check", workshop.log, "--robot", "ur5e")
    assert result.exit_code == 1
    assert "has 6" in " ".join(result.stdout.split())
    assert "cannot be used" in result.stdout


def test_a_missing_log_is_named(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    assert "nowhere.csv" in refused(tauhat("verify", workshop.estimate, tmp_path / "nowhere.csv"))
    assert "nowhere.csv" in refused(tauhat("check", tmp_path / "nowhere.csv"))


def test_a_map_that_names_a_missing_column_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    log_map = tmp_path / "map.toml"
    log_map.write_text('[time]\ncolumn = "t"\n[position]\ncolumns = ["q_1", "elbow"]\n')
    words = ("identify", "two_link", workshop.text_log, "--map", log_map, "-o", tmp_path / "e.json")
    assert "elbow" in refused(tauhat(*words))


def test_a_log_in_another_joint_order_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    log_map, robot = tmp_path / "map.toml", tmp_path / "named.toml"
    log_map.write_text(
        '[time]\ncolumn = "t"\n[position]\ncolumns = "q_{1..2}"\n[torque]\ncolumns = "tau_{1..2}"\n'
        '[joints]\nnames = ["b", "a"]\n'
    )
    joints = "".join(f'[[joints]]\nname = "{name}"\na = 1.0\nmass = 1.0\ncom = [-0.5, 0, 0]\n' for name in "ab")
    robot.write_text(f'name = "named"\nconvention = "standard"\nangle_unit = "rad"\n{joints}')
    words = ("identify", robot, workshop.text_log, "--map", log_map, "-o", tmp_path / "e.json")
    assert "another order" in refused(tauhat(*words))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("bomb.urdf", ENTITY_BOMB),
        ("cut.urdf", "<robot name='r'><link name='l'"),
        ("loop.urdf", "<robot name='r'><link name='l'/><link name='l2'/></robot>"),
        ("empty.toml", ""),
        ("robot.xml", "<mujoco/>"),
    ],
)
def test_a_broken_robot_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path, name: str, text: str) -> None:
    robot = tmp_path / name
    robot.write_text(text)
    assert name in refused(tauhat("inspect", robot, "--json"))
    refused(tauhat("identify", robot, workshop.log, "-o", tmp_path / "e.json"))
    refused(tauhat("simulate", robot, "-o", tmp_path / "log.parquet"))
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_an_unknown_robot_is_answered_with_near_names(tauhat: Tauhat) -> None:
    assert "ur5e" in refused(tauhat("inspect", "ur5"))


@pytest.mark.parametrize(
    ("words", "named"),
    [(("--model", "inertia,wind"), "wind"), (("--estimator", "magic"), "magic"), (("--lock", "nose"), "nose")],
)
def test_unknown_names_are_refused_with_the_known_ones(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path, words: tuple[str, str], named: str
) -> None:
    line = refused(tauhat("identify", "two_link", workshop.log, "-o", tmp_path / "e.json", *words))
    assert named in line
    assert "expected" in line or "known names" in line or "did you mean" in line


def test_half_an_estimate_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    half = tmp_path / "half.json"
    text = workshop.estimate.read_text()
    half.write_text(text[: len(text) // 2])
    assert "half.json" in refused(tauhat("verify", half, workshop.log, "--json"))
    assert "half.json" in refused(tauhat("report", half, "-o", tmp_path / "r.html"))


def test_an_estimate_of_another_robot_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    log = tmp_path / "ur5e.parquet"
    tauhat("simulate", "ur5e", "-o", log, "--seconds", 1, "--rate", 50)
    assert "does not fit" in refused(tauhat("verify", workshop.estimate, log))


def test_an_output_that_would_replace_its_input_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    log, estimate = tmp_path / "log.csv", tmp_path / "e.json"
    shutil.copy(workshop.text_log, log)
    shutil.copy(workshop.estimate, estimate)
    assert "overwrite" in refused(tauhat("identify", "two_link", log, "-o", log))
    alias = tmp_path / "alias.html"
    alias.symlink_to(estimate)
    assert "overwrite" in refused(tauhat("report", estimate, "-o", alias))
    assert log.read_bytes() == workshop.text_log.read_bytes()
    assert estimate.read_bytes() == workshop.estimate.read_bytes()


def test_an_output_that_cannot_be_is_refused_before_the_work(tauhat: Tauhat, tmp_path: Path) -> None:
    missing = tmp_path / "missing" / "out"
    assert "make the folder" in refused(tauhat("identify", "two_link", tmp_path / "no.csv", "-o", missing))
    assert "folder" in refused(tauhat("identify", "two_link", tmp_path / "no.csv", "-o", ""))
    long = ("--seconds", 3600, "--rate", 1000)
    assert "unknown ending" in refused(tauhat("simulate", "two_link", "-o", tmp_path / "log.docx", *long))
    assert "absurdly long" in refused(tauhat("simulate", "two_link", "-o", tmp_path / "l.csv", *long[:3], 10_000))


def test_a_cutoff_in_a_wrong_unit_is_refused(tauhat: Tauhat, workshop: Workshop) -> None:
    assert "far too low" in refused(tauhat("verify", workshop.estimate, workshop.other_log, "--cutoff", "1e-9"))


def test_check_refuses_terms_and_locks_that_mean_nothing(tauhat: Tauhat, workshop: Workshop) -> None:
    assert "wind" in refused(tauhat("check", workshop.log, "--model", "wind", "--json"))
    result = tauhat("check", workshop.log, "--lock", "joint_1", "--json")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "--robot" in result.stderr


def test_too_little_memory_is_one_line(tauhat: Tauhat, workshop: Workshop, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauhat.recordings.reading.read_recording", raising(MemoryError()))
    assert "not enough memory" in refused(tauhat("verify", workshop.estimate, workshop.log))


def test_a_damaged_parquet_log_causes_one_line_and_no_panic_text(workshop: Workshop, tmp_path: Path) -> None:
    content = bytearray(workshop.log.read_bytes())
    log, code = tmp_path / "log.parquet", "import sys; from tauhat.cli.app import main; main()"
    for place in range(len(content) - 40, len(content) - 8):
        content[place] ^= 0xFF
    log.write_bytes(content)
    done = subprocess.run([sys.executable, "-c", code, "check", log], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


def test_a_folder_in_place_of_the_output_is_refused(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    folder = tmp_path / "folder.html"
    folder.mkdir()
    for path in (folder, tmp_path / "missing" / "e.html"):
        refused(tauhat("identify", "two_link", workshop.log, "-o", path, "--json"))
        refused(tauhat("report", workshop.estimate, "-o", path))
    assert list(folder.iterdir()) == []
    refused(tauhat("simulate", "two_link", "-o", tmp_path / "log.docx", "--seconds", 1, "--rate", 50))
    (tmp_path / "file").write_text("")
    refused(tauhat("demo", "--robot", "two_link", "-o", tmp_path / "file" / "demo"))
    assert {file.name for file in tmp_path.iterdir()} == {"file", "folder.html"}


@pytest.mark.parametrize(
    "words",
    [
        ("identify",),
        ("identify", "two_link", "log.csv"),
        ("identify", "two_link", "log.csv", "-o", "e.json", "--rows", "5"),
        ("identify", "two_link", "log.csv", "-o", "e.json", "--rows", "9:2"),
        ("identify", "two_link", "log.csv", "-o", "e.json", "--cutoff", "0"),
        ("identify", "two_link", "log.csv", "-o", "e.json", "--cutoff", "fast"),
        ("identify", "two_link", "log.csv", "-o", "e.json", "--lock", "a=b"),
        ("identify", "two_link", "log.csv", "-o", "e.json", "--lock", ",a"),
        ("simulate", "two_link", "-o", "log.csv", "--seconds", "0"),
        ("fly",),
        ("robots", "--colour"),
    ],
)
def test_wrong_usage_exits_with_two(tauhat: Tauhat, words: tuple[str, ...]) -> None:
    result = tauhat(*words)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "Usage" in result.stderr


def raising(error: BaseException) -> Callable[..., None]:
    def fail(*_: object, **__: object) -> None:
        raise error

    return fail


def test_an_interrupt_exits_with_130_and_leaves_nothing(
    tauhat: Tauhat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tauhat.cli.experiment.run_experiment", raising(KeyboardInterrupt()))
    result = tauhat("simulate", "two_link", "-o", tmp_path / "log.parquet")
    assert result.exit_code == 130
    assert result.stdout == result.stderr == ""
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_the_system_is_one_line(
    tauhat: Tauhat, workshop: Workshop, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = PermissionError(13, "Permission denied", "/the/file")
    monkeypatch.setattr("tauhat.recordings.reading.read_recording", raising(error))
    line = refused(tauhat("verify", workshop.estimate, workshop.log))
    assert line == "error: /the/file: Permission denied"


def test_each_warning_is_printed_once_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        with one_line_reports():
            for text in ("first [0, 1]\nof two lines " + 20 * "and more ", "second", "second"):
                warnings.warn(text, TauhatWarning, stacklevel=1)
            warnings.warn("overflow", RuntimeWarning, stacklevel=1)
    first, *others = capsys.readouterr().err.splitlines()
    assert first.startswith("warning: first [0, 1] of two lines and more")
    assert others == ["warning: second", "warning: RuntimeWarning: overflow"]


def run_unread(words: tuple[object, ...], unread: str, given: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    """Run `tauhat` with a standard output or error whose reader has left."""
    reading, writing = os.pipe()
    os.close(reading)
    program = shutil.which("tauhat", path=Path(sys.executable).parent) or "tauhat"
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, unread: writing}
    command = [program, *map(str, words)]
    done = subprocess.run(command, input=given, timeout=120, check=False, **streams)
    os.close(writing)
    return done


@pytest.mark.parametrize("words", [("inspect", "ur5e"), ("inspect", "ur5e", "--json"), ("--help",), ("--version",)])
def test_a_reader_that_leaves_early_causes_no_complaint(words: tuple[str, ...]) -> None:
    done = run_unread(words, "stdout")
    assert done.stderr == b""
    assert done.returncode == 128 + signal.SIGPIPE


def test_a_reader_of_answers_or_of_errors_that_leaves_ends_the_program(workshop: Workshop) -> None:
    sample = b'{"t": 0.0, "q": [0, 0], "tau": [0, 0]}\n'
    words = ("sense", workshop.estimate, "--input", "-", "--rate", 250)
    assert run_unread(words, "stdout", sample).returncode == 128 + signal.SIGPIPE
    assert run_unread(("verify", workshop.estimate, "nowhere.csv"), "stderr").returncode == 128 + signal.SIGPIPE


def test_whoever_leaves_a_socket_is_an_error_there_and_ends_no_program() -> None:
    code = (
        "import socket\nfrom tauhat.cli import app\ndef serve():\n    ours, theirs = socket.socketpair()\n"
        "    theirs.close()\n    try:\n        ours.send(b'answer')\n    except BrokenPipeError:\n"
        "        print('has left')\napp.app = serve\napp.main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "has left\n", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is full")
@pytest.mark.parametrize("words", [("robots",), ("robots", "--json"), ("--help",), ("--version",), ()])
def test_an_output_that_is_full_is_one_line(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "tauhat", *words]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


def test_closed_streams_cause_no_complaint() -> None:
    code = "import os\nos.close({})\nimport sys\nsys.std{} = None\nfrom tauhat.cli.app import main\nmain()"
    for number, name in ((1, "out"), (2, "err")):
        command = [sys.executable, "-c", code.format(number, name), "robots", "--json"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0
        assert done.stderr == ""


def test_a_termination_while_writing_leaves_nothing(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys\nfrom pathlib import Path\nfrom tauhat.cli import app\nfrom tauhat.files import "
        "replace_file\ndef write(part):\n    part.write_text('half')\n    os.kill(os.getpid(), signal.SIGTERM)\n"
        "app.app = lambda: replace_file(Path(sys.argv[1]), write)\napp.main()"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "out.json")], timeout=60, check=False)
    assert done.returncode == 128 + signal.SIGTERM
    assert list(tmp_path.iterdir()) == []
