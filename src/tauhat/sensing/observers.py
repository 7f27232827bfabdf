"""Observers of external torque: how fast each answers, as the numbers that one kernel reads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.terms.presliding import LENGTHS
from tauhat.errors import SensingError
from tauhat.robots.naming import advice_on_name
from tauhat.sensing import observer_kernel as kernel
from tauhat.sensing.own_friction import own_friction
from tauhat.sensing.sensed_model import SensedModel

N_GAINS = 4
# Half of a step comes through after ln 2 / K at first order, after 1.678 / K with two eigenvalues at -K, and after
# 1.43 / w for a Butterworth pair: one gain means one response time, whatever the observer.
_SECOND_ORDER = 1.678 / np.log(2.0)
_BUTTERWORTH = 1.43 / np.log(2.0)
_CRITICAL = 1.5  # k1 of the super-twisting law in parts of the root of k2


HeatPlan: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""Numbers of the joints, slopes of friction, slow speeds and settings, as `thermal_kernel` reads them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer(ABC):
    """A smoother of the external torque.

    gain : [1/s] half of a step of torque comes through after `ln 2 / gain`, beside the delay of the filter
    """

    key: ClassVar[str]
    kind: ClassVar[int]
    gain: float = 20.0

    def __post_init__(self) -> None:
        if not 0.0 < self.gain < np.inf:
            raise SensingError("gain of an observer", where=self.key, expected="above zero", got=f"{self.gain} 1/s")

    @property
    def lag(self) -> float:
        """Mean delay of a smooth external torque beside that of the filter [s]."""
        return 1.0 / self.gain

    def gains(self, model: SensedModel, step: float) -> FloatArray:
        """Return what the kernel reads, (n_v, 4), for samples `step` seconds apart."""
        gains = np.zeros((model.n_v, N_GAINS))
        own = self._own(model, step)
        gains[:, : own.shape[-1]] = own
        return gains

    def heat(self, model: SensedModel, step: float) -> HeatPlan:  # noqa: ARG002
        """Return what `thermal_kernel` reads where the observer follows the warmth of the joints; else empty."""
        return read_only(np.zeros((0, 5))), read_only(np.zeros((0, 2))), read_only(np.zeros(0)), read_only(np.zeros(0))

    def check_follows_warmth(self) -> None:
        """Pass where the observer follows the warmth of the joints.

        Raises
        ------
        SensingError
            when it follows none.
        """
        if self.kind != kernel.THERMAL:
            raise SensingError("the observer follows no warmth", expected="thermal", got=self.key)

    def no_body(self) -> SensingError:
        """Return the refusal of a mass matrix that the observer needs and that is of no body."""
        return SensingError(
            "the mass matrix of the estimate is that of no body", where=f"observer {self.key}",
            remedy="take another observer, or identify with --physical",
        )  # fmt: skip

    @abstractmethod
    def _own(self, model: SensedModel, step: float) -> FloatArray:
        """Return the observer's numbers, (n,) for all joints or (n_v, n)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InverseDynamicsObserver(Observer):
    """The model's torque less the measured one, with filtered accelerations, behind a filter of first order."""

    key: ClassVar[str] = "inverse-dynamics"
    kind: ClassVar[int] = kernel.INVERSE

    def _own(self, model: SensedModel, step: float) -> FloatArray:  # noqa: ARG002
        return np.array([np.exp(-self.gain * step)])


