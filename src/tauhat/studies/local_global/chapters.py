"""The chapters of the comparison of local and global calibration: tables, drawings, and the words to read them by."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.limits.cartesian_limit import tool_frame
from tauhat.excitation.task_design.blocks import BLOCKS
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.inverse_kinematics import FrameKinematics
from tauhat.studies.local_global.arms import JUDGED, Plant
from tauhat.studies.local_global.conclusions import verdict
from tauhat.studies.local_global.findings import FITS, Findings
from tauhat.studies.local_global.motions import GLOBAL
from tauhat.studies.study import Cell, Chapter, Chart, Series, Table

_DRAWN = 2000  # points of a drawn way of the tool
_PAIRS = (("local", GLOBAL), ("one stage", GLOBAL), ("both", GLOBAL), ("both", "local"), ("local", "one stage"))


def scene_chapter(found: Findings, plant: Plant, terms: str) -> Chapter:
    """Return what is moved how, and what the models do not know."""
    work = found.work
    text = (
        (
            f"The work is a polishing path of {work.passes} straight passes of {1e3 * work.length:g} mm, "
            f"{1e3 * work.spacing:g} mm apart, at {1e3 * work.speed:g} mm/s with the tool's orientation fixed. "
            f"The local motions are programs of via-points in a tube of {1e3 * work.clearance:g} mm around it, with "
            f"{np.degrees(work.freedom.tilt):.0f} degrees of tilt; the global one is a Fourier series inside the "
            "joints' limits. Neither holds the path itself."
        ),
        (
            f"Every arm has parameters of its own, about {100 * plant.spread:g} % from the description, friction of "
            f"the kind {plant.friction}, joints that bend and have {1e3 * plant.gap:g} mrad of backlash, friction that "
            "falls with the temperature, and the torque sensors of an industrial arm. The model of all fits is "
            f"{terms}: it has none of these. All logs are of joints {plant.warm_up:g} K above the surroundings, "
            "but for the cold path."
        ),
    )
    return Chapter(title="The work and the motions", text=text, tables=(_motions(found),), charts=(_ways(found),))


def _motions(found: Findings) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for fit in FITS:
        fitted = {name: found.motions.fitted[name] for name in found.motions.fits[fit]}
        named = ", ".join(f"{name} {motion.duration:.3g} s" for name, motion in fitted.items())
        fastest = max(float(np.abs(motion.sample(_times(motion)).dq).max()) for motion in fitted.values())
        rows.append((fit, named, fastest, 100 * found.fitted(fit)))
    return Table(
        title="What each model is fitted to",
        header=("model", "motions", "fastest joint [rad/s]", "residual [%]"),
        rows=tuple(rows),
        note="Residual over torque on the logs that were fitted, median over the arms.",
    )


def _ways(found: Findings) -> Chart:
    motions = found.motions
    shown: dict[str, Trajectory] = {name: motions.fitted[name] for name in (GLOBAL, *motions.fits["local"])}
    series = []
    for name, motion in {**shown, "the work": motions.path}.items():
        points = _tool_way(found, motion)
        series.append(Series(name=name, x=tuple(points[:, 0].tolist()), y=tuple(points[:, 1].tolist())))
    return Chart(
        title="The tool from above",
        kind="lines",
        x_title="x [m]",
        y_title="y [m]",
        series=tuple(series),
        note="The local motions stay around the work; the global one goes through the whole room.",
    )


def _tool_way(found: Findings, motion: Trajectory) -> FloatArray:
    tool = FrameKinematics(found.robot, tool_frame(found.robot, None).name)
    return np.array([tool.at(q).translation for q in motion.sample(_times(motion)).q])


def _times(motion: Trajectory) -> FloatArray:
    return np.linspace(0.0, motion.duration, _DRAWN)


def error_chapter(found: Findings) -> Chapter:
    """Return the errors on the motions that no model was fitted to."""
    text = (
        (
            "Error of the predicted torque over the measured one, all joints, through the same low-pass. The measured "
            "torque has noise and drift of its own, which no model can predict. The path is the work; elsewhere are "
            "random motions from pose to pose in the whole room, others for every arm."
        ),
    )
    tables = (_errors(found), _paired(found), _joints(found))
    return Chapter(title="Torque on motions that were not fitted", text=text, tables=tables, charts=(_drawn(found),))


def _errors(found: Findings) -> Table:
    header = ["model"]
    for judged in JUDGED:
        header += [f"{judged}: median", "quartiles"]
    rows: list[tuple[Cell, ...]] = []
    for fit in FITS:
        row: list[Cell] = [fit]
        for judged in JUDGED:
            low, median, high = (100 * value for value in found.quartiles(fit, judged))
            row += [median, f"{low:.3g} to {high:.3g}"]
        rows.append(tuple(row))
    return Table(title="Error over torque [%]", header=tuple(header), rows=tuple(rows), note=_over(found))


def _paired(found: Findings) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for fit, other in _PAIRS:
        for judged in JUDGED:
            low, median, high = found.ratio(fit, other, judged)
            wins = f"{found.wins(fit, other, judged)} of {found.count}"
            said = verdict(found, fit, other, judged)
            rows.append((fit, other, judged, wins, median, f"{low:.3g} to {high:.3g}", said))
    return Table(
        title="Arm by arm",
        header=("model", "against", "motion", "smaller on", "ratio of errors", "quartiles", "so"),
        rows=tuple(rows),
        note="The last column is a two-sided sign test over the arms at 5 %.",
    )


def _joints(found: Findings) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for judged in JUDGED:
        rows.append((judged, "torque", *found.torque(judged).tolist()))
        rows += [(judged, fit, *found.joints(fit, judged).tolist()) for fit in FITS]
    return Table(
        title="Root mean square joint by joint [Nm]",
        header=("motion", "error of model", *found.robot.joint_names),
        rows=tuple(rows),
        note=f"The rows torque are the measured torque itself. {_over(found)}",
    )


def _drawn(found: Findings) -> Chart:
    series = []
    for fit in FITS:
        quartiles = [found.quartiles(fit, judged) for judged in JUDGED]
        low, middle, high = (tuple(100 * value for value in values) for values in zip(*quartiles, strict=True))
        series.append(Series(name=fit, x=JUDGED, y=middle, low=low, high=high))
    return Chart(
        title="Error over torque on motions that were not fitted",
        kind="bars",
        x_title="motion",
        y_title="error over torque [%]",
        series=tuple(series),
        note="Medians with quartiles over the arms.",
    )


def stages_chapter(found: Findings) -> Chapter:
    """Return what two stages make of the blocks of columns, and one stage of the same length."""
    text = (
        (
            "A fast stage counts the columns that only acceleration shows, a slow one those of gravity and friction; "
            "one stage counts all at once. Told is what the motions of each model say of each block while all other "
            "columns are unknown, before any log is taken."
        ),
    )
    rows: list[tuple[Cell, ...]] = []
    for fit in FITS:
        figures = found.blocks[fit]
        pairs = [number for block in BLOCKS for number in (figures[block].condition, figures[block].error)]
        rows.append((fit, *pairs))
    header = [name for block in BLOCKS for name in (f"{block}: condition", "error")]
    table = Table(
        title="Blocks of columns",
        header=("model", *header),
        rows=tuple(rows),
        note="Condition of the scaled columns. Error: root mean square over a block's parameters of what the standard "
        "error of each does to a torque in random states, over the noise of one reading.",
    )
    return Chapter(title="Two stages against one", text=text, tables=(table,))


def friction_chapter(found: Findings) -> Chapter:
    """Return the same with other friction of the plant."""
    text = (
        (
            "The same arms with other friction tell where the difference comes from: plain is friction that the "
            "model has, but for its temperature."
        ),
    )
    rows: list[tuple[Cell, ...]] = []
    for friction in found.frictions:
        for judged in JUDGED:
            medians = [100 * found.quartiles(fit, judged, friction).median for fit in FITS]
            wins = f"{found.wins('local', GLOBAL, judged, friction)} of {found.count}"
            rows.append((friction, judged, *medians, wins, found.ratio("local", GLOBAL, judged, friction).median))
    table = Table(
        title="Error over torque by the plant's friction [%]",
        header=("friction", "motion", *FITS, "local smaller", "local over global"),
        rows=tuple(rows),
        note=_over(found),
    )
    return Chapter(title="Other friction", text=text, tables=(table,))


def _over(found: Findings) -> str:
    return f"Medians over {found.count} arms."
