"""What all arms of the CRS A465 study showed together, and how it is said in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.studies.crs_a465.coordinates import coordinates
from tauhat.studies.crs_a465.experiment import TERMS, Experiment
from tauhat.studies.crs_a465.fits import ArmFigures, Case
from tauhat.studies.crs_a465.plant import PlantFit

_ALIKE = 0.05  # relative differences below this are not worth a word


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """Figures of every arm.

    arms : random arms whose torque is the model's
    plants : arms that MuJoCo moved; may be none
    lengths : of the fitted motions that are compared [s]
    """

    experiment: Experiment
    lengths: tuple[float, ...]
    arms: tuple[ArmFigures, ...]
    plants: tuple[Mapping[Case, PlantFit], ...]

    def torque(self, case: Case) -> float:
        """Return the median error of the torque on the unseen motion, over that torque."""
        return float(np.median([arm.fits[case].torque for arm in self.arms]))

    def joints(self, case: Case) -> FloatArray:
        """Return the same joint by joint, (n_v,)."""
        return np.asarray(np.median([arm.fits[case].joints for arm in self.arms], axis=0))

    def missed(self, case: Case) -> float:
        """Return the root mean square error of the base parameters, each in its own standard errors."""
        return float(np.sqrt(np.mean([np.mean(arm.fits[case].misses ** 2) for arm in self.arms])))

    def inside(self, case: Case) -> FloatArray:
        """Return for each base parameter of the model the share of its 95 % intervals that hold the truth, (n_b,)."""
        return np.asarray(np.mean([arm.fits[case].inside for arm in self.arms], axis=0))

    def relative(self, case: Case) -> tuple[float, float]:
        """Return the median relative error of the links' barycentric parameters, and of the drives' parameters."""
        shares = [np.abs(arm.fits[case].values - arm.true_values) / np.abs(arm.true_values) for arm in self.arms]
        rigid = coordinates().n_rigid
        return float(np.median([own[:rigid] for own in shares])), float(np.median([own[rigid:] for own in shares]))

    def weighed(self, case: Case) -> float:
        """Return the median error of all barycentric parameters, each times the torque it causes, over their size."""
        return float(np.median([_weighed(arm, case) for arm in self.arms]))

    def exact(self, model: str) -> float:
        """Return the median error on the unseen motion of least squares on a log without noise."""
        return float(np.median([arm.exact[model].torque for arm in self.arms]))

    def condition(self, model: str) -> tuple[float, float]:
        """Return the median condition numbers of the regressor, as it is and with columns of unit norm."""
        plain, scaled = np.median([arm.conditions[model] for arm in self.arms], axis=0)
        return float(plain), float(scaled)

    def after_lengths(self, model: str) -> FloatArray:
        """Return the quartiles of the error on the unseen motion after each length, (3, n_lengths)."""
        errors = np.array([arm.lengths[tuple(TERMS).index(model)] for arm in self.arms])
        low, high = (
            np.quantile(errors, 0.25, axis=0, method="lower"),
            np.quantile(errors, 0.75, axis=0, method="higher"),
        )
        return np.array([low, np.median(errors, axis=0), high])

    def simplified_wins(self) -> FloatArray:
        """Return for each length the share of arms that the simplified model predicts better, (n_lengths,)."""
        full, simplified = (np.array([arm.lengths[row] for arm in self.arms]) for row in range(len(TERMS)))
        return np.asarray(np.mean(simplified < full, axis=0))

    def on_plants(self, case: Case) -> tuple[float, FloatArray]:
        """Return the median error of the torque on the plants' unseen motions, all joints and joint by joint."""
        fits = [plant[case] for plant in self.plants]
        return float(np.median([fit.torque for fit in fits])), np.median([fit.joints for fit in fits], axis=0)


def _weighed(arm: ArmFigures, case: Case) -> float:
    missed = arm.effects * (arm.fits[case].values - arm.true_values)
    return float(np.linalg.norm(missed) / np.linalg.norm(arm.effects * arm.true_values))


def percent(share: float) -> str:
    """Return a share as percent with two digits."""
    return f"{100.0 * share:.0f} %" if abs(share) >= 0.1 else f"{100.0 * share:.2g} %"


def against(new: float, old: float) -> str:
    """Return how a positive number compares with another, in words."""
    if abs(new - old) <= _ALIKE * old:
        return "about the same"
    return f"{_factor(old / new)} times smaller" if new < old else f"{_factor(new / old)} times larger"


def listed(numbers: Sequence[float], unit: str) -> str:
    """Return numbers as a list in words, with their unit at the end."""
    words = [f"{number:g}" for number in numbers]
    joined = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
    return f"{joined} {unit}"


def _factor(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.2g}"
