"""Payload or contact: a weight that stays explains what is sensed wherever the arm goes, a hand does not.

A mass m at c from the frame, c in the frame's axes, adds the wrench (m g, R c m x g) at the frame's origin, so
    tau_ext = J_v' g m + J_w' ((R m c) x g)
is linear in (m, m c). It is fitted to one half of the samples, in blocks of time, and judged on the other half, both
ways, in standard errors of the sensor. Samples are taken half a second apart, beyond which the error forgets most.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import SensingError
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.wrench import WrenchSolver

Verdict: TypeAlias = Literal["payload", "no payload", "undecided"]

_APART = 0.5  # between samples [s]
FEWEST_SAMPLES = 6
_SURE = 3.0  # standard errors of a mass that is there
_LEFT = 0.5  # share that a payload may leave unexplained
_MOVED = 0.2  # 1 less the square is the cosine between a weight's torques at positions that can be told apart


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadCheck:
    """A payload fitted to external torque, and whether it is one.

    verdict : no payload where a mass leaves half unexplained; undecided where it fits and the arm hardly moved
    mass, mass_std : [kg]; the error as large as what is left unexplained says
    centre : (3,) from the frame, in its axes [m]; NaN where no mass is sure
    unexplained : share of the squared torque that the mass leaves, on the samples it was not fitted to
    """

    verdict: Verdict
    mass: float
    mass_std: float
    centre: FloatArray
    unexplained: float

    def __post_init__(self) -> None:
        read_only(self.centre)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "verdict": self.verdict, "mass": self.mass, "mass_std": self.mass_std, "centre": self.centre.tolist(),
            "unexplained": self.unexplained,
        }  # fmt: skip


def check_payload(
    sensed: SensedLog, solver: WrenchSolver, *, between: tuple[float, float] | None = None
) -> PayloadCheck:
    """Return whether a payload explains the external torque of a log, or of the time between two moments of it.

    Slow motion is meant: the inertia of the mass is left out.

    Parameters
    ----------
    solver : whose frame carries the mass
    between : [s], as the log's clock has it

    Raises
    ------
    SensingError
        when there are fewer than six samples half a second apart.
    """
    first, last = (sensed.t[0], sensed.t[-1]) if between is None else between
    rows = np.flatnonzero(sensed.settled & (sensed.t >= first) & (sensed.t <= last))
    rows = rows[:: max(1, round(_APART / sensed.step))]
    if rows.size < FEWEST_SAMPLES:
        raise SensingError(
            "too short to tell a payload from a contact", where=sensed.name,
            expected=f"{FEWEST_SAMPLES * _APART:g} s", got=f"{rows.size * _APART:g} s",
        )  # fmt: skip
    std = sensed.tau_std[rows]
    columns = np.stack([_columns(solver, q) for q in sensed.q[rows]]) / std[:, :, None]
    torque = sensed.tau[rows] / std
    halves = (np.arange(rows.size) // (FEWEST_SAMPLES // 2)) % 2 == 0
    unexplained = _left(columns, torque, halves)
    values, errors = _fitted(columns, torque)
    mass, mass_std = float(values[0]), float(errors[0])
    is_heavy = mass > _SURE * mass_std
    centre = values[1:] / mass if is_heavy else np.full(3, np.nan)
    return PayloadCheck(
        verdict=_verdict(columns, is_heavy and unexplained < _LEFT), mass=mass, mass_std=mass_std,
        centre=centre, unexplained=unexplained,
    )  # fmt: skip


def long_enough(sensed: SensedLog, *, between: tuple[float, float]) -> bool:
    """Return whether `check_payload` can tell anything of the time between two moments [s]."""
    rows = sensed.settled & (sensed.t >= between[0]) & (sensed.t <= between[1])
    return bool(np.count_nonzero(rows) > (FEWEST_SAMPLES - 1) * max(1, round(_APART / sensed.step)))


def _columns(solver: WrenchSolver, q: FloatArray) -> FloatArray:
    """Return external torque of each joint by m and by m c, (n_v, 4)."""
    jacobian, rotation = solver.jacobian(q)
    gravity = solver.robot.gravity
    moments = np.cross(rotation.T, gravity)  # of a unit of m c along each axis of the frame
    return np.column_stack([jacobian[:3].T @ gravity, jacobian[3:].T @ moments.T])


def _fitted(columns: FloatArray, torque: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least squares solution and its standard errors, by what is left over."""
    rows, wanted = columns.reshape(-1, columns.shape[-1]), torque.ravel()
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    kept = sizes > 1e-9 * sizes[0]
    values = right[kept].T @ ((left[:, kept].T @ wanted) / sizes[kept])
    rest = wanted - rows @ values
    spread = float(rest @ rest) / max(1, wanted.size - int(kept.sum()))
    return values, np.sqrt(spread * np.square(right[kept] / sizes[kept, None]).sum(axis=0))


def _left(columns: FloatArray, torque: FloatArray, halves: NDArray[np.bool_]) -> float:
    """Return the share of the squared torque that a payload fitted to the other half leaves."""
    rest = 0.0
    for fit, judge in ((halves, ~halves), (~halves, halves)):
        values, _ = _fitted(columns[fit], torque[fit])
        rest += float(np.square(torque[judge] - columns[judge] @ values).sum())
    return rest / max(float(np.square(torque).sum()), np.finfo(float).tiny)


def _verdict(columns: FloatArray, is_payload: bool) -> Verdict:
    if not is_payload:
        return "no payload"
    weight = columns[:, :, 0]
    sizes = np.linalg.norm(weight, axis=1)
    alike = weight @ weight[int(sizes.argmax())] / np.maximum(sizes * sizes.max(), np.finfo(float).tiny)
    return "undecided" if alike.min() > 1.0 - _MOVED**2 else "payload"
