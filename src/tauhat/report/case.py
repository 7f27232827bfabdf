"""What a report is about, and the piece it is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from tauhat.arrays import FloatArray
from tauhat.estimation.estimate import Estimate
from tauhat.recordings.findings import Finding
from tauhat.verification.prediction import LogPrediction, Verification
from tauhat.verification.residual_tests import LogResiduals

_FAR_CLOCK = 1e5  # [s] times beyond a day are wall clocks and read badly


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """What a report tells about.

    estimate : the identified model
    verification : how it predicts recordings, where that was measured
    findings : of the checks, log by log under its name (empty for all logs together); None when no log was checked
    """

    estimate: Estimate
    verification: Verification | None = None
    findings: tuple[tuple[str, tuple[Finding, ...]], ...] | None = None

    @property
    def logs(self) -> tuple[LogPrediction, ...]:
        """The predictions, none without verification."""
        return self.verification.logs if self.verification else ()

    @property
    def residuals(self) -> tuple[LogResiduals, ...]:
        """What the residuals of recordings still hold, none where they were not searched."""
        return self.verification.residuals if self.verification else ()

    def was_fitted(self, log: LogPrediction) -> bool:
        """Return whether a log of that name went into the fit."""
        return any(log.input.overlaps(given) for given in self.estimate.inputs)

    @property
    def unseen(self) -> tuple[LogPrediction, ...]:
        """The predictions of logs whose name did not go into the fit."""
        return tuple(log for log in self.logs if not self.was_fitted(log))

    def is_unfolded(self, log: LogPrediction) -> bool:
        """Return whether the report shows this log unfolded: the first unseen one, else the first."""
        return log is (self.unseen or self.logs)[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """One drawing: its id in the page, its caption, height and least width [px], and Plotly's JSON."""

    key: str
    caption: str
    height: int
    width: int
    json: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One chapter of the report: anchor, heading, escaped HTML and the drawings that the HTML places."""

    key: str
    title: str
    html: Markup
    plots: tuple[Plot, ...] = ()


def pooled_relative_rms(logs: tuple[LogPrediction, ...]) -> float:
    """Return the norm of the error over the norm of the torque, all logs and joints stacked."""
    error = np.sqrt(sum(float(np.sum((log.tau - log.predicted) ** 2)) for log in logs))
    torque = np.sqrt(sum(float(np.sum(log.tau**2)) for log in logs))
    return float(error / torque) if torque > 0 else float("inf")


def clock_start(t: FloatArray) -> float:
    """Return what to subtract from the times so that they read well: nothing, or the whole seconds of a wall clock."""
    return float(np.floor(t[0])) if abs(t[0]) > _FAR_CLOCK else 0.0
