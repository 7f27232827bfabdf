"""The chapter of the polishing study on what goes wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tauhat.errors import ModelError
from tauhat.studies.polishing.meeting import Met
from tauhat.studies.study import Chapter, Table

_HEADER = (
    "incident", "reads", "arm", "largest force [N]", "bound [N]", "ended", "reason", "to the retract [s]",
    "fed on spoilt samples [s]", "depth [mm]",
)  # fmt: skip


def incident_chapter(met: Sequence[Met]) -> Chapter:
    """Return the chapter of jobs in which something went wrong.

    Raises
    ------
    ModelError
        when there are none.
    """
    if not met:
        raise ModelError("no incidents to tell of", where="polishing study", expected="one or more")
    rows = tuple(
        (
            one.name, one.sensor, one.warmth, one.largest, one.bound, one.phase, one.reason or "-", one.seconds,
            one.blind, 1e3 * one.depth,
        )
        for one in met
    )  # fmt: skip
    table = Table(
        title="What becomes of a job in which something goes wrong", header=_HEADER, rows=rows,
        note="The force is the true one since the beginning of the incident. Its bound: the limit at which the tool "
        "retracts, three standard deviations of a reading, and what stiffness, largest speed and reaction time make "
        "of the rest. The depth is the true one of the unloaded tip below the believed surface.",
    )  # fmt: skip
    return Chapter(title="When something goes wrong", text=(_forces(met), _times(met)), tables=(table,))


def _forces(met: Sequence[Met]) -> str:
    worst = max(met, key=lambda one: one.largest)
    unsafe = [f"{one.name} ({one.sensor}, {one.warmth})" for one in met if not one.safe]
    words = (
        f"{len(met) - len(unsafe)} of {len(met)} jobs kept their bounds of force and depth and ended in the air as "
        f"they may; the largest true force was {worst.largest:.3g} N ({worst.name}, {worst.sensor}), its bound "
        f"{worst.bound:.3g} N"
    )
    return f"{words}; not safe: {'; '.join(unsafe)}." if unsafe else f"{words}."


def _times(met: Sequence[Met]) -> str:
    stopped = [one for one in met if one.reason and np.isfinite(one.seconds)]
    if not stopped:
        return f"All {len(met)} jobs were done to their end."
    seconds = np.array([one.seconds for one in stopped])
    blind = max(one.blind for one in stopped)
    return (
        f"{len(met) - len(stopped)} jobs were done to their end and {len(stopped)} given up, these "
        f"{seconds.min():.2g} to {seconds.max():.2g} s after the incident began, in the median "
        f"{np.median(seconds):.2g} s; the tool was fed on spoilt samples for no more than {blind:.2g} s of that."
    )
