"""Force sensing live: samples in over WebSocket, UDP or a Unix socket, answers out, and a page that shows them."""

from tauhat.live.access import Access, read_token
from tauhat.live.current_map import CurrentMap, map_of_constants
from tauhat.live.feed import Feed, Snapshot
from tauhat.live.limits import Limits
from tauhat.live.robot_log import RobotLog, record
from tauhat.live.sender import Sender
from tauhat.live.server import Channels, LiveServer, serve
from tauhat.live.service import Service
from tauhat.live.session import Session
from tauhat.live.universal_robots import LinkCounts, LiveSample, RobotCycle, RobotLink, UniversalRobot, sensed

__all__ = [
    "Access",
    "Channels",
    "CurrentMap",
    "Feed",
    "Limits",
    "LinkCounts",
    "LiveSample",
    "LiveServer",
    "RobotCycle",
    "RobotLink",
    "RobotLog",
    "Sender",
    "Service",
    "Session",
    "Snapshot",
    "UniversalRobot",
    "map_of_constants",
    "read_token",
    "record",
    "sensed",
    "serve",
]
