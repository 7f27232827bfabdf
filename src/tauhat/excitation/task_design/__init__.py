"""Calibration where the work is: regions of the task, stages, and programs of via-points designed for them."""

from tauhat.excitation.task_design.blocks import BLOCKS, Block, Blocks, blocks_of, names_of, told_of
from tauhat.excitation.task_design.design import TaskSettings, design_task
from tauhat.excitation.task_design.found import StageDesign, TaskDesign
from tauhat.excitation.task_design.reach import Reach, reach_of
from tauhat.excitation.task_design.regions import BoxRegion, Freedom, PathRegion, PosesRegion, TaskRegion
from tauhat.excitation.task_design.stages import TaskStage, one_stage, two_stages
from tauhat.excitation.task_design.task_file import load_task, parse_task

__all__ = [
    "BLOCKS",
    "Block",
    "Blocks",
    "BoxRegion",
    "Freedom",
    "PathRegion",
    "PosesRegion",
    "Reach",
    "StageDesign",
    "TaskDesign",
    "TaskRegion",
    "TaskSettings",
    "TaskStage",
    "blocks_of",
    "design_task",
    "load_task",
    "names_of",
    "one_stage",
    "parse_task",
    "reach_of",
    "told_of",
    "two_stages",
]
