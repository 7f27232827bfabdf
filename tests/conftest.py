"""One hypothesis profile for all tests: the same examples every time, no deadline (Numba compiles on first use)."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("fixed")
