"""What a polishing job asks for, what it may not exceed, and what counts as contact."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.control.force.force_law import require_positive
from tauhat.errors import ControlError


@dataclass(frozen=True, slots=True, kw_only=True)
class PolishTask:
    """Passes over a path under a constant force, the tool standing upright on the surface.

    force : along the normal [N]
    feed : speed along the path [m/s]
    half : length of the path to either side of its middle [m]; the first pass runs from -half to half, the next back
    passes : one way each
    acceleration : largest of the feed, also where it pauses [m/s^2]
    force_rate : at which the wanted force grows from that of first contact [N/s]
    settle : wait at full force before the feed begins [s]
    """

    force: float = 30.0
    feed: float = 0.05
    half: float = 0.15
    passes: int = 2
    acceleration: float = 0.2
    force_rate: float = 20.0
    settle: float = 1.0

    def __post_init__(self) -> None:
        require_positive("polishing task", force=self.force, feed=self.feed, half=self.half, settle=self.settle)
        require_positive("polishing task", acceleration=self.acceleration, force_rate=self.force_rate)
        if self.passes < 1:
            raise ControlError("too few passes", where="polishing task", expected=">= 1", got=self.passes)


@dataclass(frozen=True, slots=True, kw_only=True)
class PolishLimits:
    """What the tool may not exceed, whatever the readings say.

    Depths are those of the unloaded tip below the believed surface, along its normal. A spring of stiffness k under the
    force f adds f / k to the depth of the surface, so `deepest` has to hold that too.

    height : above the believed surface, where the job begins and to which the tool retracts [m]
    deepest : depth that is never exceeded; to come there means that the surface is not where it is believed [m]
    misplaced : height above the believed surface at which contact means the same [m]
    approach_speed, search_speed, retract_speed : [m/s]
    depth_acceleration : largest, except that going deeper ends at once where the tool retracts [m/s^2]
    search_travel : into the surface, after contact was lost [m]
    searches : for lost contact, in one job
    force : at which the tool retracts [N]
    """

    height: float = 0.03
    deepest: float = 8e-3
    misplaced: float = 5e-3
    approach_speed: float = 5e-3
    search_speed: float = 2e-3
    retract_speed: float = 0.05
    depth_acceleration: float = 1.0
    search_travel: float = 2e-3
    searches: int = 3
    force: float = 60.0

    def __post_init__(self) -> None:
        where = "polishing limits"
        require_positive(where, height=self.height, deepest=self.deepest, misplaced=self.misplaced, force=self.force)
        require_positive(where, approach_speed=self.approach_speed, search_speed=self.search_speed)
        require_positive(where, retract_speed=self.retract_speed, depth_acceleration=self.depth_acceleration)
        require_positive(where, search_travel=self.search_travel)
        if self.searches < 0:
            raise ControlError("searches is negative", where=where, expected=">= 0", got=self.searches)
        if self.misplaced >= self.height:
            expected = f"less than the height of {self.height:g} m"
            raise ControlError("misplaced is out of reach", where=where, expected=expected, got=self.misplaced)


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactRule:
    """What counts as contact, and as contact lost.

    Contact is sure when the force has been above `threshold` and above `errors` of its own standard deviations for
    `hold`. It is lost when the force has been below a part of the wanted one for `lost_after`.

    threshold : [N]
    errors : [standard deviations]
    hold, lost_after : [s]
    lost_part : of the wanted force
    """

    threshold: float = 3.0
    errors: float = 3.0
    hold: float = 0.02
    lost_part: float = 0.3
    lost_after: float = 0.2

    def __post_init__(self) -> None:
        where = "contact rule"
        require_positive(where, threshold=self.threshold, errors=self.errors, hold=self.hold)
        require_positive(where, lost_part=self.lost_part, lost_after=self.lost_after)
        if self.lost_part >= 1.0:
            raise ControlError("lost_part is no part", where=where, expected="< 1", got=self.lost_part)

    def touches(self, force: float, std: float) -> bool:
        """Return whether a force with its standard deviation [N] looks like contact."""
        return force > max(self.threshold, self.errors * std)
