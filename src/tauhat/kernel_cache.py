"""Compiled kernels that another version of the package left behind.

Numba keeps compiled functions beside their source and asks only whether that one file has changed. A function that
calls kernels of other files holds them compiled inside, so an upgrade that changes these would go on with the old ones.
"""

from __future__ import annotations

import os
from pathlib import Path

_KEPT = "*.nb[ci]"
_MARKER = "kernels-"


def forget_older_kernels(folder: Path, version: str) -> None:
    """Delete what Numba kept under a package's folder, unless this version has done so before.

    A file in the package's `__pycache__` remembers it. Where that cannot be written nothing is done: Numba then keeps
    compiled functions elsewhere, too.
    """
    place = folder / "__pycache__"
    marker = place / f"{_MARKER}{version}"
    if marker.exists():
        return
    try:
        place.mkdir(exist_ok=True)
        if not os.access(place, os.W_OK):
            return
        for path in (*folder.rglob(f"__pycache__/{_KEPT}"), *place.glob(f"{_MARKER}*")):
            path.unlink(missing_ok=True)  # another process may be at the same work
        marker.touch()
    except OSError:
        return
