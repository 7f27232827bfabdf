"""`tauhat sense`: from files to numbers, columns and pages; samples through a pipe; one-line refusals."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_workshop import Tauhat, Workshop, made, piped, pushed, sample_lines

from tauhat.cli.experiment import Plan, run_experiment
from tauhat.excitation.fourier import random_fourier
from tauhat.recordings import Recording, read_recording, write_recording
from tauhat.robots import inertia_at_origin, load_robot
from tauhat.sensing import WrenchSolver
from tauhat.sensing.sensed_log import AXES_KEY, FRAME_KEY
from tauhat.simulation.parameters import nominal_parameters

PUSH = np.array([4.0, 0.0, -9.0, 0.0, 0.0, 0.0])
BEGIN = 500  # sample from which something pushes


@dataclass(frozen=True)
class Bench:
    folder: Path
    estimate: Path
    free: Path
    pushed: Path


@pytest.fixture(scope="module")
def bench(workshop: Workshop, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Return the workshop's estimate, a log of another motion, and the same with a push from the middle on."""
    folder = tmp_path_factory.mktemp("sensing")
    log = read_recording(workshop.other_log)
    during = np.arange(log.n_t) >= BEGIN
    touched = replace(pushed(log, PUSH, during), wrench=np.where(during[:, None], PUSH, 0.0))
    write_recording(touched, folder / "pushed.parquet")
    return Bench(folder, workshop.estimate, workshop.other_log, folder / "pushed.parquet")


