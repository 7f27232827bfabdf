"""Motions that models are calibrated with: through the whole room, and where the work is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.tool_mount import ToolMount
from tauhat.excitation.design import DesignSettings, design
from tauhat.excitation.genetic import GeneticSettings
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.sampled import SampledMotion
from tauhat.excitation.task_design import Freedom, PathRegion, TaskSettings, TaskStage, design_task, two_stages
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.robots.inverse_kinematics import PoseSolver
from tauhat.robots.robot import Robot
from tauhat.studies.polishing.work import Posture, WorkSettings
from tauhat.workers import Workers

_RATE = 250.0  # [Hz] of references that are given as samples
_STREAM = 20261124
_WHOLE, _LOCAL = range(2)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionSettings:
    """How the calibration motions are designed.

    period, harmonics, starts : of the Fourier series through the whole room
    stages, genetic, islands : of the programs where the work is
    clear : height of their middle above the surface; they keep within a bit less of it [m]
    freedom : of the tool's orientation in them
    """

    period: float = 20.0
    harmonics: int = 5
    starts: int = 2
    stages: tuple[TaskStage, ...] = field(default_factory=two_stages)
    genetic: GeneticSettings = field(default_factory=lambda: GeneticSettings(population=40, generations=40))
    islands: int = 2
    clear: float = 0.06
    freedom: Freedom = field(default_factory=lambda: Freedom(tilt=0.3, spin=0.3))


def whole_room(robot: Robot, settings: MotionSettings, *, terms: str, seconds: float) -> Trajectory:
    """Return a designed Fourier series, over and over for about so long."""
    wanted = DesignSettings(period=settings.period, harmonics=settings.harmonics, starts=settings.starts)
    found = design(robot, rng=np.random.default_rng([_STREAM, _WHOLE]), settings=wanted, terms=terms)
    return Repeated(series=found.trajectory, periods=max(1, round(seconds / settings.period)))


def where_the_work_is(
    robot: Robot, work: WorkSettings, posture: Posture, settings: MotionSettings, *, terms: str, workers: Workers
) -> SampledMotion:
    """Return programs of via-points in a tube above the path, one after the other; `over_and_over` repeats them.

    Parameters
    ----------
    robot : with the tool's tip as its last frame
    """
    surface = work.believed(posture, "flat")
    ends = np.array([-surface.half, 0.0, surface.half])
    poses = ToolMount(frame=robot.frames[-1].name, length=0.0).poses(surface, ends, -settings.clear)
    home = PoseSolver(robot, robot.frames[-1].name).position(poses[1], np.array(posture.seed))
    region = PathRegion(poses=tuple(poses), clearance=0.9 * settings.clear, freedom=settings.freedom)
    wanted = TaskSettings(
        region=region, home=home, stages=settings.stages, genetic=settings.genetic, islands=settings.islands
    )
    found = design_task(robot, wanted, rng=np.random.default_rng([_STREAM, _LOCAL]), terms=terms, workers=workers)
    logs = [stage.recording(rate=_RATE) for stage in found.stages]
    parts = [(log.q, np.asarray(log.dq), np.asarray(log.ddq)) for log in logs]
    return _joined([np.concatenate(part) for part in zip(*parts, strict=True)])


def over_and_over(motion: SampledMotion, seconds: float) -> SampledMotion:
    """Return a motion that ends where it begins, at rest, repeated for about so long."""
    times = max(1, round(seconds / motion.duration))
    samples = motion.samples
    return _joined([np.tile(part, (times, 1)) for part in (samples.q, samples.dq, samples.ddq)])


def _joined(parts: list[FloatArray]) -> SampledMotion:
    q, dq, ddq = parts
    return SampledMotion(samples=MotionSamples(t=np.arange(len(q)) / _RATE, q=q, dq=dq, ddq=ddq))
