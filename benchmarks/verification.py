"""Verification on measured logs of real robots: bands, what residuals hold, held poses and a payload of known mass.

    python benchmarks/verification.py [--json] [--quick] [--data FOLDER] [--only TEXT]

For every case of examples/real/cases.toml the `robust` model is fitted, and on logs that were not fitted (unless the case says so): the
error, how often the 95 % bands hold, and the effects that the residuals still hold. Then static checks of the runs of a
UR10e with one joint at a time and of all judged logs, and its payload of 2.805 kg. `--quick` takes the first three
cases. The logs are not part of the project; their folder is named by --data or TAUHAT_REAL_DATA.
"""

from __future__ import annotations

import argparse
import json
import warnings
from pathlib import Path
from typing import Any

from real import EXAMPLES, default_data, percent, read_cases
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError, TauhatError, TauhatWarning
from tauhat.estimation import Estimate, identify
from tauhat.recordings import Recording, read_recording
from tauhat.robots import load_robot
from tauhat.robots.fitting import fit_to_joints
from tauhat.verification import check_payload, residual_tests, static_check, verify

MASS = 2.805  # [kg], of the UR10e's loaded run
LOADED = ("ur10e/ur-20_02_19_14harm50secLoad.csv.gz", "307:5071")
SINGLE = tuple(f"ur10e/ur-20_01_22-joint_{joint}.csv.gz" for joint in (1, 3, 5))


def read(data: Path, log: str, rows: str | None, map_name: str) -> Recording:
    window = None if rows is None else tuple(int(part) for part in rows.split(":"))
    return read_recording(data / log, map=EXAMPLES / map_name, rows=window)


def fitted(case: dict[str, Any], data: Path) -> Estimate:
    logs = [read(data, log["log"], log.get("rows"), case["map"]) for log in case["fit"]]
    beside = EXAMPLES / case["robot"]
    robot = load_robot(str(beside if beside.exists() else data / case["robot"]))
    robot = fit_to_joints(robot, logs[0].joint_names, where=logs[0].name)
    return identify(torque_model(robot, "robust"), logs, cutoff=case["cutoff"])


def judged(case: dict[str, Any], estimate: Estimate, data: Path) -> list[dict[str, Any]]:
    """Errors, coverage and named effects of every judged log of a case."""
    map_name = case.get("judge_map", case["map"])
    rows = []
    for log in case["judge"]:
        recording = read(data, log["log"], log.get("rows"), map_name)
        prediction = verify(estimate, [recording]).logs[0]
        try:
            effects = [(joint, effect) for joint, effect in residual_tests(estimate, [recording])[0].ranked]
            refused = ""
        except ModelError as error:
            effects, refused = [], str(error)
        rows.append(
            {
                "case": case["name"], "log": prediction.log, "relative_rms": prediction.relative_rms,
                "covered_by_parameters": [joint.band.covered_by_parameters for joint in prediction.joints],
                "covered": [joint.band.covered for joint in prediction.joints], "refused": refused,
                "effects": [
                    {"joint": joint, "effect": effect.effect, "term": effect.term, "share": effect.share,
                     "standard_error": effect.standard_error, "alternatives": effect.alternatives}
                    for joint, effect in effects
                ],
                "static": [finding.message for finding in static_check(estimate, [recording]).findings],
            }
        )  # fmt: skip
    return rows


def arm_of_ur10e(data: Path, *, quick: bool) -> dict[str, Any]:
    """Static checks of single-joint runs, and the payload that was weighed."""
    case = next(case for case in read_cases() if case["name"] == "ur10e 14 harm -> unknown payload")
    estimate = fitted(case, data)
    static = []
    for name in SINGLE[:1] if quick else SINGLE:
        try:
            check = static_check(estimate, [read(data, name, None, case["map"])])
            joints = [joint for joint in check.to_dict()["joints"] if joint["poses"]]
            static.append({"log": name, "joints": joints, "findings": [found.message for found in check.findings]})
        except TauhatError as error:
            static.append({"log": name, "joints": [], "findings": [str(error)]})
    known = check_payload(estimate, [read(data, *LOADED, case["map"])], mass=MASS)
    return {"static": static, "payload": known.to_dict()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--only", default="", help="only cases whose name contains this")
    options = parser.parse_args()
    if not options.data.is_dir():
        raise SystemExit(f"{options.data}: no such folder; name the folder of the recordings with --data")
    warnings.simplefilter("ignore", TauhatWarning)
    cases = [case for case in read_cases() if options.only in case["name"]][: 3 if options.quick else None]
    logs = []
    for case in cases:
        estimate = fitted(case, options.data)
        logs += judged(case, estimate, options.data)
        if not options.json:
            show(logs[-len(case["judge"]) :])
    arm = arm_of_ur10e(options.data, quick=options.quick) if "ur10e" in f"ur10e {options.only}" else {}
    if options.json:
        print(json.dumps({"logs": logs, **arm}))
        return
    show_arm(arm)


def show(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        print(f"\n{row['case']} on {row['log']}: error {100 * row['relative_rms']:.2f} %")
        print(f"  95 % bands hold, parameters alone {percent(row['covered_by_parameters'])}")
        print(f"  with the residual of the fit      {percent(row['covered'])}")
        for item in row["effects"]:
            others = f", or {', '.join(item['alternatives'])}" if item["alternatives"] else ""
            share = f"{100 * item['share']:.1f} ± {100 * item['standard_error']:.1f} %"
            print(f"  {item['joint']}: {item['effect']}{others} ({item['term'] or 'no term'}), {share} of the residual")
        if not row["effects"]:
            print(f"  {row['refused'] or 'no effect of the catalogue'}")
        for message in row["static"]:
            print(f"  static: {message}")


def show_arm(arm: dict[str, Any]) -> None:
    for run in arm["static"]:
        print(f"\nstatic, {run['log']}: {'; '.join(run['findings']) or 'agrees'}")
        for joint in run["joints"]:
            sign = ">=" if joint["held"] else "  "
            print(
                f"  {joint['name']:20} {joint['poses']:4} poses  gravity less model {joint['gravity_difference']:8.3f} ± {joint['gravity_half']:.3f}"
                f"  friction {sign} {joint['friction']:.3f}, model {joint['model_friction']:.3f} ± {joint['friction_half']:.3f} {joint['unit']}"
            )
    payload = arm["payload"]
    for number in payload["numbers"]:
        print(
            f"\npayload: {number['quantity']} known {number['known']} {number['unit']}, found {number['found']:.3f} ± {number['half']:.3f}"
        )
    print(
        f"torque error {100 * payload['relative_rms_ignored']:.2f} % without it, {100 * payload['relative_rms_found']:.2f} % with what was found"
    )


if __name__ == "__main__":
    main()
