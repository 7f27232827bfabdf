"""How wide an interval is, in standard errors, when these are estimated themselves."""

from __future__ import annotations


def student_quantile(degrees: int, *, confidence: float = 0.95) -> float:
    """Return half the width of the two-sided interval of Student's t with these degrees of freedom; at least one.

    Source: Student, "The probable error of a mean", 1908.
    """
    from scipy.special import stdtrit

    return float(stdtrit(max(1, degrees), 0.5 + 0.5 * confidence))
