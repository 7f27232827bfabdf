"""Health of logs, as commands ask for it."""

from tauhat.verification.checked_log import CheckedLog, checked_log

__all__ = ["CheckedLog", "checked_log"]
