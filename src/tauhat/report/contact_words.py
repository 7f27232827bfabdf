"""What terminal and page say of contacts: a hand or a body, and directions that joints do not tell."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tauhat.report.formatting import number

if TYPE_CHECKING:
    from tauhat.sensing.contact import ContactEvent
    from tauhat.sensing.hidden import Hidden
    from tauhat.sensing.judged_log import JudgedLog

_PERCENT = 100.0


def kind_of(event: ContactEvent) -> str:
    """Return what an event is: no payload, a body that is carried, either; nothing where it was too short to tell."""
    found = event.payload
    if found is None:
        return ""
    if found.verdict == "no payload":
        return found.verdict
    return f"{'carries' if found.verdict == 'payload' else 'push, or'} {found.mass:.2f} kg"


def zero_words(judged: JudgedLog) -> str:
    """Return what is taken off torque and wrench of a log; nothing where they are as sensed."""
    off = ["what the same motion shows in air"] if judged.air else []
    off += ["what was sensed as the arm came to rest"] if judged.zero == "standing" else []
    more = " Where the arm is elsewhere than in that pass nothing is told." if judged.air else ""
    return f"Torque and force are less {' and '.join(off)}.{more}" if off else ""


def hidden_words(hidden: Hidden) -> str:
    """Return for how long joints did not tell a direction of the wrench, and which; nothing where they always did."""
    if not hidden.share:
        return ""
    return (
        f"For {number(_PERCENT * hidden.share)} % of the time joints do not tell every direction (mostly "
        f"{', '.join(hidden.mostly)}), as near singular positions: the error bar there is that of the largest wrench "
        "conceivable."
    )