@dataclass(frozen=True, slots=True, kw_only=True)
class MomentumObserver(Observer):
    """The generalised momentum observer of first order: no accelerations.

    Source: De Luca, Mattone, "Actuator failure detection and isolation using generalized momenta", 2003.
    """

    key: ClassVar[str] = "momentum"
    kind: ClassVar[int] = kernel.FIRST

    def _own(self, model: SensedModel, step: float) -> FloatArray:  # noqa: ARG002
        return np.array([np.exp(-self.gain * step)])


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOrderMomentumObserver(Observer):
    """The generalised momentum observer of second order: smoother for the same response time."""

    key: ClassVar[str] = "momentum-2"
    kind: ClassVar[int] = kernel.SECOND

    @property
    def lag(self) -> float:
        """Mean delay of a smooth external torque beside that of the filter [s]."""
        return float(2.0 / (_SECOND_ORDER * self.gain))

    def _own(self, model: SensedModel, step: float) -> FloatArray:  # noqa: ARG002
        pole = _SECOND_ORDER * self.gain
        return np.asarray(expm(step * np.array([[0.0, 1.0], [-(pole**2), -2.0 * pole]])).ravel())


@dataclass(frozen=True, slots=True, kw_only=True)
class SlidingModeObserver(Observer):
    """Super-twisting on the momentum, discretised implicitly so that it does not chatter, then filtered.

    Source: Garofalo, Mansfeld, Jankowski, Ott, "Sliding mode momentum observers for estimation of external torques and
    joint acceleration", 2019.

    rate : how fast an external torque may change, in parts of the joint's largest a second [1/s]
    """

    key: ClassVar[str] = "sliding-mode"
    kind: ClassVar[int] = kernel.SLIDING
    rate: float = 20.0

    def _own(self, model: SensedModel, step: float) -> FloatArray:
        largest = self.rate * model.strength
        kept = np.full(model.n_v, np.exp(-self.gain * step))
        return np.stack([_CRITICAL * np.sqrt(largest), largest, kept], axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class DisturbanceObserver(Observer):
    """The nonlinear disturbance observer; its answer follows the mass matrix of the moment.

    `gain` is the rate of a joint that is coupled to no other; directions in which joints move together answer faster,
    others down to n_v times more slowly.

    Source: Mohammadi, Tavakoli, Marquez, Hashemzadeh, "Nonlinear disturbance observer design for robotic
    manipulators", 2013.
    """

    key: ClassVar[str] = "disturbance"
    kind: ClassVar[int] = kernel.DISTURBANCE

    def _own(self, model: SensedModel, step: float) -> FloatArray:  # noqa: ARG002
        return np.asarray(self.gain * model.typical_inertia[:, None])


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanObserver(Observer):
    """A Kalman filter on the momentum with a random walk as disturbance, in its steady state.

    The ratio of its noises follows from the response time: both poles of the continuous filter are a Butterworth pair.

    Source: Wahrburg, Boes, Listmann, Dai, Matthias, Ding, "Motor-current-based estimation of Cartesian contact forces
    and torques for robotic manipulators and its application to force control", 2018.
    """

    key: ClassVar[str] = "kalman"
    kind: ClassVar[int] = kernel.KALMAN

    @property
    def lag(self) -> float:
        """Mean delay of a smooth external torque beside that of the filter [s]."""
        return float(np.sqrt(2.0) / (_BUTTERWORTH * self.gain))

    def _own(self, model: SensedModel, step: float) -> FloatArray:  # noqa: ARG002
        moving = np.array([[1.0, step], [0.0, 1.0]])
        ratio = (_BUTTERWORTH * self.gain) ** 4 * step
        noise = ratio * np.array([[step**2 / 3.0, step / 2.0], [step / 2.0, 1.0]]) * step
        covariance = solve_discrete_are(moving.T, np.array([[1.0], [0.0]]), noise, np.eye(1))
        kept = covariance[:, 0] / (covariance[0, 0] + 1.0)
        return np.asarray(kept)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionObserver(MomentumObserver):
    """The momentum observer with a state of every joint's friction beside it, and what is not known of it in the error.

    The state is corrected by the external torque while nothing touches the arm and the joint moves, and left alone in
    contact. Its variance widens that of the torque.

    start, spread : state at the first sample and its standard deviation
    wander : standard deviation of the state's model, in a long time without correction
    correlation : time over which errors of the model are alike [s]
    limit : standard deviations of external torque within which the arm counts as free
    hold : how long, before the state is corrected [s]
    """

    kind: ClassVar[int] = kernel.THERMAL
    start: float
    spread: float
    wander: float
    correlation: float = 1.0
    limit: float = 3.0
    hold: float = 0.5

    def __post_init__(self) -> None:
        super(FrictionObserver, self).__post_init__()
        for name in ("spread", "wander", "correlation", "limit", "hold"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise SensingError(f"{name} of an observer", where=self.key, expected="above zero", got=value)
        if not np.isfinite(self.start):
            raise SensingError("start of an observer", where=self.key, expected="a number", got=self.start)

    def _settings(self, step: float) -> FloatArray:
        """Return the settings that `thermal_kernel` reads."""
        alike = max(1.0, 2.0 * self.correlation / step)
        settings = [self.start, self.spread**2, self.wander**2, alike, self.limit, self.hold, step, LENGTHS[0]]
        return read_only(np.array(settings))


@dataclass(frozen=True, slots=True, kw_only=True)
class ThermalObserver(FrictionObserver):
    """Friction that warms up: the state is the warmth of the joint, heated by the model's friction.

    Needs an estimate with a thermal term. A warmth of 1 is what a joint's typical speed would bring.
    """

    key: ClassVar[str] = "thermal"
    start: float = 0.5
    spread: float = 0.7
    wander: float = 0.15

    def heat(self, model: SensedModel, step: float) -> HeatPlan:
        """Return what `thermal_kernel` reads.

        Raises
        ------
        SensingError
            when the model's friction does not warm up.
        """
        if model.heat is None:
            raise SensingError(
                "the estimate does not know how friction warms up", where=f"observer {self.key}",
                expected="one with the term thermal",
                remedy="identify a warm-up recording with --model plain,thermal, or take another observer",
            )  # fmt: skip
        return read_only(model.heat.numbers(step)), model.heat.slopes, model.slow, self._settings(step)


@dataclass(frozen=True, slots=True, kw_only=True)
class RefreshObserver(FrictionObserver):
    """Friction that changes slowly for reasons nobody knows: the state is the part by which it is larger than fitted.

    For estimates without a thermal term. Dry and viscous friction grow and shrink together; the part fades to zero with
    the time constant `time`, over a gap to `start`, and wanders by `wander` meanwhile.

    time : over which friction may have changed [s]
    """

    key: ClassVar[str] = "refresh"
    start: float = 0.0
    spread: float = 0.4
    wander: float = 0.4
    time: float = 600.0

    def __post_init__(self) -> None:
        super(RefreshObserver, self).__post_init__()
        if not 0.0 < self.time < np.inf:
            raise SensingError("time of an observer", where=self.key, expected="above zero", got=f"{self.time} s")

    def heat(self, model: SensedModel, step: float) -> HeatPlan:
        """Return what `thermal_kernel` reads: a state that nothing heats, and the friction it is a part of."""
        numbers = np.zeros((model.n_v, 5))
        numbers[:, 0] = np.exp(-step / self.time)
        return read_only(numbers), own_friction(model), model.slow, self._settings(step)


OBSERVERS: Mapping[str, type[Observer]] = {
    kind.key: kind
    for kind in (
        MomentumObserver,
        SecondOrderMomentumObserver,
        InverseDynamicsObserver,
        SlidingModeObserver,
        DisturbanceObserver,
        KalmanObserver,
        ThermalObserver,
        RefreshObserver,
    )
}
"""All observers by name; the first is the default."""


def observer_named(name: str, *, gain: float | None = None) -> Observer:
    """Return the observer of this name, with another gain [1/s] if given.

    Raises
    ------
    SensingError
        when there is none, or the gain is not positive.
    """
    if name not in OBSERVERS:
        raise SensingError(
            "unknown observer", expected=", ".join(OBSERVERS), got=name[:60], remedy=advice_on_name(name, OBSERVERS)
        )
    return OBSERVERS[name]() if gain is None else OBSERVERS[name](gain=gain)
