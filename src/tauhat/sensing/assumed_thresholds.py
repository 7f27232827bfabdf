"""Thresholds of contact where nobody recorded free motion: so many standard errors of the sensor, no rate promised."""

from __future__ import annotations

import numpy as np

from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import ContactThresholds
from tauhat.sensing.sensor import ForceSensor

# In standard errors: settling, resting, standing while others move, slow, fast. What two arms with heavy gears showed
# in free motion at most lies about here; a joint that stands while its neighbours move holds friction of any size.
_LIMITS = (8.0, 4.0, 20.0, 8.0, 6.0)
_STEPS = (1.0, 15.0, 50.0)  # of the slow speed, which is a fiftieth of the top speed of the fit


def assumed_contact_thresholds(sensor: ForceSensor, *, rules: ContactRules | None = None) -> ContactThresholds:
    """Return thresholds without any free motion; learn them from some (`learn_contact_thresholds`) where you can.

    Parameters
    ----------
    sensor : model and standard errors
    rules : hysteresis and zero; as stated in `ContactRules` by default
    """
    slow = sensor.model.slow
    return ContactThresholds(
        joint_names=sensor.model.robot.joint_names, edges=np.outer(_STEPS, slow),
        limits=np.tile(np.array(_LIMITS)[:, None], sensor.n_v), rules=rules or ContactRules(), rate=np.inf,
        promised=np.inf, seconds=np.zeros(3), spread=np.nan, estimate=sensor.model.estimate,
    )  # fmt: skip