def test_a_push_is_found_back_in_the_file_and_free_motion_has_none(bench: Bench, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"
    words = ("sense", bench.estimate, bench.pushed, "-o", out, "--gain", 40, "--directions", "force")
    data = json.loads(made(*words, "--json").stdout)
    frame, log = pl.read_parquet(out), read_recording(bench.pushed)
    assert data["samples"] == frame.height == log.n_t
    assert [event["start"] for event in data["events"]] == [pytest.approx(log.t[BEGIN], abs=0.1)]
    names = ["t", *(f"tau_ext_{j}" for j in (1, 2)), *(f"tau_ext_std_{j}" for j in (1, 2))]
    wrench = ["fx", "fy", "fz", "mx", "my", "mz"]
    assert frame.columns == [*names, *wrench, *(f"{name}_std" for name in wrench)]
    metadata = pl.read_parquet_metadata(out)
    assert metadata[FRAME_KEY] == data["frame"]
    assert metadata[AXES_KEY] == "base"
    solver = WrenchSolver(robot=load_robot("two_link"))
    expected = np.array([solver.jacobian(q)[0].T @ PUSH for q in log.q])
    felt = frame.select("tau_ext_1", "tau_ext_2").to_numpy()
    late = slice(BEGIN + 100, None)
    assert np.sqrt(np.mean((felt - expected)[late] ** 2)) < 0.2 * np.sqrt(np.mean(expected[late] ** 2))
    free = json.loads(made("sense", bench.estimate, bench.free, "--json").stdout)["logs"][0]
    touched = data["logs"][0]
    assert max(joint["peak"] for joint in free["joints"]) < 0.2 * max(joint["peak"] for joint in touched["joints"])


def test_without_json_tables_are_printed(bench: Bench) -> None:
    text = made("sense", bench.estimate, bench.free, bench.pushed, "--directions", "force").stdout
    assert text.count("external torque") == 2
    assert "skipped: none" in text
    assert "fz" in text
    assert "mx" not in text


def test_several_logs_stand_in_one_file_behind_each_other(bench: Bench, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    made("sense", bench.estimate, bench.free, bench.pushed, "-o", out, "--rows", "0:300")
    frame = pl.read_csv(out)
    assert frame.columns[0] == "log"
    assert frame["log"].to_list() == [0.0] * 300 + [1.0] * 300


def test_the_page_holds_both_forces_and_escapes_nothing_away(bench: Bench, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    made("sense", bench.estimate, bench.pushed, "--report", page, "--observer", "kalman")
    text = page.read_text(encoding="utf-8")
    assert "pushed: sensed force" in text
    assert "Beside the force sensor of the log" in text
    assert '"measured"' in text


def test_rows_that_are_no_samples_are_counted_not_refused(bench: Bench, tmp_path: Path) -> None:
    frame = pl.read_parquet(bench.free)
    spoiled = pl.concat([frame[:200], frame[150:151], frame[199:200], frame[200:]])
    path = tmp_path / "spoiled.csv"
    lines = spoiled.write_csv().splitlines()
    lines[50] = lines[50].replace(lines[50].split(",")[2], "nan", 1)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    data = json.loads(made("sense", bench.estimate, path, "--json").stdout)["logs"][0]
    assert data["skipped"] == {"late": 1, "repeated": 1, "not_finite": 1}
    assert data["samples"] == frame.height - 1


def test_a_tool_that_payload_weighed_is_no_force_any_more(bench: Bench, tmp_path: Path) -> None:
    robot, tool, log = load_robot("two_link"), tmp_path / "tool.json", tmp_path / "loaded.parquet"
    truth = nominal_parameters(robot)
    inertia = truth.inertia.copy()
    inertia[1] += inertia_at_origin(mass=1.5, com=np.array([0.05, 0.02, 0.0]), inertia_at_com=np.eye(3) * 0.02)
    motion = random_fourier(robot, period=8.0, harmonics=5, rng=np.random.default_rng(0))
    plan = Plan(seconds=8.0, rate=250.0)
    loaded = replace(truth, inertia=inertia)
    run = run_experiment(robot, plan, truth=loaded, rng=np.random.default_rng(1), motion=motion)
    write_recording(run.recording, log)
    tool.write_text(made("payload", bench.estimate, log, "--json").stdout, encoding="utf-8")
    heavy, light = (
        json.loads(made("sense", bench.estimate, log, *words, "--json").stdout)["logs"][0]["joints"]
        for words in ((), ("--tool", tool))
    )
    for before, after in zip(heavy, light, strict=True):
        assert before["rms"] > 10.0 * after["rms"]


def test_every_valid_line_is_answered_and_the_others_are_counted(bench: Bench, tmp_path: Path) -> None:
    log, out = read_recording(bench.pushed), tmp_path / "out.parquet"
    given = sample_lines(log)
    mixed = [
        *given[:40],
        "garbage",
        given[10],
        '{"t": 9',
        given[39],
        given[40].replace(": ", ": NaN, ", 1),
        *given[40:],
    ]
    mixed.insert(42, json.dumps({"t": 0.161, "q": [None, 0], "tau": [0, 0]}))
    result = piped(bench.estimate, mixed, "--rate", "250")
    assert result.returncode == 0, result.stderr
    answers = [json.loads(line) for line in result.stdout.splitlines()]
    assert [answer["t"] for answer in answers] == log.t.tolist()
    made("sense", bench.estimate, bench.pushed, "-o", out)
    frame = pl.read_parquet(out)
    felt = np.array([answer["tau_ext"] for answer in answers])
    assert felt == pytest.approx(frame.select("tau_ext_1", "tau_ext_2").to_numpy(), rel=1e-5, abs=1e-9)
    assert np.array([answer["wrench"] for answer in answers])[:, 2] == pytest.approx(frame["fz"].to_numpy(), rel=1e-5)
    said = result.stderr.decode()
    assert "1 late, 1 repeated, 4 malformed" in said
    assert said.count("\n") == 1


def test_an_answer_comes_before_the_next_sample_is_given(bench: Bench) -> None:
    given = sample_lines(read_recording(bench.free))
    command = [sys.executable, "-m", "tauhat", "sense", str(bench.estimate), "--input", "-", "--rate", "250"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as program:
        for line in given[:5]:
            program.stdin.write(line.encode() + b"\n")
            program.stdin.flush()
            assert json.loads(program.stdout.readline())["t"] == json.loads(line)["t"]
        program.stdin.close()
        assert program.wait(timeout=60) == 0


def test_csv_with_a_header_is_read_as_well(bench: Bench) -> None:
    text = pl.read_parquet(bench.free)[:100].write_csv()
    result = piped(bench.estimate, text.splitlines(), "--rate", "250")
    assert result.returncode == 0, result.stderr
    assert len(result.stdout.splitlines()) == 100


@pytest.mark.parametrize(
    ("text", "rate", "message"),
    [
        ("", "250", "no sample came"),
        ("x\n" * 20, "250", "neither JSON lines nor CSV"),
        ('{"t": 0, "q": [0, 0, 0], "tau": [0, 0, 0]}\n', "250", "a sample of another robot"),
        ("\n".join(json.dumps({"t": 0.01 * k, "q": [0, 0], "tau": [0, 0]}) for k in range(120)), "250", "another rate"),
    ],
)
def test_a_stream_of_something_else_is_refused_in_one_line(bench: Bench, text, rate, message) -> None:
    result = piped(bench.estimate, text.splitlines(), "--rate", rate)
    assert result.returncode == 1
    said = result.stderr.decode()
    assert message in said
    assert said.startswith("error: ")
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--observer", "momentums"), "unknown observer"),
        (("--directions", "up"), "unknown directions"),
        (("--frame", "hand"), "no such frame"),
        (("--cutoff", 200), "cut-off of the filter"),
        (("--rate", 500), "samples of another rate"),
        (("--tool", "nothing.json"), "nothing.json"),
        (("-o", "out.txt"), "unknown ending"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(bench: Bench, tauhat: Tauhat, words, message) -> None:
    result = tauhat("sense", bench.estimate, bench.free, *words)
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_another_robots_log_is_refused(bench: Bench, tauhat: Tauhat, tmp_path: Path) -> None:
    log = read_recording(bench.free)
    path = tmp_path / "other.parquet"
    write_recording(Recording(t=log.t, q=log.q[:, [0, 1, 1]], tau=log.tau[:, [0, 1, 1]]), path)
    result = tauhat("sense", bench.estimate, path)
    assert result.exit_code == 1
    assert "the log is of another robot; expected 2 joints, got 3" in result.stderr


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("--input", "-"),
        ("--input", "file", "--rate", 250),
        ("--input", "-", "--rate", 250, "--json"),
        ("--input", "-", "--rate", 250, "--map", "map.toml"),
        ("--input", "-", "--rate", 250, "--rows", "0:9"),
        ("--input", "-", "--rate", 250, "-o", "out.csv"),
        ("--input", "-", "--rate", 250, "--report", "page.html"),
        ("--input", "-", "--rate", 250, "--alarms", 5),
        ("--gain", 0),
    ],
)
def test_words_that_do_not_fit_together_are_errors_of_usage(bench: Bench, tauhat: Tauhat, words) -> None:
    assert tauhat("sense", bench.estimate, *words).exit_code == 2


def test_inputs_are_never_overwritten(bench: Bench, tauhat: Tauhat) -> None:
    before = bench.free.read_bytes()
    result = tauhat("sense", bench.estimate, bench.free, "-o", bench.free)
    assert "overwrite" in result.stderr
    assert bench.free.read_bytes() == before
