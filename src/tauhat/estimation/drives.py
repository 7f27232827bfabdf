"""Torque constants of all joints from a run with and a run without a payload of known mass.

Let the torque of joint j be known up to a factor g_j. Then, with P u the known part of the payload and p the rest,
    g_j tau_j = Y_j x                      without,
    g_j tau_j = Y_j (x + P (u + p))        with the payload.
All joints carry the same links, which ties their factors to each other; the known mass gives the absolute size. Every
row is divided by `g_j sigma_j`, sigma_j the deviation of the residual of the measured torque, and that is repeated.

Least squares takes u to the right-hand side; the noisy torques are then regressors and pull their factors towards zero.
Total least squares allows for that. The regressor columns come from encoders and are clean beside the torque, so only
the torques are errors-in-variables (mixed least squares and total least squares): after the clean columns are
eliminated by QR, the rest [tau_1 .. tau_n], in units of its noise, is a small triangle whose last right singular vector
is the direction of g.

Source: Gautier, Briot, "Global identification of joint drive gains and dynamic parameters of robots", 2014; Van Huffel,
Vandewalle, "The total least squares problem", 1991, ch. 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray, frozen
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.block import Block
from tauhat.estimation.confidence import student_quantile
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.gain_fit import Jackknifed, jackknifed, ordinary_solution, total_solution
from tauhat.estimation.loaded_run import TEN, PayloadColumns, payload_columns
from tauhat.estimation.payload_fit import PayloadProblem, fit_payload
from tauhat.estimation.rows import check_joints
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

_PASSES = 8  # weights and factors follow each other
_MOST_GROUPS = 16  # of blocks of time of each run that the jackknife leaves out
_QUIET = 1e-6  # least residual that is believed, in parts of that of the estimate
_LEAST_CERTAIN = 0.5  # standard error over factor from which a factor is not known at all


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveGains:
    """Factors on the measured torques by one method.

    factors : (n_v,) true over measured torque
    covariance : (n_v, n_v), by leaving out blocks of time
    """

    method: str
    factors: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        n_v = np.size(self.factors)
        object.__setattr__(self, "factors", frozen("factors", self.factors, (None,), where="drives"))
        object.__setattr__(self, "covariance", frozen("covariance", self.covariance, (n_v, n_v), where="drives"))

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the factors, (n_v,)."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveCalibration:
    """Factors that make the measured torques agree with a payload of known mass.

    joint_names : in the order of the factors
    mass : of the payload [kg]
    total, ordinary : by total least squares, and by least squares
    found_mass : what the payload weighs with the torques as they were measured [kg]
    degrees : degrees of freedom of the standard errors
    """

    joint_names: tuple[str, ...]
    mass: float
    total: DriveGains
    ordinary: DriveGains
    found_mass: float
    degrees: int

    @property
    def factors(self) -> FloatArray:
        """The factors to apply, (n_v,): those of total least squares."""
        return self.total.factors

    def half_intervals(self, *, confidence: float = 0.95) -> FloatArray:
        """Return half of each factor's confidence interval, (n_v,), by Student's t."""
        return np.asarray(student_quantile(self.degrees, confidence=confidence) * self.total.standard_errors)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        joints = [
            {"name": name, "factor": float(factor), "half": float(half), "least_squares": float(other)}
            for name, factor, half, other in zip(
                self.joint_names, self.factors, self.half_intervals(), self.ordinary.factors, strict=True
            )
        ]
        return {
            "mass": self.mass, "found_mass": self.found_mass, "degrees": self.degrees, "joints": joints,
            "covariance": self.total.covariance.tolist(),
        }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeighedPayload:
    """A payload that was weighed.

    mass : [kg]
    centre : (3,) of its centre of mass in the link's frame [m], where known
    link : name of the joint whose link carries it; the last one by default
    """

    mass: float
    centre: FloatArray | None = None
    link: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.mass < np.inf:
            raise ModelError("the mass of a payload must be positive", got=f"{self.mass:g} kg")
        if self.centre is not None:
            object.__setattr__(self, "centre", frozen("centre", self.centre, (3,), where="payload"))

    @property
    def parameters(self) -> FloatArray:
        """What is known of its ten parameters, zero elsewhere."""
        values = np.zeros(TEN)
        values[0] = self.mass
        if self.centre is not None:
            values[1:4] = self.mass * self.centre
        return values

    def unknown(self, kept: IntArray) -> IntArray:
        """Return those of the kept parameters that are not known."""
        return kept[kept >= (1 if self.centre is None else 4)]


@single_threaded
def calibrate_drives(
    estimate: Estimate,
    loaded: Sequence[Recording],
    *,
    unloaded: Sequence[Recording],
    payload: WeighedPayload,
    processing: Processing | None = None,
) -> DriveCalibration:
    """Return the factors by which the measured torque of each joint is wrong.

    Parameters
    ----------
    estimate : of the arm without payload, torques as they are measured: its terms and filters are taken
    loaded, unloaded : recordings with and without the payload
    processing : other filters than the estimate's own

    Raises
    ------
    ModelError
        when a factor comes out negative or cannot be known at all (names the joint).
    """
    if not (loaded and unloaded):
        raise ModelError("drives are calibrated from recordings with and without a payload", expected="both")
    for recording in (*loaded, *unloaded):
        check_joints(estimate.model, recording)
    settings = processing or estimate.processing
    hung = payload_columns(estimate, payload.link)
    before = collect_all(estimate.model, estimate.base, unloaded, settings)
    problem = PayloadProblem(estimate=estimate, hung=hung, before=before, mass=None)
    found = fit_payload(problem, loaded, processing=settings)
    runs = (_Run(before, carries=False), _Run(found.evidence, carries=True))
    columns = _GainColumns(estimate.base.n_b, hung, payload)
    gains = _calibrated(runs, columns, start=np.array(estimate.joint_rms))
    calibration = DriveCalibration(
        joint_names=estimate.robot.joint_names,
        mass=payload.mass,
        total=gains.total,
        ordinary=gains.ordinary,
        found_mass=float(found.free[0]),
        degrees=gains.degrees,
    )
    _refuse_wrong_signs(calibration)
    return calibration


class _Run(NamedTuple):
    """Evidence of recordings, and whether the arm carried the payload."""

    evidence: Evidence
    carries: bool

    def groups(self) -> tuple[Block, ...]:
        """Return at most sixteen blocks of time."""
        return self.evidence.merged_blocks(_MOST_GROUPS)


class _GainColumns(NamedTuple):
    """The columns of the homogeneous problem `Y x + Y P p + (Y P u) - g tau = 0`, in the order x, p, u, g."""

    n_b: int
    hung: PayloadColumns
    payload: WeighedPayload

    @property
    def clean(self) -> int:
        """Number of columns without noise: those of x, p and the known payload."""
        return self.n_b + self.payload.unknown(self.hung.kept).size + 1

    def rows(self, run: _Run, block: Block, weights: FloatArray) -> FloatArray:
        """Return the weighted rows of a block of time, (n, clean + n_v)."""
        n_v = len(block.factors)
        unknown = self.hung.columns[:, self.payload.unknown(self.hung.kept)]
        known = self.hung.columns @ self.payload.parameters
        parts = []
        for joint, (factor, support) in enumerate(zip(block.factors, run.evidence.supports, strict=True)):
            part = np.zeros((factor.shape[0], self.clean + n_v))
            part[:, support] = factor[:, :-1]
            if run.carries:
                part[:, self.n_b : self.clean - 1] = factor[:, :-1] @ unknown[support]
                part[:, self.clean - 1] = factor[:, :-1] @ known[support]
            part[:, self.clean + joint] = -factor[:, -1]
            parts.append(weights[joint] * part)
        return np.vstack(parts)


class _Found(NamedTuple):
    """Both methods' factors with their covariances, and the degrees of freedom of these."""

    total: DriveGains
    ordinary: DriveGains
    degrees: int


