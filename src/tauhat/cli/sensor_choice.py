"""From options to a force sensor at one rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tauhat.cli.sensing_options import SensingOptions
    from tauhat.sensing.sensor import ForceSensor


def sensor_of(options: SensingOptions, rate: float) -> ForceSensor:
    """Return the sensor for samples of this rate [Hz].

    Raises
    ------
    TauhatError
        files that cannot be read, names that are unknown, numbers that mean nothing.
    """
    from dataclasses import replace

    from tauhat.estimation.estimate import load_estimate
    from tauhat.sensing.observers import observer_named
    from tauhat.sensing.sensor import force_sensor
    from tauhat.sensing.tool import load_tool
    from tauhat.sensing.wrench import WrenchSolver, directions_named

    estimate = load_estimate(options.estimate)
    wrench = WrenchSolver(
        robot=estimate.robot, frame=options.frame, directions=directions_named(options.directions), axes=options.axes
    )
    observer = observer_named(options.observer, gain=options.gain)
    sensor = force_sensor(
        estimate, rate=rate, observer=observer, cutoff=options.cutoff, wrench=wrench, stamps=options.stamps
    )
    if options.tool is None:
        return sensor
    tool = load_tool(options.tool)
    return replace(sensor, model=sensor.model.carrying(tool.body, tool.link))
