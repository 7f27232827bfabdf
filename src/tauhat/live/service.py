"""What every client of a server is given: one sensor, thresholds of contact, limits, and a look on the page."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tauhat.errors import LiveError
from tauhat.live.feed import Feed
from tauhat.live.limits import Limits
from tauhat.live.protocol import hello_text
from tauhat.sensing.contact import ContactDetector
from tauhat.sensing.contact_thresholds import ContactThresholds
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.wrench import WrenchSolver
from tauhat.sensing.zero import Zero


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Service:
    """One sensor for many streams.

    sensor : model, observer, rate
    thresholds : of contact; None where nobody asks for it
    limits : of what a client may take
    feed : to the page
    zero : whether what friction held as the arm came to rest is off torque and wrench as well; needs thresholds
    """

    sensor: ForceSensor
    thresholds: ContactThresholds | None = None
    limits: Limits = field(default_factory=Limits)
    feed: Feed = field(default_factory=Feed)
    zero: Zero = "as sensed"
    solver: WrenchSolver = field(init=False, repr=False)
    detector: ContactDetector | None = field(init=False, repr=False)
    hello: str = field(init=False, repr=False)

    def __post_init__(self) -> None:
        robot = self.sensor.model.robot
        if self.zero == "standing" and self.thresholds is None:
            raise LiveError(
                "the standing zero is that of contacts", where="server", remedy="give thresholds of contact"
            )
        object.__setattr__(self, "solver", self.sensor.solver)
        object.__setattr__(self, "detector", None)
        if self.thresholds is not None:
            self.thresholds.check_joints(tuple(robot.joint_names), where="server")
            detector = ContactDetector(thresholds=self.thresholds, step=self.sensor.step)
            object.__setattr__(self, "detector", detector)
        object.__setattr__(self, "hello", self._hello())

    def _hello(self) -> str:
        robot = self.sensor.model.robot
        return hello_text(
            robot=robot.name, joints=list(robot.joint_names), rate=self.sensor.rate, frame=str(self.solver.frame),
            axes=self.solver.axes, observer=self.sensor.observer.key, contacts=self.detector is not None,
            message_bytes=self.limits.message, messages_a_second=self.limits.messages,
        )  # fmt: skip

    def warm_up(self) -> None:
        """Go every way once that a sample may go, so that nothing is compiled while samples wait."""
        n_v = self.sensor.n_v
        zero, one = np.zeros(n_v), np.ones(n_v)
        memory, sensed = self.sensor.advance(self.sensor.start(), zero, zero)
        self.sensor.advance(memory, zero, zero)
        self.solver.at(zero, zero, one)
        if self.detector is not None:
            self.detector.advance(self.detector.start(), sensed.tau, sensed.variance, sensed.dq)
