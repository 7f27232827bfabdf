"""Arguments and options of commands that compare runs with and without a payload."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from tauhat.cli.options import Window, window

if TYPE_CHECKING:
    from tauhat.estimation.estimate import Estimate
    from tauhat.recordings.recording import Recording

LoadedArguments: TypeAlias = Annotated[
    list[Path],
    typer.Argument(metavar="LOADED_LOG", help="Recordings with the payload.", show_default=False, readable=False),
]
UnloadedOption: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option(
        "--unloaded",
        metavar="LOG",
        help="A recording without the payload; may be given several times.",
        show_default=False,
        readable=False,
    ),
]
UnloadedRowsOption: TypeAlias = Annotated[
    Window | None,
    typer.Option(
        "--unloaded-rows",
        metavar="FROM:TO",
        parser=window,
        help="Window of rows of each unloaded log; --rows is of the loaded ones.",
        show_default=False,
    ),
]
LinkOption: TypeAlias = Annotated[
    str,
    typer.Option("--link", metavar="JOINT", help="Joint whose link carries the payload.", show_default="the last one"),
]


def unloaded_recordings(
    estimate: Estimate, logs: Sequence[Path] | None, *, map_file: Path | None, rows: Window | None
) -> tuple[Recording, ...]:
    """Return the logs without payload as recordings of the estimate's joints; the estimate may be fitted on them."""
    from tauhat.cli.inputs import read_recordings
    from tauhat.robots.fitting import check_joint_order

    recordings = read_recordings(logs or (), map_file=map_file, rows=rows)
    for recording in recordings:
        check_joint_order(estimate.robot, recording.joint_names, where=recording.name)
    return recordings
