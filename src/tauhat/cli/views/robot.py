"""A robot: its joints, and what of it can be identified."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import aligned, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.dynamics.base import BaseParameters
    from tauhat.dynamics.model import TorqueModel
    from tauhat.robots.robot import Robot

_UNITS = ("unit", "effort_unit")
_LIMITS = ("lower", "upper", "velocity", "effort")


def robot_view(model: TorqueModel, base: BaseParameters) -> Iterator[RenderableType]:
    """Yield the joints, the base parameters with their formulas, and what no motion can tell apart."""
    yield _joint_table(model.robot)
    yield _base_table(model, base)
    yield _sentences(model, base)


def _joint_table(robot: Robot) -> RenderableType:
    from rich.markup import escape

    gravity = ", ".join(f"{value:g}" for value in robot.gravity)
    unit, effort = (" or ".join(dict.fromkeys(getattr(joint, name) for joint in robot.joints)) for name in _UNITS)
    made = table(
        f"{robot.name}: {robot.n_v} joints, gravity ({gravity}) m/s²",
        ("joint\n", "kind\n"),
        (f"lower\n[{unit}]", f"upper\n[{unit}]", f"speed\n[{unit}/s]", f"effort\n[{effort}]", "mass\n[kg]"),
    )
    limits = [joint.limits for joint in robot.joints]
    columns = [aligned([getattr(limit, name) for limit in limits], digits=3) for name in _LIMITS]
    masses = aligned(robot.inertia[:, 0].tolist())
    for joint, *figures in zip(robot.joints, *columns, masses, strict=True):
        made.add_row(escape(joint.name), joint.kind, *figures)
    return made


def _base_table(model: TorqueModel, base: BaseParameters) -> RenderableType:
    from tauhat.report.formatting import unit

    terms = ", ".join(term.key for term in model.terms)
    made = table(f"{base.n_b} base parameters of {terms}", ("parameter", "unit", "stands for"))
    parameters = model.parameters
    for index, formula in zip(base.independent, base.formulas(), strict=True):
        parameter = parameters[index]
        made.add_row(parameter.name, unit(parameter.unit), "itself" if formula == parameter.name else formula)
    return made


def _sentences(model: TorqueModel, base: BaseParameters) -> RenderableType:
    from rich.text import Text

    names = base.names
    regrouped = ", ".join(names[index] for index in base.dependent) or "none"
    unseen = ", ".join(names[index] for index in base.unidentifiable) or "none"
    text = Text(
        f"{model.n_p} standard parameters make {base.n_b} base parameters: a rich motion identifies all of these.\n"
    )
    text.append(f"Never alone, only inside the sums above ({base.dependent.size}): ", style="bold").append(
        f"{regrouped}\n"
    )
    text.append(f"Never, they act on no joint ({base.unidentifiable.size}): ", style="bold").append(f"{unseen}\n")
    return text
