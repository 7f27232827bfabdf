"""The virtual force sensor on measured logs: against a wrist sensor, against pushes, and in free motion it never saw.

    python benchmarks/sensing_real.py [--data FOLDER] [--json] [--quick]

Models are those of `tauhat identify` with its defaults, fitted to logs in which nothing touches the arm; sensing is
causal, at 125 or 100 Hz. Nothing is fitted to the log that is judged but where stated.

Wrist sensor (ur5, standing, pushed along the sensor's x). Both are zeroed over half a second at the start. Correlation
of |F| at the best lag (within 0.5 s; positive: the sensed force is late; the clocks of sensor and robot differ by an
unknown time, so latency is measured by a step of 5 Nm that is added to the measured torque of a joint). The sensor's
axes against the robot's base, a rotation, and one scale are fitted on one half of the run and judged on the other;
`rms` is that of the length of the force error over both halves, `axis` how far apart the two halves place the axis that
was pushed, `plain` the rms of |F| with nothing fitted. `zeroed`: less the zero of the contact detector, which follows
within seconds while it finds no contact (thresholds from the free runs).

Pushes. Labels come without any model: the wrist sensor above 10 N; standing, torque against its median before the
first push; in the repeated motion of No5, torque against the median of its own five cycles at the same phase. The last
two are behind a zero-phase 5 Hz filter and labelled above 30 % of the run's largest, so they tell strong pushes and
share the motor currents with what is judged.

The ur10e was logged every 10 or 12 ms and the stamps are right, which the sensor finds out in the first second of motion
(`--stamps auto`). `clock` in the output: the same with stamps counted as one period each, and believed from the start.

Free motion. Thresholds are learnt on runs that the model was not fitted to, and judged on runs that neither saw.
"""

from __future__ import annotations

import argparse
import json
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import butter, sosfiltfilt

from tauhat.arrays import FloatArray
from tauhat.cli.models import model_of
from tauhat.errors import SensingError, TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.selecting import identify_selected
from tauhat.recordings import Recording, read_recording
from tauhat.robots import Robot, load_robot
from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
from tauhat.sensing.contact import ContactDetector, ContactEvent
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import ContactThresholds
from tauhat.sensing.observers import OBSERVERS, Observer, observer_named
from tauhat.sensing.payload_check import check_payload
from tauhat.sensing.sample_rate import usual_step
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.sensor import STAMPS, Stamps, force_sensor
from tauhat.sensing.threshold_learning import thresholds_of
from tauhat.sensing.wrench import WrenchSolver, directions_named
from tauhat.sensing.zero import NO_ZERO, StandingZero, zeroed

MAPS = Path(__file__).parent.parent / "examples" / "real"
FORCE_RUN = "Movement_No10_Standstill_ForceSensor_Fx"
SLOW_FREE = (
    "Movement_No5_Acc_slow_no_disturbance",
    "Movement_No6_Acc_slow_Verify_Model",
    "Movement_No8_Singularity_Free_1",
)
OTHER_FREE = ("Movement_No1", "Movement_No2", "Movement_No3_Acc")
UR10E_FIT = ("ur-20_02_10-30sec_12harm", "ur-20_02_19_14harm50sec")
UR10E_FREE = ("ur-20_02_12-40sec_12harm", "ur-20_01_22-joint_1", "ur-20_01_22-joint_3", "ur-20_01_22-joint_5")
LAG, STEP_TORQUE, LABEL_FORCE, LABEL_PART, NEAR, REBOUND = 0.5, 5.0, 10.0, 0.3, 0.3, 2.0


def default_data() -> Path:
    return Path(os.environ.get("TAUHAT_REAL_DATA", Path(__file__).parents[2] / "shared" / "data"))


@dataclass(frozen=True, kw_only=True)
class Arm:
    """Logs of one robot."""

    folder: Path
    map: Path
    ending: str
    robot: Robot

    def log(self, name: str) -> Recording:
        return read_recording(self.folder / f"{name}{self.ending}", map=self.map)

    def fitted(self, names: Sequence[str], kind: str = "robust") -> Estimate:
        """The model of `tauhat identify --model KIND` (`+physical`: `--physical`)."""
        logs = [self.log(name) for name in names]
        word = kind.removesuffix("+physical")
        way = identify_selected if word == "auto" else identify
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)
            return way(
                model_of(self.robot, word, logs), logs,
                constraints=PhysicalConstraints() if kind.endswith("+physical") else None,
            )  # fmt: skip


