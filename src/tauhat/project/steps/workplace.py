"""What the steps of a project share: the robot, and where things are."""

from __future__ import annotations

import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauhat.errors import TauhatWarning
from tauhat.estimation.estimate import Estimate, input_log, load_estimate
from tauhat.export.controller_arms import has_six_revolute_joints
from tauhat.files import write_text
from tauhat.project.settings import DesignedMotion, GivenLogs, Project, SimulatedLogs, labelled
from tauhat.project.step import log_files
from tauhat.recordings.log import Log
from tauhat.recordings.reading import read_log
from tauhat.recordings.recognising import recognise
from tauhat.recordings.tables import open_table
from tauhat.robots.fitting import check_joint_order
from tauhat.robots.library import builtin_names, load_robot
from tauhat.robots.robot import Robot

ROBOT, ESTIMATE, VERIFICATION = "robot/robot.json", "estimate.json", "verification.json"
CHECKS, REPORT, DESIGN, ADVICE = "checks.json", "report.html", "motion/design.json", "recordings/RECORD.md"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Workplace:
    """A project with its robot.

    source : the robot's file, none where it is built in
    """

    project: Project
    robot: Robot
    source: Path | None

    def path(self, output: str) -> Path:
        """Return where an output is."""
        return self.project.folder / output

    def write(self, output: str, document: Any) -> None:
        """Write plain data as JSON."""
        write_text(self.path(output), json.dumps(document, indent=1))

    @property
    def motions(self) -> tuple[str, ...]:
        """Sampled motions; none where the logs were made with another motion."""
        count = 0 if self.project.motion is None else self.project.motion.count
        return _numbered("motion/motion", count)

    @property
    def programs(self) -> tuple[str, ...]:
        """Programs of designed motions, for arms that Universal Robots programs move; else none."""
        if not has_six_revolute_joints(self.robot) or not isinstance(self.project.motion, DesignedMotion):
            return ()
        return tuple(f"{name.removesuffix('.parquet')}.script" for name in self.motions)

    @property
    def simulated_logs(self) -> tuple[str, ...]:
        """Simulated logs to identify from; none where logs are given."""
        return _numbered("recordings/identification", len(self.motions)) if self._simulated else ()

    @property
    def unseen_log(self) -> tuple[str, ...]:
        """The simulated log to verify on; none where logs are given."""
        return ("recordings/verification.parquet",) if self._simulated else ()

    @property
    def limits(self) -> Path | None:
        """The file of further limits of the motion."""
        motion = self.project.motion
        return self.project.place(motion.limits) if isinstance(motion, DesignedMotion) and motion.limits else None

    @property
    def _simulated(self) -> bool:
        return isinstance(self.project.record, SimulatedLogs)

    def given_logs(self, given: object) -> tuple[Path, ...]:
        """Return the logs that people bring."""
        return tuple(self.project.place(log) for log in given.logs) if isinstance(given, GivenLogs) else ()

    def given_map(self, given: object) -> Path | None:
        """Return the map of logs that people bring, where one is named."""
        return self.project.place(given.map) if isinstance(given, GivenLogs) and given.map else None

    def awaited(self, given: object) -> tuple[Path, ...]:
        """Return every file that has to be there before logs that people bring can be read."""
        log_map = self.given_map(given)
        return (*self.given_logs(given), *(() if log_map is None else (log_map,)))

    def settings_of_logs(self, section: str, given: object) -> dict[str, Any]:
        """Return names and order of logs that people bring; simulated ones have their own step."""
        return labelled(section, given) if isinstance(given, GivenLogs) else {}

    def files_of_logs(self, given: object) -> tuple[Path, ...]:
        """Return these logs with their maps and what the maps name, as far as they are there."""
        log_map = self.given_map(given)
        return tuple(file for log in self.given_logs(given) for file in log_files(log, log_map) if file.is_file())

    def fitted_logs(self) -> list[Log]:
        """Return the logs to identify from, whatever is wrong in them."""
        return self._logs(self.simulated_logs, self.project.record)

    def unseen_logs(self, estimate: Estimate) -> list[Log]:
        """Return the logs to verify on.

        Raises
        ------
        RecordingError
            when a log has the robot's joints in another order.

        Warns
        -----
        TauhatWarning
            when the estimate was fitted on one of them.
        """
        logs = self._logs(self.unseen_log, self.project.verify)
        for log in logs:
            recording = log.recording()
            check_joint_order(estimate.robot, recording.joint_names, where=recording.name)
            if any(known.overlaps(input_log(recording)) for known in estimate.inputs):
                message = (
                    f"{recording.name} is one of the logs the estimate was fitted on: its error there proves little"
                )
                warnings.warn(message, TauhatWarning, stacklevel=2)
        return logs

    def _logs(self, simulated: tuple[str, ...], given: object) -> list[Log]:
        if simulated:  # their columns say what they are: a map in their folder is that of other logs
            places = [self.path(name) for name in simulated]
            return [read_log(place, map=recognise(open_table(place))) for place in places]
        return [read_log(place, map=self.given_map(given)) for place in self.given_logs(given)]

    def estimate(self) -> Estimate:
        """Return the estimate."""
        return load_estimate(self.path(ESTIMATE))


def workplace_of(project: Project) -> Workplace:
    """Return the workplace of a project.

    Raises
    ------
    RobotError
        when there is no such robot.
    """
    name = project.robot.source
    source = None if name in builtin_names() else project.place(name)
    robot = load_robot(name if source is None else source, locked=project.robot.locked or None)
    return Workplace(project=project, robot=robot, source=source)


def _numbered(stem: str, count: int) -> tuple[str, ...]:
    """Return one file without a number, several with one."""
    if count == 1:
        return (f"{stem}.parquet",)
    return tuple(f"{stem}-{number}.parquet" for number in range(1, count + 1))