def _calibrated(runs: tuple[_Run, _Run], columns: _GainColumns, *, start: FloatArray) -> _Found:
    """Return the factors; `start` is the deviation of the residual of each joint, (n_v,)."""
    n_t = sum(run.evidence.n_t for run in runs)
    noise, factors = start, np.ones(start.size)
    for _ in range(_PASSES):
        weights = 1.0 / (noise * np.abs(factors))
        rows = np.vstack([columns.rows(run, run.evidence.total, weights) for run in runs])
        solution = total_solution(rows, columns.clean, n_t * (weights * noise) ** 2)
        _refuse_unknown(solution, columns)
        factors = solution[columns.clean :]
        noise = np.maximum(_residuals(rows, solution, columns, runs) / weights / np.abs(factors), _QUIET * start)
    weights = 1.0 / (noise * np.abs(factors))
    stacks = [[columns.rows(run, block, weights) for block in run.groups()] for run in runs]
    squares = n_t * (weights * noise) ** 2
    total, ordinary = jackknifed(
        stacks,
        (
            lambda part, share: total_solution(part, columns.clean, share * squares),
            lambda part, _: ordinary_solution(part, columns.clean),
        ),
    )
    degrees = max(1, min(len(stack) for stack in stacks) - 1)
    return _Found(_gains("total least squares", total, columns), _gains("least squares", ordinary, columns), degrees)


def _residuals(rows: FloatArray, solution: FloatArray, columns: _GainColumns, runs: tuple[_Run, _Run]) -> FloatArray:
    """Return the root mean square of each joint's weighted equations, (n_v,)."""
    n_v = solution.size - columns.clean
    heights = [factor.shape[0] for run in runs for factor in run.evidence.total.factors]
    owner = np.repeat(np.tile(np.arange(n_v), len(runs)), heights)
    squares = np.bincount(owner, weights=(rows @ solution) ** 2, minlength=n_v)
    return np.asarray(np.sqrt(squares / sum(run.evidence.n_t for run in runs)))


def _gains(method: str, found: Jackknifed, columns: _GainColumns) -> DriveGains:
    own = slice(columns.clean, None)
    return DriveGains(method=method, factors=found.values[own], covariance=found.covariance[own, own])


def _refuse_unknown(solution: FloatArray, columns: _GainColumns) -> None:
    if not np.isfinite(solution).all() or not solution[columns.clean :].all():
        raise ModelError(
            "the payload does not tell the torque constants apart",
            remedy="record motions that lift it, with all joints",
        )


def _refuse_wrong_signs(calibration: DriveCalibration) -> None:
    """Refuse factors below zero, and those that are anything: standard error of the size of the factor."""
    errors = calibration.total.standard_errors
    for name, factor, error in zip(calibration.joint_names, calibration.factors, errors, strict=True):
        uncertain = error > _LEAST_CERTAIN * abs(factor)
        if factor < 0.0 and not uncertain:
            raise ModelError(
                "the torque has the wrong sign", where=f"joint {name}", expected="a positive factor",
                got=f"{factor:.3f} ± {error:.3f}", remedy="turn `sign` of this joint in the map's [torque] section",
            )  # fmt: skip
        if uncertain:
            raise ModelError(
                "the recordings do not tell the torque constant", where=f"joint {name}",
                got=f"factor {factor:.3g} with a standard error of {error:.2g}",
                remedy="record motions in which this joint moves the payload and the links of other joints",
            )  # fmt: skip