def sensed(
    estimate: Estimate,
    log: Recording,
    *,
    observer: Observer | None = None,
    cutoff: float | None = None,
    wrench: dict[str, Any] | None = None,
    stamps: Stamps = "auto",
) -> SensedLog:
    """Force alone at the robot's last frame, by the sensor's defaults."""
    settings = {"directions": directions_named("force")} | (wrench or {})
    solver = WrenchSolver(robot=estimate.robot, **settings)
    rate = 1.0 / usual_step(log.t)
    return force_sensor(estimate, rate=rate, observer=observer, cutoff=cutoff, wrench=solver, stamps=stamps).along(log)


class Ur5Models:
    """Models without one or two of the slow free runs, each fitted once."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.known: dict[frozenset[str], Estimate] = {}

    def without(self, *names: str) -> Estimate:
        left = frozenset(names)
        if left not in self.known:
            self.known[left] = self.arm.fitted([n for n in (*OTHER_FREE, *SLOW_FREE) if n not in left])
        return self.known[left]

    def seen(self, name: str, *without: str) -> SensedLog:
        return sensed(self.without(name, *without), self.arm.log(name))


# ---------------------------------------------------------------------------------------------- wrist sensor


class Wrist(NamedTuple):
    """The wrist sensor at the times of the robot's log, zeroed, (n_t, 3) [N]."""

    t: FloatArray
    force: FloatArray


def wrist_of(path: Path, t: FloatArray) -> Wrist:
    with np.load(path) as data:
        force = np.stack([np.interp(t, data["t_ft"], column) for column in data["ft"][:, :3].T], axis=1)
    return Wrist(t, force - force[(t > 0.5) & (t < 1.0)].mean(axis=0))


def shifted(estimate: FloatArray, truth: FloatArray, lag: int) -> tuple[FloatArray, FloatArray]:
    n = len(truth)
    return estimate[max(0, lag) : n + min(0, lag)], truth[max(0, -lag) : n + min(0, -lag)]


def best_lag(estimate: FloatArray, truth: FloatArray, most: int) -> tuple[float, int]:
    found = [(float(np.corrcoef(*shifted(estimate, truth, lag))[0, 1]), lag) for lag in range(-most, most + 1)]
    return max(found)


def turned_and_scaled(estimate: FloatArray, truth: FloatArray) -> tuple[FloatArray, float]:
    """The rotation (on the right) and the scale that bring forces closest to the sensor's."""
    left, _, right = np.linalg.svd(estimate.T @ truth)
    left[:, -1] *= np.sign(np.linalg.det(left @ right))
    rotation = left @ right
    return rotation, float(np.trace(rotation.T @ estimate.T @ truth) / np.sum(np.square(estimate)))


