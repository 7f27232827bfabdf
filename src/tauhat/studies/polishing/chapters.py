"""The chapters of the polishing study: the story from calibration to force, its tables and drawings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tauhat.errors import ModelError
from tauhat.studies.polishing.arm import WARMTHS, Warmth
from tauhat.studies.polishing.findings import Findings, Spread, finished, spread
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, NO_WARMTH, OPEN_LOOP, OTHERS, SOLVED, WITH_WARMTH
from tauhat.studies.polishing.shift import Worked
from tauhat.studies.polishing.trials import GLOBAL, LOCAL, Outcome
from tauhat.studies.polishing.truth import Difficulty
from tauhat.studies.polishing.work import SHAPES
from tauhat.studies.study import Cell, Chapter, Chart, Series, Table

_FIRST = f"{NO_WARMTH}, first posture", f"{WITH_WARMTH}, first posture"
_AIR = f"{NO_WARMTH}, pass in air"


def summary_of(found: Findings) -> str:
    """Return the answer in a few sentences."""
    task = found.arm.work.task
    parts = [_told(found, difficulty) for difficulty in found.difficulties]
    return (
        f"{found.arms} arms ({found.arm.robot}) of each kind polish flat and curved workpieces with {task.force:g} N "
        f"at {1e3 * task.feed:g} mm/s, force known from motor torques alone. RMS error of the true "
        f"normal force, median over the jobs done to their end: {'; '.join(parts)}."
    )


def _told(found: Findings, difficulty: Difficulty) -> str:
    names = (WITH_WARMTH, _AIR, NO_WARMTH, LOAD_CELL)
    told = []
    for name in names:
        cold, warm = (spread(found.of(name, difficulty, warmth)).median for warmth in WARMTHS)
        told.append(f"{name} {cold:.3g} % cold and {warm:.3g} % warm")
    return f"{difficulty} arms, " + ", ".join(told)


def scene_chapter(found: Findings) -> Chapter:
    """Return what was done."""
    arm, task, plant = found.arm, found.arm.work.task, found.arm.plant
    calibration = (
        f"Calibration: every arm runs a designed motion through the whole room for {arm.calibration.seconds:g} s, "
        "beginning cold. From that log come three models: the textbook's, with Coulomb and viscous friction; one whose "
        "friction remembers its displacement; and that one with a warmth for each joint that nobody measured. Models "
        "without warmth see the second half only, when the arm is warm."
    )
    work = (
        f"Work: a tool on a spring of {1e-3 * arm.tool.stiffness:g} N/mm presses with {task.force:g} N on a workpiece "
        f"and is fed {2e3 * task.half:g} mm there and back at {1e3 * task.feed:g} mm/s. The surface is "
        f"{1e3 * arm.work.tilted:g} mrad and {1e3 * arm.work.beside:g} mm (one sigma) from where the path believes it; "
        "places before the arm change from arm to arm. Contact, friction of the tool, the arm's own controller with "
        "its delay, and all errors of encoders and currents are simulated; the arm knows its description only."
    )
    difficulty = (
        f"Easy arms have Stribeck friction of {100 * plant.stribeck[0]:g} % beside what the models have. Hard arms "
        f"have {100 * plant.stribeck[1]:g} %, bristles {plant.length[1]:g} times as long as the models "
        f"believe, friction by load, and since the calibration {100 * plant.wrong:g} % (one sigma) of "
        f"every link's weight and every drive's torque constant have changed. Warm arms are as warm as "
        f"the calibration leaves them; going on for long, it would take {100 * plant.lost[0]:g} to "
        f"{100 * plant.lost[1]:g} % of their friction. A pass in air is the whole job {1e3 * arm.work.limits.height:g} "
        "mm higher, way down and passes, made just before it and as warm."
    )
    loop = (
        "A force law of 1 Hz moves the tool along the normal. The error counts while the tool is fed under full force, "
        "turning round included; it is that of the true force, which no sensor of the arm shows."
    )
    return Chapter(title="From calibration to force", text=(calibration, work, difficulty, loop))


def force_chapter(found: Findings) -> Chapter:
    """Return the error of the true force, by what the polisher reads."""
    tables = [_forces(found, difficulty) for difficulty in found.difficulties]
    series = tuple(_bar(found, difficulty, warmth) for difficulty in found.difficulties for warmth in WARMTHS)
    chart = Chart(
        title="Error of the true normal force", kind="bars", x_title="what the polisher reads",
        y_title="RMS [% of the commanded force]", series=series, note="Medians and quartiles over jobs.",
    )  # fmt: skip
    return Chapter(title="The force that was pressed with", text=_words(found), tables=tuple(tables), charts=(chart,))


def _words(found: Findings) -> tuple[str, ...]:
    def of(name: str, warmth: int) -> float:
        return spread(found.of(name, "easy", WARMTHS[warmth])).median

    cold, steady, air = (of(name, 0) for name in (WITH_WARMTH, NO_WARMTH, _AIR))
    return (
        (
            f"Cold, the model without warmth takes lost friction for force: {steady:.3g} %. With a pass in air along "
            f"the same path it is {air:.3g} %, and with the warmth that runs along, without a pass, {cold:.3g} %."
        ),
        (
            f"A load cell reaches {of(LOAD_CELL, 0):.3g} % with the same loop; pressing blindly to a depth is off by "
            f"{of(OPEN_LOOP, 0):.3g} %."
        ),
    )


def _forces(found: Findings, difficulty: Difficulty) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name in found.sensors(difficulty):
        row: list[Cell] = [name]
        for warmth in WARMTHS:
            jobs = found.of(name, difficulty, warmth)
            rms, bias = spread(jobs), spread(jobs, "bias")
            row += [rms.median, _between(rms), rms.largest, bias.median, finished(jobs)]
        jobs = [*found.of(name, difficulty, "cold"), *found.of(name, difficulty, "warm")]
        row += [spread(jobs, "read", 1.0).median, _inside(jobs)]
        rows.append(tuple(row))
    what = ("RMS [%]", "quartiles", "worst", "bias [%]", "done")
    return Table(
        title=f"{difficulty.capitalize()} arms",
        header=("reading", *(f"{warmth}: {w}" for warmth in WARMTHS for w in what), "reading off [N]", "inside [%]"),
        rows=tuple(rows),
        note="RMS and mean error of the true force over the commanded one, over jobs that were done to their end; "
        "`done` names why others were given up. Inside: 95 % error bars of the reading that hold the true force.",
    )


def _between(figures: Spread) -> str:
    return f"{figures.low:.3g} to {figures.high:.3g}" if np.isfinite(figures.low) else "-"


def _inside(jobs: list[Outcome]) -> float:
    shares = [100.0 * job.inside for job in jobs if np.isfinite(job.inside)]
    return float(np.mean(shares)) if shares else np.nan


def _bar(found: Findings, difficulty: Difficulty, warmth: Warmth) -> Series:
    names = tuple(name for name in found.sensors(difficulty) if name != OPEN_LOOP)
    figures = [spread(found.of(name, difficulty, warmth)) for name in names]
    return Series(
        name=f"{difficulty}, {warmth}", x=names, y=tuple(f.median for f in figures), low=tuple(f.low for f in figures),
        high=tuple(f.high for f in figures),
    )  # fmt: skip


def shapes_chapter(found: Findings) -> Chapter:
    """Return flat against curved."""
    rows: list[tuple[Cell, ...]] = []
    for difficulty in found.difficulties:
        for name in found.sensors(difficulty):
            figures = [
                spread(found.of(name, difficulty, warmth, shape=shape)).median for shape in SHAPES for warmth in WARMTHS
            ]
            rows.append((difficulty, name, *figures))
    header = ("arms", "reading", *(f"{shape}, {warmth} [%]" for shape in SHAPES for warmth in WARMTHS))
    table = Table(title="Flat and curved", header=header, rows=tuple(rows), note="Medians of the RMS over jobs.")
    text = (f"The curved workpiece is a cylinder of {1e3 * found.arm.work.radius:g} mm radius, crossed by the path.",)
    return Chapter(title="Flat and curved workpieces", text=text, tables=(table,))


def others_chapter(found: Findings) -> Chapter:
    """Return other observers and other solves."""
    rows: list[tuple[Cell, ...]] = []
    for name in (_AIR, *found.others(), NO_WARMTH, WITH_WARMTH):
        row: list[Cell] = [name]
        for warmth in WARMTHS:
            jobs = found.of(name, "easy", warmth, shape="flat")
            row += [spread(jobs).median, finished(jobs)]
        rows.append(tuple(row))
    table = Table(
        title="Observers and solves, easy arms, flat workpiece",
        header=("reading", *(f"{warmth}: {what}" for warmth in WARMTHS for what in ("RMS [%]", "done"))),
        rows=tuple(rows),
        note="Observers by name have the model without warmth and a pass in air; all solve for one direction where no "
        "other solve is named.",
    )
    text = tuple(_compared(found, warmth) for warmth in WARMTHS)
    return Chapter(title="Observers and solves", text=text, tables=(table,))


def _compared(found: Findings, warmth: Warmth) -> str:
    """Return how far observers are apart, and solves with one model."""

    def of(name: str) -> float:
        return spread(found.of(name, "easy", warmth, shape="flat")).median

    figures = [of(name) for name in (_AIR, *(name for name, way in OTHERS.items() if way.air))]
    observers = [figure for figure in figures if np.isfinite(figure)] or [np.nan]
    solves = [of(name) for name in (WITH_WARMTH, *(f"{WITH_WARMTH}, {solve}" for solve in tuple(SOLVED)[1:]))]
    told = ", ".join(f"for {solve} {rms:.3g} %" for solve, rms in zip(SOLVED, solves, strict=True))
    return (
        f"{warmth.capitalize()}, observers by name lie between {min(observers):.3g} and {max(observers):.3g} %. With "
        f"warmth, solved {told}: a direction that is left open can take errors of the joints for force."
    )


def local_chapter(found: Findings) -> Chapter:
    """Return calibration where the work is against that through the whole room."""
    rows: list[tuple[Cell, ...]] = []
    for name in _FIRST:
        for calibration in (GLOBAL, LOCAL):
            row: list[Cell] = [name.split(",")[0], calibration]
            for warmth in WARMTHS:
                jobs = found.of(name, "easy", warmth, calibration=calibration)
                figures = spread(jobs)
                row += [figures.median, _between(figures), finished(jobs)]
            rows.append(tuple(row))
    table = Table(
        title="Calibrated through the whole room, and where the work is",
        header=(
            "model",
            "calibration",
            *(f"{w}: {what}" for w in WARMTHS for what in ("RMS [%]", "quartiles", "done")),
        ),
        rows=tuple(rows),
        note="Easy arms, the first place of the workpiece, flat; force solved for one direction.",
    )
    wins = _wins(found)
    text = (
        (
            "The same time of calibration is spent on programs of via-points in a tube above the path, in two stages, "
            f"instead of a motion through the whole room. With warmth in the model it is better in {wins}."
        ),
    )
    return Chapter(title="Local and global calibration", text=text, tables=(table,))


def _wins(found: Findings) -> str:
    better = total = 0
    for warmth in WARMTHS:
        whole, near = (found.of(_FIRST[1], "easy", warmth, calibration=c) for c in (GLOBAL, LOCAL))
        pairs = [(a.rms, b.rms) for a, b in zip(whole, near, strict=True) if np.isfinite([a.rms, b.rms]).all()]
        better += sum(b < a for a, b in pairs)
        total += len(pairs)
    return f"{better} of {total} jobs"


def drawn_chapter(found: Findings) -> Chapter:
    """Return one arm's jobs, drawn."""
    charts = [_drawn(found, warmth) for warmth in WARMTHS]
    text = (
        (
            "The arm comes along the path in air and back, comes down slowly, presses, waits, feeds there and back, "
            "and retracts. In air a good sensor reads nothing."
        ),
    )
    return Chapter(title="One arm at work", text=text, charts=tuple(charts))


