"""The page of the model in use: tracking with and without it, and recordings done again in simulation."""

from __future__ import annotations

from pathlib import Path

from tauhat.errors import ModelError
from tauhat.report.page import require_libraries, write_page
from tauhat.verification.motion_forward import ForwardMotion
from tauhat.verification.motion_tracking import TrackingComparison


def write_tracking_report(
    path: str | Path,
    *,
    tracking: TrackingComparison | None = None,
    forward: ForwardMotion | None = None,
    title: str = "The model in motion",
) -> Path:
    """Write a self-contained HTML page of how the model serves in motion, and return its path.

    Parameters
    ----------
    tracking : controllers beside each other on a plant
    forward : a recording done again in simulation

    Raises
    ------
    ModelError
        when neither is given.
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    if tracking is None and forward is None:
        raise ModelError("nothing to show", expected="a tracking comparison, or a recording done again")
    require_libraries()
    from tauhat.report.sections import tracking as chapters

    sections = [] if tracking is None else [chapters.tracking(tracking)]
    sections += [] if forward is None else [chapters.forward(forward)]
    return write_page(path, sections, title=title)
