"""How wrong a sensor is where nothing touches the arm: the error bar that free motion teaches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauhat.errors import SensingError
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording
from tauhat.sensing.sensor import ForceSensor

_FEWEST = 10.0  # seconds of settled free motion from which an error is told


def learnt_from_free_motion(sensor: ForceSensor, logs: Sequence[Recording | Log]) -> ForceSensor:
    """Return the sensor with the error of each joint that it shows along logs without contact.

    The residual of a fit is that of the motion it was fitted to. At other speeds, in other places and at another
    temperature the model is more wrong: logs of the work, done in air, tell by how much. What is not known of bristles
    is added to it as before.

    Parameters
    ----------
    logs : without any contact, at the speeds of the work

    Raises
    ------
    SensingError
        when there are less than ten seconds of it, or a log does not suit the sensor.
    """
    sensed = [sensor.along(log) for log in logs]
    torques = np.concatenate([log.tau[log.settled] for log in sensed]) if sensed else np.zeros((0, sensor.n_v))
    seconds = len(torques) * sensor.step
    if seconds < _FEWEST:
        raise SensingError(
            "too little free motion to learn an error from", expected=f"{_FEWEST:g} s", got=f"{seconds:.1f} s"
        )
    rms = np.maximum(np.sqrt(np.mean(torques**2, axis=0)), np.finfo(float).tiny)
    return replace(sensor, model=replace(sensor.model, rms=rms))
