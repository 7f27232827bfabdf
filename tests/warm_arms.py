"""Arms that warm up: Pinocchio's torque plus a thermal law in kelvins, written here and used by nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio

from sample_arms import planar_arm
from tauhat.arrays import FloatArray
from tauhat.dynamics import torque_model
from tauhat.dynamics.terms import Thermal
from tauhat.estimation import Estimate, identify
from tauhat.estimation.warming import thermal_term
from tauhat.recordings.recording import Recording
from tauhat.robots import Robot
from tauhat.robots.kinematics import pinocchio_model


@dataclass(frozen=True, kw_only=True)
class WarmArm:
    """Friction `(Fc sgn(dq) + Fv dq)` that falls with temperature, and gears that its power heats; (n_v,) each.

    dry, viscous : Fc, Fv at the ambient temperature [Nm, Nm s/rad]
    dry_slope, viscous_slope : relative change by a kelvin [1/K]
    capacity, resistance : of the gear against its surroundings [J/K, K/W]
    """

    robot: Robot
    dry: FloatArray
    viscous: FloatArray
    dry_slope: FloatArray
    viscous_slope: FloatArray
    capacity: FloatArray
    resistance: FloatArray

    @property
    def times(self) -> FloatArray:
        """Time constants of cooling [s]."""
        return self.capacity * self.resistance

    def scaled_slopes(self, speeds: FloatArray) -> FloatArray:
        """Return the change of dry and viscous friction by what running at these speeds would heat, (n_v, 2)."""
        kelvins = self.resistance * (self.dry + self.viscous * speeds) * speeds
        pairs = self.dry * self.dry_slope * kelvins, self.viscous * self.viscous_slope * kelvins
        return np.column_stack(pairs)

    def friction(self, dq: FloatArray, step: float, warmer: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return friction along dq (n_t, n_v) from `warmer` (n_v,) [K] above ambient, and the temperatures [K]."""
        torque, kelvins, above = np.empty_like(dq), np.empty_like(dq), np.array(warmer, dtype=float)
        for k, speed in enumerate(dq):
            dry = self.dry * (1.0 + self.dry_slope * above)
            viscous = self.viscous * (1.0 + self.viscous_slope * above)
            torque[k], kelvins[k] = dry * np.sign(speed) + viscous * speed, above
            above = above + step / self.capacity * (torque[k] * speed - above / self.resistance)
        return torque, kelvins


def repeated_motion(n_v: int, period: float, step: float, *, seed: int = 0, size: float = 0.6) -> list[FloatArray]:
    """Return position, speed and acceleration over one period of a Fourier motion, (n, n_v) each."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, period, step)
    out = [np.zeros((t.size, n_v)) for _ in range(3)]
    for order in range(1, 6):
        w = 2.0 * np.pi * order / period
        a, b = rng.normal(size=(2, n_v)) * size / order**0.5
        sine, cosine = np.sin(w * t)[:, None], np.cos(w * t)[:, None]
        out[0] += a * sine + b * cosine
        out[1] += w * (a * cosine - b * sine)
        out[2] -= w * w * (a * sine + b * cosine)
    return out


def warm_log(
    arm: WarmArm,
    minutes: float,
    *,
    rate: float = 50.0,
    warmer: FloatArray | float = 0.0,
    seed: int = 0,
    period: float = 10.0,
    noise: float = 0.3,
    slow: float = 1.0,
) -> Recording:
    """Return a recording of repeated motion; `slow` stretches it in time; temperatures are logged as 25 and above."""
    step, n_v = 1.0 / rate, arm.robot.n_v
    q, dq, ddq = repeated_motion(n_v, period * slow, step, seed=seed)
    model = pinocchio_model(arm.robot)
    data = model.createData()
    rigid = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    turns = max(1, round(60.0 * minutes / (period * slow)))
    q, dq, rigid = (np.tile(part, (turns, 1)) for part in (q, dq, rigid))
    friction, above = arm.friction(dq, step, np.broadcast_to(warmer, n_v))
    rng = np.random.default_rng(seed + 100)
    return Recording(
        t=step * np.arange(len(q)), q=q + 1e-5 * rng.normal(size=q.shape),
        tau=rigid + friction + noise * rng.normal(size=q.shape), temperature=25.0 + above, name="warm-up",
    )  # fmt: skip


def two_link(*, changing: float = 1.0) -> WarmArm:
    """Return the planar arm with gears that warm up by 50 to 65 K; slopes times `changing`."""
    return WarmArm(
        robot=planar_arm(), dry=np.array([6.0, 3.0]), viscous=np.array([8.0, 4.0]),
        dry_slope=changing * np.array([-0.008, -0.01]), viscous_slope=changing * np.array([-0.015, -0.02]),
        capacity=np.array([150.0, 60.0]), resistance=np.array([3.0, 6.0]),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class WarmedUp:
    """An arm, its warm-up, and what was identified from it with and without a thermal term."""

    arm: WarmArm
    log: Recording
    plain: Estimate
    thermal: Estimate

    @property
    def term(self) -> Thermal:
        found = thermal_term(self.thermal.model)
        assert found is not None
        return found

    @property
    def kelvins(self) -> FloatArray:
        """What one unit of warmth is, (n_v,) [K]."""
        speeds = np.array(self.term.speeds)
        return self.arm.resistance * (self.arm.dry + self.arm.viscous * speeds) * speeds

    @property
    def hot(self) -> FloatArray:
        """How warm the arm is at the end, (n_v,) [K]."""
        assert self.log.temperature is not None
        return self.log.temperature[-1] - 25.0


@cache
def warmed_up() -> WarmedUp:
    arm = two_link()
    log = warm_log(arm, 25.0, rate=40.0)
    plain, thermal = (identify(torque_model(arm.robot, names), [log]) for names in ("plain", "plain,thermal"))
    return WarmedUp(arm=arm, log=log, plain=plain, thermal=thermal)
