"""Where a polisher's force comes from: a load cell, the virtual sensor, or nothing at all."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.reading import ForceReading
from tauhat.sensing.sensor import ForceSensor, Sensed
from tauhat.sensing.wrench import WrenchSolver
from tauhat.sensing.zero import AirPass
from tauhat.simulation.contact.running_cell import CellSample


class Place(NamedTuple):
    """Where the tool is on its way.

    along : direction of the feed along the tool's x: 1, -1, or 0 while it stands
    progress : way of the tool since the passes began, there and back [m]
    down : whether it is on its way down, in the air as far as anyone knows
    """

    along: float
    progress: float
    down: bool = False


class ForceReader(ABC):
    """Makes readings of samples; keeps nothing but the memory that it is handed."""

    __slots__ = ()

    @abstractmethod
    def start(self) -> Any:
        """Return the memory before the first sample."""

    @abstractmethod
    def read(self, memory: Any, sample: CellSample, place: Place) -> tuple[Any, ForceReading | None]:
        """Return the memory behind a sample and the force along the outward normal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCellReading(ForceReader):
    """The load cell behind the tip, and its error [N]."""

    std: float = 0.6

    def start(self) -> None:
        """Return nothing."""
        return

    def read(self, memory: None, sample: CellSample, place: Place) -> tuple[None, ForceReading | None]:  # noqa: ARG002
        """Return what the load cell shows."""
        return memory, ForceReading(sample.load_cell, self.std)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoReading(ForceReader):
    """No force: the polisher runs open loop."""

    def start(self) -> None:
        """Return nothing."""
        return

    def read(self, memory: None, sample: CellSample, place: Place) -> tuple[None, ForceReading | None]:  # noqa: ARG002
        """Return no reading."""
        return memory, None


class AirZero(NamedTuple):
    """The external torque that a job in air shows.

    down : (n_v,) its mean over the second half of the way down, when friction has built up; what swings about it does
        not swing alike twice [Nm or N]
    passes : by the way of the tool since they began
    """

    down: FloatArray
    passes: AirPass

    def at(self, place: Place) -> FloatArray:
        """Return the torque to take off, (n_v,); between the way down and the passes that of their beginning."""
        return self.down if place.down else self.passes.torque_at(np.array([place.progress]))[0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensedReading(ForceReader):
    """The virtual sensor: external torque of the joints, solved for the force along the tool's axis.

    The frame of the wrench is the tip, whose z points into the workpiece and whose x is along the path: a force that
    pushes the tool out is along -z, and friction is assumed to be against the feed.

    sensor : of the external torque
    solvers : of the force while the tool stands, moves along its x, and against it
    normal : (6,) unit wrench whose part in the solved one is the normal force
    zero : what the same job shows in air; None: nothing is taken off
    """

    sensor: ForceSensor
    solvers: tuple[WrenchSolver, WrenchSolver, WrenchSolver]
    zero: AirZero | None = None
    normal: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]))

    def start(self) -> FloatArray:
        """Return the sensor's memory."""
        return self.sensor.start()

    def read(self, memory: FloatArray, sample: CellSample, place: Place) -> tuple[FloatArray, ForceReading | None]:
        """Return the force along the tool's axis with its error; none while the sensor settles."""
        memory, sensed = self.sensor.advance(memory, sample.q, sample.tau)
        return memory, self.solved(sensed, place) if sensed.settled else None

    def solved(self, sensed: Sensed, place: Place) -> ForceReading:
        """Return the force along the tool's axis, with its error, that makes this external torque."""
        tau = sensed.tau
        if self.zero is not None:
            tau = tau - self.zero.at(place)
        solver = self.solvers[round(place.along)]
        found = solver.along(sensed.q[None], tau[None], sensed.variance[None], own=np.square(sensed.lag)[None])
        force = float(self.normal @ found.wrench[0])
        return ForceReading(force, float(np.sqrt(self.normal @ found.covariance[0] @ self.normal)))


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolFriction:
    """What is assumed of the friction between tool and workpiece.

    part : tangential over normal force while the tool slides, against the feed
    off : standard deviation of the tangential force beside that, in either direction, while it slides [N]
    held : the same while it stands: anything up to the breakaway of friction [N]
    """

    part: float = 0.2
    off: float = 3.0
    held: float = 6.0


def along_the_normal(sensor: ForceSensor, frame: str, friction: ToolFriction) -> tuple[WrenchSolver, ...]:
    """Return solvers for a force along the tool's axis with friction against the feed: standing, forth and back.

    What friction may be beside that is solved for as well, but not believed to be large.
    """
    wide = WrenchSolver(robot=sensor.model.robot).largest[0]

    def solver(way: float, off: float) -> WrenchSolver:
        return _solver(sensor, frame, np.vstack([[-way * friction.part, 0.0, -1.0], np.eye(3)[:2]]), (wide, off, off))

    return solver(0.0, friction.held), solver(1.0, friction.off), solver(-1.0, friction.off)


def of_three_forces(sensor: ForceSensor, frame: str) -> tuple[WrenchSolver, ...]:
    """Return solvers for a force in any direction, the same whichever way the tool moves."""
    return (_solver(sensor, frame, np.eye(3)),) * 3


def of_all_components(sensor: ForceSensor, frame: str) -> tuple[WrenchSolver, ...]:
    """Return solvers for the whole wrench, the inverse Jacobian of a textbook, as far as joints tell it."""
    return (
        WrenchSolver(robot=sensor.model.robot, frame=frame, axes="frame", correlation=sensor.solver.correlation),
    ) * 3


def _solver(sensor: ForceSensor, frame: str, forces: FloatArray, sizes: tuple[float, ...] = ()) -> WrenchSolver:
    """Return the solver for forces in these directions of the frame, (n, 3)."""
    columns = np.vstack([forces.T, np.zeros((3, len(forces)))])
    return WrenchSolver(
        robot=sensor.model.robot, frame=frame, directions=columns / np.linalg.norm(columns, axis=0), axes="frame",
        correlation=sensor.solver.correlation, sizes=np.array(sizes),
    )  # fmt: skip
