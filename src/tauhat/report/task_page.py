"""The page of a task-oriented design: where the tool moves, how fast, and what each stage makes visible."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tauhat.excitation.task_design import BLOCKS, Block, TaskDesign, names_of
from tauhat.report.formatting import percent
from tauhat.report.page import require_libraries, write_page
from tauhat.report.study_page import ShownChart, shown_table
from tauhat.studies.study import Cell, Table

if TYPE_CHECKING:
    from tauhat.report.case import Section

_OUTSIDE = (
    "Via-points are in the region; home may be outside, and joint moves between two points bend away from a line."
)
_NOTE = (
    "The error is the standard error of a parameter times what its column is in random states, over the noise of one "
    "reading at 20 independent ones a second. Below 1 it counts as visible."
)


def write_task_report(path: str | Path, design: TaskDesign) -> Path:
    """Write a self-contained HTML page about a task-oriented design and return its path.

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    require_libraries()
    sections = [_summary(design), _speeds(design), _information(design), _visible(design)]
    robot = design.stages[0].motion.robot
    return write_page(path, sections, title=f"{robot.name}: calibration where the work is")


def _summary(design: TaskDesign) -> Section:
    from tauhat.report.task_figures import region_plot, tool_path

    count, visible = len(design.stages), len(design.visible())
    found = f"{visible} of {design.facts.n} parameters visible"
    programs = "One program in it makes" if count == 1 else f"{count} programs in it make"
    text = (
        f"The arm reaches {percent(design.reached)} of the region from home. {programs} {found}.",
        "Each program begins and ends at rest at home, and repeats without a pause to fill the time of its stage.",
    )
    header = ("Stage", "For", "One run [s]", "Repeats", "Moves", "Slowed", "Farthest outside [mm]", "Search [s]")
    outside = [1e3 * float(design.region.outside(tool_path(found)).max()) for found in design.stages]
    rows = tuple(
        (
            found.stage.name, ", ".join(found.stage.counted), found.motion.duration, found.repeats,
            len(found.motion.moves), len(found.motion.slowed), away, found.seconds,
        )
        for found, away in zip(design.stages, outside, strict=True)
    )  # fmt: skip
    note = (
        "Slowed: ways and corners that a joint's limit makes slower than asked for. Outside: the tool, of the region."
    )
    table = Table(title="Programs", header=header, rows=rows, note=note)
    chart = ShownChart(region_plot(design, key="region"), _OUTSIDE)
    return _section("summary", "In short", text=text, tables=(table, *_margins(design)), charts=(chart,))


def _margins(design: TaskDesign) -> Iterator[Table]:
    """Yield what is left of limits of several joints at once, where there are any."""
    names = tuple(design.stages[0].margins)
    if names:
        rows = tuple((name, *(percent(found.margins[name]) for found in design.stages)) for name in names)
        header = ("Limit", *(found.stage.name for found in design.stages))
        yield Table(title="Left of other limits, beyond what is kept unused", header=header, rows=rows)


def _speeds(design: TaskDesign) -> Section:
    from tauhat.report.task_figures import speed_plot

    charts = tuple(ShownChart(speed_plot(found, key=f"speed-{index}"), "") for index, found in enumerate(design.stages))
    text = ("One run of each program. The limits are those of the joints, drawn in by the margin.",)
    return _section("speeds", "Speed", text=text, charts=charts)


def _information(design: TaskDesign) -> Section:
    from tauhat.report.task_figures import block_plot

    text = (
        "A stage is searched for what it tells of its own columns while all other columns are unknown.",
        "A value near zero is a combination of parameters that its readings do not show.",
    )
    blocks = [block for block in BLOCKS if design.blocks.of((block,)).size]
    charts = tuple(ShownChart(block_plot(design, block, key=f"block-{block}"), "") for block in blocks)
    return _section("information", "Singular values", text=text, charts=charts)


def _visible(design: TaskDesign) -> Section:
    stages = [found.stage.name for found in design.stages]
    seen = [set(design.visible(count)) for count in range(1, len(stages) + 1)]
    text = [
        f"After the stage {stage}: {len(visible)} of {design.facts.n} parameters are visible."
        for stage, visible in zip(stages, seen, strict=True)
    ]
    tables = tuple(_parameters(design, block) for block in BLOCKS if design.blocks.of((block,)).size)
    return _section("visible", "What became visible", text=(*text, _NOTE), tables=tables)


def _parameters(design: TaskDesign, block: Block) -> Table:
    """Return the parameters of a block with their errors after each stage."""
    names, stages = names_of(design.facts), [found.stage.name for found in design.stages]
    errors = np.array([design.errors(count) for count in range(1, len(stages) + 1)])
    seen = [design.visible(count) for count in range(1, len(stages) + 1)]
    rows: list[tuple[Cell, ...]] = []
    for index in design.blocks.of((block,)):
        since = next((stage for stage, visible in zip(stages, seen, strict=True) if names[index] in visible), "–")
        rows.append((names[index], *errors[:, index].tolist(), since))
    header = ("Parameter", *(f"Error after {stage}" for stage in stages), "Visible since")
    return Table(title=f"Columns of the block {block}", header=header, rows=tuple(rows))


def _section(
    key: str, title: str, *, text: tuple[str, ...], tables: tuple[Table, ...] = (), charts: tuple[ShownChart, ...] = ()
) -> Section:
    from tauhat.report.case import Section
    from tauhat.report.rendering import rendered

    html = rendered("study.html.j2", text=text, tables=[shown_table(table) for table in tables], charts=charts)
    return Section(key=key, title=title, html=html, plots=tuple(chart.plot for chart in charts))
