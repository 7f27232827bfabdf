"""A polishing cell: an arm with a compliant tool, a workpiece, the arm's controller, and sensors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tauhat.control.force.surface import Surface
from tauhat.control.force.tool_mount import ToolMount
from tauhat.errors import SimulationError
from tauhat.robots.robot import Frame, Robot
from tauhat.simulation.closed_loop import Encoder
from tauhat.simulation.contact.joint_control import JointControl, loaded_robot
from tauhat.simulation.contact.load_cell import LoadCell
from tauhat.simulation.contact.material import Material
from tauhat.simulation.contact.tool import CompliantTool, carrying_frame
from tauhat.simulation.contact.workpiece import refuse_shape
from tauhat.simulation.parameters import TrueParameters, nominal_parameters
from tauhat.simulation.sensors import SensorErrors

_WHOLE = 1e-6  # how far a ratio of rates may be from a whole number
_STEADY = 1.0  # largest timestep in the tip's own time sqrt(mass / stiffness): half the limit of stability


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cell:
    """What a cell is made of; `start_cell` sets it in motion.

    robot : as its description has it, which is what its controller knows
    parameters : the truth, with holders and other loads as attached bodies, without the tip; nominal by default
    surface : where the workpiece really is; None: no workpiece, a pass in the air
    tool, material : what touches
    frame : that carries the tool along its z, which points to the workpiece; the robot's last by default
    control : the robot's own position controller
    encoder : what that controller sees, and the side of elastic joints that the log's position is of
    sensors, load_cell : how far the log is from the truth
    sample_rate : of references and samples [Hz]
    timestep : of the integrator [s]
    settle : time the robot holds the start pose before the clock starts [s]
    """

    robot: Robot
    parameters: TrueParameters | None = None
    surface: Surface | None = None
    tool: CompliantTool = field(default_factory=CompliantTool)
    material: Material = field(default_factory=Material)
    frame: str = ""
    control: JointControl = field(default_factory=JointControl)
    encoder: Encoder = field(default_factory=Encoder)
    sensors: SensorErrors = field(default_factory=SensorErrors)
    load_cell: LoadCell = field(default_factory=LoadCell)
    sample_rate: float = 250.0
    timestep: float = 1e-3
    settle: float = 1.0

    def __post_init__(self) -> None:
        for name in ("sample_rate", "timestep"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise SimulationError(f"cell, {name}", expected="a positive number", got=value)
        if not 0.0 <= self.settle < np.inf:
            raise SimulationError("cell, settle", expected="a time >= 0", got=self.settle)
        _whole("timesteps in a control period", 1.0 / (self.control.rate * self.timestep))
        _whole("control periods in a sample period", self.control.rate / self.sample_rate)
        own = (self.tool.tip_mass / self.tool.stiffness) ** 0.5
        if self.timestep > _STEADY * own:
            raise SimulationError(
                "the tool's spring is too stiff for the timestep", where="cell", expected=f"at most {own:.2g} s",
                got=f"{self.timestep:.2g} s", remedy="shorten the timestep, or make the tip heavier",
            )  # fmt: skip
        if self.surface is not None:
            refuse_shape(self.surface)
        carrying_frame(self.robot, self.frame)

    @property
    def substeps(self) -> int:
        """Timesteps in a control period."""
        return round(1.0 / (self.control.rate * self.timestep))

    @property
    def periods(self) -> int:
        """Control periods in a sample period."""
        return round(self.control.rate / self.sample_rate)

    @property
    def carrier(self) -> Frame:
        """The frame that carries the tool."""
        return carrying_frame(self.robot, self.frame)

    @property
    def mount(self) -> ToolMount:
        """The tool as a force-controlled path takes it."""
        return ToolMount(frame=self.carrier.name, length=self.tool.length)

    @property
    def truth(self) -> TrueParameters:
        """The arm's true parameters, without the tip."""
        return nominal_parameters(self.robot) if self.parameters is None else self.parameters

    @property
    def truth_with_tip(self) -> TrueParameters:
        """The same with the tip bolted to it: the arm of this cell for experiments in the air, by `simulate`."""
        truth = self.truth
        return replace(truth, attached=(*truth.attached, self.tool.tip_body(self.carrier)))

    @property
    def robot_with_tip(self) -> Robot:
        """The described robot with the frame `tip` at the foremost point of its tip at rest, and no load.

        Raises
        ------
        RobotError
            when the robot has a frame of that name already.
        """
        return replace(self.robot, frames=(*self.robot.frames, self.tool.tip_frame(self.carrier)))

    @property
    def known_robot(self) -> Robot:
        """The robot that the controller knows: the description, and the loads that were entered for it."""
        return loaded_robot(self.robot, self.truth_with_tip.attached)


def in_the_air(cell: Cell) -> Cell:
    """Return the cell without its workpiece."""
    return replace(cell, surface=None)


def _whole(what: str, ratio: float) -> None:
    if round(ratio) < 1 or abs(ratio - round(ratio)) > _WHOLE * ratio:
        raise SimulationError(f"cell, {what}", expected="a whole number", got=f"{ratio:g}")
