"""A controller as a real one is: it sees noise, and it is stopped when the robot is lost."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.control.controller import Controller, ControlSample
from tauhat.control.laws import Feedforward
from tauhat.errors import ArrayError, SimulationError

_RECENT = 50  # [steps] over which the memory of jumps fades
_RATTLING = 0.1  # share of these in which a torque jumps by more than its limit: the loop is unstable


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WrappedController(ABC):
    """What a controller around another one takes over from it.

    inner : the controller
    """

    inner: Controller

    @property
    def feedforward(self) -> Feedforward:
        """The inner controller's."""
        return self.inner.feedforward

    @property
    def torque_limit(self) -> FloatArray:
        """The inner controller's, (n_v,) [Nm or N]."""
        return self.inner.torque_limit


class Counted(NamedTuple):
    """Memory of a controller within, and how many steps have passed."""

    inner: Any
    steps: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NoisySight(WrappedController):
    """A controller that sees position and speed with noise.

    The noise is drawn beforehand and repeats after its last row, so that a step stays a pure function.

    position, speed : (n, n_v) added to what it sees [rad, rad/s] or [m, m/s]
    """

    position: FloatArray
    speed: FloatArray

    def __post_init__(self) -> None:
        position = frozen("position", self.position, (None, None), where="noisy sight")
        if not len(position):
            raise ArrayError("position is empty", where="noisy sight", expected="at least a row")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "speed", frozen("speed", self.speed, position.shape, where="noisy sight"))

    def start(self, sample: ControlSample) -> Counted:
        """Return the inner controller's memory, and no step."""
        return Counted(self.inner.start(self._seen(sample, 0)), 0)

    def step(self, memory: Counted, sample: ControlSample) -> tuple[Counted, FloatArray]:
        """Return the memory behind this step, and the inner controller's torque (n_v,) [Nm or N]."""
        inner, torque = self.inner.step(memory.inner, self._seen(sample, memory.steps))
        return Counted(inner, memory.steps + 1), torque

    def _seen(self, sample: ControlSample, steps: int) -> ControlSample:
        row = steps % len(self.position)
        return sample._replace(q=sample.q + self.position[row], dq=sample.dq + self.speed[row])


class WatchedMemory(NamedTuple):
    """Memory of a controller within, its last torque, and how often of late each torque jumped, (n_v,) each."""

    inner: Any
    torque: FloatArray
    jumps: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Watched(WrappedController):
    """A controller that gives up when the robot is lost: too far from its reference, or rattling.

    With torque limits an unstable loop seldom runs away: it swings between its limits, near the reference. A joint
    rattles when its torque jumps by more than its limit in more than a tenth of the last steps (counted with a memory
    that fades over 50).

    farthest : (n_v,) [rad or m]
    """

    farthest: FloatArray

    def __post_init__(self) -> None:
        farthest = frozen("farthest", self.farthest, (None,), where="watched controller")
        if not (farthest > 0.0).all():
            raise ArrayError("farthest is not positive", where="watched controller", got=f"{farthest.min():g}")
        object.__setattr__(self, "farthest", farthest)

    def start(self, sample: ControlSample) -> WatchedMemory:
        """Return the inner controller's memory, and no jump."""
        return WatchedMemory(self.inner.start(sample), sample.tau, np.zeros(self.farthest.size))

    def step(self, memory: WatchedMemory, sample: ControlSample) -> tuple[WatchedMemory, FloatArray]:
        """Return the memory behind this step, and the inner controller's torque.

        Raises
        ------
        SimulationError
            when a joint is too far from its reference, or nowhere, or rattles.
        """
        error = np.abs(sample.q - sample.q_ref)
        if not (error <= self.farthest).all():
            joint = int(np.argmax(np.where(np.isfinite(error), error / self.farthest, np.inf)))
            expected, got = f"within {self.farthest[joint]:g} of its reference", f"{error[joint]:.3g}"
            raise _lost("the robot is lost", joint, sample.t, expected=expected, got=got)
        inner, torque = self.inner.step(memory.inner, sample)
        jumped = np.abs(torque - memory.torque) > self.inner.torque_limit
        jumps = memory.jumps * (1.0 - 1.0 / _RECENT) + jumped
        if jumps.max() > _RATTLING * _RECENT:
            joint = int(np.argmax(jumps))
            got = f"{100.0 * jumps[joint] / _RECENT:.0f} %"
            raise _lost("the robot rattles", joint, sample.t, expected="jumps in less than 10 % of the steps", got=got)
        return WatchedMemory(inner, torque, jumps), torque


def _lost(what: str, joint: int, t: float, *, expected: str, got: str) -> SimulationError:
    where = f"joint {joint + 1}, t = {t:.4g} s"
    remedy = "lower the gains, or start in the pose of the reference"
    return SimulationError(what, where=where, expected=expected, got=got, remedy=remedy)


def noisy_sight(
    inner: Controller, rng: np.random.Generator, *, rows: int, deviations: tuple[FloatArray, FloatArray]
) -> NoisySight:
    """Return the controller with white noise on what it sees.

    Parameters
    ----------
    rows : steps before the noise repeats
    deviations : standard deviations of position and speed, (n_v,) each
    """
    position, speed = (rng.standard_normal((rows, len(size))) * size for size in deviations)
    return NoisySight(inner=inner, position=position, speed=speed)
