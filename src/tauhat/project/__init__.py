"""One project, one folder: the whole way of one robot, made step by step, and again only where something changed."""

from tauhat.project.project_file import load_project, project_path
from tauhat.project.running import ProjectRun, StepReport, plan_project, run_project
from tauhat.project.settings import (
    DesignedMotion,
    Exports,
    GivenLogs,
    GivenMotion,
    Identification,
    Project,
    ReportSettings,
    RobotSettings,
    SimulatedLogs,
    UnseenMotion,
)
from tauhat.project.template import write_new_project

__all__ = [
    "DesignedMotion",
    "Exports",
    "GivenLogs",
    "GivenMotion",
    "Identification",
    "Project",
    "ProjectRun",
    "ReportSettings",
    "RobotSettings",
    "SimulatedLogs",
    "StepReport",
    "UnseenMotion",
    "load_project",
    "plan_project",
    "project_path",
    "run_project",
    "write_new_project",
]
