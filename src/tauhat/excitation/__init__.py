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
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.sampled import SampledMotion, sampled_motion
from tauhat.excitation.space import FourierSpace, SampledSpace, random_points
from tauhat.excitation.trajectory import MotionSamples, Trajectory

__all__ = [
    "CRITERIA",
    "FAR",
    "METHODS",
    "AOptimal",
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
    "Knowledge",
    "LimitSet",
    "Method",
    "Mixed",
    "MotionLimit",
    "MotionLimits",
    "MotionSamples",
    "Repeated",
    "SampledMotion",
    "SampledSpace",
    "Trajectory",
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
    "random_fourier",
    "random_points",
    "rest_basis",
    "sampled_motion",
    "with_exact_sign",
]
