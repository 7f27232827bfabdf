"""From the words of `--zero` to what is taken off what is sensed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

if TYPE_CHECKING:
    from tauhat.sensing.contact_rules import ContactRules
    from tauhat.sensing.sensor import ForceSensor
    from tauhat.sensing.zero import AirPass, Zero

_MOST_NUMBERS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class ZeroChoice:
    """What is taken off.

    kind : standing is what friction holds when the arm comes to rest, off what is told as well; `usual`: off what
        contacts are told by alone; `none`: nowhere; `air`: a pass in air, off everything
    numbers : of a standing zero, seconds and the time constant with which it follows [s]; empty for the usual ones
    log : of the pass in air
    """

    kind: Literal["usual", "standing", "none", "air"] = "usual"
    numbers: tuple[float, ...] = ()
    log: Path | None = None

    @property
    def told(self) -> Zero:
        """What torque and wrench are told less, beside a pass in air."""
        return "standing" if self.kind == "standing" else "as sensed"

    @property
    def rules(self) -> ContactRules | None:
        """Rules of contact with this zero; None for the usual ones."""
        from tauhat.sensing.contact_rules import ContactRules
        from tauhat.sensing.zero import NO_ZERO, StandingZero

        if self.kind == "none":
            return ContactRules(zero=NO_ZERO)
        if not self.numbers:
            return None
        return ContactRules(zero=StandingZero(**dict(zip(("seconds", "follow"), self.numbers, strict=False))))

    def air_pass(self, sensor: ForceSensor, map_file: Path | None) -> AirPass | None:
        """Return the pass in air, where one was named.

        Raises
        ------
        TauhatError
            a log that cannot be read, or is of another robot.
        """
        if self.log is None:
            return None
        from tauhat.recordings.reading import read_log
        from tauhat.sensing.free_logs import sensed_free
        from tauhat.sensing.zero import air_pass

        return air_pass(sensed_free(sensor, [read_log(self.log, map=map_file)])[0])


def zero_choice(text: str) -> ZeroChoice:
    """Return the zero that `standing[:SECONDS[:FOLLOW]]`, `air:LOG` or `none` names."""
    kind, colon, rest = text.partition(":")
    if kind == "air" and rest:
        return ZeroChoice(kind="air", log=Path(rest))
    if kind == "none" and not colon:
        return ZeroChoice(kind="none")
    numbers = rest.split(":") if colon else []
    if kind != "standing" or len(numbers) > _MOST_NUMBERS:
        raise typer.BadParameter(
            f"expected standing, standing:SECONDS, standing:SECONDS:FOLLOW, air:LOG or none: {text}"
        )
    try:
        return ZeroChoice(kind="standing", numbers=tuple(float(number) for number in numbers))
    except ValueError as error:
        raise typer.BadParameter(f"not a number of seconds in {text!r}") from error


def check_without_air(zero: ZeroChoice | None) -> None:
    """Pass unless a pass in air is to be taken off samples as they come.

    Raises
    ------
    typer.BadParameter
        when it is.
    """
    if zero is not None and zero.kind == "air":
        raise typer.BadParameter(
            "air:LOG is for logs: nobody says when the motion of samples begins", param_hint="'--zero'"
        )
