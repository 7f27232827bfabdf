"""What scripts rely on: one JSON document on standard output, its keys, the files that are written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_workshop import Tauhat, Workshop

from tauhat.estimation.estimate import load_estimate
from tauhat.recordings.reading import read_recording


def document(tauhat: Tauhat, *words: object) -> dict:
    result = tauhat(*words, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_robots_lists_every_builtin_with_its_joints(tauhat: Tauhat) -> None:
    robots = {robot["name"]: robot for robot in document(tauhat, "robots")["robots"]}
    assert len(robots["ur5e"]["joints"]) == 6
    assert robots["two_link"]["joints"] == ["joint_1", "joint_2"]
    assert all(robot["description"] for robot in robots.values())


def test_inspect_tells_every_standard_parameter_once(tauhat: Tauhat) -> None:
    robot = document(tauhat, "inspect", "two_link")
    base = [parameter["name"] for parameter in robot["base_parameters"]]
    assert sorted(base + robot["regrouped"] + robot["unidentifiable"]) == sorted(robot["standard_parameters"])
    assert {p["name"]: p["formula"] for p in robot["base_parameters"]}["mx_1"] == "mx_1 + 0.5 m_2"
    assert robot["joints"][0]["limits"]["acceleration"] == pytest.approx(20.0, rel=1e-3)


def test_inspect_with_fewer_terms_and_a_locked_joint_has_fewer_parameters(tauhat: Tauhat) -> None:
    whole = document(tauhat, "inspect", "two_link")
    part = document(tauhat, "inspect", "two_link", "--model", "inertia", "--lock", "joint_2=0.3")
    assert [joint["name"] for joint in part["joints"]] == ["joint_1"]
    assert part["terms"] == ["inertia"]
    assert len(part["base_parameters"]) < len(whole["base_parameters"])


def test_unlimited_joints_are_null_in_json(tauhat: Tauhat, tmp_path: Path) -> None:
    robot = tmp_path / "free.toml"
    robot.write_text('name = "free"\nconvention = "standard"\nangle_unit = "rad"\n[[joints]]\nname = "a"\na = 1.0\n')
    assert document(tauhat, "inspect", robot)["joints"][0]["limits"]["upper"] is None


def test_check_finds_a_simulated_log_usable(tauhat: Tauhat, workshop: Workshop) -> None:
    (log,) = document(tauhat, "check", workshop.log, "--robot", "two_link")["logs"]
    assert log["usable"]
    assert log["samples"] == 1001
    assert {"code", "severity", "joint", "message", "number", "advice"} == set(log["findings"][0])
    assert {"clock", "limits", "torque_sign", "excitation"} <= {finding["code"] for finding in log["findings"]}


def test_check_without_a_robot_judges_the_numbers_alone(tauhat: Tauhat, workshop: Workshop) -> None:
    (log,) = document(tauhat, "check", workshop.log)["logs"]
    codes = {finding["code"] for finding in log["findings"]}
    assert "clock" in codes
    assert "torque_sign" in codes  # the power balance needs no robot
    assert not {"limits", "excitation"} & codes


def test_simulate_writes_a_log_with_its_truth_beside_it(tauhat: Tauhat, tmp_path: Path) -> None:
    log = tmp_path / "run.v2.csv.gz"
    said = document(
        tauhat, "simulate", "two_link", "-o", log, "--seconds", 2, "--rate", 300, "--noise", 0, "--quantisation", 0.01
    )
    recording = read_recording(log)
    assert recording.n_t == said["samples"] == 601
    assert abs(recording.q / 0.01 - (recording.q / 0.01).round()).max() < 1e-9
    truth = json.loads((tmp_path / "run.v2.truth.json").read_text())
    assert said["truth"] == str(tmp_path / "run.v2.truth.json")
    assert len(truth["parameters"]) == 28
    assert len(truth["base_parameters"]) == 13
    assert truth["plan"]["rate"] == 300


def test_the_seed_decides_what_is_simulated(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    logs = [tmp_path / f"{name}.parquet" for name in "abc"]
    for log, seed in zip(logs, (0, 0, 1), strict=True):
        document(tauhat, "simulate", "two_link", "-o", log, "--seconds", 2, "--rate", 100, "--seed", seed)
    first, same, other = (read_recording(log) for log in logs)
    assert (first.tau == same.tau).all()
    assert abs(first.tau - other.tau).max() > 1.0


def test_identify_writes_an_estimate_near_the_truth(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    path = tmp_path / "e.json"
    said = document(tauhat, "identify", "two_link", workshop.log, workshop.other_log, "-o", path, "--model", "plain")
    assert said["estimate"] == str(path)
    assert {"parameters", "fit", "structure", "processing", "inputs"} <= set(said)
    assert said["structure"] is None
    assert [log["name"] for log in said["inputs"]] == ["first", "second"]
    estimate = load_estimate(path)
    truth = json.loads((workshop.folder / "first.truth.json").read_text())["base_parameters"]
    errors = [
        abs(row.value - known["value"]) / row.standard_error
        for row, known in zip(estimate.summary(), truth, strict=True)
        if row.name[:2] not in {"Fc", "To"}
    ]
    assert max(errors) < 4.5


def test_identify_takes_the_robust_model_by_itself(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    words = ("identify", "two_link", workshop.log, workshop.other_log, "-o", tmp_path / "e.json")
    by_default = document(tauhat, *words)
    named = document(tauhat, *words, "--model", "robust")
    assert by_default["parameters"] == named["parameters"]
    symbols = {parameter["name"].split("_")[0] for parameter in named["parameters"]}
    assert {"Fv", "Fr", "Fs", "Fd", "Fe", "To"} <= symbols
    assert document(tauhat, "verify", tmp_path / "e.json", workshop.text_log)["logs"][0]["relative_rms"] < 0.05


def test_identify_tells_how_it_chose_the_terms_when_asked_to(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path
) -> None:
    words = ("identify", "two_link", workshop.log, workshop.other_log, "-o", tmp_path / "e.json", "--model", "auto")
    structure = document(tauhat, *words)["structure"]
    assert (structure["folds"], structure["whole"]) == (2, True)
    assert {"term", "change", "gain", "uncertainty", "taken"} == set(structure["trials"][0])
    assert load_estimate(tmp_path / "e.json").structure is not None
    shown = " ".join(tauhat(*words).stdout.split())
    assert "left-out recordings" in shown
    assert "How the terms were chosen" in report_of(tauhat, tmp_path / "e.json", tmp_path / "r.html")


def report_of(tauhat: Tauhat, estimate: Path, page: Path) -> str:
    document(tauhat, "report", estimate, "-o", page)
    return page.read_text(encoding="utf-8")


def test_identify_takes_a_model_file(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    model = tmp_path / "model.toml"
    model.write_text('terms = "inertia,viscous"\n[[term]]\nterm = "coulomb"\nwidths = [0.02, 0.03]\n')
    document(tauhat, "identify", "two_link", workshop.log, "-o", tmp_path / "e.json", "--model", model)
    terms = {term.key: term for term in load_estimate(tmp_path / "e.json").model.terms}
    assert list(terms) == ["inertia", "viscous", "coulomb"]
    assert terms["coulomb"].widths == (0.02, 0.03)


@pytest.mark.parametrize(
    ("model", "match"),
    [
        ("polynomial,viscous", "term polynomial cannot be told apart from viscous"),
        ("robust,coupling", "term coupling: no motor turns with two joints"),
        ("inertia,gas-spring", "term gas-spring needs joint"),
        ("missing.toml", "missing.toml"),
    ],
)
def test_a_model_that_cannot_be_is_one_line(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path, model: str, match: str
) -> None:
    result = tauhat("identify", "two_link", workshop.log, "-o", tmp_path / "e.json", "--model", model)
    assert result.exit_code == 1
    assert match in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_identify_takes_estimator_cutoff_rows_and_model(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    words = ("--estimator", "ols", "--cutoff", 12.5, "--rows", "100:900", "--model", "inertia,viscous,coulomb")
    said = document(tauhat, "identify", "two_link", workshop.log, "-o", tmp_path / "e.json", *words)
    assert said["fit"]["estimator"]["name"] == "ols"
    assert said["processing"]["cutoff"] == 12.5
    assert said["inputs"][0]["rows"] == [100, 900]
    assert not any(parameter["name"].startswith(("Ia", "To")) for parameter in said["parameters"])


def test_verify_gives_the_keys_of_the_contract(tauhat: Tauhat, workshop: Workshop) -> None:
    logs = document(tauhat, "verify", workshop.estimate, workshop.other_log, workshop.text_log)["logs"]
    assert [log["log"] for log in logs] == ["second", "third"]
    for log in logs:
        assert {"log", "relative_rms", "rms", "r2", "joints"} <= set(log)
        assert [joint["name"] for joint in log["joints"]] == ["joint_1", "joint_2"]
        assert {"name", "relative_rms", "rms"} <= set(log["joints"][0])
        assert 0.0 < log["relative_rms"] < 0.05
        assert log["r2"] > 0.99


def test_verify_uses_the_cutoff_and_the_rows_it_is_given(tauhat: Tauhat, workshop: Workshop) -> None:
    plain = document(tauhat, "verify", workshop.estimate, workshop.other_log)
    other = document(tauhat, "verify", workshop.estimate, workshop.other_log, "--cutoff", 5, "--rows", "200:")
    assert other["processing"] == plain["processing"] | {"cutoff": 5.0}
    assert other["logs"][0]["relative_rms"] != plain["logs"][0]["relative_rms"]


def test_verify_on_a_fitted_log_warns_and_on_another_does_not(tauhat: Tauhat, workshop: Workshop) -> None:
    assert "proves little" in tauhat("verify", workshop.estimate, workshop.log).stderr
    assert tauhat("verify", workshop.estimate, workshop.other_log).stderr == ""


def test_report_writes_one_html_file(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    path = tmp_path / "r.html"
    said = document(tauhat, "report", workshop.estimate, workshop.other_log, workshop.text_log, "-o", path)
    assert said["report"] == str(path)
    assert [log["log"] for log in said["logs"]] == ["second", "third"]
    assert "second: 1001 samples" in path.read_text()


def test_report_of_an_estimate_alone_needs_no_log(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    assert document(tauhat, "report", workshop.estimate, "-o", tmp_path / "r.html")["logs"] == []
    assert (tmp_path / "r.html").read_text().startswith("<!")


def test_warnings_go_to_standard_error_once_and_leave_json_pure(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path
) -> None:
    weak = ("--rows", "0:60", "--model", "inertia,rotor,viscous,coulomb,offset")
    result = tauhat("identify", "two_link", workshop.log, "-o", tmp_path / "e.json", *weak, "--json")
    lines = result.stderr.splitlines()
    assert lines
    assert all(line.startswith("warning: ") for line in lines)
    assert len(set(lines)) == len(lines)
    assert json.loads(result.stdout)["robot"] == "two_link"
