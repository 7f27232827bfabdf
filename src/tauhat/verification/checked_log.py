"""Health of logs: the checks that fit what is known, in one list."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tauhat.dynamics.model import torque_model
from tauhat.recordings.checks import check_limits, check_log
from tauhat.recordings.findings import SEVERITIES, Finding
from tauhat.recordings.log import Log
from tauhat.robots.fitting import fit_to_joints
from tauhat.robots.robot import Robot
from tauhat.verification.health import check_axes, check_recording


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckedLog:
    """A log and what the checks say about it, the gravest first."""

    log: Log
    findings: tuple[Finding, ...]

    @property
    def usable(self) -> bool:
        """Whether nothing was found that forbids to identify from the log."""
        return all(finding.severity != "error" for finding in self.findings)


def checked_log(log: Log, *, robot: Robot | None = None, terms: str | Iterable[str]) -> CheckedLog:
    """Return the log with the findings of all checks that it is sound enough for.

    Parameters
    ----------
    robot : adds its limits, and with a sound log what its torque model says
    terms : of the torque model

    Raises
    ------
    RecordingError
        when the log has the robot's joints in another order.
    """
    checked = CheckedLog(log=log, findings=check_log(log))
    if robot is None:
        return _with(checked, check_axes(log.recording())) if checked.usable and log.tau is not None else checked
    fitted = fit_to_joints(robot, log.joint_names, where=log.path)
    checked = _with(checked, check_limits(log, fitted))
    if not checked.usable or log.tau is None:
        return checked
    return _with(checked, check_recording(torque_model(fitted, terms), log.recording()))


def _with(checked: CheckedLog, findings: tuple[Finding, ...]) -> CheckedLog:
    together = sorted((*checked.findings, *findings), key=lambda finding: -SEVERITIES.index(finding.severity))
    return CheckedLog(log=checked.log, findings=tuple(together))
