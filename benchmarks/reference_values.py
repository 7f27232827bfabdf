"""Friction and coupling of the Staubli TX40 and the parameters of the EMPS drive, beside published values.

    python benchmarks/reference_values.py [--json] [--data FOLDER]

With the friction law of the publications (viscous, Coulomb, offset; on the TX40 also inertia, viscous and Coulomb
friction of the motor that turns with joints 5 and 6), joints weighted by their noise, on the whole logs. The sign is
smooth with a width of 0.02 rad/s. The delay that the tool finds on the EMPS log is not compensated here: the published
values are not either. Rows with a standard error above a third of the value say little.
"""

from __future__ import annotations

import argparse
import json
import warnings
from pathlib import Path
from typing import Any

from real import EXAMPLES, default_data
from tauhat.cli.inputs import robot_of_recordings
from tauhat.cli.models import model_of
from tauhat.dynamics import Coulomb
from tauhat.dynamics.terms import Coupling
from tauhat.errors import TauhatWarning
from tauhat.estimation import WeightedLeastSquares, identify
from tauhat.recordings import read_recording
from tauhat.recordings.processing import Processing

WIDTH = 0.02
TX40 = {
    "Fv": (8.05, 5.53, 1.97, 1.11, 1.86, 0.65),
    "Fc": (7.14, 8.26, 6.34, 2.48, 3.03, 0.282),
    "Iam": (None,) * 5 + (0.00964,),
    "Fvm": (None,) * 5 + (0.616,),
    "Fsm": (None,) * 5 + (1.95,),
}
EMPS = {"m": (95.1089,), "Fv": (203.5034,), "Fc": (20.3935,), "To": (-3.1648,)}


def tx40(data: Path) -> Any:
    recording = read_recording(data / "tx40/pos_read_data.csv.gz", map=EXAMPLES / "tx40.toml", rows=(300, 38400))
    robot = robot_of_recordings(str(data / "tx40/tx40_mdh_modified.urdf"), [recording], locked=None)
    model = model_of(robot, "plain", [recording]).with_term(Coulomb(widths=(WIDTH,) * robot.n_v))
    model = model.with_term(Coupling(motors=recording.shared_motors, widths=(WIDTH,)))
    return identify(model, [recording], cutoff=40.0, estimator=WeightedLeastSquares(power=1.0))


def emps(data: Path) -> Any:
    recording = read_recording(data / "emps/DATA_EMPS.mat", map=EXAMPLES / "emps.toml")
    robot = robot_of_recordings(str(EXAMPLES / "emps_robot.toml"), [recording], locked=None)
    processing = Processing(cutoff=100.0, motion_cutoff=300.0)
    return identify(model_of(robot, "plain", [recording]), [recording], processing=processing)


def rows(name: str, estimate: Any, reference: dict[str, tuple[float | None, ...]]) -> list[dict[str, Any]]:
    found = {row.name: row for row in estimate.summary()}
    return [
        {
            "robot": name, "parameter": f"{symbol}_{joint + 1}", "published": value,
            "here": found[f"{symbol}_{joint + 1}"].value, "standard_error": found[f"{symbol}_{joint + 1}"].standard_error,
        }
        for symbol, values in reference.items()
        for joint, value in enumerate(values)
        if value is not None
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--data", type=Path, default=default_data())
    options = parser.parse_args()
    warnings.simplefilter("ignore", TauhatWarning)
    table = rows("tx40", tx40(options.data), TX40) + rows("emps", emps(options.data), EMPS)
    if options.json:
        print(json.dumps(table))
        return
    print(f"{'robot':6} {'parameter':10} {'published':>10} {'here':>10} {'± se':>8} {'apart %':>8}")
    for row in table:
        apart = 100 * (row["here"] / row["published"] - 1)
        print(
            f"{row['robot']:6} {row['parameter']:10} {row['published']:10.5g} {row['here']:10.5g} "
            f"{row['standard_error']:8.2g} {apart:+8.1f}"
        )


if __name__ == "__main__":
    main()
