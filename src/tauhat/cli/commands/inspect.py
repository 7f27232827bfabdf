"""`tauhat inspect`: what a robot is and what of it can be identified."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tauhat.cli.options import TERM_NAMES, JsonOption, LockOption, ModelOption, RobotArgument
from tauhat.cli.output import show
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from tauhat.dynamics.base import BaseParameters
    from tauhat.dynamics.model import TorqueModel
    from tauhat.robots.joint import Joint


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat inspect` takes."""

    robot: RobotArgument
    model: ModelOption = TERM_NAMES
    lock: LockOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Show a robot's joints, limits and base parameters: what a motion could identify and what none can."""
    from tauhat.cli.views.robot import robot_view
    from tauhat.dynamics.base import base_parameters
    from tauhat.dynamics.model import torque_model
    from tauhat.robots.library import load_robot

    with working("looking for the base parameters"):
        model = torque_model(load_robot(options.robot, locked=options.lock), options.model)
        base = base_parameters(model)
    show(_document(model, base), lambda: robot_view(model, base), as_json=options.as_json)


def _document(model: TorqueModel, base: BaseParameters) -> dict[str, Any]:
    robot, parameters = model.robot, model.parameters
    return {
        "name": robot.name,
        "source": robot.source,
        "gravity": robot.gravity.tolist(),
        "joints": [_joint(joint) for joint in robot.joints],
        "frames": [frame.name for frame in robot.frames],
        "terms": [term.key for term in model.terms],
        "standard_parameters": list(base.names),
        "base_parameters": [
            {"name": parameters[index].name, "formula": formula, "unit": parameters[index].unit}
            for index, formula in zip(base.independent, base.formulas(), strict=True)
        ],
        "regrouped": [base.names[index] for index in base.dependent],
        "unidentifiable": [base.names[index] for index in base.unidentifiable],
    }


def _joint(joint: Joint) -> dict[str, Any]:
    limits = {name: getattr(joint.limits, name) for name in ("lower", "upper", "velocity", "effort", "acceleration")}
    facts = {"name": joint.name, "kind": joint.kind, "parent": joint.parent, "mass": float(joint.inertia[0])}
    return {**facts, "unit": joint.unit, "effort_unit": joint.effort_unit, "limits": limits}
