"""What each term of the torque model is worth on measured logs: unseen error with and without it.

    python benchmarks/terms.py [--json] [--data FOLDER] [--only TEXT] [--quick]

Every case of examples/real is fitted and judged as in real.py, by the library in one process, with the robust model, with
each of its terms left out, with each further term added, and with friction laws of other families in the place of its
own. The last row is the mean change of the logarithm of the error. Cases that only fit are left out of that mean.
"""

from __future__ import annotations

import argparse
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from real import EXAMPLES, default_data, read_cases
from tauhat.cli.inputs import robot_of_recordings
from tauhat.cli.models import model_of
from tauhat.dynamics.model import ROBUST_TERMS
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation import identify
from tauhat.recordings.reading import read_recording
from tauhat.verification import verify

DROPPED = ("load-dahl", "cube-root", "viscous", "stribeck", "rotor", "offset")
ADDED = ("coulomb", "viscous-asymmetry", "spring")


def variants() -> dict[str, str]:
    rigid = "inertia,rotor,offset"
    return {
        "robust": "robust",
        **{f"-{key}": ",".join(term for term in ROBUST_TERMS if term != key) for key in DROPPED},
        **{f"+{key}": f"robust,{key}" for key in ADDED},
        "no dahl": f"{rigid},viscous,cube-root,stribeck,coulomb,load-coulomb",
        "plain": "plain",
        "plain+stribeck": "plain,stribeck",
        "polynomial": f"{rigid},polynomial",
        "asymmetric": "inertia,rotor,asymmetric",
    }


def read(data: Path, case: dict[str, Any], role: str) -> list[Any]:
    name = case["map"] if role == "fit" else case.get("judge_map", case["map"])
    windows = [tuple(int(row) for row in log["rows"].split(":")) if "rows" in log else None for log in case[role]]
    return [
        read_recording(data / log["log"], map=EXAMPLES / name, rows=rows)
        for log, rows in zip(case[role], windows, strict=True)
    ]


def errors(data: Path, case: dict[str, Any], models: dict[str, str]) -> dict[str, float]:
    """Mean relative error in % over the judged logs, by variant; nan where it cannot be identified."""
    fitted, judged = read(data, case, "fit"), read(data, case, "judge")
    path = EXAMPLES / case["robot"] if (EXAMPLES / case["robot"]).exists() else data / case["robot"]
    robot = robot_of_recordings(str(path), fitted, locked=None)
    shared = any(recording.shared_motors for recording in fitted)
    found = {}
    for label, text in models.items():
        try:
            model = model_of(robot, f"{text},coupling" if shared and text not in {"robust", "plain"} else text, fitted)
            estimate = identify(model, fitted, cutoff=case["cutoff"])
            found[label] = 100 * float(np.mean([log.relative_rms for log in verify(estimate, judged).logs]))
        except TauhatError:
            found[label] = float("nan")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--only", default="", help="only cases whose name contains this")
    parser.add_argument("--quick", action="store_true", help="the robust and the plain model alone")
    options = parser.parse_args()
    warnings.simplefilter("ignore", TauhatWarning)
    if not options.data.is_dir():
        raise SystemExit(f"{options.data}: no such folder; name the folder of the recordings with --data")
    models = {label: text for label, text in variants().items() if not options.quick or label in {"robust", "plain"}}
    cases = [case for case in read_cases() if options.only in case["name"] and "payload" not in case["name"]]
    rows = {case["name"]: errors(options.data, case, models) for case in cases}
    unseen = [name for name in rows if "fit only" not in name and "trap" not in name]
    change = {
        label: 100 * float(np.nanmean([np.log(rows[name][label] / rows[name]["robust"]) for name in unseen]))
        for label in models
    }
    if options.json:
        print(json.dumps({"errors": rows, "mean_change": change}))
        return
    print(f"{'unseen error %':26}" + "".join(f"{label:>19}" for label in models))
    for name, row in rows.items():
        print(f"{name:26}" + "".join(f"{row[label]:19.2f}" for label in models))
    print(f"{'mean change %':26}" + "".join(f"{change[label]:+19.1f}" for label in models))


if __name__ == "__main__":
    main()
