"""`tauhat sense`: error bars learnt on free motion, zeros and passes in air, carried bodies; page and streams."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_workshop import Tauhat, Workshop, made, piped, pushed, sample_lines

from tauhat.recordings import read_recording, write_recording

WEIGHT = np.array([0.0, 0.0, -20.0, 0.0, 0.0, 0.0])
OFFSET = 0.8  # Nm on each joint that no model knows


@dataclass(frozen=True)
class Bench:
    """An estimate, two free passes of one motion and one of half the rate, and a pass that carries a weight."""

    estimate: Path
    air: Path
    free: Path
    coarse: Path
    carrying: Path


@pytest.fixture(scope="module")
def bench(workshop: Workshop, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("zero")
    made(
        "simulate", "two_link", "-o", folder / "run.parquet", "--seconds", 16, "--rate", 250, "--seed", 7, "--spread", 0
    )
    log, rng = read_recording(folder / "run.parquet"), np.random.default_rng(0)
    logs = {
        name: replace(log, tau=log.tau + OFFSET + rng.normal(scale=0.05, size=log.tau.shape))
        for name in ("air", "free")
    }
    logs["coarse"] = replace(logs["free"], **{name: getattr(logs["free"], name)[::2] for name in log_parts(log)})
    logs["carrying"] = pushed(logs["free"], WEIGHT, log.t >= 4.0)
    for name, given in logs.items():
        write_recording(given, folder / f"{name}.parquet")
    return Bench(workshop.estimate, *(folder / f"{name}.parquet" for name in ("air", "free", "coarse", "carrying")))


def log_parts(log: Any) -> list[str]:
    return ["t", *log.channels()]


def document(*words: object) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(made("sense", *words, "--json").stdout)
    return found


def bars(data: dict[str, Any]) -> list[float]:
    return [joint["std"] for joint in data["logs"][0]["joints"]]


def test_free_motion_teaches_the_error_bars_and_the_file_keeps_them(bench: Bench, tmp_path: Path) -> None:
    limits = tmp_path / "limits.json"
    words = (bench.estimate, bench.carrying)
    fitted = document(*words)
    learnt = document(*words, "--free", bench.air, "--thresholds", limits)
    again = document(*words, "--thresholds", limits)
    assert [data["error"]["from"] for data in (fitted, learnt, again)] == ["fit", "free motion", "thresholds"]
    assert bars(again) == bars(learnt)
    assert again["events"] == learnt["events"]
    assert min(bars(learnt)) > 2.0 * max(bars(fitted))  # the offset, which the fit did not know
    seen = document(bench.estimate, bench.air)["logs"][0]["joints"]
    assert learnt["error"]["rms"] == pytest.approx([joint["rms"] for joint in seen])
    assert min(learnt["error"]["rms"]) > 0.9 * OFFSET
    assert json.loads(limits.read_text(encoding="utf-8"))["schema_version"] == 2


def test_error_bars_are_those_of_what_is_told_less_a_standing_zero(
    bench: Bench, tauhat: Tauhat, tmp_path: Path
) -> None:
    log, limits = read_recording(bench.free), tmp_path / "limits.json"
    rng = np.random.default_rng(1)
    tau = log.tau[0] + rng.normal(scale=0.05, size=log.tau.shape)
    held = replace(log, q=np.repeat(log.q[:1], log.n_t, axis=0), dq=None, tau=tau)
    write_recording(held, tmp_path / "held.parquet")
    words = (bench.estimate, tmp_path / "held.parquet", "--thresholds", limits)
    plain = document(*words, "--free", tmp_path / "held.parquet")
    less = document(*words, "--free", tmp_path / "held.parquet", "--zero", "standing")
    assert max(less["error"]["rms"]) < 0.2 * min(plain["error"]["rms"])
    assert bars(document(*words, "--zero", "standing")) == bars(less)
    result = tauhat("sense", *words)
    assert result.exit_code == 1
    assert "behind a standing zero" in result.stderr


def test_thresholds_of_another_estimate_are_refused_and_those_of_none_are_taken_with_a_note(
    bench: Bench, tauhat: Tauhat, tmp_path: Path
) -> None:
    limits, other = tmp_path / "limits.json", tmp_path / "other.json"
    document(bench.estimate, bench.free, "--free", bench.air, "--thresholds", limits)
    made("identify", "two_link", bench.air, "-o", other, "--model", "plain")
    result = tauhat("sense", other, bench.free, "--thresholds", limits)
    assert result.exit_code == 1
    assert "thresholds of another estimate" in result.stderr
    data = json.loads(limits.read_text(encoding="utf-8"))
    del data["estimate"]
    limits.write_text(json.dumps(data), encoding="utf-8")
    done = made("sense", other, bench.free, "--thresholds", limits)
    assert "do not say of which estimate" in " ".join(done.stderr.split())


def test_a_free_log_of_another_rate_teaches_the_same(bench: Bench) -> None:
    fine, coarse = (
        document(bench.estimate, bench.carrying, "--free", free)["error"]["rms"] for free in (bench.free, bench.coarse)
    )
    assert coarse == pytest.approx(fine, rel=0.05)


def test_a_little_free_motion_leaves_the_error_bars_of_the_fit_and_says_so(bench: Bench, workshop: Workshop) -> None:
    done = made("sense", bench.estimate, bench.carrying, "--free", workshop.other_log, "--json")
    assert "too few to learn an error bar from" in " ".join(done.stderr.split())
    assert json.loads(done.stdout)["error"]["from"] == "fit"


def test_a_pass_in_air_takes_off_what_the_model_does_not_know(bench: Bench, tmp_path: Path) -> None:
    limits, air = tmp_path / "limits.json", f"air:{bench.air}"
    plain = document(bench.estimate, bench.free)
    words = (bench.estimate, bench.carrying, "--zero", air)
    less = document(bench.estimate, bench.free, "--zero", air)
    for before, after in zip(plain["logs"][0]["joints"], less["logs"][0]["joints"], strict=True):
        assert after["rms"] < 0.1 * before["rms"]
    found = document(*words, "--free", bench.free, "--thresholds", limits)
    assert max(found["error"]["rms"]) < 0.1 * OFFSET
    assert document(*words, "--thresholds", limits)["events"] == found["events"]
    assert found["zero"] == "air"
    assert found["events"][0]["start"] == pytest.approx(4.0, abs=0.1)


def test_a_carried_body_is_called_one_in_table_document_and_page(bench: Bench, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    words = (bench.estimate, bench.carrying, "--zero", f"air:{bench.air}")
    longest = max(document(*words)["events"], key=lambda event: event["end"] - event["start"])
    assert longest["payload"]["verdict"] == "payload"
    assert longest["payload"]["mass"] == pytest.approx(20.0 / 9.81, rel=0.25)  # a fast motion
    said = made("sense", *words, "--report", page).stdout
    name = f"carries {longest['payload']['mass']:.2f} kg"
    assert name in said
    text = page.read_text(encoding="utf-8")
    for word in (
        name,
        "less what the same motion shows in air",
        "carrying: contacts",
        "in parts of its threshold",
        "Hidden [%]",
        "do not tell every direction",
    ):
        assert word in text
    assert "hidden %" in said
    assert "behind starts or off the pass in air" in " ".join(said.split())


def test_the_warmth_of_the_joints_is_on_the_page_of_the_observer_that_follows_it(bench: Bench, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    model = tmp_path / "warm.json"
    made("identify", "two_link", bench.air, "-o", model, "--model", "plain,thermal")
    made("sense", model, bench.free, "--observer", "thermal", "--report", page)
    assert "free: warmth" in page.read_text(encoding="utf-8")
    made("sense", model, bench.free, "--report", page)
    assert "free: warmth" not in page.read_text(encoding="utf-8")


def test_a_stream_takes_off_the_same_zero_as_a_log(bench: Bench, tmp_path: Path) -> None:
    log = read_recording(bench.free)
    held = replace(log, q=np.repeat(log.q[:1], log.n_t, axis=0), dq=None, tau=log.tau[0] + 0.0 * log.tau)
    write_recording(held, tmp_path / "held.parquet")
    words = ("--zero", "standing:0.3")
    out = tmp_path / "out.csv"
    data = json.loads(made("sense", bench.estimate, tmp_path / "held.parquet", *words, "-o", out, "--json").stdout)
    done = piped(bench.estimate, sample_lines(held), "--rate", "250", *words)
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert data["zero"] == "standing"
    table = np.genfromtxt(out, delimiter=",", names=True)
    assert [answer["tau_ext"][0] for answer in answers] == pytest.approx(
        table["tau_ext_1"].tolist(), rel=1e-5, abs=1e-9
    )
    assert [answer["wrench"][2] for answer in answers] == pytest.approx(table["fz"].tolist(), rel=1e-4, abs=1e-9)
    assert abs(table["tau_ext_1"][-1]) < 0.01 < abs(table["tau_ext_1"][100])
    assert not answers[-1]["contact"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--zero", "air:{air}", "--free", "{air}"), "the pass in air is no free motion"),
        (("--zero", "air:{other}"), "not the motion of the pass in air"),
        (("--zero", "air:nowhere.parquet"), "nowhere.parquet"),
        (("--zero", "none", "--thresholds", "{limits}"), "learnt with another zero"),
        (("--thresholds", "{behind}"), "behind a pass in air"),
        (("--zero", "standing", "--thresholds", "{without}"), "expected none, got standing"),
        (("--zero", "standing:2", "--thresholds", "{limits}"), "leave the numbers out"),
        (("--gain", "40", "--thresholds", "{limits}"), "learnt with another sensor"),
        (("--free", "{air}", "--thresholds", "{estimate}"), "would overwrite a file it is made from"),
        (("--free", "{air}", "-o", "{air}"), "would overwrite a file it is made from"),
        (("--zero", "air:{air}", "-o", "{air}"), "would overwrite a file it is made from"),
    ],
)
def test_zeros_that_do_not_fit_are_refused_in_one_line(
    bench: Bench, workshop: Workshop, tauhat: Tauhat, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    limits, behind, without = (tmp_path / f"{name}.json" for name in ("limits", "behind", "without"))
    if "--thresholds" in words and "{estimate}" not in words:
        document(bench.estimate, bench.free, "--free", bench.air, "--thresholds", limits)
        learnt = json.loads(limits.read_text(encoding="utf-8"))
        behind.write_text(json.dumps(learnt | {"taken_off": "air"}), encoding="utf-8")
        rules = learnt["rules"] | {"zero": learnt["rules"]["zero"] | {"seconds": 0.0}}
        without.write_text(json.dumps(learnt | {"rules": rules}), encoding="utf-8")
    places = {"air": bench.air, "other": workshop.log, "limits": limits, "behind": behind, "without": without}
    places["estimate"] = bench.estimate
    result = tauhat("sense", bench.estimate, bench.free, *(word.format(**places) for word in words))
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("zero", ["stand", "standing:much", "standing:1:2:3", "air", "none:1", "standing:-1"])
def test_words_that_name_no_zero_are_errors(bench: Bench, tauhat: Tauhat, zero: str) -> None:
    result = tauhat("sense", bench.estimate, bench.free, "--zero", zero)
    assert result.exit_code in (1, 2)
    assert "zero" in result.stderr


def test_a_stream_refuses_thresholds_behind_a_pass_and_a_rate_of_alarms_that_nobody_reads(
    bench: Bench, tauhat: Tauhat, tmp_path: Path
) -> None:
    limits = tmp_path / "limits.json"
    document(bench.estimate, bench.free, "--free", bench.air, "--thresholds", limits)
    stream = ("sense", bench.estimate, "--input", "-", "--rate", 250, "--thresholds", limits)
    result = tauhat(*stream, "--alarms", 5)
    assert result.exit_code == 2
    assert "needs --free" in " ".join(result.stderr.split())
    learnt = json.loads(limits.read_text(encoding="utf-8"))
    limits.write_text(json.dumps(learnt | {"taken_off": "air"}), encoding="utf-8")
    result = tauhat(*stream)
    assert result.exit_code == 1
    assert "behind a pass in air" in result.stderr


def test_a_stream_has_no_pass_in_air(bench: Bench, tauhat: Tauhat) -> None:
    result = tauhat("sense", bench.estimate, "--input", "-", "--rate", 250, "--zero", f"air:{bench.air}")
    assert result.exit_code == 2
    assert "nobody says" in " ".join(result.stderr.split())
