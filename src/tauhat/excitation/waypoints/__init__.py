"""Motions of industrial controllers: joint moves, lines, zones, dwells, at speeds that the joints can keep."""

from tauhat.excitation.waypoints.motion import WaypointMotion, waypoint_motion
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Move, ToolLimits, Zone
from tauhat.excitation.waypoints.ramps import AccelerationLimited, JerkLimited, Ramps
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.excitation.waypoints.slowing import Slowed

__all__ = [
    "AccelerationLimited",
    "JerkLimited",
    "JointMove",
    "LineMove",
    "Move",
    "Ramps",
    "Slowed",
    "ToolLimits",
    "WaypointMotion",
    "WaypointSettings",
    "Zone",
    "waypoint_motion",
]
