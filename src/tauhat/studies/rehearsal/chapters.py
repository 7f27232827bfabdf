"""The chapters of a rehearsal: the answer, the errors, the joints, and what was done."""

from __future__ import annotations

import numpy as np

from tauhat.studies.doubts import doubts_chapter
from tauhat.studies.rehearsal.cells import Cell
from tauhat.studies.rehearsal.findings import Findings
from tauhat.studies.rehearsal.trials import BAND
from tauhat.studies.study import Cell as TableCell
from tauhat.studies.study import Chapter, Chart, Series, Table

_ERROR = "error of the torque on an unseen motion [%]"
_FEWEST_TO_SPREAD = 5  # robots whose tenths are told
_MOST = 0.5  # share of the squared error that constant errors of the sensors make, from which it is told


def summary_of(found: Findings) -> str:
    """Return the answer in a few sentences."""
    told = found.shown
    if told is None:
        return f"No model could be identified: {found.outcomes[0].failure}"
    words = [_verdict(found, told), _constant_words(told)]
    lost = sum(bool(outcome.failure) for outcome in found.outcomes)
    if lost:
        words.append(f"{lost} of {len(found.outcomes)} identifications gave no model.")
    return " ".join(word for word in words if word)


def _verdict(found: Findings, told: Cell) -> str:
    name = found.experiment.robot.name
    what = f"{told.seconds:g} s of motion with {told.sensors} sensors"
    figures = f"the torque of an unseen motion is off by {100 * told.error:.3g} % ({_of_robots(told)})"
    if found.target is None:
        return f"{name}: from {what}, {figures}."
    wanted = f"{100 * found.target:g} %"
    if found.answer is None:
        return f"{name}: nothing that was tried stays within {wanted} on nine of ten robots. Best is {what}: {figures}."
    return f"{name}: for {wanted}, {what} will do: {figures}."


def _of_robots(told: Cell) -> str:
    if told.robots == 1:
        return "one robot"
    within = f"{100 * told.low:.3g} to {100 * told.high:.3g} %"
    spread = f"; eight of ten are at {within}" if told.robots >= _FEWEST_TO_SPREAD else ""
    return f"median of {told.robots} robots{spread}"


def _constant_words(told: Cell) -> str:
    """Return what is to be said where most of the error is what the torque sensors are always wrong by."""
    if not told.error**2 - told.as_sensed**2 > _MOST * told.error**2:
        return ""
    return (
        "Most of it is what the torque sensors are always wrong by, their factors and offsets: without these the model "
        f"is off by {100 * told.as_sensed:.3g} %. A longer motion does not help there; zeroed sensors and tauhat "
        "calibrate-drives do."
    )


def chapters_of(found: Findings) -> tuple[Chapter, ...]:
    """Return all chapters."""
    chapters = [_errors(found)]
    if found.shown is not None:
        chapters.append(_joints(found, found.shown))
    doubts = doubts_chapter(
        (outcome.failure for outcome in found.outcomes),
        (doubt for outcome in found.outcomes for doubt in outcome.doubts),
        of="identifications",
    )
    if doubts is not None:
        chapters.append(doubts)
    return (*chapters, _done(found))


def _errors(found: Findings) -> Chapter:
    rule = (
        "Error: norm of the predicted less the true torque over that of the true torque, all joints stacked, below "
        f"{BAND:g} Hz on a motion that was not fitted. The true torque is that of the side where the sensors sit, "
        "without any error."
    )
    parts = (
        "As sensed: held against the true torque with the factors and offsets that the torque sensors are always wrong "
        "by, which no log can tell. On the log: what tauhat verify shows on a real robot, through the filters that "
        "were chosen from that log."
    )
    target = ""
    if found.target is not None:
        target = (
            f"The target of {100 * found.target:g} % is met where every robot gave a model and nine of ten are within "
            "it. Cheapest are the worst sensors that meet it at any length, and with them the shortest motion."
        )
    text = tuple(words for words in (rule, parts, target) if words)
    charts = (_over_length(found),) if len(found.lengths) > 1 else ()
    return Chapter(title="Error over length and sensors", text=text, tables=(_cells(found),), charts=charts)


def _cells(found: Findings) -> Table:
    errors = ("error [%]", "a tenth below [%]", "nine tenths below [%]", "as sensed [%]", "on the log [%]")
    wanted = ("verdict",) if found.target is not None else ()
    return Table(
        title="Error of the torque",
        header=("sensors", "motion [s]", *errors, "truth inside [%]", "models", *wanted),
        rows=tuple((*_row(cell), *_mark(found, cell)) for cell in found.cells),
        note=f"Medians over {found.robots} robots. Truth inside: share of the 95 % intervals of the base parameters "
        "that hold the true value; errors that are no noise, such as wrong factors, are not in the intervals.",
    )


def _row(cell: Cell) -> tuple[TableCell, ...]:
    figures = (cell.error, cell.low, cell.high, cell.as_sensed, cell.on_log, cell.inside)
    models = f"{cell.models} of {cell.robots}"
    return (cell.sensors, cell.seconds, *(100.0 * figure for figure in figures), models)


def _mark(found: Findings, cell: Cell) -> tuple[str, ...]:
    if found.target is None:
        return ()
    if cell == found.answer:
        return ("cheapest",)
    return ("meets it" if cell.meets(found.target) else "",)