def _drawn(found: Findings, warmth: Warmth) -> Chart:
    jobs = [job for job in found.drawn if job.warmth == warmth]
    series = [Series(name=f"{job.sensor}: true", x=job.t, y=job.true) for job in jobs]
    series += [Series(name=f"{job.sensor}: read", x=job.t, y=job.read) for job in jobs if job.sensor != LOAD_CELL]
    return Chart(
        title=f"One {warmth} arm, flat workpiece", kind="lines", x_title="time [s]", y_title="normal force [N]",
        series=tuple(series), note="True force, and what the polisher read.",
    )  # fmt: skip


def shift_chapter(done: Sequence[Worked], hours: float) -> Chapter:
    """Return the force over a shift.

    Raises
    ------
    ModelError
        when nothing was done.
    """
    if not done:
        raise ModelError("no jobs of a shift to tell of", where="polishing study", expected="one or more")
    names = tuple(dict.fromkeys(worked.outcome.sensor for worked in done))
    times = sorted({worked.hour for worked in done})
    rms, bias = ([_over_shift(done, name, times, figure) for name in names] for figure in ("rms", "bias"))
    warm = [float(np.mean([w.temperature for w in done if w.hour == hour])) for hour in times]
    charts = (
        Chart(
            title="Error of the true force over the shift", kind="lines", x_title="time [h]",
            y_title="RMS [% of the commanded force]", series=tuple(rms),
        ),
        Chart(
            title="Mean of the error over the shift", kind="lines", x_title="time [h]", y_title="bias [%]",
            series=tuple(bias),
        ),
        Chart(
            title="Warmth of the joints", kind="lines", x_title="time [h]", y_title="mean temperature [deg C]",
            series=(Series(name="joints", x=tuple(times), y=tuple(warm)),),
        ),
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    for name in names:
        jobs = [worked.outcome for worked in done if worked.outcome.sensor == name]
        drift, figures = spread(jobs, "bias"), spread(jobs)
        rows.append((name, figures.median, figures.largest, drift.median, drift.high - drift.low, finished(jobs)))
    table = Table(
        title=f"Over {hours:g} h",
        header=("reading", "RMS [%]", "worst [%]", "bias [%]", "quartiles of bias apart [%]", "done"),
        rows=tuple(rows),
        note="A pass in air is that of the cold beginning where it is not taken anew.",
    )
    text = (
        (
            "The shift begins cold. A job is simulated every quarter of an hour; in between joints take "
            "the heat of work or, in the break, cool, in one exact step. The virtual sensor starts again at every job; "
            "the drives' torque sensors drift meanwhile."
        ),
    )
    return Chapter(title="A shift", text=text, tables=(table,), charts=charts)


def _over_shift(done: Sequence[Worked], name: str, times: list[float], figure: str) -> Series:
    y = []
    for hour in times:
        jobs = [w.outcome for w in done if w.outcome.sensor == name and w.hour == hour]
        y.append(spread(jobs, figure).median)
    return Series(name=name, x=tuple(times), y=tuple(y))
