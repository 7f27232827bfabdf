"""Calibration where the work is: regions of the task, stages, and programs of via-points designed for them."""

from tauhat.excitation.task_design.blocks import BLOCKS, Block, Blocks, blocks_of, told_of
from tauhat.excitation.task_design.design import TaskSettings, design_task
from tauhat.excitation.task_design.found import StageDesign, TaskDesign
from tauhat.excitation.task_design.reach import Reach, reach_of
from tauhat.excitation.task_design.regions import BoxRegion, Freedom, PathRegion, PosesRegion, TaskRegion
from tauhat.excitation.task_design.stages import TaskStage, one_stage, two_stages

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
    "one_stage",
    "reach_of",
    "told_of",
    "two_stages",
]
