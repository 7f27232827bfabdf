"""What makes a controller's currents torques: options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

if TYPE_CHECKING:
    from tauhat.live.current_map import CurrentMap

ConstantsOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--constants", metavar="K[,K...]", show_default=False,
        help="Torque constants instead of a map: Nm at the joint per ampere, one or six.",
    ),
]  # fmt: skip


def currents_of(map_file: Path | None, constants: str | None) -> CurrentMap:
    """Return what makes currents torques: a map, or torque constants with commas between.

    Raises
    ------
    TauhatError
        neither is there, or it does not hold torque constants.
    """
    from tauhat.errors import MapError
    from tauhat.live.current_map import CurrentMap, map_of_constants
    from tauhat.recordings.mapfile import load_map

    if map_file is not None and constants is not None:
        raise typer.BadParameter("not together with --map", param_hint="'--constants'")
    if map_file is not None:
        return CurrentMap(log_map=load_map(map_file))
    if constants is None:
        raise MapError(
            "no torque constants: a controller tells currents, not torques",
            remedy="give --map MAP.toml of the robot's logs, or --constants K1,...,K6 in Nm per ampere",
        )
    try:
        return map_of_constants([float(number) for number in constants.split(",")])
    except ValueError as error:
        raise typer.BadParameter(f"not numbers with commas between: {constants}", param_hint="'--constants'") from error
