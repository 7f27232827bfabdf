"""`tauhat sense --input -`: a line of JSON for every sample on standard input, as soon as it is there."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tauhat.cli.output import counted
from tauhat.cli.reporting import say

if TYPE_CHECKING:
    from tauhat.arrays import FloatArray
    from tauhat.sensing.contact_thresholds import ContactThresholds
    from tauhat.sensing.sensed_log import SampleCounts
    from tauhat.sensing.sensor import ForceSensor, Sensed
    from tauhat.sensing.wrench import WrenchSolver
    from tauhat.sensing.zero import Zero


_Judge: TypeAlias = "Callable[[float, Sensed], tuple[Sensed, dict[str, Any]]]"


def answer(sensor: ForceSensor, thresholds: ContactThresholds | None = None, *, zero: Zero = "as sensed") -> None:
    """Answer the samples on standard input until it ends; tell on standard error how many there were.

    With thresholds each answer says whether something touches the arm, and where that begins or ends; the zero of a
    standing arm can then be taken off torque and wrench.

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
    judge: _Judge = _no_contacts if thresholds is None else _contacts(thresholds, sensor, zero)
    for sample in read_samples(sys.stdin.buffer, sensor.model.robot):
        sized = sample is not None and len(sample.q) == n_v == len(sample.tau)
        if sample is None or (not sized and memory.counts.taken):
            malformed += 1
            continue
        memory, sensed = stream.take(memory, sample.t, np.array(sample.q), np.array(sample.tau))
        if sensed is not None:
            told, said = judge(sample.t, sensed)
            sys.stdout.write(json.dumps(_answered(sample.t, told) | said, allow_nan=False) + "\n")
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


def _no_contacts(_: float, sensed: Sensed) -> tuple[Sensed, dict[str, Any]]:
    return sensed, {}


def _contacts(thresholds: ContactThresholds, sensor: ForceSensor, zero: Zero) -> _Judge:
    """Return what says of each sample in turn whether something touches the arm."""
    from tauhat.sensing.contact import ContactDetector
    from tauhat.sensing.touch import TouchFollower

    detector = ContactDetector(thresholds=thresholds, step=sensor.step)
    detector.check_joints(tuple(sensor.model.robot.joint_names), where="standard input")
    memory, touches = detector.start(), TouchFollower(detector)

    def judge(t: float, sensed: Sensed) -> tuple[Sensed, dict[str, Any]]:
        nonlocal memory
        memory, found = detector.advance(memory, sensed.tau, sensed.variance, sensed.dq, settled=sensed.settled)
        told = _less(sensed, found.zero, sensor.solver) if zero == "standing" else sensed
        said: dict[str, Any] = {"contact": found.contact, "excess": float(f"{found.excess:.4g}"), "link": found.link}
        event = touches.see(t, memory, float(np.linalg.norm(told.wrench[:3])))
        if event == "end" and touches.newest is not None:
            said["link"] = touches.newest.link  # of the whole contact
        return told, (said if event is None else said | {"event": event})

    return judge


def _less(sensed: Sensed, zero: FloatArray, solver: WrenchSolver) -> Sensed:
    """Return a sample less a zero of the joints; the wrench is solved again, as `zeroed` does along a log."""
    tau = sensed.tau - zero
    samples = (value[None] for value in (sensed.q, tau, sensed.variance))
    found = solver.along(*samples, own=np.square(sensed.lag)[None])
    return sensed._replace(tau=tau, wrench=found.wrench[0], covariance=found.covariance[0])


def _short(values: FloatArray) -> list[float]:
    return [float(f"{value:.6g}") for value in values]


def _sentence(counts: SampleCounts) -> str:
    skipped = {
        "late": counts.late, "repeated": counts.repeated, "not finite": counts.not_finite,
        "malformed": counts.malformed,
    }  # fmt: skip
    again = "once" if counts.restarts == 1 else f"{counts.restarts} times"
    frozen = f"; frozen, as of a controller that hangs: {counts.frozen}" if counts.frozen else ""
    return f"{counts.taken} samples; skipped: {counted(skipped)}; started again {again}{frozen}"
