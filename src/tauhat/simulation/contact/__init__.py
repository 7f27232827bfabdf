"""The polishing cell: an arm with a compliant tool in contact with a workpiece, sample by sample."""

from tauhat.simulation.contact.cell import Cell, in_the_air
from tauhat.simulation.contact.joint_control import FeedforwardTorque, JointControl, loaded_robot
from tauhat.simulation.contact.load_cell import LoadCell, LoadCellReader
from tauhat.simulation.contact.material import Material, Region
from tauhat.simulation.contact.running_cell import CellSample, RunningCell, start_cell
from tauhat.simulation.contact.sensor_stream import SensorStream, ShownSample
from tauhat.simulation.contact.tool import TIP, CompliantTool
from tauhat.simulation.contact.worked_heat import FrictionPower, constant_power

__all__ = [
    "TIP",
    "Cell",
    "CellSample",
    "CompliantTool",
    "FeedforwardTorque",
    "FrictionPower",
    "JointControl",
    "LoadCell",
    "LoadCellReader",
    "Material",
    "Region",
    "RunningCell",
    "SensorStream",
    "ShownSample",
    "constant_power",
    "in_the_air",
    "loaded_robot",
    "start_cell",
]
