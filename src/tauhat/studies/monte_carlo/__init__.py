"""The study of all estimators on simulated robots whose parameters are known."""

from tauhat.studies.monte_carlo.cells import Cell, cells_of
from tauhat.studies.monte_carlo.experiment import Disturbance, Experiment, experiment_of, problem_of
from tauhat.studies.monte_carlo.families import FAMILIES, SLOW, family_of
from tauhat.studies.monte_carlo.fitting import Case, Fit, fits_of
from tauhat.studies.monte_carlo.measures import column_sizes, model_torque, relative_error
from tauhat.studies.monte_carlo.monte_carlo_study import MonteCarloStudy

__all__ = [
    "FAMILIES",
    "SLOW",
    "Case",
    "Cell",
    "Disturbance",
    "Experiment",
    "Fit",
    "MonteCarloStudy",
    "cells_of",
    "column_sizes",
    "experiment_of",
    "family_of",
    "fits_of",
    "model_torque",
    "problem_of",
    "relative_error",
]
