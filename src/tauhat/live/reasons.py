"""Why the system refused, in a few words."""

from __future__ import annotations

import os


def reason_of(error: Exception) -> str:
    """Return what an error of the system, or of a name that is none, means; without the address, which is said beside.

    Parameters
    ----------
    error : of a socket, a file or the look-up of a name
    """
    if isinstance(error, UnicodeError):
        return "not a name of a machine"
    if isinstance(error, OSError):
        number = error.errno or 0  # below zero for names that were looked up in vain
        return os.strerror(number) if number > 0 else error.strerror or str(error)
    return str(error)
