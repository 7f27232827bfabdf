"""tauhat: robot dynamics identification and sensorless force estimation from joint logs."""

from __future__ import annotations

from pathlib import Path

from tauhat.kernel_cache import forget_older_kernels

__version__ = "0.1.0"
__all__ = ["__version__"]

forget_older_kernels(Path(__file__).parent, __version__)
