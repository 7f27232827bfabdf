"""The demonstration: the whole way from a motion to a verified model, on a simulated robot whose truth is known."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.cli.experiment import Plan, run_experiment, truth_path, write_experiment
from tauhat.cli.health import checked_log
from tauhat.dynamics.model import PLAIN_TERMS, torque_model
from tauhat.dynamics.motion import Motion
from tauhat.errors import OutputError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.excitation.design import Design, DesignSettings, design
from tauhat.excitation.information import information
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.recordings.reading import read_log
from tauhat.recordings.writing import write_recording
from tauhat.report.page import write_report
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import Truth
from tauhat.simulation.parameters import TrueParameters, perturbed
from tauhat.verification.prediction import Verification, verify
from tauhat.verification.truth import TruthComparison, compare_with_truth

_PERIOD = 10.0  # [s] of the designed motion, about; it is repeated
_STARTS = 2  # of the design: a third took two seconds more and was no better
_RATE = 100.0  # [Hz] of the motion file


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoSettings:
    """What is demonstrated: robot, how its two logs are made, how far it is from its description, and the seed."""

    robot: str = "ur5e"
    plan: Plan = field(default_factory=Plan)
    spread: float = 0.1
    seed: int = 0

    @property
    def periods(self) -> int:
        """How often the designed motion is run."""
        return max(1, round(self.plan.seconds / _PERIOD))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demo:
    """What the demonstration made.

    files : role -> path: motion, identification_log, verification_log, truth, estimate, report
    designed : the motion that was identified from
    random_condition : condition number of the random motion that was verified on, for comparison
    comparison : with the truth, on the motion that was not fitted
    seconds : it took
    """

    folder: Path
    files: dict[str, Path]
    designed: Design
    random_condition: float
    estimate: Estimate
    verification: Verification
    comparison: TruthComparison
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        fit = self.estimate.to_dict()["fit"]
        return {
            "robot": self.estimate.robot.name,
            "folder": str(self.folder),
            "files": {role: str(path) for role, path in self.files.items()},
            "motion": {**self.designed.to_dict(), "random_condition": self.random_condition},
            "fit": {name: fit[name] for name in ("estimator", "relative_rms", "rank", "condition")},
            "logs": self.verification.to_dict()["logs"],
            "truth": self.comparison.to_dict(),
            "seconds": self.seconds,
        }


def run_demo(folder: Path, settings: DemoSettings, *, tell: Callable[[str], None]) -> Demo:
    """Design a motion, simulate it and a random one, identify on the first, verify on the second, write the report.

    Parameters
    ----------
    folder : made if it is not there
    tell : called with each step in words as it begins
    """
    begin = time.monotonic()
    _make(folder)
    files, robot = _files(folder), load_robot(settings.robot)
    rng = np.random.default_rng(settings.seed)
    truth = perturbed(robot, rng, spread=settings.spread)
    tell(f"1/6 designing a motion for {robot.name}")
    designed = _designed(robot, settings, files["motion"], rng=rng)
    tell(f"2/6 {robot.name} in MuJoCo: {settings.plan.seconds:g} s of that motion to identify from")
    whole = Repeated(series=designed.trajectory, periods=settings.periods)
    _recorded(robot, settings, files["identification_log"], truth=truth, rng=rng, motion=whole)
    tell("3/6 a random motion to verify on")
    unseen = _recorded(robot, settings, files["verification_log"], truth=truth, rng=rng)
    tell(f"4/6 identifying {', '.join(PLAIN_TERMS)}")
    estimate = identify(torque_model(robot), [read_log(files["identification_log"]).recording()])
    estimate.save(files["estimate"])
    tell("5/6 verifying on the random motion, and against the truth")
    log = read_log(files["verification_log"])
    verification = verify(estimate, [log.recording()])
    comparison = compare_with_truth(estimate, unseen)
    tell("6/6 checking the log and writing the report")
    findings = checked_log(log, robot=robot, terms=PLAIN_TERMS).findings
    motion = designed.trajectory
    write_report(files["report"], estimate, verification=verification, findings=findings, motion=motion)
    return Demo(
        folder=folder,
        files=files,
        designed=designed,
        random_condition=_condition(robot, unseen.reference),
        estimate=estimate,
        verification=verification,
        comparison=comparison,
        seconds=time.monotonic() - begin,
    )


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError("the folder cannot be made", where=folder, got=error.strerror or error) from error


def _files(folder: Path) -> dict[str, Path]:
    identification = folder / "identification.parquet"
    return {
        "motion": folder / "motion.parquet",
        "identification_log": identification,
        "verification_log": folder / "verification.parquet",
        "truth": truth_path(identification),
        "estimate": folder / "estimate.json",
        "report": folder / "report.html",
    }


def _designed(robot: Robot, settings: DemoSettings, path: Path, *, rng: np.random.Generator) -> Design:
    period, harmonics = settings.plan.seconds / settings.periods, settings.plan.harmonics
    wanted = DesignSettings(period=period, harmonics=harmonics, method="gradient", starts=_STARTS)
    found = design(robot, rng=rng, settings=wanted)
    write_recording(found.recording(rate=_RATE, joint_names=robot.joint_names), path)
    return found


def _recorded(
    robot: Robot,
    settings: DemoSettings,
    log: Path,
    *,
    truth: TrueParameters,
    rng: np.random.Generator,
    motion: Trajectory | None = None,
) -> Truth:
    simulation = run_experiment(robot, settings.plan, truth=truth, rng=rng, motion=motion)
    write_experiment(robot, simulation, log, plan=settings.plan, seed=settings.seed)
    return simulation.truth


def _condition(robot: Robot, samples: MotionSamples) -> float:
    """Return the condition number of a motion as `Design` has it: exact sign, columns scaled by constants."""
    rows = [np.ascontiguousarray(part.T) for part in (samples.q, samples.dq, samples.ddq)]
    motion = Motion(q=rows[0], dq=rows[1], ddq=rows[2])
    eigenvalues = np.linalg.eigvalsh(information(torque_model(robot)).matrix(motion))
    return float(np.sqrt(eigenvalues[-1] / eigenvalues[0])) if eigenvalues[0] > 0.0 else float("inf")
