"""Prediction error on measured logs of eight real robots, beside the reference error of one plain baseline.

    python benchmarks/real.py [--json] [--data FOLDER] [--only TEXT] [--models plain,robust,auto,robust+physical]
                              [--estimators wls,irls,...]

Every case goes through the command line as a user would: `tauhat identify --model NAME` (and
`--physical` for `NAME+physical`), then `tauhat verify` on logs
that were not fitted (unless the case says so), with one set of defaults for all robots and the reference's own cut-off.
`aim` is what an earlier experiment with the same scoring reached, where there is one. The logs are not part of the
project; their folder is named by --data or TAUHAT_REAL_DATA.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tauhat.errors import TauhatError
from tauhat.recordings import LogSource
from tauhat.studies.real_logs import RealCase, load_cases

EXAMPLES = Path(__file__).parent.parent / "examples" / "real"


def default_data() -> Path:
    beside = Path(__file__).parent.parent.parent / "shared" / "data"
    return Path(os.environ.get("TAUHAT_REAL_DATA", beside))


class RefusedError(Exception):
    """A command that ended with an error; its last line."""


def tauhat(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run one command."""
    command = [sys.executable, "-m", "tauhat", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RefusedError(done.stderr.strip().splitlines()[-1])
    return done


def arguments_of(logs: tuple[LogSource, ...], case: RealCase) -> list[str]:
    """Command-line arguments for logs that share a window, a map and a cut-off."""
    windows = {log.rows for log in logs}
    if len(windows) != 1:
        raise SystemExit(f"{case.name}: logs of one call share one window")
    rows, mapped = windows.pop(), logs[0].map
    return [
        *(str(log.path) for log in logs), *(["--map", str(mapped)] if mapped else []), "--cutoff", str(case.cutoff),
        *(["--rows", f"{rows[0]}:{'' if rows[1] is None else rows[1]}"] if rows else []),
    ]  # fmt: skip


def run_case(case: RealCase, folder: Path, model: str, estimator: str) -> dict[str, Any]:
    """Identify and verify one case with one model and estimator; return its errors."""
    estimate = folder / "estimate.json"
    start = time.perf_counter()
    fitted = tauhat(
        "identify", case.robot, *arguments_of(case.fit, case),
        "--model", model.removesuffix("+physical"), *(["--physical"] if model.endswith("+physical") else []),
        "--estimator", estimator,
        "-o", str(estimate),
    )  # fmt: skip
    seconds = time.perf_counter() - start
    judged = tauhat("verify", str(estimate), *arguments_of(case.judge, case), "--json")
    logs = json.loads(judged.stdout)["logs"]
    stored = json.loads(estimate.read_text(encoding="utf-8"))
    warnings = [line for line in fitted.stderr.splitlines() if line.startswith("warning")]
    return {
        "name": case.name, "errors": [log["relative_rms"] for log in logs], "reference": case.reference,
        "moving": [log["moving_relative_rms"] for log in logs],
        "joints": [[joint["relative_rms"] for joint in log["joints"]] for log in logs], "seconds": seconds,
        "condition": stored["fit"]["condition"], "processing": stored["processing"], "warnings": warnings,
        "missing_warnings": [word for word in case.expect if word not in " ".join(warnings)],
        "aim": case.aim, "model": model, "estimator": estimator, "waits": case.waits,
        "structure": stored["structure"],
    }  # fmt: skip


def tried(case: RealCase, folder: Path, model: str, estimator: str) -> dict[str, Any]:
    """The same, or why the library refused."""
    try:
        return run_case(case, folder, model, estimator)
    except RefusedError as error:
        return {"name": case.name, "model": model, "estimator": estimator, "refused": str(error)}


def percent(values: Sequence[float]) -> str:
    return " ".join(f"{100 * value:.2f}" for value in values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--only", default="", help="only cases whose name contains this")
    parser.add_argument("--models", default="plain,robust,auto", help="models to compare")
    parser.add_argument("--estimators", default="wls", help="estimators to compare")
    options = parser.parse_args()
    if not options.data.is_dir():
        raise SystemExit(f"{options.data}: no such folder; name the folder of the recordings with --data")
    try:
        cases = load_cases(EXAMPLES / "cases.toml", data=options.data)
    except TauhatError as error:
        raise SystemExit(str(error)) from error
    cases = tuple(case for case in cases if options.only in case.name)
    models = options.models.split(",")
    with tempfile.TemporaryDirectory() as folder:
        results = [
            tried(case, Path(folder), model, estimator)
            for case in cases
            for model in models
            for estimator in options.estimators.split(",")
        ]
    if options.json:
        print(json.dumps(results))
        return
    print(
        f"{'fitted -> judged':34} {'model':16} {'estimator':13} {'reference %':>12} {'aim %':>6} {'here %':>12} {'moving rows':>12} {'verdict':>8} {'cond':>8} "
        f"{'s':>5}  per joint %"
    )
    for row in results:
        show(row)


def show(row: dict[str, Any]) -> None:
    if "refused" in row:
        print(f"{row['name']:34} {row['model']:16} {row['estimator']:13} {row['refused']}")
        return
    met = all(error <= reference for error, reference in zip(row["errors"], row["reference"], strict=True))
    verdict = "met" if met else "NOT MET"
    joints = " | ".join(" ".join(f"{100 * value:.0f}" for value in joints) for joints in row["joints"])
    aim = f"{100 * row['aim']:.1f}" if row["aim"] else ""
    print(
        f"{row['name']:34} {row['model']:16} {row['estimator']:13} {percent(row['reference']):>12} {aim:>6} {percent(row['errors']):>12} "
        f"{percent(row['moving']):>12} {verdict:>8} {row['condition']:8.3g} {row['seconds']:5.1f}  {joints}"
    )
    if row["waits"]:
        print(f"{'':34} the model does not have: {row['waits']}")
    for missing in row["missing_warnings"]:
        print(f"{'':34} MISSING WARNING: {missing}")
    for trial in (row["structure"] or {}).get("trials", ()):
        if trial["taken"]:
            print(f"{'':34} auto: {trial['change']} {trial['term']}, unseen error {100 * trial['gain']:.0f} % less")


if __name__ == "__main__":
    main()
