"""Error budget: which part of a model's error comes from where, on rehearsed experiments and on real logs."""

from tauhat.verification.error_budget.advice import WORTH
from tauhat.verification.error_budget.budget import BudgetSettings, CauseShare, ErrorBudget, error_budget
from tauhat.verification.error_budget.causes import CAUSES, Case, Cause, causes_of
from tauhat.verification.error_budget.log_budget import LogBudget, LogShare, log_budget
from tauhat.verification.error_budget.trial import BudgetMotions, Measure, RobotBudget

__all__ = [
    "CAUSES",
    "WORTH",
    "BudgetMotions",
    "BudgetSettings",
    "Case",
    "Cause",
    "CauseShare",
    "ErrorBudget",
    "LogBudget",
    "LogShare",
    "Measure",
    "RobotBudget",
    "causes_of",
    "error_budget",
    "log_budget",
]
