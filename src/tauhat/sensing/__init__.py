"""The virtual force sensor: external torque and wrench with error bars, from position and motor torque alone."""

from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
from tauhat.sensing.contact import ContactDetector, ContactEvent, Contacts
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import ContactThresholds, load_contact_thresholds
from tauhat.sensing.free_motion import learnt_from_free_motion
from tauhat.sensing.hidden import Hidden, hidden_along
from tauhat.sensing.judged_log import JudgedLog, judged_log
from tauhat.sensing.learnt_error import LearntError, error_of
from tauhat.sensing.observers import OBSERVERS, Observer, observer_named
from tauhat.sensing.payload_check import PayloadCheck, check_payload
from tauhat.sensing.sensed_log import SampleCounts, SensedLog
from tauhat.sensing.sensed_model import SensedModel, sensed_model
from tauhat.sensing.sensor import ForceSensor, Sensed, force_sensor
from tauhat.sensing.stream import SensorStream, StreamMemory
from tauhat.sensing.threshold_learning import learn_contact_thresholds
from tauhat.sensing.tool import Tool, load_tool
from tauhat.sensing.torque_observer import SensedTorque, TorqueObserver
from tauhat.sensing.wrench import DIRECTIONS, SensedWrench, WrenchSolver, directions_named
from tauhat.sensing.zero import NO_ZERO, AirPass, StandingZero, air_pass, without_air, zeroed

__all__ = [
    "DIRECTIONS",
    "NO_ZERO",
    "OBSERVERS",
    "AirPass",
    "ContactDetector",
    "ContactEvent",
    "ContactRules",
    "ContactThresholds",
    "Contacts",
    "ForceSensor",
    "Hidden",
    "JudgedLog",
    "LearntError",
    "Observer",
    "PayloadCheck",
    "SampleCounts",
    "Sensed",
    "SensedLog",
    "SensedModel",
    "SensedTorque",
    "SensedWrench",
    "SensorStream",
    "StandingZero",
    "StreamMemory",
    "Tool",
    "TorqueObserver",
    "WrenchSolver",
    "air_pass",
    "assumed_contact_thresholds",
    "check_payload",
    "directions_named",
    "error_of",
    "force_sensor",
    "hidden_along",
    "judged_log",
    "learn_contact_thresholds",
    "learnt_from_free_motion",
    "load_contact_thresholds",
    "load_tool",
    "observer_named",
    "sensed_model",
    "without_air",
    "zeroed",
]
