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
from tauhat.errors import OutputError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.recordings.reading import read_log
from tauhat.report.page import write_report
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import Truth
from tauhat.simulation.parameters import TrueParameters, perturbed
from tauhat.verification.prediction import Verification, verify
from tauhat.verification.truth import TruthComparison, compare_with_truth


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoSettings:
    """What is demonstrated: robot, how its two logs are made, how far it is from its description, and the seed."""

    robot: str = "ur5e"
    plan: Plan = field(default_factory=Plan)
    spread: float = 0.1
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demo:
    """What the demonstration made.

    files : role -> path: identification_log, verification_log, truth, estimate, report
    comparison : with the truth, on the motion that was not fitted
    seconds : it took
    """

    folder: Path
    files: dict[str, Path]
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
            "fit": {name: fit[name] for name in ("estimator", "relative_rms", "rank", "condition")},
            "logs": self.verification.to_dict()["logs"],
            "truth": self.comparison.to_dict(),
            "seconds": self.seconds,
        }


def run_demo(folder: Path, settings: DemoSettings, *, tell: Callable[[str], None]) -> Demo:
    """Simulate two motions, identify on the first, verify on the second and against the truth, write the report.

    Parameters
    ----------
    folder : made if it is not there
    tell : called with each step in words as it begins
    """
    begin = time.monotonic()
    _make(folder)
    files = _files(folder)
    robot = load_robot(settings.robot)
    rng = np.random.default_rng(settings.seed)
    truth = perturbed(robot, rng, spread=settings.spread)
    tell(f"1/5 {robot.name} in MuJoCo: a random motion of {settings.plan.seconds:g} s to identify from")
    _recorded(robot, settings, files["identification_log"], truth=truth, rng=rng)
    tell("2/5 another motion to verify on")
    unseen = _recorded(robot, settings, files["verification_log"], truth=truth, rng=rng)
    tell(f"3/5 identifying {', '.join(PLAIN_TERMS)}")
    estimate = identify(torque_model(robot), [read_log(files["identification_log"]).recording()])
    estimate.save(files["estimate"])
    tell("4/5 verifying on the second motion, and against the truth")
    log = read_log(files["verification_log"])
    verification = verify(estimate, [log.recording()])
    comparison = compare_with_truth(estimate, unseen)
    tell("5/5 checking the log and writing the report")
    findings = checked_log(log, robot=robot, terms=PLAIN_TERMS).findings
    write_report(files["report"], estimate, verification=verification, findings=findings)
    return Demo(
        folder=folder,
        files=files,
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
        "identification_log": identification,
        "verification_log": folder / "verification.parquet",
        "truth": truth_path(identification),
        "estimate": folder / "estimate.json",
        "report": folder / "report.html",
    }


def _recorded(
    robot: Robot, settings: DemoSettings, log: Path, *, truth: TrueParameters, rng: np.random.Generator
) -> Truth:
    simulation = run_experiment(robot, settings.plan, truth=truth, rng=rng)
    write_experiment(robot, simulation, log, plan=settings.plan, seed=settings.seed)
    return simulation.truth
