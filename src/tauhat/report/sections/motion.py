"""A designed motion: how it keeps its limits, and how well it sees each parameter."""

from __future__ import annotations

import numpy as np

from tauhat.report.case import Section
from tauhat.report.motion_case import MotionCase
from tauhat.report.motion_figures import seen_plot, spectrum_plot, trajectory_plot
from tauhat.report.rendering import rendered

_LISTED = 8  # parameters named as the least certain


def motion(case: MotionCase) -> Section:
    """Return the trajectories of all joints against their limits, and what is left of every limit."""
    plots = tuple(trajectory_plot(case, joint, key=f"joint-{joint}") for joint in range(case.robot.n_v))
    html = rendered(
        "motion.html.j2",
        rows=list(zip(case.robot.joint_names, case.used().tolist(), plots, strict=True)),
        margins=dict(case.margins),
        condition=case.condition,
        random_condition=float(case.singular_random[0] / case.singular_random[-1]),
        duration=float(case.samples.t[-1] + case.samples.t[1] - case.samples.t[0]),
        n=len(case.names),
        rests=case.rests,
    )
    return Section(key="motion", title="The motion", html=html, plots=plots)


def seen(case: MotionCase) -> Section:
    """Return how well each parameter will be known, joint by joint, and which ones least."""
    order = np.argsort(np.array(case.joints), kind="stable")
    plot = seen_plot(case, order, key="seen")
    least = np.argsort(-case.deviations)[:_LISTED]
    html = rendered(
        "seen.html.j2",
        plot=plot,
        better=int((case.ratios <= 1.0).sum()),
        n=len(case.names),
        least=[(case.names[index], float(case.deviations[index]), float(case.ratios[index])) for index in least],
    )
    return Section(key="seen", title="Which parameters it sees well", html=html, plots=(plot,))


def spectrum(case: MotionCase) -> Section:
    """Return the singular values of the scaled regressor."""
    plot = spectrum_plot(case, key="spectrum")
    html = rendered("spectrum.html.j2", plot=plot, condition=case.condition)
    return Section(key="spectrum", title="Singular values", html=html, plots=(plot,))
