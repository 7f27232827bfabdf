"""`tauhat sense`: contacts by thresholds that are assumed, learnt on free logs, written and read."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_workshop import Tauhat, Workshop, made, piped, pushed, sample_lines

from tauhat.recordings import read_recording, write_recording

FORCE = np.array([30.0, 0.0, -40.0, 0.0, 0.0, 0.0])
FIRST, LAST = 3.0, 3.6  # seconds of the push


@dataclass(frozen=True)
class Bench:
    estimate: Path
    free: Path
    pushed: Path


@pytest.fixture(scope="module")
def bench(workshop: Workshop, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("contacts")
    log = read_recording(workshop.other_log)
    write_recording(pushed(log, FORCE, (log.t >= FIRST) & (log.t < LAST)), folder / "pushed.parquet")
    return Bench(workshop.estimate, workshop.other_log, folder / "pushed.parquet")


def answers(bench: Bench, log: Path, *words: str) -> list[dict[str, Any]]:
    """Return what is answered to the samples of a log through a pipe."""
    done = piped(bench.estimate, sample_lines(read_recording(log)), "--rate", "250", *words)
    assert done.returncode == 0, done.stderr
    return [json.loads(text) for text in done.stdout.splitlines()]


def line(text: str) -> str:
    return " ".join(text.split())


def events(text: str) -> list[dict[str, object]]:
    found: list[dict[str, object]] = json.loads(text)["events"]
    return found


def test_thresholds_learnt_on_a_free_log_find_the_push_and_nothing_else(bench: Bench, tmp_path: Path) -> None:
    limits = tmp_path / "limits.json"
    words = ("sense", bench.estimate, bench.pushed, "--directions", "force", "--json")
    learnt = made(*words, "--free", bench.free, "--thresholds", limits)
    assert "free motion can promise" in learnt.stderr
    (event,) = events(learnt.stdout)
    assert event["start"] == pytest.approx(FIRST, abs=0.1)
    assert LAST < event["end"] < LAST + 0.4  # the observer forgets a push of many thresholds in so long
    assert {"start", "end", "link", "peak", "log"} <= set(event)
    assert events(made(*words, "--thresholds", limits).stdout) == [event]
    assert events(made("sense", bench.estimate, bench.free, "--thresholds", limits, "--json").stdout) == []


def test_a_rate_that_the_free_motion_supports_is_told(bench: Bench) -> None:
    words = ("sense", bench.estimate, bench.pushed, "--free", bench.free)
    assert "thresholds allow 4000 false ones an hour" in line(made(*words, "--alarms", "4000").stdout)
    assert "asked for: 1" in line(made(*words).stdout)


def test_without_free_motion_a_strong_push_is_found_and_the_doubt_told(bench: Bench) -> None:
    said = made("sense", bench.estimate, bench.pushed, "--directions", "force").stdout
    assert "nothing is known of false ones" in line(said)
    assert "Contacts" in said


def test_samples_through_a_pipe_are_told_when_a_contact_begins_and_ends(bench: Bench, tmp_path: Path) -> None:
    limits = tmp_path / "limits.json"
    words = ("sense", bench.estimate, bench.pushed, "--directions", "force", "--json")
    (event,) = events(made(*words, "--free", bench.free, "--thresholds", limits).stdout)
    for choice in (("--thresholds", str(limits)), ("--free", str(bench.free))):
        found = answers(bench, bench.pushed, *choice)
        told = [(answer["event"], answer["t"]) for answer in found if "event" in answer]
        first, (word, end) = told
        assert first == ("start", event["start"])
        assert (word, end) == (
            "end",
            pytest.approx(event["end"], abs=0.005),
        )  # the first sample without, not the last with
        touched = [answer["t"] for answer in found if answer["contact"]]
        assert (touched[0], touched[-1]) == (event["start"], event["end"])
        assert max(answer["excess"] for answer in found) == pytest.approx(event["excess"], rel=1e-3)
        assert {answer["link"] for answer in found if not answer["contact"] and "event" not in answer} == {None}
        assert [answer["link"] for answer in found if answer.get("event") == "end"] == [event["link"]]
    assert not any(answer["contact"] for answer in answers(bench, bench.free, "--thresholds", str(limits)))


def test_without_thresholds_a_pipe_says_nothing_of_contact(bench: Bench) -> None:
    assert {"contact", "event", "link"}.isdisjoint(answers(bench, bench.pushed)[-1])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--free", "nowhere.parquet"), "nowhere.parquet"),
        (("--thresholds", "nowhere.json"), "nowhere.json"),
        (("--alarms", "0"), "alarms"),
    ],
)
def test_what_cannot_be_learnt_from_is_refused(
    bench: Bench, tauhat: Tauhat, words: tuple[str, str], message: str
) -> None:
    done = tauhat("sense", bench.estimate, bench.pushed, *words)
    assert done.exit_code != 0
    assert message in done.stderr
