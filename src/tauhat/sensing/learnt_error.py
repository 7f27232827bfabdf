"""The error of a sensor as free motion teaches it, kept beside the thresholds that count in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SensingError
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.zero import Zero

_SAME = 0.01  # share to which two settings are one


class SensorSettings(NamedTuple):
    """What an error depends on beside the model: how torque is filtered and observed.

    observer : by name
    gain : of it [1/s]
    cutoff : of the filter that position and torque share [Hz]
    """

    observer: str
    gain: float
    cutoff: float

    def check(self, sensor: ForceSensor) -> None:
        """Pass where a sensor has these settings.

        Raises
        ------
        SensingError
            when it has others: errors and limits in them are then not its own.
        """
        found = settings_of(sensor)
        pairs = ((self.gain, found.gain), (self.cutoff, found.cutoff))
        if self.observer != found.observer or any(abs(a - b) > _SAME * a for a, b in pairs):
            options = f"--observer {self.observer} --gain {self.gain:g} --cutoff {self.cutoff:g}"
            raise SensingError(
                "an error learnt with another sensor", expected=str(self), got=str(found),
                remedy=f"{options}, or learn again (--free)",
            )  # fmt: skip

    def __str__(self) -> str:
        """Return the settings in words."""
        return f"{self.observer}, gain {self.gain:g} 1/s, cut-off {self.cutoff:g} Hz"


def settings_of(sensor: ForceSensor) -> SensorSettings:
    """Return the settings of a sensor."""
    return SensorSettings(sensor.observer.key, sensor.observer.gain, float(sensor.cutoff or 0.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearntError:
    """What `learnt_from_free_motion` changes in a sensor.

    rms : (n_v,) of the model's error [Nm or N]
    stretch : (n_v,) what standard errors are multiplied with where they are told
    correlation : (n_v, n_v) of the joints' errors, as the wrench is solved with it
    settings : of the sensor that showed it; None: nobody knows
    zero : what was taken off where it was shown; standing: the error of torque as sensed is larger
    """

    rms: FloatArray
    stretch: FloatArray
    correlation: FloatArray
    settings: SensorSettings | None = None
    zero: Zero = "as sensed"

    def __post_init__(self) -> None:
        n_v = np.size(self.rms)
        for name, shape in (("rms", (n_v,)), ("stretch", (n_v,)), ("correlation", (n_v, n_v))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="learnt error"))
        if not ((self.rms > 0.0).all() and (self.stretch > 0.0).all()):
            raise SensingError("learnt error", expected="above zero", got=self.rms.tolist())
        if self.zero not in {"as sensed", "standing"}:
            raise SensingError("zero of a learnt error", expected="as sensed or standing", got=str(self.zero)[:60])

    @property
    def sizes(self) -> FloatArray:
        """Standard errors where the joints move and nothing else is in doubt, (n_v,) [Nm or N]."""
        return self.rms * self.stretch

    @property
    def is_learnt(self) -> bool:
        """Whether it is no longer that of a fit: error bars were stretched."""
        return bool((self.stretch != 1.0).any())

    def on(self, sensor: ForceSensor) -> ForceSensor:
        """Return the sensor with this error.

        Raises
        ------
        SensingError
            when it was learnt with another observer, gain or filter.
        """
        if self.settings is not None:
            self.settings.check(sensor)
        model = replace(sensor.model, rms=self.rms, stretch=self.stretch)
        return replace(sensor, model=model, wrench=replace(sensor.solver, correlation=self.correlation))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "rms": self.rms.tolist(), "stretch": self.stretch.tolist(), "correlation": self.correlation.tolist(),
            "settings": None if self.settings is None else self.settings._asdict(), "zero": self.zero,
        }  # fmt: skip


def learnt_error(data: Mapping[str, Any]) -> LearntError:
    """Return the error that plain data holds; files written before settings were kept have none."""
    settings = data.get("settings")
    return LearntError(**{**data, "settings": SensorSettings(**settings) if settings else None})


def error_of(sensor: ForceSensor, *, zero: Zero = "as sensed") -> LearntError:
    """Return the error that a sensor has now.

    Parameters
    ----------
    zero : what was taken off where it was learnt
    """
    return LearntError(
        rms=sensor.model.rms, stretch=sensor.model.stretch, correlation=np.array(sensor.solver.correlation),
        settings=settings_of(sensor), zero=zero,
    )  # fmt: skip
