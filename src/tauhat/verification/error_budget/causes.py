"""The causes of error that a rehearsed experiment can have, and how each of them is switched off."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.simulation.sensors import SensorErrors

_MODELLED = "plain"  # kind of friction that the usual models have


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """An experiment, and how a model is identified from it.

    experiment : with sensors whose offsets, factors and phases are drawn
    warmer : how much warmer the joints are when the model is judged than when it was identified [K]
    with_further : a second, designed motion is identified from, too
    with_true_motion : identified from true velocities, and accelerations out of these, instead of filtered positions
    """

    experiment: PlannedExperiment
    warmer: float = 0.0
    with_further: bool = False
    with_true_motion: bool = False

    @property
    def sensors(self) -> SensorErrors:
        """What the log shows of the truth."""
        return self.experiment.settings.sensors

    def sensing(self, **errors: Any) -> Case:
        """Return the case with other errors of the sensors."""
        settings = replace(self.experiment.settings, sensors=replace(self.sensors, **errors))
        return replace(self, experiment=replace(self.experiment, settings=settings))

    def truly(self, **parts: Any) -> Case:
        """Return the case with another truth."""
        return replace(self, experiment=replace(self.experiment, **parts))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cause:
    """One cause of error.

    present : whether a case has it
    without : the case that lacks only this
    """

    key: str
    title: str
    present: Callable[[Case], bool]
    without: Callable[[Case], Case]


def causes_of(case: Case) -> tuple[Cause, ...]:
    """Return the causes that a case has, in the order of `CAUSES`."""
    return tuple(cause for cause in CAUSES.values() if cause.present(case))


def switched_off(case: Case, keys: Collection[str]) -> Case:
    """Return the case without these causes."""
    for key in keys:
        case = CAUSES[key].without(case)
    return case


def _any_of(*names: str) -> Callable[[Case], bool]:
    return lambda case: any(bool(np.any(getattr(case.sensors, name))) for name in names)


def _none_of(*names: str) -> Callable[[Case], Case]:
    return lambda case: case.sensing(**dict.fromkeys(names, 0.0))


_NOISE = ("torque_noise", "relative_torque_noise")
_OFFSETS = ("torque_offset", "torque_offset_spread", "torque_drift", "torque_walk")
_CLOCK = ("sampling_jitter", "stamp_jitter", "lost_samples")


def _noisy(case: Case) -> bool:
    of_velocity = case.sensors.velocity_noise
    return _any_of(*_NOISE)(case) or (of_velocity is not None and bool(np.any(of_velocity)))


def _without_noise(case: Case) -> Case:
    quiet = None if case.sensors.velocity_noise is None else 0.0
    return _none_of(*_NOISE)(case).sensing(velocity_noise=quiet)


def _stepped(case: Case) -> bool:
    return _any_of("encoder_step")(case) or bool(np.any(case.experiment.settings.encoder.step))


def _without_steps(case: Case) -> Case:
    settings = case.experiment.settings
    exact = replace(settings, encoder=replace(settings.encoder, step=0.0))
    return _none_of("encoder_step")(case.truly(settings=exact))


def _with_modelled_friction(case: Case) -> Case:
    heat = case.experiment.heat
    own = None if heat is None else replace(heat, laws=np.zeros((0, heat.n_v)))
    return case.truly(friction=_MODELLED, heat=own)


def _gains(case: Case) -> bool:
    return bool(np.any(np.asarray(case.sensors.torque_factor) != 1.0)) or _any_of("torque_factor_spread")(case)


_ALL = (
    Cause(key="noise", title="noise of torque and velocity", present=_noisy, without=_without_noise),
    Cause(key="quantisation", title="steps of the encoders", present=_stepped, without=_without_steps),
    Cause(
        key="differentiation",
        title="differentiation and filtering",
        present=lambda case: not case.with_true_motion,
        without=lambda case: replace(case, with_true_motion=True),
    ),
    Cause(
        key="conditioning",
        title="length and conditioning of the motion",
        present=lambda case: not case.with_further,
        without=lambda case: replace(case, with_further=True),
    ),
    Cause(
        key="friction",
        title="friction beyond viscous and Coulomb",
        present=lambda case: case.experiment.friction != _MODELLED,
        without=_with_modelled_friction,
    ),
    Cause(
        key="temperature",
        title="temperature",
        present=lambda case: case.experiment.heat is not None,
        without=lambda case: case.truly(heat=None),
    ),
    Cause(
        key="elasticity",
        title="elasticity and backlash",
        present=lambda case: case.experiment.elasticity is not None,
        without=lambda case: case.truly(elasticity=None),
    ),
    Cause(
        key="delay",
        title="delay between torque and position",
        present=_any_of("torque_delay"),
        without=_none_of("torque_delay"),
    ),
    Cause(
        key="gains",
        title="torque constants",
        present=_gains,
        without=lambda case: case.sensing(torque_factor=1.0, torque_factor_spread=0.0),
    ),
    Cause(
        key="offsets", title="offset and drift of the torque", present=_any_of(*_OFFSETS), without=_none_of(*_OFFSETS)
    ),
    Cause(
        key="ripple",
        title="ripple of the torque",
        present=lambda case: any(bool(np.any(ripple.amplitude)) for ripple in case.sensors.ripples),
        without=lambda case: case.sensing(ripples=()),
    ),
    Cause(key="clock", title="clock and lost rows", present=_any_of(*_CLOCK), without=_none_of(*_CLOCK)),
)
CAUSES: Mapping[str, Cause] = {cause.key: cause for cause in _ALL}
"""Every cause by its key."""
