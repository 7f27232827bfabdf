"""The controller as part of the identification problem: law, gains and reference of the robot that was recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.control.laws import PDGravity, TrackingLaw
from tauhat.dynamics.forward import Masses, rotor_mass_matrix
from tauhat.dynamics.simulated_arm import Integrator, Stepping
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

_POSES = 32  # along the motion at which the mass matrix is looked at
_EDGE = 1e-6  # of a step, by which a time may be outside the reference for rounding


class Positions(Protocol):
    """A motion at given times, (n_t, n_v) each."""

    @property
    def q(self) -> FloatArray:
        """Position [rad or m]."""
        ...

    @property
    def dq(self) -> FloatArray:
        """Velocity [rad/s or m/s]."""
        ...

    @property
    def ddq(self) -> FloatArray:
        """Acceleration [rad/s^2 or m/s^2]."""
        ...


class Reference(Protocol):
    """A motion that the robot was asked for, in the time of the recording; every designed trajectory is one."""

    def sample(self, t: FloatArray) -> Positions:
        """Return the motion at the times t, (n_t,) [s]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledReference:
    """A reference that was logged: on straight lines between its samples, at rest before the first and behind the last.

    Where the controller takes no reference of the speed, as a cascade of position and speed loops, dq is zero.

    t : (n_t,) increasing [s]
    q, dq, ddq : (n_t, n_v) [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray

    def __post_init__(self) -> None:
        t = frozen("t", self.t, (None,), where="reference")
        if t.size < 2:
            raise ModelError("too few samples", where="reference", expected="at least 2", got=t.size)
        if (np.diff(t) <= 0.0).any():
            raise ModelError("time does not increase", where="reference")
        object.__setattr__(self, "t", t)
        shape = frozen("q", self.q, (t.size, None), where="reference").shape
        for name in ("q", "dq", "ddq"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="reference"))

    def sample(self, t: FloatArray) -> SampledReference:
        """Return the reference at the times t, (n_t,) [s]."""
        columns = (
            [np.interp(t, self.t, column) for column in signal.T] for signal in (self.q, self.dq, self.ddq)
        )  # fmt: skip
        q, dq, ddq = (np.array(rows).T for rows in columns)
        edge = _EDGE * np.diff(self.t).min()
        resting = (t < self.t[0] - edge) | (t > self.t[-1] + edge)
        dq[resting], ddq[resting] = 0.0, 0.0
        return SampledReference(t=t, q=q, dq=dq, ddq=ddq)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopFile:
    """The file that a loop was read from: its name, and the hash of its bytes."""

    name: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosedLoop:
    """How the recorded robot was driven, as far as it is known.

    law : with its gains; its feedforward, of gravity or of the whole model, is made of the description's own values, as
        the controller's would be: it stays the same whatever parameters are tried.
        None: critically damped PD with the gravity of the simulated parameters, gains tuned to `bandwidth` anew for
        every set of parameters, so that the closed loop stays the same
    bandwidth : of the tuned law [Hz]
    references : one a recording, in its time; empty: the measured position, low-passed at `reference_cutoff`
    reference_cutoff : [Hz]; that of the processing where it is lower
    control_rate : at which the controller computes a torque and holds it [Hz]; None: all the time
    delay : from a position to the torque that answers it, whole periods of the controller; none without control_rate
    longest_step : of the integrator [s]; a step between two samples, or two torques, is cut into equal ones below it
    integrator : "leapfrog", or "runge-kutta" for smooth friction
    file : that it was read from
    """

    law: TrackingLaw | None = None
    bandwidth: float = 20.0
    references: Sequence[Reference] = ()
    reference_cutoff: float = 10.0
    control_rate: float | None = None
    delay: int = 0
    longest_step: float = 1e-3
    integrator: Integrator = "leapfrog"
    file: LoopFile | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "references", tuple(self.references))
        for name in ("bandwidth", "reference_cutoff", "control_rate", "longest_step"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < np.inf:
                raise ModelError(f"closed loop: {name} must be positive", got=value)
        if self.delay < 0:
            raise ModelError("closed loop: delay is negative", got=self.delay)
        if self.integrator not in {"leapfrog", "runge-kutta"}:
            raise ModelError("closed loop: unknown integrator", expected="leapfrog or runge-kutta", got=self.integrator)

    @property
    def known(self) -> bool:
        """Whether law and references are the robot's own."""
        return self.law is not None and bool(self.references)

    def stepping(self, step: float) -> Stepping:
        """Return how a log with this step between its samples [s] is simulated; a held torque lasts whole steps."""
        if self.control_rate is None:
            return Stepping(step, _cut(step, self.longest_step), 0, self.integrator)
        torques = step * self.control_rate  # of the controller in a sample
        if torques >= 1.0:
            hold = _cut(step / round(torques), self.longest_step)
            return Stepping(step, round(torques) * hold, hold, self.integrator, self.delay)
        substeps = _cut(step, self.longest_step)
        return Stepping(step, substeps, round(substeps / torques), self.integrator, self.delay)

    def law_for(self, robot: Robot, masses: Masses, q: FloatArray) -> TrackingLaw:
        """Return the law, tuned to these masses along the motion q (n_t, n_v) where none is given.

        `kp = w^2 D, kd = 2 w D` with `w = 2 pi bandwidth` and D the mean diagonal of the mass matrix.

        Raises
        ------
        ModelError
            when the law is of another number of joints.
        """
        if self.law is not None:
            if self.law.n_v != robot.n_v:
                raise ModelError("the law does not fit the robot", expected=f"{robot.n_v} joints", got=self.law.n_v)
            return self.law
        poses = q[:: max(1, len(q) // _POSES)]
        mass = rotor_mass_matrix(robot, poses, masses=masses)
        diagonal = np.maximum(np.diagonal(mass, axis1=1, axis2=2).mean(axis=0), 0.0)
        w = 2.0 * np.pi * self.bandwidth
        return PDGravity(kp=w**2 * diagonal, kd=2.0 * w * diagonal)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: what an estimate keeps of the loop it was found with; references by their kind."""
        law: dict[str, Any] | None = None
        if self.law is not None:
            gains = {"kp": self.law.kp.tolist(), "kd": self.law.kd.tolist(), "ki": self.law.integral_gain.tolist()}
            limits = [limit if np.isfinite(limit) else None for limit in self.law.torque_limit.tolist()]
            law = {"law": self.law.key, **gains, "torque_limit": limits}
        return {
            "file": None if self.file is None else asdict(self.file),
            "law": law,
            "bandwidth": None if law else self.bandwidth,
            "references": [type(reference).__name__ for reference in self.references] or "measured",
            "reference_cutoff": self.reference_cutoff,
            "control_rate": self.control_rate,
            "delay": self.delay,
            "longest_step": self.longest_step,
            "integrator": self.integrator,
        }


def _cut(step: float, longest: float) -> int:
    """Return into how many equal parts, none above the longest, a step is cut."""
    return max(1, int(np.ceil(step / longest - 1e-6)))
