"""Control laws as pure steps, without plant or clock."""

from tauhat.control.laws import PDGravity

__all__ = ["PDGravity"]
