"""Where the force that a polisher works with comes from: measured, or believed from the depth."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

from tauhat.control.force.force_law import require_positive
from tauhat.control.force.reading import ForceReading, Reason, Sight
from tauhat.errors import ControlError

_FORGIVEN = 0.25  # part of a sample's time in trouble that a good sample makes up for
_SPENT = 1e-9  # part of a period: times are sums of periods, which round


class Expected(NamedTuple):
    """What a polisher expects of its force.

    depth : of the tip below the believed surface [m]
    force : that the job asks for [N]
    """

    depth: float
    force: float


class ForceSource(ABC):
    """Makes of what a sensor gave, or did not give, the force to work with."""

    __slots__ = ()

    @abstractmethod
    def start(self) -> Any:
        """Return the memory before the first reading."""

    @abstractmethod
    def step(
        self, memory: Any, reading: ForceReading | None, *, expected: Expected, period: float
    ) -> tuple[Any, Sight]:
        """Return the memory behind this period, and the force to work with."""


class Watch(NamedTuple):
    """The reading before, how many since were the same, and how long readings have been of no use [s]."""

    last: ForceReading | None
    same: int
    useless: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredForce(ForceSource):
    """Works with the readings of a sensor, and watches whether they are worth it.

    A reading is of no use when it is missing, not finite, the same to the bit as the `frozen_after` readings before it
    (noise never repeats; a load cell so coarse that it does needs a larger number), or when its error bar is larger
    than a part of the force asked for. It is a fault when this lasts; a good reading makes up for a quarter of a bad
    one, so that a sensor that is bad every other time is found out too.

    patience : for readings of no use [s]
    frozen_after : [samples]
    uncertain_part : largest standard deviation over the force that the job asks for
    """

    patience: float = 0.1
    frozen_after: int = 25
    uncertain_part: float = 0.5

    def __post_init__(self) -> None:
        require_positive("MeasuredForce", patience=self.patience, uncertain_part=self.uncertain_part)
        if self.frozen_after < 1:
            raise ControlError("frozen_after is too small", where="MeasuredForce", expected=1, got=self.frozen_after)

    def start(self) -> Watch:
        """Return no reading."""
        return Watch(None, 0, 0.0)

    def step(
        self, memory: Watch, reading: ForceReading | None, *, expected: Expected, period: float
    ) -> tuple[Watch, Sight]:
        """Return the reading, with what is wrong with it and whether that has lasted longer than the patience."""
        same = memory.same + 1 if reading is not None and reading == memory.last else 0
        trouble = self._trouble(reading, same, expected.force)
        useless = memory.useless + period if trouble else max(0.0, memory.useless - _FORGIVEN * period)
        lasting = useless > self.patience + _SPENT * period
        usable = reading if reading is not None and reading.valid else None
        return Watch(reading, same, useless), Sight(usable, trouble, trouble if lasting else "")

    def _trouble(self, reading: ForceReading | None, same: int, force: float) -> Reason:
        if reading is None:
            return "reading_missing"
        if not reading.valid:
            return "reading_invalid"
        if same >= self.frozen_after:
            return "reading_frozen"
        return "untrusted" if reading.std > self.uncertain_part * force else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class BelievedForce(ForceSource):
    """Works open loop: no reading is used, the force is that of a believed spring, `stiffness max(0, depth)`.

    The laws then bring the tip to the depth `force / stiffness` below the believed surface. Where surface or stiffness
    are not as believed, neither is the force, and nothing here can tell.

    stiffness : of tool and surface together [N/m]
    """

    stiffness: float

    def __post_init__(self) -> None:
        require_positive("BelievedForce", stiffness=self.stiffness)

    def start(self) -> None:
        """Return nothing: there is nothing to remember."""
        return

    def step(
        self,
        memory: None,
        reading: ForceReading | None,  # noqa: ARG002 (open loop)
        *,
        expected: Expected,
        period: float,  # noqa: ARG002 (of sources that watch)
    ) -> tuple[None, Sight]:
        """Return the force of the spring at the depth, without an error bar."""
        return memory, Sight(ForceReading(self.stiffness * max(0.0, expected.depth), 0.0), "", "")
