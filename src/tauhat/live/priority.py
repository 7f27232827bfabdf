"""Real-time priority: a sample is answered before other programs have their turn.

Without it the scheduler gives every program its share, and where a browser draws on the same cores one answer in a
thousand waits for some milliseconds, whatever the server does. The kernel keeps a part of each second for all others.
"""

from __future__ import annotations

import os

from tauhat.errors import LiveError

_PRIORITY = 20  # of 1 to 99: above ordinary programs, below the kernel's own interrupt threads at 50


def take_realtime_priority() -> None:
    """Let this thread, and those it starts later, run before all programs of ordinary priority (SCHED_FIFO).

    Raises
    ------
    LiveError
        when the operating system knows no such priority or does not grant it.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except AttributeError as error:
        raise LiveError("no real-time priority", where="this operating system", remedy="leave it out") from error
    except OSError as error:
        raise LiveError(
            "real-time priority is not granted", got=error.strerror or str(error),
            remedy=f"allow it (CAP_SYS_NICE, or an rtprio limit of {_PRIORITY}), or leave it out",
        ) from error  # fmt: skip
