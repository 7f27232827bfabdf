"""The chapters of the study of the virtual force sensor: forces, error bars, warmth."""

from __future__ import annotations

import numpy as np

from tauhat.studies.force_sensing.findings import REFRESH, STEADY, THERMAL, Findings, mean, median
from tauhat.studies.force_sensing.trials import PACES, WARMTHS
from tauhat.studies.study import Cell, Chapter, Chart, Series, Table

_HONEST = (0.93, 0.97)  # share of 95 % intervals that may hold the truth


def summary_of(found: Findings) -> str:
    """Return the answer in a few sentences."""
    steady, thermal = (np.median(found.drift(name)) for name in (STEADY, THERMAL))
    names = STEADY, THERMAL, REFRESH
    cold, warm = (
        [median(found.of(name, pace="moving", warmth=warmth), "force_rms") for name in names] for warmth in WARMTHS
    )
    inside = mean(found.of(THERMAL), "force_inside")
    return (
        f"{found.seeds} arms ({found.scene.robot}), pushes of about {found.scene.force:g} N a component. Moving, "
        f"the force of the {THERMAL} observer is off by {cold[1]:.3g} N cold and {warm[1]:.3g} N warm, that of the "
        f"{STEADY} observer, which knows no warmth, by {cold[0]:.3g} and {warm[0]:.3g} N, and that of the {REFRESH} "
        f"observer, which follows friction with the same model, by {cold[2]:.3g} and {warm[2]:.3g} N. Friction drifts "
        f"by {thermal:.3g} Nm between cold and warm in place of {steady:.3g}. Of the 95 % intervals of force "
        f"{100 * inside:.3g} % hold the truth."
    )


def chapters_of(found: Findings) -> tuple[Chapter, ...]:
    """Return what was done, the forces, the error bars, what errors have in common, and the drift."""
    return _scene(found), _forces(found), _bars(found), _together(found), _drift(found)


def _scene(found: Findings) -> Chapter:
    scene = found.scene
    arm = (
        f"Every arm is a random {scene.robot} with friction of kind {scene.friction} and sensors of preset "
        f"{scene.sensors}. Its friction loses {100 * scene.lost:g} % as it warms up, with a time constant of "
        f"{scene.time_constant:g} s: minutes in place of the half hour of a real gear, so that a warm-up fits into "
        f"a log of {scene.warm_up:g} s. One model is fitted to that log without warmth, one with it; both see the same."
    )
    pushes = (
        "The sensors learn how wrong they are on the work in air, cold and warm. Then known forces push at the tool, "
        "each for a second, on a way that no log in air has, and standing. No force sensor, no temperature and "
        "nothing of the truth is shown to them."
    )
    late = (
        "An error is that against the force 0.06 s before: half of a step comes through in that time. The first "
        "1.5 s of a log do not count."
    )
    return Chapter(title="What was done", text=(arm, pushes, late))


def _forces(found: Findings) -> Chapter:
    rows = []
    for observer in found.observers:
        row: list[Cell] = [observer]
        for pace in PACES:
            for warmth in WARMTHS:
                outcomes = found.of(observer, pace=pace, warmth=warmth)
                row += [median(outcomes, "force_rms"), median(outcomes, "force_95")]
        rows.append(tuple(row))
    header = (
        "observer",
        *(f"{pace}, {warmth}: {what} [N]" for pace in PACES for warmth in WARMTHS for what in ("RMS", "95 %")),
    )
    series = tuple(
        Series(
            name=f"moving, {warmth}",
            x=found.observers,
            y=tuple(
                median(found.of(observer, pace="moving", warmth=warmth), "force_rms") for observer in found.observers
            ),
        )
        for warmth in WARMTHS
    )
    return Chapter(
        title="Forces",
        text=("Observers differ little at the same response time; what they know of friction decides.",),
        tables=(
            Table(
                title="Size of the error of the force", header=header, rows=tuple(rows),
                note="Medians over arms. RMS and 95 % quantile of the length of the error vector.",
            ),
        ),
        charts=(
            Chart(
                title="Error of the force in motion", kind="bars", x_title="observer", y_title="RMS [N]", series=series,
                note="All but thermal have a model without warmth, fitted to the whole warm-up.",
            ),
        ),
    )  # fmt: skip


