"""External joint torque with its error, sample by sample or along a recording, by any of the observers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import SensingError
from tauhat.sensing.causal_filter import CausalFilter
from tauhat.sensing.observer_kernel import ROWS, SCRATCH, observe
from tauhat.sensing.observers import HeatPlan, MomentumObserver, Observer
from tauhat.sensing.sensed_model import SensedModel
from tauhat.sensing.thermal_kernel import SAID, VARIANCE, WARMTH

_OUT = 5
_SAID = {None: 0.0, True: 1.0, False: -1.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class BristleDoubt:
    """What is not known of friction that remembers its displacement: variances of its states, which are in -1 to 1.

    start : before the joint has moved; 1/3 is that of any state
    turned : at least, behind a reversal
    slid : after a long way
    """

    start: float = 1.0 / 3.0
    turned: float = 0.04
    slid: float = 0.0025

    def __post_init__(self) -> None:
        if not all(0.0 <= value <= 1.0 for value in (self.start, self.turned, self.slid)):
            raise SensingError("doubt of bristles", expected="variances from 0 to 1", got=(self.start, self.turned))


class ObserverMemory(NamedTuple):
    """What an observer remembers between samples: joint by joint (ROWS, n_v), and states of bristles (3, n)."""

    rows: FloatArray
    bent: FloatArray


class SensedTorque(NamedTuple):
    """External torque of one sample or of many, (n_v,) or (n_t, n_v).

    tau : what the environment adds [Nm or N]
    variance : of tau, joint by joint
    q, dq : filtered position and velocity to which it belongs
    raw : the mean external torque since the sample before, not smoothed
    """

    tau: FloatArray
    variance: FloatArray
    q: FloatArray
    dq: FloatArray
    raw: FloatArray


class SensedWarmth(NamedTuple):
    """Warmth of the joints of one sample or of many, (n_v,) or (n_t, n_v), and its variance.

    Zero where the fitted recording began, one what a joint's typical speed would bring (`dynamics.thermal_kernel`); by
    the observer `refresh` the part by which friction is larger than fitted.
    """

    theta: FloatArray
    variance: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueObserver:
    """A model, an observer and a sample rate: pure steps, and the same along a recording.

    model : what the estimate knows
    step : time between samples [s]
    observer : the smoother; the momentum observer at 20 1/s by default
    cutoff : of the filter that position and torque share [Hz]
    """

    model: SensedModel
    step: float
    observer: Observer = field(default_factory=MomentumObserver)
    cutoff: float = 10.0
    doubt: BristleDoubt = field(default_factory=BristleDoubt)
    _plan: tuple[FloatArray, FloatArray, FloatArray, FloatArray, HeatPlan] = field(init=False, repr=False)
    _body: tuple[NDArray[Any], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        numbers = CausalFilter(cutoff=self.cutoff, step=self.step).numbers
        gains = read_only(self.observer.gains(self.model, self.step))
        doubt = self.doubt
        rest = read_only(np.array([self.observer.kind, self.step, doubt.start, doubt.turned, doubt.slid]))
        object.__setattr__(self, "_body", self.model.body())
        errors = read_only(np.stack([self.model.rms, self.model.stretch]))
        heat = self.observer.heat(self.model, self.step)
        object.__setattr__(self, "_plan", (numbers, gains, errors, rest, heat))

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.model.n_v

    @property
    def parts(self) -> tuple[Any, Any]:
        """Body and plan, as the kernel `observe` takes them."""
        return self._body, self._plan

    def start(self) -> ObserverMemory:
        """Return the memory before the first sample."""
        return ObserverMemory(np.full((ROWS, self.n_v), np.nan), np.zeros((3, self.model.bristles.size)))

    def advance(
        self, memory: ObserverMemory, q: FloatArray, tau: FloatArray, *, free: bool | None = None
    ) -> tuple[ObserverMemory, SensedTorque]:
        """Return the memory behind a sample and the external torque, (n_v,).

        Parameters
        ----------
        q, tau : (n_v,) position and motor torque, joint side, as measured [rad or m, Nm or N]
        free : whether nothing touches the arm, for an observer that learns then; its own rule decides by default

        Raises
        ------
        SensingError
            when the observer needs a mass matrix of a body, and the model has none here.
        """
        after = ObserverMemory(memory.rows.copy(), memory.bent.copy())
        after.rows[SAID] = _SAID[free]
        sample, out = np.stack([q, tau]), np.empty((_OUT, self.n_v))
        if not observe(self._body, self._plan, sample, (*after, *_scratch(self.n_v)), out):
            raise self.observer.no_body()
        return after, SensedTorque(*out)

    def warmth(self, memory: ObserverMemory) -> SensedWarmth:
        """Return the warmth of the joints behind a sample; nan by an observer that follows none."""
        return SensedWarmth(memory.rows[WARMTH].copy(), memory.rows[VARIANCE].copy())

    def along(self, q: FloatArray, tau: FloatArray, *, free: NDArray[np.bool_] | None = None) -> SensedTorque:
        """Return the external torque along consecutive samples, (n_t, n_v); causal: a row knows none after it.

        Parameters
        ----------
        q, tau : (n_t, n_v) `step` seconds apart
        free : (n_t,) as in `advance`

        Raises
        ------
        SensingError
            as `advance`.
        """
        out, _ = self._along(q, tau, free)
        return SensedTorque(*(np.ascontiguousarray(out[:, index]) for index in range(_OUT)))

    def warmth_along(self, q: FloatArray, tau: FloatArray, *, free: NDArray[np.bool_] | None = None) -> SensedWarmth:
        """Return the warmth of the joints behind each of consecutive samples; parameters as `along`.

        Raises
        ------
        SensingError
            as `advance`, and when the observer follows no warmth.
        """
        self.observer.check_follows_warmth()
        _, warm = self._along(q, tau, free)
        return SensedWarmth(np.ascontiguousarray(warm[:, 0]), np.ascontiguousarray(warm[:, 1]))

    def _along(self, q: FloatArray, tau: FloatArray, free: NDArray[np.bool_] | None) -> tuple[FloatArray, FloatArray]:
        """Return what the kernel fills, (n_t, 5, n_v), and warmth and variance behind it, (n_t, 2, n_v)."""
        position = frozen("q", q, (None, self.n_v), where="sensing")
        torque = frozen("tau", tau, (len(position), self.n_v), where="sensing")
        out, warm = np.empty((len(position), _OUT, self.n_v)), np.empty((len(position), 2, self.n_v))
        memory, samples = self.start(), (position, torque, _said(free, len(position)))
        if not _observe_along(self._body, self._plan, samples, (*memory, *_scratch(self.n_v)), (out, warm)):
            raise self.observer.no_body()
        return out, warm


def _scratch(n_v: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    return np.empty((SCRATCH, n_v)), np.empty(40 * n_v), np.empty((n_v, n_v))


def _said(free: NDArray[np.bool_] | None, n_t: int) -> FloatArray:
    """Return what the caller says of contact, as `thermal_kernel` has it, (n_t,)."""
    if free is None:
        return np.zeros(n_t)
    flags = np.asarray(free)
    if flags.dtype != np.bool_ or flags.shape != (n_t,):
        raise SensingError(
            "samples that are free", expected=f"{n_t} of true or false", got=f"{flags.shape} of {flags.dtype}"
        )
    return np.where(flags, 1.0, -1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _observe_along(body, plan, samples, memory, filled):  # type: ignore[no-untyped-def]
    rows, sample = memory[0], np.empty((2, memory[0].shape[1]))
    out, warm = filled
    for k in range(out.shape[0]):
        sample[0], sample[1] = samples[0][k], samples[1][k]
        rows[SAID] = samples[2][k]
        if not observe(body, plan, sample, memory, out[k]):
            return False
        warm[k, 0], warm[k, 1] = rows[WARMTH], rows[VARIANCE]
    return True
