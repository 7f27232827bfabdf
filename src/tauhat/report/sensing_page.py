"""The page of what was sensed: contacts, force with its band over time, joint torques, a real sensor beside it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.report.contact_words import hidden_words, kind_of, zero_words
from tauhat.report.page import require_libraries, write_page
from tauhat.report.study_page import ShownChart, shown_table
from tauhat.sensing.beside_sensor import beside_sensor
from tauhat.sensing.hidden import Hidden
from tauhat.sensing.judged_log import JudgedLog
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.wrench import COMPONENTS
from tauhat.studies.study import Table

if TYPE_CHECKING:
    from tauhat.report.case import Section

_UNITS = ("N", "N", "N", "Nm", "Nm", "Nm")
_SIGN = "Positive is what the environment adds. Bands are plus and minus 1.96 standard errors."
_START = "Behind a start the velocity is not known yet, and the band is as wide as the joint's torque allows."
_CONTACTS = (
    "A contact begins where the external torque of a joint passes its threshold and ends below the release. A joint "
    "feels what acts behind it: the link is the last that felt it, and what is touched is that or one further out."
)
_PAYLOADS = (
    "± is one standard error. Excess: in thresholds. Events of three seconds or more say whether a body that is "
    "carried explains them."
)
_WARMTH = (
    "Zero where the recording of the fit began, one what a joint's typical speed would bring. Learnt where nothing "
    "touches the arm."
)
_SIZE = "Sizes of both forces, so that axes and mounting of the sensor do not matter; its clock may be off."


def write_sensing_report(
    path: str | Path,
    sensed: Sequence[SensedLog | JudgedLog],
    *,
    measured: Sequence[FloatArray | None] = (),
    title: str = "",
) -> Path:
    """Write a self-contained HTML page of what was sensed along logs and return its path.

    Parameters
    ----------
    sensed : logs; those that were judged are shown with contacts, hidden directions and warmth
    measured : wrench of a real sensor along each log, (n_t, 6) with a row for every sample of the log, or None
    title : heading; how many logs by default

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    require_libraries()
    beside = list(measured) or [None] * len(sensed)
    sections = [
        section for index, (log, sensor) in enumerate(zip(sensed, beside, strict=True))
        for section in _all_sections(log, sensor, index)
    ]  # fmt: skip
    logs = _log_of(sensed[0]).name if len(sensed) == 1 else f"{len(sensed)} logs"
    return write_page(path, sections, title=title or f"{logs}: sensed force")


def _log_of(log: SensedLog | JudgedLog) -> SensedLog:
    return log.sensed if isinstance(log, JudgedLog) else log


def _all_sections(given: SensedLog | JudgedLog, sensor: FloatArray | None, index: int) -> Iterator[Section]:
    """Yield contacts first, then force and joints, then warmth."""
    log, judged = _log_of(given), given if isinstance(given, JudgedLog) else None
    if judged is not None:
        yield _contacts(judged, index)
    yield from _sections(log, None if sensor is None else sensor[log.rows], index, judged)
    if judged is not None and judged.warmth is not None:
        yield from _warmth(judged, index)


def _contacts(judged: JudgedLog, index: int) -> Section:
    from tauhat.report.case import clock_start
    from tauhat.report.contact_figures import contacts_plot

    events, found = judged.contacts.events, judged.thresholds
    told = "Nothing touched the arm." if not events else f"{len(events)} contacts." if len(events) > 1 else "1 contact."
    known = (
        f"Thresholds were learnt on {found.seconds.sum():.0f} s of free motion, which can promise {found.promised:.3g} "
        f"false contacts an hour; asked for: {found.rate:g}."
        if found.seconds.any() else "No free motion was given, so nothing is known of false contacts."
    )  # fmt: skip
    if found.error is not None and found.error.is_learnt:
        known += " Error bars are those that it has shown."
    start = clock_start(judged.sensed.t)
    rows = tuple(
        (event.link, kind_of(event) or "–", f"{event.start - start:.2f}", f"{event.end - start:.2f}", event.peak,
         event.peak_std, event.excess)
        for event in events
    )  # fmt: skip
    since = f" − {start:.0f} s" if start else ""
    header = ("Link", "What it is", f"From{since} [s]", f"To{since} [s]", "Peak [N]", "± [N]", "Excess")
    tables = (Table(title="Contacts", header=header, rows=rows, note=_PAYLOADS),) if rows else ()
    chart = ShownChart(contacts_plot(judged, key=f"contacts-{index}"), "")
    title = f"{judged.sensed.name}: contacts"
    return _section(f"contacts-of-{index}", title, (told, known, _CONTACTS), tables, chart)


def _warmth(judged: JudgedLog, index: int) -> Iterator[Section]:
    from tauhat.report.contact_figures import warmth_plot

    plot = warmth_plot(judged, key=f"warmth-{index}")
    if plot is not None:
        title = f"{judged.sensed.name}: warmth"
        yield _section(f"warmth-of-{index}", title, (_WARMTH,), (), ShownChart(plot, ""))


