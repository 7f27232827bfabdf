"""The error of a sensor as free motion teaches it, kept beside the thresholds that count in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SensingError
from tauhat.sensing.sensor import ForceSensor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearntError:
    """What `learnt_from_free_motion` changes in a sensor.

    rms : (n_v,) of the model's error [Nm or N]
    stretch : (n_v,) what standard errors are multiplied with where they are told
    correlation : (n_v, n_v) of the joints' errors, as the wrench is solved with it
    """

    rms: FloatArray
    stretch: FloatArray
    correlation: FloatArray

    def __post_init__(self) -> None:
        n_v = np.size(self.rms)
        for name, shape in (("rms", (n_v,)), ("stretch", (n_v,)), ("correlation", (n_v, n_v))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="learnt error"))
        if not ((self.rms > 0.0).all() and (self.stretch > 0.0).all()):
            raise SensingError("learnt error", expected="above zero", got=self.rms.tolist())

    @property
    def sizes(self) -> FloatArray:
        """Standard errors where the joints move and nothing else is in doubt, (n_v,) [Nm or N]."""
        return self.rms * self.stretch

    @property
    def is_learnt(self) -> bool:
        """Whether it is no longer that of a fit: error bars were stretched."""
        return bool((self.stretch != 1.0).any())

    def on(self, sensor: ForceSensor) -> ForceSensor:
        """Return the sensor with this error."""
        model = replace(sensor.model, rms=self.rms, stretch=self.stretch)
        return replace(sensor, model=model, wrench=replace(sensor.solver, correlation=self.correlation))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "rms": self.rms.tolist(), "stretch": self.stretch.tolist(), "correlation": self.correlation.tolist(),
        }  # fmt: skip


def error_of(sensor: ForceSensor) -> LearntError:
    """Return the error that a sensor has now."""
    return LearntError(
        rms=sensor.model.rms, stretch=sensor.model.stretch, correlation=np.array(sensor.solver.correlation)
    )
