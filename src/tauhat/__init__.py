"""tauhat: robot dynamics identification and sensorless force estimation from joint logs."""

from __future__ import annotations

__version__ = "0.1.0"
__all__ = ["__version__"]