def _sections(log: SensedLog, measured: FloatArray | None, index: int, judged: JudgedLog | None) -> Iterator[Section]:
    from tauhat.report.sensing_figures import Sensed, bands_plot

    seen = np.flatnonzero(log.solved)
    forces = [Sensed(COMPONENTS[k], _UNITS[k], log.wrench[:, k], log.wrench_std[:, k]) for k in seen]
    if measured is not None:
        forces.insert(0, Sensed("size of the force", "N", *_size(log), np.linalg.norm(measured[:, :3], axis=1)))
    chart = bands_plot(log.t, forces, key=f"wrench-{index}", caption=f"At {log.frame}, axes of the {log.axes}")
    told = judged.hidden if judged is not None and judged.hidden.share else None
    tables = (_wrench_table(log, seen.tolist(), told), *_beside(log, measured))
    more = () if judged is None else tuple(filter(None, (zero_words(judged), hidden_words(judged.hidden))))
    text = (_counted(log), _SIGN, _START, *more)
    yield _section(f"wrench-of-{index}", f"{log.name}: force", text, tables, ShownChart(chart, ""))
    units = ["N" if name in log.prismatic else "Nm" for name in log.joint_names]
    joints = [
        Sensed(name, unit, log.tau[:, k], log.tau_std[:, k])
        for k, (name, unit) in enumerate(zip(log.joint_names, units, strict=True))
    ]
    chart = bands_plot(log.t, joints, key=f"torque-{index}", caption="External torque of every joint")
    table = _joint_table(log, units)
    yield _section(f"torque-of-{index}", f"{log.name}: joints", (), (table,), ShownChart(chart, ""))


def _size(log: SensedLog) -> tuple[FloatArray, FloatArray]:
    """Return the size of the force and its standard error along its own direction, (n_t,) [N]."""
    force = log.wrench[:, :3]
    return np.linalg.norm(force, axis=1), log.force_std(force, slice(None))


def _counted(log: SensedLog) -> str:
    counts = log.counts
    left_out = f"{counts.late} late, {counts.repeated} repeated, {counts.not_finite} not finite"
    return (
        f"{log.n_t} samples at {1.0 / log.step:.6g} Hz. Left out: {left_out}. Gaps behind which the sensor started "
        f"again: {counts.restarts}."
    )


def _wrench_table(log: SensedLog, seen: Sequence[int], hidden: Hidden | None) -> Table:
    sizes = log.sizes(log.wrench, log.wrench_std)
    more = [
        () if hidden is None else (100.0 * float(part),) for part in (np.zeros(6) if hidden is None else hidden.parts)
    ]
    rows = [(name, unit, *size, *last) for name, unit, size, last in zip(COMPONENTS, _UNITS, sizes, more, strict=True)]
    header = ("Component", "Unit", "rms", "Peak", "± there", "Usually ±", *(() if hidden is None else ("Hidden [%]",)))
    note = "± is one standard error. Samples behind starts are left out."
    explained = " Hidden: the part of it that joints did not tell, over time." if hidden is not None else ""
    return Table(
        title="Sizes and error bars", header=header, rows=tuple(rows[k] for k in seen), note=note + explained,
    )  # fmt: skip


def _joint_table(log: SensedLog, units: Sequence[str]) -> Table:
    sizes = log.sizes(log.tau, log.tau_std)
    rows = tuple((name, unit, *size) for name, unit, size in zip(log.joint_names, units, sizes, strict=True))
    return Table(
        title="Sizes and error bars", header=("Joint", "Unit", "rms", "Peak", "± there", "Usually ±"), rows=rows,
    )  # fmt: skip


def _beside(log: SensedLog, measured: FloatArray | None) -> Iterator[Table]:
    """Yield how the force compares with that of a real sensor, where the log has one that changes."""
    if measured is None:
        return
    kept = log.settled
    found = beside_sensor(log.wrench[kept, :3], measured[kept, :3], step=log.step)
    if found is not None:
        rows = (("correlation at best lag", "", found.correlation), ("sensed later by", "s", found.lag),
                ("measured over sensed", "", found.scale), ("rms of the difference", "N", found.rms))  # fmt: skip
        yield Table(
            title="Beside the force sensor of the log", header=("Quantity", "Unit", "Value"), rows=rows, note=_SIZE
        )


def _section(key: str, title: str, text: tuple[str, ...], tables: tuple[Table, ...], chart: ShownChart) -> Section:
    from tauhat.report.case import Section
    from tauhat.report.rendering import rendered

    html = rendered("study.html.j2", text=text, tables=[shown_table(table) for table in tables], charts=(chart,))
    return Section(key=key, title=title, html=html, plots=(chart.plot,))
