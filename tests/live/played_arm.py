"""What the stand-in for a controller plays: an arm that moves, how it is connected to, and a sensor for it."""

from __future__ import annotations

import numpy as np
from rtde_stand_in import RtdeStandIn

from tauhat.live.current_map import map_of_constants
from tauhat.live.universal_robots import UniversalRobot
from tauhat.robots import load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing import ForceSensor, SensedModel
from tauhat.sensing.thermal import SensedHeat

RATE = 500.0
CONSTANTS = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
CURRENTS = map_of_constants(CONSTANTS)
ROBOT = load_robot("ur5e")
START = 4321.5  # the controller has been running for a while


def played(seconds: float = 20.0, rate: float = RATE) -> dict[str, np.ndarray]:
    """Return what a controller tells while an arm without friction moves, its torque by Pinocchio."""
    import pinocchio

    t, phase = np.arange(int(seconds * rate)) / rate, np.arange(6)
    speed = 1.3 + 0.4 * phase
    swing = speed * t[:, None] + phase
    q, dq, ddq = 0.8 * np.sin(swing), 0.8 * speed * np.cos(swing), -0.8 * speed**2 * np.sin(swing)
    model = pinocchio_model(ROBOT)
    data = model.createData()
    tau = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    warm = 30.0 + 0.01 * t[:, None] + phase
    return {
        "timestamp": START + t, "actual_q": q, "actual_current": tau / CONSTANTS, "target_moment": tau,
        "target_current": tau / 10.0, "joint_temperatures": warm,
    }  # fmt: skip


PLAYED = played()


def robot_at(stand_in: RtdeStandIn, **settings: object) -> UniversalRobot:
    chosen: dict[str, object] = {"currents": CURRENTS, "rate": RATE, "patience": 5.0, "silence": 0.6} | settings
    return UniversalRobot(address=stand_in.address, **chosen)  # type: ignore[arg-type]


def rows(t: np.ndarray) -> np.ndarray:
    return np.searchsorted(PLAYED["timestamp"], t)


def sensor(rate: float) -> ForceSensor:
    from tauhat.dynamics.passive_kernel import ELEMENT
    from tauhat.dynamics.terms import Thermal

    nothing = np.zeros(0, dtype=ELEMENT)
    model = SensedModel(
        robot=ROBOT, inertia=ROBOT.inertia, rotor=np.zeros(6), sliding=nothing, bristles=nothing,
        rms=np.full(6, 0.1), slow=np.full(6, 0.02), heat=SensedHeat(term=Thermal(), slopes=np.zeros((6, 2))),
    )  # fmt: skip
    return ForceSensor(model=model, rate=rate)
