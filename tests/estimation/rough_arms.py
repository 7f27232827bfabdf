"""A planar arm with friction of any kind, known exactly, moved slowly and fast."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sample_arms import Truth, motion_from_rest, planar_arm
from tauhat.dynamics import TorqueModel, torque_model
from tauhat.dynamics.terms import Term
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

SETTINGS = Processing(cutoff=25.0, motion_cutoff=60.0)


def rough_truth(*terms: Term, keys: str = "inertia", **values: float | tuple[float, float]) -> Truth:
    """Return the planar arm with these terms; `values` by symbol, for both joints or one each, others nominal or 0."""
    robot = planar_arm()
    model = TorqueModel(robot=robot, terms=(*torque_model(robot, keys).terms, *terms))
    standard = np.zeros(model.n_p)
    for index, parameter in enumerate(model.parameters):
        if index < robot.inertia.size:
            standard[index] = robot.inertia.ravel()[index]
        elif parameter.symbol in values:
            standard[index] = np.broadcast_to(values[parameter.symbol], 2)[parameter.joint]
    return Truth(model, standard)


def slow_and_fast(
    truth: Truth, *, seed: int, noise: float = 0.0, seconds: float = 12.0, part: float = 1.0
) -> Recording:
    """Return a recording at 250 samples per second; `noise` [Nm], `part` of the usual amplitude."""
    t = np.arange(0.0, seconds, 0.004)
    q, dq, ddq = (part * signal for signal in motion_from_rest(2, t, seed=seed))
    rng = np.random.default_rng(1000 + seed)
    tau = truth.torque(q, dq, ddq)
    return Recording(t=t, q=q, tau=tau + noise * rng.normal(size=tau.shape), name=f"run {seed}")


def without_masses(model: TorqueModel) -> TorqueModel:
    """Return the model of the robot whose description tells no masses."""
    joints = tuple(replace(joint, inertia=np.zeros(10)) for joint in model.robot.joints)
    return replace(model, robot=replace(model.robot, joints=joints))
