"""One BLAS thread while many small factors are made: with more, threads wait for each other longer than they work."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def single_threaded(action: Callable[P, R]) -> Callable[P, R]:
    """Return the function with BLAS limited to one thread while it runs.

    A QR of a few hundred numbers by two threads takes up to ten times as long on a busy machine as by one.
    """

    @functools.wraps(action)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        import scipy.linalg.lapack  # noqa: F401 (only a BLAS that is loaded can be limited, and SciPy brings its own)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return action(*args, **kwargs)

    return limited
