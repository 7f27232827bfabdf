"""From the options of `tauhat sense` to a force sensor at one rate."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tauhat.sensing.sensor import ForceSensor


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorChoice:
    """What was chosen of a sensor beside its rate."""

    estimate: Path
    observer: str
    gain: float | None
    cutoff: float | None
    frame: str | None
    directions: str
    axes: Literal["base", "frame"]
    tool: Path | None
    stamps: Literal["auto", "exact", "jittered"]

    def sensor(self, rate: float) -> ForceSensor:
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

        estimate = load_estimate(self.estimate)
        wrench = WrenchSolver(
            robot=estimate.robot, frame=self.frame, directions=directions_named(self.directions), axes=self.axes
        )
        observer = observer_named(self.observer, gain=self.gain)
        sensor = force_sensor(
            estimate, rate=rate, observer=observer, cutoff=self.cutoff, wrench=wrench, stamps=self.stamps
        )
        if self.tool is None:
            return sensor
        tool = load_tool(self.tool)
        return replace(sensor, model=sensor.model.carrying(tool.body, tool.link))