def _over_length(found: Findings) -> Chart:
    lines = []
    for sensors in dict.fromkeys(cell.sensors for cell in found.cells):
        cells = [cell for cell in found.cells if cell.sensors == sensors]
        y, low, high = (tuple(100.0 * getattr(cell, name) for cell in cells) for name in ("error", "low", "high"))
        lines.append(Series(name=sensors, x=tuple(cell.seconds for cell in cells), y=y, low=low, high=high))
    if found.target is not None:
        ends = (found.lengths[0], found.lengths[-1])
        lines.append(Series(name="target", x=ends, y=(100.0 * found.target,) * 2))
    return Chart(
        title="Error over the length of the motion",
        kind="lines",
        x_title="length of the motion [s]",
        y_title=_ERROR,
        series=tuple(lines),
        logarithmic=("x", "y"),
        note="Medians and what a tenth and nine tenths of the robots stay below. Where a line is flat, a longer motion "
        "does not help: the error is not noise.",
    )


def _joints(found: Findings, told: Cell) -> Chapter:
    own = [o for o in found.outcomes if (o.sensors, o.seconds) == (told.sensors, told.seconds) and not o.failure]
    errors = 100.0 * np.array([outcome.joints for outcome in own])
    low, middle, high = np.quantile(errors, [0.1, 0.5, 0.9], axis=0)
    names = found.experiment.robot.joint_names
    rows = tuple(zip(names, middle.tolist(), low.tolist(), high.tolist(), strict=True))
    note = "Each joint's error over the norm of its own true torque: joints that carry little have the largest."
    table = Table(
        title=f"Error joint by joint, {told.seconds:g} s with {told.sensors} sensors",
        header=("joint", "error [%]", "a tenth below [%]", "nine tenths below [%]"),
        rows=rows,
        note=note,
    )
    series = Series(
        name=told.sensors, x=names, y=tuple(middle.tolist()), low=tuple(low.tolist()), high=tuple(high.tolist())
    )
    chart = Chart(
        title="Error joint by joint", kind="bars", x_title="joint", y_title=_ERROR, series=(series,), note=note
    )
    return Chapter(title="Joint by joint", text=(), tables=(table,), charts=(chart,))


def _done(found: Findings) -> Chapter:
    experiment, settings = found.experiment, found.experiment.settings
    more = [name for name in ("elasticity", "heat", "attached") if getattr(experiment, name)]
    extras = f", and {', '.join(more)} as the experiment says" if more else ""
    robots = (
        f"{found.robots} true robots of {experiment.robot.name}: parameters {100 * experiment.spread:g} % about the "
        f"description, friction of the kind {experiment.friction}{extras}. A MuJoCo plant with a step of "
        f"{1e3 * settings.timestep:g} ms follows each motion under its controller at {settings.control_rate:g} Hz; "
        f"the log has {settings.sample_rate:g} Hz. What a robot's sensors are wrong by stays from log to log."
    )
    fitted = (
        f"Each log was identified with the {found.terms} model by {found.estimator}, filters chosen from the log, "
        f"and verified on {found.unseen}, logged by the same sensors. Lengths and sensors see the same robots."
    )
    limits = (
        "What it cannot tell: whatever the plant does not have, such as bending links or friction of a kind that was "
        "not chosen, and sensors that are worse than they were said to be."
    )
    return Chapter(title="What was done", text=(robots, fitted, limits), tables=(*_motions(found), *_sensors(found)))


def _motions(found: Findings) -> tuple[Table, ...]:
    if not found.designs:
        return ()
    rows = tuple((period, design.condition, design.seconds) for period, design in sorted(found.designs.items()))
    return (
        Table(
            title="Designed motions",
            header=("period [s]", "condition number", "design [s]"),
            rows=rows,
            note="Designed once for all robots, on the description; longer motions repeat them.",
        ),
    )


def _sensors(found: Findings) -> tuple[Table, ...]:
    effort = found.experiment.robot.effort_limit
    part = 100.0 / np.where(np.isfinite(effort), effort, np.nan)
    torques: list[tuple[TableCell, ...]] = []
    clocks: list[tuple[TableCell, ...]] = []
    for named in found.sensors:
        errors = named.errors
        in_parts = [
            float(np.mean(np.asarray(getattr(errors, name)) * part))
            for name in ("torque_noise", "torque_offset_spread", "torque_drift")
        ]
        ripple = float(np.mean(np.sum([np.asarray(ripple.amplitude) for ripple in errors.ripples], axis=0) * part))
        factor = 100.0 * float(np.mean(errors.torque_factor_spread))
        torques.append((named.name, errors.torque_side, *in_parts, ripple, factor))
        jitter = 1e3 * max(errors.sampling_jitter, errors.stamp_jitter)
        step, lost = float(np.max(errors.encoder_step)), 100.0 * errors.lost_samples
        clocks.append((named.name, step, 1e3 * errors.torque_delay, jitter, lost))
    note = "Noise, offset, drift and ripple in parts of each joint's largest torque; of presets, our choice."
    header = ("sensors", "torque of the", "noise [%]", "offset [%]", "drift [%/h]", "ripple [%]", "factor [%]")
    steps = ("sensors", "position step [rad]", "torque late [ms]", "jitter [ms]", "lost rows [%]")
    return (
        Table(title="Sensors: torque", header=header, rows=tuple(torques), note=note),
        Table(title="Sensors: position and clock", header=steps, rows=tuple(clocks)),
    )
