"""The model in use: tracking with and without it, and recordings done again in simulation."""

from __future__ import annotations

import numpy as np

from tauhat.report.case import Section
from tauhat.report.rendering import rendered
from tauhat.report.tracking_figures import finite_runs, forward_plot, tracking_bars, tracking_plot
from tauhat.verification.motion_forward import ForwardMotion
from tauhat.verification.motion_tracking import TrackingComparison, TrackingRun

_KNOWLEDGE = ("none", "nominal", "identified")


def tracking(result: TrackingComparison) -> Section:
    """Return the errors of all controllers, and the motion with identified, nominal and no model."""
    bars = tracking_bars(result, key="tracking-bars")
    shown = best_of_each(result)
    plots = [
        tracking_plot(result, shown, joint, key=f"tracking-{joint}") for joint in range(len(result.names))
    ]  # fmt: skip
    html = rendered(
        "tracking.html.j2",
        result=result,
        bars=bars,
        shown=[run.name for run in shown],
        plots=list(zip(result.names, plots, strict=True)),
        seconds=float(result.t[-1]),
    )
    return Section(key="tracking", title="Tracking with the model", html=html, plots=(bars, *plots))


def best_of_each(result: TrackingComparison) -> tuple[TrackingRun, ...]:
    """Return the controller with the least error among those without model, with the nominal, with the identified."""
    best = []
    for knowledge in _KNOWLEDGE:
        runs = [run for run in result.runs if run.knows == knowledge and not run.failure]
        if runs:
            best.append(min(runs, key=lambda run: float(np.linalg.norm(run.rms))))
    return tuple(best)


def forward(result: ForwardMotion) -> Section:
    """Return the recording done again by the models: under a law, and driven by the measured torque."""
    driven = finite_runs([run for run in result.runs if run.way == "driven"])
    number = range(len(result.names))
    plots = [forward_plot(result, driven, joint, key=f"forward-{joint}") for joint in number]
    html = rendered(
        "forward.html.j2", result=result, plots=list(zip(result.names, plots, strict=True)), span=result.span
    )
    return Section(key="forward", title="The recording done again in simulation", html=html, plots=tuple(plots))
