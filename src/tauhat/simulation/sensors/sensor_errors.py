"""The settings of a robot's sensors: how far the log is from the truth, and by which physics."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation.sensors.joint_values import checked, per_joint
from tauhat.simulation.sensors.ripple import Ripple

ShownVelocity: TypeAlias = Literal["measured", "differenced"]
TorqueSide: TypeAlias = Literal["motor", "link"]
Stamps: TypeAlias = Literal["instants", "ticks"]

_SIGNED = ("torque_offset", "torque_drift", "torque_delay")
_SIZES = (
    "encoder_step",
    "torque_noise",
    "relative_torque_noise",
    "torque_offset_spread",
    "torque_walk",
    "torque_factor_spread",
    "sampling_jitter",
    "stamp_jitter",
)
_SCALED = (
    *("encoder_step", "torque_noise", "relative_torque_noise", "torque_offset", "torque_offset_spread"),
    *("torque_drift", "torque_walk", "torque_factor_spread"),
)
_OF_THE_CLOCK = ("torque_delay", "sampling_jitter", "stamp_jitter", "lost_samples", "lost_run")
_CHOICES = {
    "velocity": ("measured", "differenced"),
    "torque_side": ("motor", "link"),
    "stamps": ("instants", "ticks"),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorErrors:
    """Errors of a robot's sensors; values are one number for all joints or (n_v,) each, zero means a perfect sensor.

    What is shown of the torque is `factor tau + ripple`, read `torque_delay` late, `+ offset + drift + walk + noise`.

    encoder_step : quantisation of the position [rad or m]
    velocity_noise : standard deviation of a measured velocity [rad/s or m/s]; None where the log has none
    velocity : `measured`, or `differenced`: the step of the position shown, over a period of the log's clock
    torque_side : the torque of the `motor` (its current), or that which a sensor behind the gear sees on the `link`
    torque_noise : standard deviation of white torque noise [Nm or N]
    relative_torque_noise : the same as a fraction of each joint's RMS torque; both add up as variances
    torque_offset : constant error of the torque [Nm or N]
    torque_offset_spread : standard deviation of a further one, drawn for each joint [Nm or N]
    torque_drift : growth of the error from the start of the log [Nm/h or N/h]
    torque_walk : standard deviation of a random walk after an hour [Nm or N]; it grows with the root of time
    torque_factor : shown torque over true one, the error of a torque constant
    torque_factor_spread : standard deviation of the logarithm of a further factor, drawn for each joint
    ripples : errors of the torque that repeat with the angle
    torque_delay : how much later than the position the torque is read, any fraction of a sample [s]
    sampling_jitter : standard deviation of the instants of sampling about the clock's ticks, of uniform density [s]
    stamp_jitter : the same of the time stamps about the instants [s]
    stamps : the log's time tells `instants`, or counts `ticks` of the clock
    lost_samples : share of the rows that the log lacks
    lost_run : mean number of rows that are lost together
    """

    encoder_step: float | FloatArray = 0.0
    velocity_noise: float | FloatArray | None = None
    velocity: ShownVelocity = "measured"
    torque_side: TorqueSide = "motor"
    torque_noise: float | FloatArray = 0.0
    relative_torque_noise: float | FloatArray = 0.0
    torque_offset: float | FloatArray = 0.0
    torque_offset_spread: float | FloatArray = 0.0
    torque_drift: float | FloatArray = 0.0
    torque_walk: float | FloatArray = 0.0
    torque_factor: float | FloatArray = 1.0
    torque_factor_spread: float | FloatArray = 0.0
    ripples: tuple[Ripple, ...] = ()
    torque_delay: float = 0.0
    sampling_jitter: float = 0.0
    stamp_jitter: float = 0.0
    stamps: Stamps = "instants"
    lost_samples: float = 0.0
    lost_run: float = 1.0

    def __post_init__(self) -> None:
        for name, known in _CHOICES.items():
            if getattr(self, name) not in known:
                raise SimulationError(f"sensor error {name}", expected=" or ".join(known), got=getattr(self, name))
        for name in _SIGNED:
            object.__setattr__(self, name, checked(name, getattr(self, name)))
        for name in _SIZES:
            object.__setattr__(self, name, checked(name, getattr(self, name), least=0.0))
        if self.velocity_noise is not None:
            object.__setattr__(self, "velocity_noise", checked("velocity_noise", self.velocity_noise, least=0.0))
        object.__setattr__(self, "torque_factor", checked("torque_factor", self.torque_factor))
        if np.min(self.torque_factor) <= 0.0:
            raise SimulationError("sensor error torque_factor must be above zero", got=self.torque_factor)
        object.__setattr__(self, "ripples", tuple(self.ripples))
        for name in _OF_THE_CLOCK:
            if np.ndim(getattr(self, name)):
                raise SimulationError(f"sensor error {name}", expected="one number", got=getattr(self, name))
            object.__setattr__(self, name, float(checked(name, getattr(self, name))))
        self._check_losses()

    def _check_losses(self) -> None:
        if not 0.0 <= self.lost_samples < 0.5:
            expected = "a share of 0 to 0.5"
            raise SimulationError("sensor error lost_samples", expected=expected, got=self.lost_samples)
        if self.lost_run < 1.0:
            raise SimulationError("sensor error lost_run", expected="at least 1", got=self.lost_run)

    def scaled(self, factor: float) -> SensorErrors:
        """Return sensors `factor` times as bad: all errors of values; those of the clock stay.

        Raises
        ------
        SimulationError
            when the factor is negative, or a torque factor would no longer be positive.
        """
        if not 0.0 <= factor < np.inf:
            raise SimulationError("scale of sensor errors", expected="a number >= 0", got=factor)
        noise = self.velocity_noise
        scaled: dict[str, Any] = {name: factor * np.asarray(getattr(self, name)) for name in _SCALED}
        return replace(
            self,
            **scaled,
            velocity_noise=None if noise is None else factor * np.asarray(noise),
            torque_factor=1.0 + factor * (np.asarray(self.torque_factor) - 1.0),
            ripples=tuple(ripple.scaled(factor) for ripple in self.ripples),
        )

    def drawn(self, n_v: int, rng: np.random.Generator) -> SensorErrors:
        """Return the sensors of one robot: offsets, factors and phases that stay from log to log are drawn.

        `measure` draws what is not drawn yet, anew for every log.
        """
        offset = per_joint("torque_offset", self.torque_offset, n_v)
        factor = per_joint("torque_factor", self.torque_factor, n_v)
        if np.any(self.torque_offset_spread):
            spread = per_joint("torque_offset_spread", self.torque_offset_spread, n_v)
            offset = offset + spread * rng.standard_normal(n_v)
        if np.any(self.torque_factor_spread):
            spread = per_joint("torque_factor_spread", self.torque_factor_spread, n_v)
            factor = factor * np.exp(spread * rng.standard_normal(n_v))
        return replace(
            self,
            torque_offset=offset,
            torque_offset_spread=0.0,
            torque_factor=factor,
            torque_factor_spread=0.0,
            ripples=tuple(ripple.drawn(n_v, rng) for ripple in self.ripples),
        )
