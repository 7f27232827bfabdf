"""`--cluster` and `--workers`: the same estimate from logs that others read, or one line that says why not."""

from __future__ import annotations

import socket

import pytest
from cli_workshop import made, run_tauhat

from tauhat.estimation import load_estimate


@pytest.fixture
def nowhere() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{free.getsockname()[1]}"


def refusal(*words: object) -> str:
    result = run_tauhat(*words)
    assert result.exit_code == 1
    lines = [line for line in result.stderr.splitlines() if line.startswith("error:")]
    assert len(lines) == 1
    return lines[0]


def test_processes_that_read_the_logs_give_the_same_estimate(workshop, tmp_path):
    words = ("identify", "two_link", workshop.log, workshop.other_log, "--rows", "10:900")
    made(*words, "-o", tmp_path / "here.json")
    made(*words, "-o", tmp_path / "there.json", "--workers", 1)
    here, there = (load_estimate(tmp_path / name).to_dict() for name in ("here.json", "there.json"))
    assert here == there


def test_what_workers_cannot_do_is_refused(workshop, tmp_path, nowhere):
    words = ("identify", "two_link", workshop.log, "-o", tmp_path / "never.json")
    assert "irls reads every row" in refusal(*words, "--workers", 1, "--estimator", "irls")
    assert "--model auto" in refusal(*words, "--cluster", nowhere, "--model", "auto")
    assert "give one of the two" in refusal(*words, "--cluster", nowhere, "--workers", 2)
    assert not (tmp_path / "never.json").exists()


def test_a_cluster_that_is_not_there_is_named_in_one_line(workshop, tmp_path, nowhere):
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    words = ("identify", "two_link", workshop.log, "-o", tmp_path / "never.json")
    assert f"{nowhere}: no Dask scheduler can be reached" in refusal(*words, "--cluster", nowhere)
