"""What a check says: one fact in plain words, its number, and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

Severity: TypeAlias = Literal["ok", "note", "warning", "error"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One result of a check.

    code : stable name, for programs
    severity : "ok"; "note": worth knowing; "warning": doubtful; "error": cannot be identified from
    joint : name of the joint it concerns, None for the whole log
    message : the fact in plain words, its number with a unit
    number : the number itself, None where there is none
    advice : what to do, empty where nothing is needed
    """

    code: str
    severity: Severity
    message: str
    joint: str | None = None
    number: float | None = None
    advice: str = ""


def worst(findings: tuple[Finding, ...]) -> Severity:
    """Return the gravest severity among findings, "ok" for none."""
    return max((finding.severity for finding in findings), key=SEVERITIES.index, default="ok")
