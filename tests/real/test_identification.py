"""Real robots identified through the command line, with the maps and cases a user has; errors against the reference.

The cases are those of `examples/real/cases.toml` and `benchmarks/real.py`. What the model of today cannot reach is said
there (`waits`) and is held to what is reached, so that it cannot get worse unseen.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tauhat.cli.app import app

EXAMPLES = Path(__file__).parents[2] / "examples" / "real"
CASES: list[dict[str, Any]] = tomllib.loads((EXAMPLES / "cases.toml").read_text(encoding="utf-8"))["case"]
TRAP = (
    "kr300 A -> B (trap)"  # one run determines no model: only that it warns is asked of any, the limit of the plain one
)

pytestmark = pytest.mark.real


def run(*arguments: object) -> tuple[str, str]:
    """Return what a command prints on stdout and stderr."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.stderr
    return result.stdout, result.stderr


def log_arguments(logs: list[dict[str, str]], data: Path, map_name: str, cutoff: float) -> list[object]:
    rows = logs[0].get("rows")
    windows = ["--rows", rows] if rows else []
    return [*(data / log["log"] for log in logs), "--map", EXAMPLES / map_name, "--cutoff", cutoff, *windows]


@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_unseen_error_is_at_or_under_the_reference(case: dict[str, Any], real_data: Path, tmp_path: Path) -> None:
    local = EXAMPLES / case["robot"]
    robot = local if local.exists() else real_data / case["robot"]
    estimate = tmp_path / "estimate.json"
    fit = log_arguments(case["fit"], real_data, case["map"], case["cutoff"])
    model = ["--model", "plain"] if case["name"] == TRAP else []
    _, warnings = run("identify", robot, *fit, *model, "-o", estimate)
    judge = log_arguments(case["judge"], real_data, case.get("judge_map", case["map"]), case["cutoff"])
    document, _ = run("verify", estimate, *judge, "--json")
    errors = [log["relative_rms"] for log in json.loads(document)["logs"]]
    assert all(error <= limit for error, limit in zip(errors, case["reference"], strict=True)), errors
    for word in case.get("expect", ()):
        assert word in warnings


def test_the_robust_model_warns_of_the_trap(real_data: Path, tmp_path: Path) -> None:
    case = next(case for case in CASES if case["name"] == TRAP)
    fit = log_arguments(case["fit"], real_data, case["map"], case["cutoff"])
    _, warnings = run("identify", real_data / case["robot"], *fit, "-o", tmp_path / "estimate.json")
    assert "condition number" in warnings
    assert "far off on another" in warnings


def test_the_wrist_of_the_tx40_gets_its_coupling_by_itself_and_the_values_of_the_reference(
    real_data: Path, tmp_path: Path
) -> None:
    case = next(case for case in CASES if case["name"].startswith("tx40"))
    whole = [{**case["fit"][0], "rows": "300:38400"}]
    fit = log_arguments(whole, real_data, case["map"], case["cutoff"])
    robot = real_data / case["robot"]
    said, _ = run("identify", robot, *fit, "--model", "plain", "-o", tmp_path / "estimate.json", "--json")
    found = {row["name"]: row["value"] for row in json.loads(said)["parameters"]}
    viscous = dict(zip([f"Fv_{k}" for k in range(1, 7)], [8.05, 5.53, 1.97, 1.11, 1.86, 0.65], strict=True))
    dry = dict(zip([f"Fc_{k}" for k in range(1, 6)], [7.14, 8.26, 6.34, 2.48, 3.03], strict=True))
    coupling = {"Iam_6": 0.00964, "Fvm_6": 0.616, "Fsm_6": 1.95}
    # of figaroh-examples, without Fc_6 (0.282), whose error bar is as wide as itself
    for name, value in (viscous | dry | coupling).items():
        assert found[name] == pytest.approx(value, rel=0.1), name


def findings(*arguments: object) -> list[dict[str, Any]]:
    result = CliRunner().invoke(app, ["check", *(str(argument) for argument in arguments), "--json"])
    document: dict[str, Any] = json.loads(result.stdout)
    return [finding for log in document["logs"] for finding in log["findings"]]


@pytest.mark.parametrize("with_robot", [True, False], ids=["with robot", "without robot"])
def test_check_finds_the_reversed_torque_of_the_ur3(real_data: Path, tmp_path: Path, with_robot: bool) -> None:
    mapped = (EXAMPLES / "ur3.toml").read_text(encoding="utf-8")
    as_logged = tmp_path / "as_logged.toml"
    as_logged.write_text(mapped.replace("sign = -1", "sign = 1"), encoding="utf-8")
    robot = ["--robot", real_data / "ur3/ur3_robot.urdf"] if with_robot else []
    log = real_data / "ur3/id1.mat"
    wrong = [f for f in findings(log, "--map", as_logged, *robot) if f["code"] == "torque_sign"]
    assert [f["severity"] for f in wrong] == ["error"]
    assert "sign = -1" in wrong[0]["advice"]
    right = [f for f in findings(log, "--map", EXAMPLES / "ur3.toml", *robot) if f["code"] == "torque_sign"]
    assert [f["severity"] for f in right] == ["ok"]


@pytest.mark.parametrize("log", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_check_finds_the_late_position_of_the_emps(real_data: Path, log: str) -> None:
    said = findings(real_data / "emps" / log, "--map", EXAMPLES / "emps.toml", "--robot", EXAMPLES / "emps_robot.toml")
    delay = next(finding for finding in said if finding["code"] == "torque_delay")
    assert delay["severity"] == "warning"
    assert delay["number"] == pytest.approx(0.9, abs=0.25)


UNDELAYED = {
    "ur10e": ("ur10e/ur10e.urdf", "ur10e/ur-20_02_10-30sec_12harm.csv.gz", "ur10e.toml"),
    "ur3": ("ur3/ur3_robot.urdf", "ur3/id1.mat", "ur3.toml"),
    "kr300": ("kr300/kr300_from_dh.urdf", "kr300/run_A.csv.gz", "kr300.toml"),
    "kinova": ("kinova_gen3/gen3.urdf", "kinova_gen3/Trajectory1.csv.gz", "kinova_gen3.toml"),
}


@pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")
@pytest.mark.parametrize("name", UNDELAYED)
def test_check_raises_no_false_alarm_about_sign_or_delay(real_data: Path, name: str) -> None:
    robot, log, mapped = UNDELAYED[name]
    said = findings(real_data / log, "--map", EXAMPLES / mapped, "--robot", real_data / robot)
    doubtful = {f["code"] for f in said if f["severity"] in {"warning", "error"}}
    assert not {"torque_delay", "torque_sign", "torque_scale"} & doubtful


def test_check_says_that_one_run_of_the_kr300_is_too_weak(real_data: Path) -> None:
    said = findings(
        real_data / "kr300/run_A.csv.gz", "--map", EXAMPLES / "kr300.toml", "--robot",
        real_data / "kr300/kr300_from_dh.urdf",
    )  # fmt: skip
    excitation = next(finding for finding in said if finding["code"] == "excitation")
    assert excitation["severity"] == "warning"
    assert excitation["number"] > 300
