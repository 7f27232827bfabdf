"""The error budget as a study: which part of a model's error comes from where, with its page."""

from tauhat.studies.error_budget.error_budget_study import ErrorBudgetStudy
from tauhat.studies.error_budget.log_result import log_budget_result
from tauhat.studies.error_budget.typical import typical_experiment

__all__ = ["ErrorBudgetStudy", "log_budget_result", "typical_experiment"]
