"""Force control as pure steps: surfaces, force laws, and a polisher that presses, feeds and gives up by rule."""

from tauhat.control.force.admittance_law import AdmittanceLaw
from tauhat.control.force.feed_profile import FeedProfile
from tauhat.control.force.force_law import ForceLaw
from tauhat.control.force.force_source import BelievedForce, Expected, ForceSource, MeasuredForce
from tauhat.control.force.path_joints import PathJoints
from tauhat.control.force.path_solving import path_joints
from tauhat.control.force.pi_law import PIForceLaw
from tauhat.control.force.polish_memory import Phase, PolishCommand, PolishMemory
from tauhat.control.force.polish_settings import ContactRule, PolishLimits, PolishTask
from tauhat.control.force.polisher import Polisher
from tauhat.control.force.reading import ForceReading, Reason, Sight
from tauhat.control.force.surface import CylindricalSurface, FlatSurface, Surface
from tauhat.control.force.tool_mount import ToolMount

__all__ = [
    "AdmittanceLaw",
    "BelievedForce",
    "ContactRule",
    "CylindricalSurface",
    "Expected",
    "FeedProfile",
    "FlatSurface",
    "ForceLaw",
    "ForceReading",
    "ForceSource",
    "MeasuredForce",
    "PIForceLaw",
    "PathJoints",
    "Phase",
    "PolishCommand",
    "PolishLimits",
    "PolishMemory",
    "PolishTask",
    "Polisher",
    "Reason",
    "Sight",
    "Surface",
    "ToolMount",
    "path_joints",
]
