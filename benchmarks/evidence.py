"""Speed and memory of evidence at growing log lengths: samples per second and peak memory must not depend on length.

    python benchmarks/evidence.py [--json] [--samples 100000 1000000 10000000]

Aims: at least 400 000 samples/s per core at 6 joints, memory flat. Each length runs in a process of its own, so that
its peak memory is its own. The log is made chunk by chunk and never held.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # figures are per core

import numpy as np

from tauhat.dynamics import base_parameters, torque_model
from tauhat.estimation.evidence import evidence_from_rows
from tauhat.estimation.rows import rows_of_stretches
from tauhat.recordings.processing import CHUNK, Processing, Stretch
from tauhat.robots import load_robot

RATE = 1000.0  # [Hz]


def stretches(n_t: int) -> Iterator[Stretch]:
    """A smooth motion of six joints with a torque, made once and handed out again and again."""
    t = np.arange(CHUNK) / RATE
    phase = np.arange(6)[:, None]
    q, dq, ddq = np.sin(t + phase), np.cos(t + phase), -np.sin(t + phase)
    tau = 10.0 * q + np.random.default_rng(0).normal(size=q.shape)
    for start in range(0, n_t, CHUNK):
        n = min(CHUNK, n_t - start)
        yield Stretch(t[:n] + start / RATE, q[:, :n], dq[:, :n], ddq[:, :n], tau[:, :n])


def run(n_t: int) -> dict[str, float]:
    model = torque_model(load_robot("ur10e"))
    base = base_parameters(model)
    layout = model.layout(base.independent)
    processing = Processing(cutoff=10.0, motion_cutoff=30.0)
    evidence_from_rows(layout, base, rows_of_stretches(model, layout, stretches(3 * CHUNK), processing, step=1 / RATE))
    start = time.perf_counter()
    rows = rows_of_stretches(model, layout, stretches(n_t), processing, step=1 / RATE)
    evidence = evidence_from_rows(layout, base, rows)
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    blocks = float(len(evidence.blocks))
    return {"samples": n_t, "seconds": seconds, "per_second": n_t / seconds, "peak_mib": peak, "blocks": blocks}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--samples", type=int, nargs="+", default=[100_000, 1_000_000, 10_000_000])
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(run(options.one)))
        return
    rows = []
    for n_t in options.samples:
        command = [sys.executable, __file__, "--one", str(n_t)]
        rows.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
    if options.json:
        print(json.dumps(rows))
        return
    print("evidence of a 6-joint arm, 58 base parameters, 10 Hz low-pass, one core")
    print(f"{'samples':>12} {'samples/s':>12} {'us/sample':>10} {'peak MiB':>9} {'blocks':>7}")
    for row in rows:
        micro = 1e6 / row["per_second"]
        print(
            f"{row['samples']:12d} {row['per_second']:12.0f} {micro:10.2f} {row['peak_mib']:9.0f} {row['blocks']:7.0f}"
        )
    print("aims: 400 000 samples/s, memory flat")


if __name__ == "__main__":
    main()
