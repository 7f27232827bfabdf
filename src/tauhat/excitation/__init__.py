"""Motions that identify: Fourier series, criteria of information, genetic and gradient design."""

from tauhat.excitation.criteria import (
    CRITERIA,
    AOptimal,
    ConditionNumber,
    Criterion,
    DOptimal,
    EOptimal,
    Mixed,
    criterion_named,
)
from tauhat.excitation.design import METHODS, Design, DesignSettings, Method, design, limit_margins, method_named
from tauhat.excitation.fourier import FourierSeries, fourier_basis, random_fourier, rest_basis
from tauhat.excitation.genetic import GeneticSettings
from tauhat.excitation.information import (
    Information,
    Knowledge,
    after_evidence,
    after_motions,
    information,
    payload_information,
    with_exact_sign,
)
from tauhat.excitation.limits import (
    FAR,
    LimitSet,
    MotionLimit,
    MotionLimits,
    load_limits,
    motion_limits,
    parse_limits,
)
from tauhat.excitation.point_to_point import PointToPoint, Quintic, Trapezoidal, point_to_point
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.sampled import SampledMotion, sampled_motion
from tauhat.excitation.space import FourierSpace, SampledSpace, random_points
from tauhat.excitation.static_motion import static_motion
from tauhat.excitation.sweep import Sweep, sweep
from tauhat.excitation.task_path import TaskPath, task_path
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.excitation.waypoints import (
    AccelerationLimited,
    JerkLimited,
    JointMove,
    LineMove,
    Slowed,
    ToolLimits,
    WaypointMotion,
    WaypointSettings,
    Zone,
    waypoint_motion,
)

__all__ = [
    "CRITERIA",
    "FAR",
    "METHODS",
    "AOptimal",
    "AccelerationLimited",
    "ConditionNumber",
    "Criterion",
    "DOptimal",
    "Design",
    "DesignSettings",
    "EOptimal",
    "FourierSeries",
    "FourierSpace",
    "GeneticSettings",
    "Information",
    "JerkLimited",
    "JointMove",
    "Knowledge",
    "LimitSet",
    "LineMove",
    "Method",
    "Mixed",
    "MotionLimit",
    "MotionLimits",
    "MotionSamples",
    "PointToPoint",
    "Quintic",
    "Repeated",
    "SampledMotion",
    "SampledSpace",
    "Slowed",
    "Sweep",
    "TaskPath",
    "ToolLimits",
    "Trajectory",
    "Trapezoidal",
    "WaypointMotion",
    "WaypointSettings",
    "Zone",
    "after_evidence",
    "after_motions",
    "criterion_named",
    "design",
    "fourier_basis",
    "information",
    "limit_margins",
    "load_limits",
    "method_named",
    "motion_limits",
    "parse_limits",
    "payload_information",
    "point_to_point",
    "random_fourier",
    "random_points",
    "rest_basis",
    "sampled_motion",
    "static_motion",
    "sweep",
    "task_path",
    "waypoint_motion",
    "with_exact_sign",
]
