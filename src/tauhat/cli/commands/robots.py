"""`tauhat robots`: the built-in robots."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tauhat.cli.options import JsonOption
from tauhat.cli.output import show, unbroken

if TYPE_CHECKING:
    from rich.console import RenderableType


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat robots` takes."""

    as_json: JsonOption = False


def run(options: Options) -> None:
    """List the robots that come with tauhat."""
    from tauhat.robots.library import describe_builtins, load_robot

    robots = [
        {"name": name, "description": description, "joints": list(load_robot(name).joint_names)}
        for name, description in describe_builtins().items()
    ]
    show({"robots": robots}, lambda: _view(robots), as_json=options.as_json)


def _view(robots: list[dict[str, Any]]) -> Iterator[RenderableType]:
    from tauhat.cli.views.tables import table

    made = table("Built-in robots", ("name", "description"), ("joints",))
    for robot in robots:
        made.add_row(robot["name"], robot["description"], str(len(robot["joints"])))
    yield made
    yield unbroken("A robot of your own is a .urdf file or a .toml DH table:\n  tauhat inspect my_robot.urdf")
