"""Contact: when something touches the arm, from when to when, and behind which joint.

A joint feels what acts on the links behind it and nothing else, so the last joint that clearly feels something tells
the link that is touched, or one further out: joints whose axis the force meets, or runs along, feel nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import SensingError
from tauhat.sensing.contact_kernel import RESTING, ROWS, SETTLING, STATES, judge
from tauhat.sensing.contact_thresholds import CONDITIONS, ContactThresholds
from tauhat.sensing.judged_rows import judged_rows
from tauhat.sensing.payload_check import PayloadCheck
from tauhat.sensing.sample_rate import OFF_RATE
from tauhat.sensing.sensed_log import SensedLog

_BEFORE = 0.2  # seconds before the start of a contact: what is sensed there is not its


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContactEvent:
    """Something touched the arm.

    start, end : [s]; found at `start`, gone below the release at `end`
    link : the link, by its joint, that is touched, or one further out
    peak, peak_std : largest force at the sensor's frame less that just before, and the force's standard error there [N]
    excess : largest residual in parts of the threshold
    torque : (n_v,) external torque at that moment, zeroed [Nm or N]
    fast : whether a joint was faster than in the free motion of the thresholds
    open : whether it lasted to the end of the log
    payload : whether a body that is carried explains it; None where it is too short to tell, or nobody asked
    """

    start: float
    end: float
    link: str
    peak: float
    peak_std: float
    excess: float
    torque: FloatArray
    fast: bool
    open: bool
    payload: PayloadCheck | None = None

    def __post_init__(self) -> None:
        read_only(self.torque)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "start": self.start, "end": self.end, "link": self.link, "peak": self.peak,
            "peak_std": self.peak_std, "excess": self.excess,
            "torque": self.torque.tolist(), "fast": self.fast, "open": self.open,
            "payload": None if self.payload is None else self.payload.to_dict(),
        }  # fmt: skip


class ContactMemory(NamedTuple):
    """What a detector remembers: zero and residual, (2, n_v); contact, seconds standing, seconds seen, (3,)."""

    rows: FloatArray
    state: FloatArray


class ContactSample(NamedTuple):
    """What one sample told.

    contact : whether something touches the arm
    excess : residual in parts of the threshold; contact begins at 1
    condition : settling, resting or moving
    fast : whether a joint is faster than in the free motion of the thresholds; thresholds grow with the speed then
    link : of the moment, None without contact
    zero : (n_v,) what was taken off [Nm or N]
    """

    contact: bool
    excess: float
    condition: str
    fast: bool
    link: str | None
    zero: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contacts:
    """Contacts along a log.

    events : in order
    touched : (n_t,) whether something touches the arm
    excess : (n_t,) residual in parts of the threshold
    resting : (n_t,) whether the arm stands, settling or resting
    fast : (n_t,) whether a joint is faster than in the free motion of the thresholds
    zero : (n_t, n_v) what was taken off [Nm or N]
    """

    events: tuple[ContactEvent, ...]
    touched: NDArray[np.bool_]
    excess: FloatArray
    resting: NDArray[np.bool_]
    fast: NDArray[np.bool_]
    zero: FloatArray

    def __post_init__(self) -> None:
        for name in ("touched", "excess", "resting", "fast", "zero"):
            read_only(getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContactDetector:
    """Thresholds at one sample rate: pure steps, and the same along a log.

    thresholds : learnt on free motion
    step : time between samples [s]
    """

    thresholds: ContactThresholds
    step: float
    _scaling: tuple[FloatArray, FloatArray] = field(init=False, repr=False)
    _way: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not 0.0 < self.step < np.inf:
            raise SensingError("time between samples", where="contact", expected="above zero", got=f"{self.step} s")
        object.__setattr__(self, "_scaling", (self.thresholds.edges, self.thresholds.limits))
        object.__setattr__(self, "_way", read_only(self.thresholds.rules.way(self.step)))

    def start(self) -> ContactMemory:
        """Return the memory before the first sample."""
        return ContactMemory(np.zeros((ROWS, self.thresholds.n_v)), np.zeros(STATES))

    def advance(
        self, memory: ContactMemory, tau: FloatArray, variance: FloatArray, dq: FloatArray, *, settled: bool = True
    ) -> tuple[ContactMemory, ContactSample]:
        """Return the memory behind a sample and whether something touches the arm.

        Parameters
        ----------
        tau, variance, dq : (n_v,) external torque, its variance, and the velocity, as a sensor gives them
        settled : whether the sensor has forgotten its start; nothing is told before
        """
        after = ContactMemory(memory.rows.copy(), memory.state.copy())
        sensed = np.stack([tau, variance, dq])
        if sensed.shape != (3, self.thresholds.n_v):
            raise SensingError(
                "a sample of another robot", where="contact", expected=f"{self.thresholds.n_v} joints", got=sensed.shape
            )
        excess, condition, fast = judge(self._scaling, self._way, sensed, settled, after)
        contact = bool(after.state[0])
        link = self.link_of(after.rows[1]) if contact else None
        zero = read_only(after.rows[0].copy())
        return after, ContactSample(contact, float(excess), CONDITIONS[condition], bool(fast), link, zero)

    def along(self, log: SensedLog) -> Contacts:
        """Return the contacts along a log; causal: a sample knows none after it.

        Raises
        ------
        SensingError
            when the thresholds are of other joints or the log is of another rate.
        """
        self.check_joints(log.joint_names, where=log.name)
        if not abs(log.step / self.step - 1.0) <= OFF_RATE:
            raise SensingError(
                "samples of another rate", where=log.name, expected=f"{self.step} s", got=f"{log.step} s"
            )
        n_v = self.thresholds.n_v
        out = judged_rows(log, self._scaling, self.thresholds.rules)
        told, zero = out[:, 4 : 4 + n_v], out[:, 4 + n_v :].copy()
        edges = np.flatnonzero(np.diff(np.concatenate([[0.0], out[:, 0], [0.0]])))
        spans = [slice(*span) for span in zip(edges[::2], edges[1::2], strict=True)]
        return Contacts(
            events=tuple(self._event(log, out, told, zero, span) for span in spans),
            touched=out[:, 0] > 0.0, excess=out[:, 1].copy(), resting=np.isin(out[:, 2], (SETTLING, RESTING)),
            fast=out[:, 3] > 0.0, zero=zero,
        )  # fmt: skip

    def check_joints(self, names: tuple[str, ...], *, where: str) -> None:
        """Pass where the thresholds are of these joints; see `ContactThresholds.check_joints`."""
        self.thresholds.check_joints(names, where=where)

    def link_of(self, told: FloatArray) -> str:
        """Return the link, by its joint furthest out that feels at least what keeps a contact.

        Parameters
        ----------
        told : (n_v,) residual of each joint in parts of its threshold, of a sample or the largest of a contact
        """
        felt = np.flatnonzero(told >= self.thresholds.rules.release)
        return self.thresholds.joint_names[int(felt[-1]) if felt.size else int(told.argmax())]

    def _event(self, log: SensedLog, out: FloatArray, told: FloatArray, zero: FloatArray, span: slice) -> ContactEvent:
        top = span.start + int(out[span, 1].argmax())
        before = max(0, span.start - round(_BEFORE / log.step))
        force = log.wrench[span, :3] - log.wrench[before, :3]
        sizes = np.linalg.norm(force, axis=1)
        at = int(sizes.argmax())
        return ContactEvent(
            start=float(log.t[span.start]), end=float(log.t[span.stop - 1]), link=self.link_of(told[span].max(axis=0)),
            peak=float(sizes[at]), peak_std=float(log.force_std(force, span)[at]),
            excess=float(out[top, 1]),
            torque=log.tau[top] - zero[top], fast=bool(out[span, 3].any()), open=bool(span.stop == log.n_t),
        )  # fmt: skip
