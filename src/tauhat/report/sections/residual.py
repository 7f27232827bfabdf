"""Where in time and speed the error sits."""

from __future__ import annotations

from tauhat.report.case import Case, Plot, Section
from tauhat.report.figures import speed_plot, time_plot
from tauhat.report.rendering import rendered


def residual(case: Case) -> Section:
    """Return for every log the residual over time, all joints together, and over speed, joint by joint."""
    logs = []
    plots: list[Plot] = []
    for number, log in enumerate(case.logs):
        over_time = time_plot(log, key=f"time-{number}")
        over_speed = [speed_plot(log, joint, key=f"speed-{number}-{joint}") for joint in range(len(log.joints))]
        logs.append(
            {
                "name": log.log,
                "unfolded": case.is_unfolded(log),
                "time": over_time,
                "speed": over_speed,
                "parts": len(log.joints[0].by_time),
            }
        )
        plots += [over_time, *over_speed]
    html = rendered("residual.html.j2", logs=logs)
    return Section(key="residual", title="Where the error sits", html=html, plots=tuple(plots))
