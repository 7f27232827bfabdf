"""A payload and the torque constants of a UR10e, from its published runs with and without a known mass of 2.805 kg.

    python benchmarks/payload.py [--data FOLDER] [--model TERMS]

First what the payload comes out as, with the torque gains as published. Then the gains calibrated from the pair by both
methods, and two checks that do not use the payload's mass: gains from the first half judged on the second, and the
ratio of torque to current in the controller's own commands, which are logged beside the measured currents. The logs are
not part of the project; their folder is named by --data or TAUHAT_REAL_DATA.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from real import EXAMPLES, default_data
from tauhat.dynamics import torque_model
from tauhat.estimation import Estimate, identify
from tauhat.estimation.drives import WeighedPayload, calibrate_drives
from tauhat.estimation.payload import KnownPayload, Payload, identify_payload
from tauhat.recordings import Recording, read_recording
from tauhat.robots import load_robot
from tauhat.verification import verify

MASS, CUTOFF = 2.805, 8.0
PUBLISHED = (
    np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47]),
    np.array([10.0, 10.696, 8.457, 9.003, 9.480, 10.123]),
)
RUNS = (("ur-20_02_19_14harm50sec.csv.gz", (194, 4966)), ("ur-20_02_19_14harm50secLoad.csv.gz", (307, 5071)))


def scaled(recording: Recording, factors: np.ndarray) -> Recording:
    return replace(recording, tau=recording.tau * factors)


def half(recording: Recording, second: int) -> Recording:
    middle = recording.n_t // 2
    return recording.rows(second * middle, (second + 1) * middle)


def commanded_gains(data: Path) -> np.ndarray:
    """Torque over current in the controller's commands: slope of current on torque, velocity, direction and a constant.

    The commanded torque is the controller's model, the commanded current that plus friction over the torque constant.
    """
    name, (start, stop) = RUNS[0]
    rows = np.loadtxt(data / "ur10e" / name, delimiter=",")[start:stop]
    speed, current, torque = rows[:, 7:13], rows[:, 19:25], rows[:, 25:31]
    slopes = []
    for joint in range(6):
        dq = speed[:, joint]
        columns = np.column_stack([torque[:, joint], dq, np.sign(dq), np.ones_like(dq)])
        slopes.append(1.0 / np.linalg.lstsq(columns, current[:, joint], rcond=None)[0][0])
    return np.array(slopes)


def line(name: str, payload: Payload, empty: Estimate, loaded: Recording) -> str:
    free, body = payload.free_body, payload.body
    error = verify(payload.loaded, [loaded]).logs[0].relative_rms
    ignored = verify(empty, [loaded]).logs[0].relative_rms
    seen = sum(value for row in body.inertia_seen for value in row)
    return (
        f"{name:34} {free.mass:6.3f} ± {free.mass_half:5.3f} {100 * payload.free_relative_rms:6.2f} "
        f"{body.mass:8.3f} {100 * error:6.2f} {100 * ignored:8.2f}   {np.round(body.centre, 3)}   {seen} of 9"
    )


def weighings(model, empty: Recording, loaded: Recording) -> Estimate:
    """Print what the payload comes out as; return the estimate of the arm alone."""
    estimate = identify(model, [empty], cutoff=CUTOFF)
    print(
        f"{'payload of 2.805 kg':34} {'free kg':>14} {'err %':>6} {'body kg':>8} {'err %':>6} {'ignored %':>9}   centre, inertia seen"
    )
    print(line("estimate taken as it is", identify_payload(estimate, [loaded]), estimate, loaded))
    print(line("arm and payload together", identify_payload(estimate, [loaded], unloaded=[empty]), estimate, loaded))
    known = identify_payload(estimate, [loaded], unloaded=[empty], known=KnownPayload(mass=MASS))
    print(line("together, mass known", known, estimate, loaded))
    return estimate


def calibrations(model, estimate: Estimate, runs: tuple[Recording, Recording], data: Path) -> None:
    """Print calibrated gains, where they came from, and the checks."""
    empty, loaded = runs
    payload = WeighedPayload(mass=MASS)
    print(f"\n{'gains [Nm/A]':34} joints 1 to 6")
    for number, gains in enumerate(PUBLISHED, start=1):
        print(f"{f'published, set {number}':34} {np.round(gains, 2)}")
    for number, gains in enumerate(PUBLISHED, start=1):
        factor = gains / PUBLISHED[0]
        start = identify(model, [scaled(empty, factor)], cutoff=CUTOFF)
        found = calibrate_drives(start, [scaled(loaded, factor)], unloaded=[scaled(empty, factor)], payload=payload)
        print(
            f"{f'calibrated from set {number}':34} {np.round(gains * found.factors, 2)}  found {found.found_mass:.3f} kg"
        )
        print(f"{'  ± (95 %)':34} {np.round(gains * found.half_intervals(), 2)}")
        print(f"{'  by least squares':34} {np.round(gains * found.ordinary.factors, 2)}")
    first = calibrate_drives(estimate, [half(loaded, 0)], unloaded=[half(empty, 0)], payload=payload)
    print(f"{'calibrated from the first halves':34} {np.round(PUBLISHED[0] * first.factors, 2)}")
    print(f"{'torque over current, commanded':34} {np.round(commanded_gains(data), 2)}  (knows nothing of the payload)")
    late = [scaled(half(run, 1), first.factors) for run in runs]
    arm = identify(model, [late[0]], cutoff=CUTOFF)
    print(f"\n{'gains of first halves, second half':34} {'free kg':>14} {'err %':>6} {'body kg':>8} {'err %':>6}")
    print(line("estimate taken as it is", identify_payload(arm, [late[1]]), arm, late[1]))
    print(line("arm and payload together", identify_payload(arm, [late[1]], unloaded=[late[0]]), arm, late[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--model", default="robust", help="terms of the torque model")
    options = parser.parse_args()
    if not options.data.is_dir():
        raise SystemExit(f"{options.data}: no such folder; name the folder of the recordings with --data")
    folder = options.data / "ur10e"
    runs = tuple(read_recording(folder / name, map=EXAMPLES / "ur10e.toml", rows=rows) for name, rows in RUNS)
    model = torque_model(load_robot(str(folder / "ur10e.urdf")), options.model)
    estimate = weighings(model, *runs)
    calibrations(model, estimate, runs, options.data)


if __name__ == "__main__":
    main()
