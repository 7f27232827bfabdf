"""What every observer makes of one arm: its errors, and how often its error bars hold the truth."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.dynamics.model import torque_model
from tauhat.errors import TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.recordings.recording import Recording
from tauhat.sensing.free_motion import learnt_from_free_motion
from tauhat.sensing.observers import OBSERVERS, ThermalObserver, observer_named
from tauhat.sensing.sensor import ForceSensor, force_sensor
from tauhat.sensing.wrench import WrenchSolver, directions_named
from tauhat.sensing.zero import zeroed
from tauhat.studies.force_sensing.scene import ContactScene, Pace, PushedLog, SceneSettings, Warmth

PACES: tuple[Pace, ...] = ("moving", "standing")
WARMTHS: tuple[Warmth, ...] = ("cold", "warm")
_LATE = 0.06  # [s] by which a step of force comes through half: truth is shown that much later
_SETTLED = 1.5  # [s] from the start of a log that are left out
_INTERVAL = 1.96


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One arm, and what is tried on it.

    terms : of the model without warmth; `thermal` is added for the other
    directions : that the wrench is solved for
    """

    scene: SceneSettings
    seed: int
    terms: str
    directions: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One observer on one log.

    force_rms, force_95 : of the size of the force's error, root mean square and 95 % quantile [N]
    torque_inside, force_inside : share of the 95 % intervals of joint torque and force that hold the truth
    apart_rms, apart_inside : the same of the force where errors of joints are taken as independent [N, 1]
    friction : torque error along the motion, mean over a joint's samples of error times direction (n_v,) [Nm or N];
        empty where the arm stands
    """

    seed: int
    observer: str
    pace: Pace
    warmth: Warmth
    force_rms: float = np.nan
    force_95: float = np.nan
    torque_inside: float = np.nan
    force_inside: float = np.nan
    apart_rms: float = np.nan
    apart_inside: float = np.nan
    friction: tuple[float, ...] = ()


@single_threaded
def tried(trial: Trial) -> tuple[Outcome, ...]:
    """Return what all observers make of one arm."""
    scene = ContactScene(trial.scene, trial.seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        steady = identify(torque_model(scene.robot, trial.terms), [scene.warm_up])
        thermal = identify(torque_model(scene.robot, f"{trial.terms},thermal"), [scene.warm_up])
    air = [log for warmth in WARMTHS for log in scene.in_air(warmth)]
    sensors = {key: _sensor(thermal if key == ThermalObserver.key else steady, key, trial, air) for key in OBSERVERS}
    logs = {(pace, warmth): scene.pushed(pace, warmth) for pace in PACES for warmth in WARMTHS}
    return tuple(
        _outcome(Outcome(seed=trial.seed, observer=key, pace=pace, warmth=warmth), sensor, log)
        for key, sensor in sensors.items()
        for (pace, warmth), log in logs.items()
    )


def _sensor(estimate: Estimate, key: str, trial: Trial, air: list[Recording]) -> ForceSensor:
    """Return the sensor with an error learnt on motion in air, cold and warm."""
    solver = WrenchSolver(robot=estimate.robot, directions=directions_named(trial.directions))
    sensor = force_sensor(estimate, rate=trial.scene.rate, observer=observer_named(key), wrench=solver)
    return learnt_from_free_motion(sensor, air)


def _outcome(blank: Outcome, sensor: ForceSensor, log: PushedLog) -> Outcome:
    sensed = sensor.along(log.recording)
    late, first = round(_LATE / sensor.step), round(_SETTLED / sensor.step)
    rows = sensed.rows[first + late :] - late
    window = slice(first + late, None)
    force, torque = sensed.wrench[window, :3] - log.force[rows], sensed.tau[window] - log.torque[rows]
    independent = replace(sensor.solver, correlation=np.eye(sensor.n_v))
    each = zeroed(sensed, np.zeros_like(sensed.tau), solver=independent)
    apart = each.wrench[window, :3] - log.force[rows]
    size = np.linalg.norm(force, axis=1)
    inside = np.abs(torque) <= _INTERVAL * sensed.tau_std[window]
    held = np.abs(force) <= _INTERVAL * sensed.wrench_std[window, :3]
    return replace(
        blank,
        force_rms=float(np.sqrt(np.mean(size**2))),
        force_95=float(np.quantile(size, 0.95)),
        torque_inside=float(np.mean(inside)),
        force_inside=float(np.mean(held)),
        apart_rms=float(np.sqrt(np.mean(np.sum(np.square(apart), axis=1)))),
        apart_inside=float(np.mean(np.abs(apart) <= _INTERVAL * each.wrench_std[window, :3])),
        friction=_along_motion(torque, sensed.dq[window], sensor.model.slow) if blank.pace == "moving" else (),
    )


def _along_motion(error: FloatArray, dq: FloatArray, slow: FloatArray) -> tuple[float, ...]:
    """Return the mean of error times direction of each joint while it moves, (n_v,) [Nm or N]."""
    moving = np.abs(dq) > slow
    signed = np.where(moving, error * np.sign(dq), 0.0).sum(axis=0)
    return tuple((signed / np.maximum(moving.sum(axis=0), 1)).tolist())
