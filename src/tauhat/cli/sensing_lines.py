"""`tauhat sense --input -`: a line of JSON for every sample on standard input, as soon as it is there."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from tauhat.cli.reporting import say

if TYPE_CHECKING:
    from tauhat.arrays import FloatArray
    from tauhat.sensing.sensed_log import SampleCounts
    from tauhat.sensing.sensor import ForceSensor, Sensed


def answer(sensor: ForceSensor) -> None:
    """Answer the samples on standard input until it ends; tell on standard error how many there were.

    Raises
    ------
    SensingError
        another robot's samples, another rate, a format that is unknown, or no sample at all.
    """
    from tauhat.errors import SensingError
    from tauhat.sensing.sample_lines import read_samples
    from tauhat.sensing.stream import SensorStream

    stream = SensorStream(sensor=sensor, name="standard input")
    memory, malformed, n_v = stream.start(), 0, sensor.n_v
    for sample in read_samples(sys.stdin.buffer, sensor.model.robot):
        sized = sample is not None and len(sample.q) == n_v == len(sample.tau)
        if sample is None or (not sized and memory.counts.taken):
            malformed += 1
            continue
        memory, sensed = stream.take(memory, sample.t, np.array(sample.q), np.array(sample.tau))
        if sensed is not None:
            sys.stdout.write(json.dumps(_answered(sample.t, sensed), allow_nan=False) + "\n")
            sys.stdout.flush()
    counts = memory.counts._replace(malformed=malformed)
    if not counts.taken:
        raise SensingError("no sample came", where="standard input", got=_sentence(counts))
    say("done", _sentence(counts))


def _answered(t: float, sensed: Sensed) -> dict[str, Any]:
    return {
        "t": t,
        "tau_ext": _short(sensed.tau),
        "tau_ext_std": _short(np.sqrt(sensed.variance)),
        "wrench": _short(sensed.wrench),
        "wrench_std": _short(np.sqrt(np.diagonal(sensed.covariance))),
    }


def _short(values: FloatArray) -> list[float]:
    return [float(f"{value:.6g}") for value in values]


def _sentence(counts: SampleCounts) -> str:
    skipped = {
        "late": counts.late, "repeated": counts.repeated, "not finite": counts.not_finite,
        "malformed": counts.malformed,
    }  # fmt: skip
    said = ", ".join(f"{count} {name}" for name, count in skipped.items() if count) or "none"
    return f"{counts.taken} samples; skipped: {said}; started again {counts.restarts} times"
