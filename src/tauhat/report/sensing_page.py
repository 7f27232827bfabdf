"""The page of what was sensed: force with its band over time, joint torques, error bars, a real sensor beside it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.report.page import require_libraries, write_page
from tauhat.report.study_page import ShownChart, shown_table
from tauhat.sensing.beside_sensor import beside_sensor
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.wrench import COMPONENTS
from tauhat.studies.study import Table

if TYPE_CHECKING:
    from tauhat.report.case import Section

_UNITS = ("N", "N", "N", "Nm", "Nm", "Nm")
_SIGN = "Positive is what the environment adds. Bands are plus and minus 1.96 standard errors."
_START = "Behind a start the velocity is not known yet, and the band is as wide as the joint's torque allows."
_SIZE = "Sizes of both forces, so that axes and mounting of the sensor do not matter; its clock may be off."


def write_sensing_report(
    path: str | Path, sensed: Sequence[SensedLog], *, measured: Sequence[FloatArray | None] = (), title: str = ""
) -> Path:
    """Write a self-contained HTML page of what was sensed along logs and return its path.

    Parameters
    ----------
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
        for section in _sections(log, None if sensor is None else sensor[log.rows], index)
    ]  # fmt: skip
    logs = sensed[0].name if len(sensed) == 1 else f"{len(sensed)} logs"
    return write_page(path, sections, title=title or f"{logs}: sensed force")


def _sections(log: SensedLog, measured: FloatArray | None, index: int) -> Iterator[Section]:
    from tauhat.report.sensing_figures import Sensed, bands_plot

    seen = np.flatnonzero(log.solved)
    forces = [Sensed(COMPONENTS[k], _UNITS[k], log.wrench[:, k], log.wrench_std[:, k]) for k in seen]
    if measured is not None:
        forces.insert(0, Sensed("size of the force", "N", *_size(log), np.linalg.norm(measured[:, :3], axis=1)))
    chart = bands_plot(log.t, forces, key=f"wrench-{index}", caption=f"At {log.frame}, axes of the {log.axes}")
    tables = (_wrench_table(log, seen.tolist()), *_beside(log, measured))
    text = (_counted(log), _SIGN, _START)
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
    force, errors = log.wrench[:, :3], log.wrench_std[:, :3]
    size = np.linalg.norm(force, axis=1)
    towards = force / np.maximum(size, np.finfo(float).tiny)[:, None]
    return size, np.linalg.norm(towards * errors, axis=1)


def _counted(log: SensedLog) -> str:
    counts = log.counts
    left_out = f"{counts.late} late, {counts.repeated} repeated, {counts.not_finite} not finite"
    return (
        f"{log.n_t} samples at {1.0 / log.step:.6g} Hz. Left out: {left_out}. Gaps behind which the sensor started "
        f"again: {counts.restarts}."
    )


def _wrench_table(log: SensedLog, seen: Sequence[int]) -> Table:
    sizes = log.sizes(log.wrench, log.wrench_std)
    rows = [(name, unit, *size) for name, unit, size in zip(COMPONENTS, _UNITS, sizes, strict=True)]
    return Table(
        title="Sizes and error bars", header=("Component", "Unit", "rms", "Peak", "± there", "Usually ±"),
        rows=tuple(rows[k] for k in seen), note="± is one standard error. Samples behind starts are left out.",
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
