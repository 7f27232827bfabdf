"""Payload: mass, centre of mass and inertia of what the arm carries, from a loaded and an unloaded run.

Either the estimate of the unloaded arm is taken as it is, and only the payload is fitted to what it leaves of the
loaded run; or unloaded recordings are given again, and arm and payload are fitted to both together, the payload's
columns being zero where there was none. Filters, terms and their shapes are those of the estimate.

Source: Khalil, Gautier, Lemoine, "Identification of the payload inertial parameters of industrial manipulators", 2007.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.blas import single_threaded
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.confidence import student_quantile
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.loaded_run import TEN, payload_columns
from tauhat.estimation.payload_body import Body, body_of, physical_payload
from tauhat.estimation.payload_fit import PayloadFit, PayloadProblem, carrying_estimate, fit_payload
from tauhat.estimation.physical_constraints import Box, Ellipsoid
from tauhat.estimation.rows import check_joints
from tauhat.estimation.solution import joint_residuals
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

_MOMENTS = (4, 6, 9)  # Ixx, Iyy, Izz among the ten
_ROUNDING = 1e-6  # relative half-width of the bounds that stand for a known mass
_MISFIT = 0.25  # residual over torque of a joint from which no payload explains it
_WORSE = 4.0  # times the residual in the fit of the arm alone


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownPayload:
    """What is known of a payload beforehand.

    link : name of the joint whose link carries it; the last one by default
    mass : [kg], where it was weighed
    limit : heaviest payload that the arm may carry [kg]
    centre : where the centre of mass may be, in the link's frame
    """

    link: str = ""
    mass: float | None = None
    limit: float = np.inf
    centre: Box | Ellipsoid | None = None

    def __post_init__(self) -> None:
        if not self.limit > 0.0:
            raise ModelError("the heaviest payload must have a mass", got=f"{self.limit:g} kg")
        if self.mass is not None:
            if not 0.0 < self.mass < np.inf:
                raise ModelError("the mass of a payload must be positive", got=f"{self.mass:g} kg")
            self.check(self.mass)

    def check(self, mass: float) -> None:
        """Refuse a mass above the limit.

        Raises
        ------
        ModelError
            when it is.
        """
        if mass > self.limit:
            raise ModelError(
                "the payload is heavier than the limit", expected=f"at most {self.limit:g} kg", got=f"{mass:.4g} kg",
                remedy="if it is not, torque gains are too large: see `tauhat calibrate-drives`",
            )  # fmt: skip

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest mass [kg]."""
        if self.mass is None:
            return 0.0, self.limit
        return self.mass * (1.0 - _ROUNDING), self.mass * (1.0 + _ROUNDING)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Payload:
    """A payload with its error bars, and the arm that carries it.

    link : name of the joint whose link carries it
    values : (10,) `m, mx, .., Izz` about the origin of the link's frame: of a physical body
    free_values : (10,) those that fit best without constraints; zero where the motion sees nothing
    covariance : (10, 10) of `free_values`
    degrees : degrees of freedom of the standard errors
    joint_rms, torque_rms : (n_v,) residual and torque of the loaded run [Nm or N]
    free_joint_rms : (n_v,) residual without constraints
    condition : of the problem with columns of unit norm
    pure : which of the ten are found alone, not in a sum with others
    loaded : the estimate of arm and payload together
    """

    link: str
    values: FloatArray
    free_values: FloatArray
    covariance: FloatArray
    degrees: int
    joint_rms: FloatArray
    free_joint_rms: FloatArray
    torque_rms: FloatArray
    condition: float
    pure: tuple[bool, ...]
    loaded: Estimate

    def __post_init__(self) -> None:
        n_v = self.loaded.robot.n_v
        shapes: dict[str, tuple[int, ...]] = {
            "values": (TEN,), "free_values": (TEN,), "covariance": (TEN, TEN),
            "joint_rms": (n_v,), "free_joint_rms": (n_v,), "torque_rms": (n_v,),
        }  # fmt: skip
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="payload"))

    @property
    def body(self) -> Body:
        """Mass, centre and central inertia of the physical body, with half 95 % intervals."""
        return body_of(self.values, self.free_values, self.covariance, self._quantile, self.pure)

    @property
    def free_body(self) -> Body:
        """Mass, centre and central inertia without physical constraints; its inertia may be no body's."""
        return body_of(self.free_values, self.free_values, self.covariance, self._quantile, self.pure)

    @property
    def _quantile(self) -> float:
        return student_quantile(self.degrees)

    @property
    def relative_rms(self) -> float:
        """Residual over torque of the loaded run, all joints stacked."""
        return float(np.linalg.norm(self.joint_rms) / np.linalg.norm(self.torque_rms))

    @property
    def free_relative_rms(self) -> float:
        """The same without physical constraints."""
        return float(np.linalg.norm(self.free_joint_rms) / np.linalg.norm(self.torque_rms))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; null for what the recordings do not tell."""
        body = self.body
        return {
            "link": self.link,
            "mass": body.mass,
            "mass_half": body.mass_half,
            "centre": _where(body.centre, body.centre_seen),
            "centre_half": _where(body.centre_half, body.centre_seen),
            "inertia": [_where(*pair) for pair in zip(body.inertia, body.inertia_seen, strict=True)],
            "inertia_half": [_where(*pair) for pair in zip(body.inertia_half, body.inertia_seen, strict=True)],
            "values": self.values.tolist(),
            "free_values": self.free_values.tolist(),
            "covariance": self.covariance.tolist(),
            "degrees": self.degrees,
            "relative_rms": self.relative_rms,
            "free_relative_rms": self.free_relative_rms,
            "joint_rms": self.joint_rms.tolist(),
            "condition": self.condition if np.isfinite(self.condition) else None,
        }


def _where(values: FloatArray, seen: tuple[bool, ...]) -> list[float | None]:
    return [float(value) if known else None for value, known in zip(values, seen, strict=True)]


@single_threaded
def identify_payload(
    estimate: Estimate,
    loaded: Sequence[Recording],
    *,
    unloaded: Sequence[Recording] = (),
    known: KnownPayload | None = None,
    processing: Processing | None = None,
) -> Payload:
    """Return the payload that the arm of the estimate carried in the loaded recordings.

    Parameters
    ----------
    unloaded : recordings of the same arm without the payload; with them arm and payload are fitted together
    known : link, mass, limit and place of the payload, as far as known
    processing : other filters than the estimate's own

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when the payload cannot be seen, is heavier than the limit, or no body keeps to what is known.

    Warns
    -----
    TauhatWarning
        when a moment of inertia comes out negative by more than its error: torque gains or the model are off; or when
        a joint is predicted far worse than in the fit of the arm alone.
    """
    if not loaded:
        raise ModelError("no recording with a payload")
    for recording in (*loaded, *unloaded):
        check_joints(estimate.model, recording)
    facts = known or KnownPayload()
    hung = payload_columns(estimate, facts.link)
    settings = processing or estimate.processing
    before = collect_all(estimate.model, estimate.base, unloaded, settings) if unloaded else None
    fit = fit_payload(
        PayloadProblem(estimate=estimate, hung=hung, before=before, mass=facts.mass), loaded, processing=settings
    )
    facts.check(float(fit.free[0]))
    if fit.free[0] <= 0.0:
        raise ModelError(
            "the payload comes out without mass", where=loaded[0].name, got=f"{fit.free[0]:.4g} kg",
            remedy="are the loaded and the unloaded recordings mixed up?",
        )  # fmt: skip
    values = physical_payload(estimate, hung, fit.payload_evidence(), fit.free, mass=facts.bounds, centre=facts.centre)
    payload = _payload(fit, values, carrying_estimate(fit, values, [*unloaded, *loaded], settings))
    _warn_of_negative_inertia(payload)
    if not unloaded:
        _warn_of_misfit(payload, estimate)
    return payload


def _payload(fit: PayloadFit, values: FloatArray, loaded: Estimate) -> Payload:
    hung = fit.problem.hung
    covariance = np.zeros((TEN, TEN))
    covariance[np.ix_(hung.kept, hung.kept)] = fit.payload_covariance
    free = fit.arm + hung.kept_columns @ fit.free[hung.kept]
    return Payload(
        link=loaded.robot.joint_names[hung.link],
        values=values,
        free_values=fit.free,
        covariance=covariance,
        degrees=fit.degrees,
        joint_rms=loaded.joint_rms,
        free_joint_rms=joint_residuals(fit.evidence, free),
        torque_rms=loaded.torque_rms,
        condition=fit.condition,
        pure=hung.pure,
        loaded=loaded,
    )


def _warn_of_misfit(payload: Payload, arm: Estimate) -> None:
    """Warn of joints whose torque the arm's estimate does not hold for any more, whatever the payload is."""
    left = payload.free_joint_rms / np.maximum(payload.torque_rms, np.finfo(float).tiny)
    joints = np.flatnonzero((left > _MISFIT) & (payload.free_joint_rms > _WORSE * arm.joint_rms))
    if joints.size:
        shares = ", ".join(f"{100 * left[joint]:.0f} % on {arm.robot.joint_names[joint]}" for joint in joints)
        warnings.warn(
            f"no payload explains the torque of the loaded run: {shares} are left, far more than in the fit of the "
            "arm, mostly because its friction there does not hold with a load: give unloaded recordings as well "
            "(--unloaded), or an estimate from a richer motion",
            TauhatWarning,
            stacklevel=3,
        )


def _warn_of_negative_inertia(payload: Payload) -> None:
    body = payload.free_body
    upper = np.diag(body.inertia) + np.diag(body.inertia_half)
    upper = np.where([payload.pure[place] for place in _MOMENTS], upper, np.inf)
    worst = int(np.argmin(upper))
    if upper[worst] < 0.0:
        moment, half = body.inertia[worst, worst], body.inertia_half[worst, worst]
        warnings.warn(
            f"without physical constraints the payload's moment of inertia about its own {'xyz'[worst]} axis is "
            f"{moment:.3g} ± {half:.2g} kg m^2, which no body has: the torque gains of the joints "
            "disagree (see `tauhat calibrate-drives`), or the motion is too slow to show it",
            TauhatWarning,
            stacklevel=3,
        )