def against_wrist(found: SensedLog, wrist: Wrist) -> dict[str, Any]:
    force = found.wrench[:, :3] - found.wrench[(found.t > 0.5) & (found.t < 1.0), :3].mean(axis=0)
    sizes = np.linalg.norm(force, axis=1), np.linalg.norm(wrist.force, axis=1)
    correlation, lag = best_lag(*sizes, most=round(LAG / found.step))
    moved, truth = shifted(force, wrist.force, lag)
    halves = slice(0, len(moved) // 2), slice(len(moved) // 2, None)
    errors, scales, rotations = [], [], []
    for fit, judge in (halves, halves[::-1]):
        rotation, scale = turned_and_scaled(moved[fit], truth[fit])
        errors.append(np.sum(np.square(scale * moved[judge] @ rotation - truth[judge]), axis=1))
        scales.append(scale)
        rotations.append(rotation)
    pushed = np.linalg.svd(truth, full_matrices=False)[2][0]
    between = np.degrees(np.arccos(np.clip((rotations[0] @ pushed) @ (rotations[1] @ pushed), -1.0, 1.0)))
    plain = np.linalg.norm(moved, axis=1) - np.linalg.norm(truth, axis=1)
    return {
        "correlation": correlation, "lag": lag * found.step, "rms": float(np.sqrt(np.mean(np.concatenate(errors)))),
        "rms_halves": [float(np.sqrt(error.mean())) for error in errors[::-1]], "scales": scales,
        "axis_apart_deg": float(between), "plain_rms": float(np.sqrt(np.mean(np.square(plain)))),
    }  # fmt: skip


def response(estimate: Estimate, log: Recording, **settings: Any) -> dict[str, float]:
    """How long half and nine tenths of a step of torque on the first joint take to come through [s]."""
    at = log.n_t // 8
    pushed = np.array(log.tau)
    pushed[at:, 0] -= STEP_TORQUE
    free, touched = (sensed(estimate, one, **settings).tau[:, 0] for one in (log, replace(log, tau=pushed)))
    part = (touched - free)[at:] / STEP_TORQUE
    step = usual_step(log.t)
    times = {}
    for level in (0.5, 0.9):
        k = int(np.argmax(part >= level))  # the torque is straight between samples: the step is half a sample early
        times[f"t{round(100 * level)}"] = step * (k - (part[k] - level) / (part[k] - part[k - 1]) + 0.5)
    return {name: float(value) for name, value in times.items()}


def wrist_row(estimate: Estimate, log: Recording, wrist: Wrist, settings: dict[str, Any]) -> dict[str, Any]:
    try:
        return against_wrist(sensed(estimate, log, **settings), wrist) | response(estimate, log, **settings)
    except SensingError as error:
        return {"refused": str(error)}


def wrist_table(arm: Arm, models: Ur5Models, quick: bool) -> list[dict[str, Any]]:
    log = arm.log(FORCE_RUN)
    wrist = wrist_of(arm.folder / f"{FORCE_RUN}.npz", log.t)
    physical, everything = "robust+physical", (*OTHER_FREE, *SLOW_FREE)
    fits = {"robust": models.without(), physical: arm.fitted(everything, physical)}
    if not quick:
        fits |= {kind: arm.fitted(everything, kind) for kind in ("auto", "plain")}
        fits["robust, without No3"] = models.without("Movement_No3_Acc")
    cases: list[tuple[str, dict[str, Any]]] = [(kind, {}) for kind in fits]
    cases += [("robust", {"observer": observer_named("refresh")})]
    cases += [(physical, {"observer": observer_named(name)}) for name in OBSERVERS]
    cases += [(physical, {"observer": observer_named("momentum", gain=gain)}) for gain in (10.0, 40.0)]
    cases += [(physical, {"cutoff": cutoff}) for cutoff in (5.0, 20.0)]
    six = directions_named("wrench")
    cases += [(physical, {"wrench": {"directions": six}}), (physical, {"wrench": {"largest": (30.0, 1.5)}})]
    cases += [(physical, {"wrench": {"directions": six, "largest": (30.0, 1.5)}})]
    rows = []
    for kind, settings in cases:
        row = wrist_row(fits[kind], log, wrist, settings)
        rows.append({"model": kind, "settings": settings_word(settings)} | row)
    rows += zeroed_rows(models, log, wrist)
    with np.load(arm.folder / f"{FORCE_RUN}.npz") as data:
        own = replace(sensed(models.without(), log), wrench=np.array(data["tcp_force"], dtype=np.float64))
    return [*rows, {"model": "the controller's own", "settings": ""} | against_wrist(own, wrist)]


def zeroed_rows(models: Ur5Models, log: Recording, wrist: Wrist) -> list[dict[str, Any]]:
    """The same less the zero of the contact detector."""
    estimate, rows = models.without(), []
    for gain in (10.0, 20.0, 40.0):
        observer = observer_named("momentum", gain=gain)
        free = [sensed(models.without(name), models.arm.log(name), observer=observer) for name in SLOW_FREE]
        found = sensed(estimate, log, observer=observer)
        solver = WrenchSolver(robot=estimate.robot, directions=directions_named("force"))
        for follow in (2.0, 5.0, 10.0, np.inf) if gain == 20.0 else (5.0,):
            thresholds = learnt(free, estimate, ContactRules(zero=StandingZero(follow=follow)))
            zero = ContactDetector(thresholds=thresholds, step=found.step).along(found).zero
            word = f"momentum, gain {gain:g}, zeroed, follows in {follow:g} s"
            row = against_wrist(zeroed(found, zero, solver=solver), wrist)
            rows.append({"model": "robust", "settings": word} | row | response(estimate, log, observer=observer))
    return rows


def refresh_rows(models: Ur5Models) -> list[dict[str, Any]]:
    """Rms of the force of free runs, each by a model that has not seen it, with friction followed and without."""
    rows = []
    for name in SLOW_FREE:
        each = [
            sensed(models.without(name), models.arm.log(name), observer=observer_named(observer))
            for observer in ("momentum", "refresh")
        ]
        plain, followed = (float(np.sqrt(np.mean(np.sum(log.wrench[log.settled, :3] ** 2, axis=1)))) for log in each)
        rows.append({"log": name, "momentum": plain, "refresh": followed})
    return rows


# ---------------------------------------------------------------------------------------------- pushes


class Push(NamedTuple):
    """A labelled push [s], and the largest of what labels it."""

    start: float
    end: float
    size: float


def labelled(t: FloatArray, size: FloatArray, level: float) -> list[Push]:
    """Stretches above a level; those less than 0.3 s apart are one, those shorter than 0.05 s none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], size > level, [0]])))
    spans: list[list[int]] = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if spans and t[first] - t[spans[-1][1] - 1] < NEAR:
            spans[-1][1] = int(last)
        else:
            spans.append([int(first), int(last)])
    found = [Push(float(t[a]), float(t[b - 1]), float(size[a:b].max())) for a, b in spans]
    return [push for push in found if push.end - push.start >= 0.05]


def smooth(log: Recording) -> FloatArray:
    return np.asarray(sosfiltfilt(butter(2, 5.0, fs=log.rate, output="sos"), log.tau, axis=0))


def standing_labels(log: Recording) -> list[Push]:
    size = np.abs(smooth(log) - np.median(log.tau[log.t < log.t[0] + 1.5], axis=0)).max(axis=1)
    return labelled(log.t, size, LABEL_PART * float(size.max()))


def cyclic_labels(log: Recording, *, begin: float = 3.0, period: float = 6.0) -> list[Push]:
    torque, phases = smooth(log), np.arange(0.0, period, 0.008)
    cycles = int((log.t[-1] - begin) // period) + 1
    times = begin + phases[None] + period * np.arange(cycles)[:, None]
    each = np.stack([np.interp(times, log.t, column) for column in torque.T], axis=-1)
    usual = np.nanmedian(np.where((times <= log.t[-1])[..., None], each, np.nan), axis=0)
    phase = (log.t - begin) % period
    size = np.abs(torque - np.stack([np.interp(phase, phases, column) for column in usual.T], axis=1)).max(axis=1)
    size[log.t < begin + 0.2] = 0.0
    return labelled(log.t, size, LABEL_PART * float(size.max()))


def push_row(name: str, log: Recording, pushes: list[Push], events: Sequence[ContactEvent]) -> dict[str, Any]:
    times = [(event, [push for push in pushes if near(event, push)]) for event in events]
    first = {push: min((e.start for e, hit in times if push in hit), default=None) for push in pushes}
    found = {push: start for push, start in first.items() if start is not None}
    delays = [max(start - push.start, -NEAR) for push, start in found.items()]
    false = [event for event, hit in times if not hit]
    after = [event for event in false if any(0.0 < event.start - push.end < REBOUND for push in pushes)]
    return {
        "log": name, "seconds": log.duration, "pushes": len(pushes), "found": len(found),
        "missed": [(push.start, push.size) for push in pushes if push not in found],
        "delay_median": float(np.median(delays)) if delays else None, "delay_largest": max(delays, default=None),
        "false": len(false), "false_after_push": len(after),
        "events": [{"start": e.start, "end": e.end, "link": e.link, "peak": e.peak} for e in events],
    }  # fmt: skip


def near(event: ContactEvent, push: Push) -> bool:
    return event.start <= push.end + NEAR and event.end >= push.start - NEAR


def contacts(thresholds: ContactThresholds, found: SensedLog) -> tuple[ContactEvent, ...]:
    return ContactDetector(thresholds=thresholds, step=found.step).along(found).events


def learnt(free: Sequence[SensedLog], estimate: Estimate, rules: ContactRules) -> ContactThresholds:
    slow = force_sensor(estimate, rate=125.0).model.slow
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        return thresholds_of(free, slow=slow, rules=rules)


# ---------------------------------------------------------------------------------------------- free motion


def free_row(name: str, found: SensedLog, thresholds: ContactThresholds, learnt_on: Sequence[str]) -> dict[str, Any]:
    result = ContactDetector(thresholds=thresholds, step=found.step).along(found)
    seconds = found.n_t * found.step
    return {
        "log": name, "learnt_on": list(learnt_on), "seconds": seconds, "alarms": len(result.events),
        "per_hour": 3600.0 * len(result.events) / seconds, "largest": float(result.excess.max()),
        "faster_s": float(np.count_nonzero(result.fast) * found.step), "spread": thresholds.spread,
    }  # fmt: skip


ASSUMED = "nothing learnt"
RULES = {
    "default": ContactRules(),
    "zero stays": ContactRules(zero=StandingZero(follow=np.inf)),
    "no zero": ContactRules(zero=NO_ZERO),
    "no settling": ContactRules(settle=0.0),
}


def ur5_contacts(arm: Arm, models: Ur5Models) -> dict[str, Any]:
    whole = models.without()
    free = {name: models.seen(name) for name in SLOW_FREE}
    pairs = {(a, b): models.seen(a, b) for a in SLOW_FREE for b in SLOW_FREE if a != b}
    force = arm.log(FORCE_RUN)
    wrist = wrist_of(arm.folder / f"{FORCE_RUN}.npz", force.t)
    standing, moving = (arm.log(f"Movement_{name}") for name in ("No10_Standstill_WDist", "No5_Acc_slow_w_disturbance"))
    judged: list[tuple[Recording, list[Push]]] = [
        (force, labelled(wrist.t, np.linalg.norm(wrist.force, axis=1), LABEL_FORCE)),
        (standing, standing_labels(standing)),
        (moving, cyclic_labels(moving)),
    ]
    result: dict[str, Any] = {"pushes": [], "free": [], "halves": []}
    assumed = assumed_contact_thresholds(force_sensor(whole, rate=125.0))
    for log, pushes in judged:
        row = push_row(log.name, log, pushes, contacts(assumed, sensed(whole, log)))
        result["pushes"].append({"rules": ASSUMED} | row)
    result["free"] += [{"rules": ASSUMED} | free_row(name, free[name], assumed, []) for name in SLOW_FREE]
    for word, rules in RULES.items():
        thresholds = learnt(list(free.values()), whole, rules)
        for log, pushes in judged:
            row = push_row(log.name, log, pushes, contacts(thresholds, sensed(whole, log)))
            result["pushes"].append({"rules": word} | row)
        for name in SLOW_FREE:
            others = [other for other in SLOW_FREE if other != name]
            left = learnt([pairs[other, name] for other in others], whole, rules)
            result["free"].append({"rules": word} | free_row(name, free[name], left, others))
        result["halves"] += [{"rules": word} | row for row in half_rows(free, whole, rules)]
    return result


def half_rows(free: dict[str, SensedLog], estimate: Estimate, rules: ContactRules) -> list[dict[str, Any]]:
    """Thresholds from one half of every run, judged on the other: motions of a kind that was seen."""
    rows = []
    for which, (fit, judge) in {"second halves": (0, 1), "first halves": (1, 0)}.items():
        parts = {name: (part(log, 0), part(log, 1)) for name, log in free.items()}
        thresholds = learnt([halves[fit] for halves in parts.values()], estimate, rules)
        each = [free_row(name, halves[judge], thresholds, ["the other halves"]) for name, halves in parts.items()]
        alarms, seconds = sum(row["alarms"] for row in each), sum(row["seconds"] for row in each)
        rows.append({
            "log": which, "learnt_on": ["the other halves"], "seconds": seconds, "alarms": alarms,
            "per_hour": 3600.0 * alarms / seconds, "largest": max(row["largest"] for row in each),
            "faster_s": sum(row["faster_s"] for row in each), "spread": thresholds.spread,
        })  # fmt: skip
    return rows


def part(log: SensedLog, half: int) -> SensedLog:
    window = slice(0, log.n_t // 2) if half == 0 else slice(log.n_t // 2, None)
    names = ("t", "rows", "q", "dq", "tau", "tau_std", "raw", "wrench", "wrench_std", "settled", "lag")
    return replace(log, **{name: np.array(getattr(log, name)[window]) for name in names})


def clock_rows(arm: Arm) -> list[dict[str, Any]]:
    """Rms of the external torque in free motion, stamps counted as periods, believed, and as positions tell."""
    estimate, rows = arm.fitted(UR10E_FIT), []
    for name in UR10E_FREE[:1]:
        for stamps in STAMPS:
            found = sensed(estimate, arm.log(name), stamps=stamps)
            rows_moving = (np.abs(found.dq) > 0.2) & found.settled[:, None]
            rms = np.sqrt((np.square(found.tau) * rows_moving).sum(axis=0) / rows_moving.sum(axis=0))
            row = {"log": name, "clock": stamps, "rms": rms.tolist(), "believed": found.believed, "samples": found.n_t}
            rows.append(row)
    return rows


def show_clock(rows: list[dict[str, Any]]) -> None:
    print("\nrms of external torque in free motion, joints faster than 0.2 rad/s, Nm")
    for row in rows:
        print(
            f"{row['log']:42} {row['clock']:18} {' '.join(f'{value:6.2f}' for value in row['rms'])}  believed {row['believed']} of {row['samples']}"
        )


def ur10e_contacts(arm: Arm) -> dict[str, Any]:
    estimate = arm.fitted(UR10E_FIT)
    free = {name: sensed(estimate, arm.log(name)) for name in UR10E_FREE}
    log = arm.log("ur-20_01_22-push_pose_1")
    pushes = standing_labels(log)
    assumed = assumed_contact_thresholds(force_sensor(estimate, rate=100.0))
    row = push_row(log.name, log, pushes, contacts(assumed, sensed(estimate, log)))
    result: dict[str, Any] = {"pushes": [{"rules": ASSUMED} | row], "halves": []}
    result["free"] = [{"rules": ASSUMED} | free_row(name, found, assumed, []) for name, found in free.items()]
    for word, rules in RULES.items():
        thresholds = learnt(list(free.values()), estimate, rules)
        row = push_row(log.name, log, pushes, contacts(thresholds, sensed(estimate, log)))
        result["pushes"].append({"rules": word} | row)
        for name, found in free.items():
            others = [other for other in free if other != name]
            left = learnt([free[other] for other in others], estimate, rules)
            result["free"].append({"rules": word} | free_row(name, found, left, others))
        result["halves"] += [{"rules": word} | row for row in half_rows(free, estimate, rules)]
    return result


# ---------------------------------------------------------------------------------------------- payload


def payload_rows(ur5: Arm, ur10e: Arm, models: Ur5Models) -> list[dict[str, Any]]:
    """A known payload of 2.805 kg, free motion, and hand pushes, each asked whether it is a payload."""
    loaded = ur10e.fitted(UR10E_FIT)
    cases: list[tuple[Arm, Estimate, str, tuple[float, float] | None]] = [
        (ur10e, loaded, "ur-20_02_19_14harm50secLoad", None),
        (ur10e, loaded, "ur-20_02_19_14harm50secLoad", (12.0, 18.0)),
        (ur10e, loaded, "ur-20_02_12-40sec_12harm", None),
        (ur10e, loaded, "ur-20_01_22-push_pose_1", None),
        (ur5, models.without(), "Movement_No5_Acc_slow_w_disturbance", (18.0, 29.0)),
        (ur5, models.without(), "Movement_No10_Standstill_WDist", None),
    ]
    rows = []
    for arm, estimate, name, window in cases:
        found = sensed(estimate, arm.log(name))
        between = None if window is None else (float(found.t[0]) + window[0], float(found.t[0]) + window[1])
        seconds = found.t[-1] - found.t[0] if window is None else window[1] - window[0]
        check = check_payload(found, WrenchSolver(robot=estimate.robot), between=between)
        rows.append({"log": name, "seconds": float(seconds)} | check.to_dict())
    return rows


# ---------------------------------------------------------------------------------------------- output


def settings_word(settings: dict[str, Any]) -> str:
    words = []
    for name, value in settings.items():
        if isinstance(value, Observer):
            words.append(f"{value.key}, gain {value.gain:g}")
        elif isinstance(value, dict):
            words.append("six components" if "directions" in value else "force")
            words += [f"at most {value['largest']}"] if "largest" in value else []
        else:
            words.append(f"{name} {value:g}")
    return ", ".join(words) or "defaults"


def show_wrist(rows: list[dict[str, Any]]) -> None:
    print(
        f"{'model':22} {'settings':48} {'corr |F|':>8} {'lag ms':>7} {'rms N':>6} {'halves':>12} {'scale':>10} {'axis deg':>10} {'plain':>6} {'t50 ms':>7} {'t90 ms':>7}"
    )
    for row in rows:
        if "refused" in row:
            print(f"{row['model']:22} {row['settings']:48} {row['refused']}")
            continue
        times = f"{1e3 * row['t50']:7.0f} {1e3 * row['t90']:7.0f}" if "t50" in row else ""
        halves, scales = (" ".join(f"{value:.2f}" for value in row[name]) for name in ("rms_halves", "scales"))
        print(
            f"{row['model']:22} {row['settings']:48} {row['correlation']:8.4f} {1e3 * row['lag']:7.0f} {row['rms']:6.2f} "
            f"{halves:>12} {scales:>10} {row['axis_apart_deg']:10.0f} {row['plain_rms']:6.2f} {times}"
        )


def show_contacts(robot: str, found: dict[str, Any]) -> None:
    print(
        f"\n{robot}: {'pushes of':42} {'rules':18} {'found':>7} {'delay s, median, largest':>25} {'false':>6} {'behind a push':>14}  missed (s, size)"
    )
    for row in found["pushes"]:
        delay = "" if row["delay_median"] is None else f"{row['delay_median']:.2f} {row['delay_largest']:.2f}"
        missed = ", ".join(f"{at:.1f} s {size:.0f}" for at, size in row["missed"])
        print(
            f"{'':6}{row['log'][:42]:42} {row['rules']:18} {row['found']:3d}/{row['pushes']:<3d} {delay:>25} {row['false']:6d} {row['false_after_push']:14d}  {missed}"
        )
    print(
        f"{'':6}{'unseen free motion':42} {'rules':18} {'seconds':>8} {'alarms':>7} {'per hour':>9} {'largest':>8} {'faster s':>9}"
    )
    for row in (*found["free"], *found["halves"]):
        print(
            f"{'':6}{row['log'][:42]:42} {row['rules']:18} {row['seconds']:8.0f} {row['alarms']:7d} {row['per_hour']:9.0f} {row['largest']:8.2f} {row['faster_s']:9.1f}"
        )


def show_payload(rows: list[dict[str, Any]]) -> None:
    print(f"\n{'payload or contact':42} {'seconds':>8} {'verdict':>12} {'mass kg':>9} {'+-':>6} {'unexplained':>12}")
    for row in rows:
        print(
            f"{row['log'][:42]:42} {row['seconds']:8.1f} {row['verdict']:>12} {row['mass']:9.3f} {row['mass_std']:6.3f} {row['unexplained']:12.2f}"
        )


def show_refresh(rows: list[dict[str, Any]]) -> None:
    print("\nrms of the force in free motion, N: momentum, refresh")
    for row in rows:
        print(f"{row['log'][:42]:42} {row['momentum']:6.2f} {row['refresh']:6.2f}")


SHOWN = {"wrist": show_wrist, "refresh": show_refresh, "clock": show_clock, "payload": show_payload}


def arms(data: Path) -> dict[str, Arm]:
    def arm(folder: str, urdf: str, ending: str) -> Arm:
        place = data / folder
        return Arm(folder=place, map=MAPS / f"{folder}.toml", ending=ending, robot=load_robot(place / urdf))

    return {"ur5": arm("ur5", "ur5_robot.urdf", ".npz"), "ur10e": arm("ur10e", "ur10e.urdf", ".csv.gz")}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--quick", action="store_true", help="two models instead of five against the wrist sensor")
    options = parser.parse_args()
    if not options.data.is_dir():
        raise SystemExit(f"{options.data}: no such folder; name the folder of the recordings with --data")
    both = arms(options.data)
    models = Ur5Models(both["ur5"])
    ways: dict[str, Callable[[], Any]] = {
        "wrist": lambda: wrist_table(both["ur5"], models, options.quick),
        "refresh": lambda: refresh_rows(models),
        "ur5": lambda: ur5_contacts(both["ur5"], models),
        "ur10e": lambda: ur10e_contacts(both["ur10e"]),
        "clock": lambda: clock_rows(both["ur10e"]),
        "payload": lambda: payload_rows(both["ur5"], both["ur10e"], models),
    }
    results = {}
    for name, way in ways.items():
        results[name] = way()
        if not options.json:
            SHOWN.get(name, lambda found, name=name: show_contacts(name, found))(results[name])
    if options.json:
        print(json.dumps(results))


if __name__ == "__main__":
    main()
