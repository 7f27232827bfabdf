"""Dry friction with a memory on traced numbers: as in steady motion, or exact, with states that the caller keeps.

A Dahl state z follows the way of a joint or motor, `dz/dq = (sgn(dq) - z) / x0`. Over one sample the direction is
constant and the solution exact, `z+ = s + (z - s) exp(-|q+ - q| / x0)` with the sign s of the way, which is zero, and
leaves z as it was, at rest. In steady motion z is the sign of the speed.

Source: Dahl, "A solid friction model", 1968.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from tauhat.arrays import FloatArray
from tauhat.export.tracing import Scalar, Trace

STATE = "state"  # what C calls the caller's states

Way = Mapping[int, float]  # joint -> by how much the motor turns with it


class DryStates(ABC):
    """Where the states of dry friction, -1 to 1, come from in a C function."""

    @abstractmethod
    def state(self, way: Way, length: float) -> Scalar:
        """Return one state: that of a motor which turns with the joints of `way`, over a length [rad or m]."""


class SteadyStates(DryStates):
    """The states after a long way in one direction: a smooth sign of the speed, the same for every length."""

    def __init__(self, trace: Trace, dq: Sequence[Scalar], widths: FloatArray) -> None:
        self._trace = trace
        self._dq = dq
        self._widths = widths

    def state(self, way: Way, length: float) -> Scalar:  # noqa: ARG002 (steady: every length is behind)
        """Return the smooth sign of the motor's speed."""
        width = sum(abs(factor) * float(self._widths[joint]) for joint, factor in way.items())
        return self._trace.call("tanh", along(self._trace, way, self._dq) * (1.0 / width))


class SteppedStates(DryStates):
    """The states after the step from the last positions to these; notes what the caller's struct holds afterwards."""

    def __init__(self, trace: Trace, q: Sequence[Scalar]) -> None:
        self._trace = trace
        self._q = q
        self._last = [trace.variable(f"{STATE}->q[{joint}]") for joint in range(len(q))]
        self._after: list[Scalar] = []

    def state(self, way: Way, length: float) -> Scalar:
        """Return the next state of the caller's struct, one step on."""
        trace = self._trace
        before = trace.variable(f"{STATE}->bent[{len(self._after)}]")
        moved = along(trace, way, self._q) - along(trace, way, self._last)
        sign = trace.call("sign", moved)
        left = trace.call("exp", trace.call("fabs", moved) * (-1.0 / length))
        after = sign + (before - sign) * left
        self._after.append(after)
        return after

    @property
    def count(self) -> int:
        """Number of states."""
        return len(self._after)

    def results(self) -> dict[str, Scalar]:
        """Return what the caller's struct holds after the step."""
        bent = {f"{STATE}->bent[{index}]": value for index, value in enumerate(self._after)}
        return {f"{STATE}->q[{joint}]": value for joint, value in enumerate(self._q)} | bent


def along(trace: Trace, way: Way, joints: Sequence[Scalar]) -> Scalar:
    """Return a joint quantity as a motor has it."""
    total = trace.scalar(0.0)
    for joint, factor in way.items():
        total = total + float(factor) * joints[joint]
    return total
