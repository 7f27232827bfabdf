"""What the language of a controller can say of a move, for those who choose moves before they are written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

ZoneKind: TypeAlias = Literal["part", "radius"]
"""How the size of a zone is said: as a part of the ways, or as a radius of the tool."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """What a language can say of moves whose speeds and accelerations are whole per cent.

    joint_zone, line_zone : the only kind of zone at joint moves and at lines; None where both can be said
    least_acceleration : part of the limits of joint moves
    least_line_acceleration : of lines [m/s^2]
    line_speed_step : of which speeds of lines are whole multiples [m/s]; 0 for any speed
    dwell_step : of which dwells are whole multiples [s]; 0 for any time
    """

    joint_zone: ZoneKind | None = None
    line_zone: ZoneKind | None = None
    least_acceleration: float = 0.0
    least_line_acceleration: float = 0.0
    line_speed_step: float = 0.0
    dwell_step: float = 0.0