def _bars(found: Findings) -> Chapter:
    rows: list[tuple[Cell, ...]] = []
    for observer in found.observers:
        of_pace = [found.of(observer, pace=pace) for pace in PACES]
        shares = [
            100.0 * mean(outcomes, figure) for outcomes in of_pace for figure in ("torque_inside", "force_inside")
        ]
        rows.append((observer, *shares))
    outside = [
        f"{observer}, {pace}, {what}"
        for observer in found.observers
        for pace in PACES
        for what, figure in (("joint torque", "torque_inside"), ("force", "force_inside"))
        if not _HONEST[0] <= mean(found.of(observer, pace=pace), figure) <= _HONEST[1]
    ]
    words = (
        "Error bars hold the truth as often as they say, 93 to 97 %, for every observer, joint torque and force."
        if not outside
        else f"Outside 93 to 97 %: {'; '.join(outside)}."
    )
    return Chapter(
        title="Error bars",
        text=(
            words,
            "The error of a model is slow: within one log it has few independent values, so single logs scatter.",
        ),
        tables=(
            Table(
                title="Share of 95 % intervals that hold the truth [%]",
                header=("observer", *(f"{pace}, {what}" for pace in PACES for what in ("joint torque", "force"))),
                rows=tuple(rows),
                note="Mean over arms, cold and warm together.",
            ),
        ),
    )


def _together(found: Findings) -> Chapter:
    rows: list[tuple[Cell, ...]] = []
    for observer in found.observers:
        row: list[Cell] = [observer]
        for pace in PACES:
            outcomes = found.of(observer, pace=pace)
            row += [median(outcomes, "apart_rms"), median(outcomes, "force_rms")]
            row += [100.0 * mean(outcomes, "apart_inside"), 100.0 * mean(outcomes, "force_inside")]
        rows.append(tuple(row))
    words = (
        "One wrong mass or one temperature is felt by several joints. Together: weighted by the correlation that "
        "the work in air showed, as everywhere else on this page. Apart: each joint for itself."
    )
    told = "apart: RMS [N]", "together: RMS [N]", "apart: inside [%]", "together: inside [%]"
    return Chapter(
        title="What errors of joints have in common",
        text=(words,),
        tables=(
            Table(
                title="Force with and without the correlation of joints",
                header=("observer", *(f"{pace}, {what}" for pace in PACES for what in told)), rows=tuple(rows),
                note="Cold and warm together: medians of RMS, mean shares of the 95 % intervals that hold the truth.",
            ),
        ),
    )  # fmt: skip


def _drift(found: Findings) -> Chapter:
    steady, thermal, refresh = (found.drift(name) for name in (STEADY, THERMAL, REFRESH))
    ratios = np.array(thermal) / np.maximum(steady, np.finfo(float).tiny)
    better = int(np.sum(ratios <= 0.5))
    words = (
        f"The friction torque that a sensor takes for force changes by {np.median(steady):.3g} Nm from cold to warm "
        f"without a thermal model and by {np.median(thermal):.3g} Nm with it: median ratio {np.median(ratios):.2f}, "
        f"at most half on {better} of {found.seeds} arms. Following friction without such a model leaves "
        f"{np.median(refresh):.3g} Nm."
    )
    table = Table(
        title="Drift of friction torque from cold to warm [Nm]",
        header=("arm", STEADY, THERMAL, "ratio", REFRESH),
        rows=tuple(
            (number, float(a), float(b), float(ratio), float(c))
            for number, (a, b, ratio, c) in enumerate(zip(steady, thermal, ratios, refresh, strict=True))
        ),
        note="Mean error along the motion, joints in root mean square.",
    )
    return Chapter(title="Cold against warm", text=(words,), tables=(table,))
