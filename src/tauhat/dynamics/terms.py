"""Terms: physical effects that add to a joint's torque and are linear in their parameters.

A term tells which parameters it owns (`parameters`), which of them each joint's torque depends on (`support`), and the
regressor columns along a stretch of motion (`columns`). Columns may be pointwise, stateful (they carry a state from one
stretch of a recording to the next) or iterated (they read `Motion.load`, the torque of a previous pass).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.adjoint_kernel import adjoint_kernel
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.rigid_body import inertial_columns
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot

INERTIAL_SYMBOLS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
INERTIAL_UNITS = ("kg", *("kg m",) * 3, *("kg m^2",) * 6)
WIDTHS = (1e-4, 1e-3, 3e-3, 1e-2, 2e-2, 4e-2)  # of the smooth sign, in parts of the top speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number of a torque model.

    symbol : the field's letter, e.g. Ixx or Fv
    joint : index of the joint or link it describes
    unit : SI, joint side of the gear
    lower : smallest physically possible value
    """

    symbol: str
    joint: int
    unit: str
    lower: float = -np.inf

    @property
    def name(self) -> str:
        """Symbol and joint number, counted from one: Ixx_3."""
        return f"{self.symbol}_{self.joint + 1}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Term(ABC):
    """A physical effect, linear in its parameters."""

    key: ClassVar[str]
    stateful: ClassVar[bool] = False
    iterated: ClassVar[bool] = False

    @abstractmethod
    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return the term's parameters on this robot, in order."""

    @abstractmethod
    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the indices of the term's parameters that load it."""

    @abstractmethod
    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return for each joint the columns of its support, (n_support, n_t), and the state behind the last sample.

        `state` is None at the start of a recording and for pointwise terms.
        """

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to `gradient` what the sensitivities `bars` of the term's columns say about the motion.

        Parameters
        ----------
        bars : for each joint df/d(columns of its support), (n_support, n_t)

        Raises
        ------
        ModelError
            when the term's columns have no gradient.
        """
        raise ModelError(
            f"the columns of term {self.key} have no gradient", remedy="leave it out of the motion's design"
        )

    def candidates(self, top_speeds: FloatArray) -> tuple[Term, ...]:
        """Return the forms of the term among which the fit on the recordings decides; most terms have one.

        Parameters
        ----------
        top_speeds : (n_v,) largest speed of each joint in the recordings [rad/s or m/s]
        """
        return (self,)


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertia(Term):
    """Rigid links with gravity: ten standard parameters a link.

    Source: Atkeson, An, Hollerbach 1986.
    """

    key: ClassVar[str] = "inertia"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return `m, mx, ..., Izz` of every link."""
        symbols = tuple(zip(INERTIAL_SYMBOLS, INERTIAL_UNITS, strict=True))
        return tuple(
            Parameter(
                symbol=symbol, joint=link, unit=unit, lower=0.0 if symbol in {"m", "Ixx", "Iyy", "Izz"} else -np.inf
            )
            for link in range(robot.n_v)
            for symbol, unit in symbols
        )

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the parameters of the links that move with it."""
        return tuple(
            np.concatenate([np.arange(10 * link, 10 * link + 10) for link in robot.subtree(joint)])
            for joint in range(robot.n_v)
        )

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the regressor's rows joint by joint; pointwise."""
        whole = inertial_columns(kernel_tree(robot), motion)
        support = self.support(robot)
        return tuple(_rows(whole[:, joint], support[joint]) for joint in range(robot.n_v)), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add the adjoint of the regressor."""
        whole = np.zeros((10 * robot.n_v, robot.n_v, motion.n_t))
        for joint, (rows, bar) in enumerate(zip(self.support(robot), bars, strict=True)):
            whole[rows, joint] = bar
        adjoint_kernel(*kernel_tree(robot).geometry, motion.q, motion.dq, motion.ddq, whole, *gradient)


def _rows(columns: FloatArray, rows: IntArray) -> FloatArray:
    """Return the rows as a view where they are contiguous, which they are on a serial arm."""
    if rows.size == rows[-1] - rows[0] + 1:
        return columns[rows[0] : rows[-1] + 1]
    return columns[rows]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTerm(Term):
    """A term with one parameter a joint that loads this joint alone."""

    symbol: ClassVar[str]
    smallest: ClassVar[float] = -np.inf

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return one parameter a joint."""
        return tuple(
            Parameter(symbol=self.symbol, joint=index, unit=self.unit(joint), lower=self.smallest)
            for index, joint in enumerate(robot.joints)
        )

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return each joint's own parameter."""
        return tuple(np.array([joint]) for joint in range(robot.n_v))

    @abstractmethod
    def unit(self, joint: Joint) -> str:
        """Return the parameter's unit on this joint."""


def _own(values: FloatArray) -> tuple[FloatArray, ...]:
    return tuple(values[joint : joint + 1] for joint in range(values.shape[0]))


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorInertia(JointTerm):
    """Inertia of the motor's rotor, reflected to the joint side: `Ia ddq`."""

    key: ClassVar[str] = "rotor"
    symbol: ClassVar[str] = "Ia"
    smallest: ClassVar[float] = 0.0

    def unit(self, joint: Joint) -> str:
        """Return kg m^2, or kg on a prismatic joint."""
        return "kg m^2" if joint.kind == "revolute" else "kg"

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return ddq; pointwise."""
        return _own(motion.ddq), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of ddq."""
        gradient.ddq[:] += np.concatenate(bars)


@dataclass(frozen=True, slots=True, kw_only=True)
class Viscous(JointTerm):
    """Viscous friction: `Fv dq`."""

    key: ClassVar[str] = "viscous"
    symbol: ClassVar[str] = "Fv"
    smallest: ClassVar[float] = 0.0

    def unit(self, joint: Joint) -> str:
        """Return torque over speed."""
        return "Nm s/rad" if joint.kind == "revolute" else "N s/m"

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return dq; pointwise."""
        return _own(motion.dq), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of dq."""
        gradient.dq[:] += np.concatenate(bars)


@dataclass(frozen=True, slots=True, kw_only=True)
class Coulomb(JointTerm):
    """Coulomb friction with a smooth sign: `Fc tanh(dq / width)`.

    Near zero speed the sign of a measured velocity is noise, and a column of noise biases every estimate. The sign is
    therefore smoothed over a width, a small part of each joint's top speed. Which part is chosen by the residual on the
    recordings that are fitted (`candidates`): from practically the plain sign to four hundredths. On eight real robots
    this predicted better than the plain sign, and far better than a sign that is held at rest.

    widths : per joint [rad/s or m/s]; empty until chosen, and then the plain sign is taken
    """

    key: ClassVar[str] = "coulomb"
    symbol: ClassVar[str] = "Fc"
    smallest: ClassVar[float] = 0.0
    widths: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "widths", tuple(float(width) for width in self.widths))
        if any(not 0.0 < width < np.inf for width in self.widths):
            raise ModelError("the widths of the smooth sign must be positive", got=self.widths)

    def unit(self, joint: Joint) -> str:
        """Return the unit of the joint's torque."""
        return joint.effort_unit

    def candidates(self, top_speeds: FloatArray) -> tuple[Term, ...]:
        """Return the term with widths of 1e-4 to 0.04 of the top speeds; given widths stay."""
        if self.widths:
            return (self,)
        tops = np.where(top_speeds > 0, top_speeds, 1.0)
        return tuple(Coulomb(widths=tuple((part * tops).tolist())) for part in WIDTHS)

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the smooth sign of dq; pointwise."""
        if not self.widths:
            return _own(np.sign(motion.dq)), state
        if len(self.widths) != robot.n_v:
            raise ModelError("one width a joint is needed", expected=robot.n_v, got=len(self.widths))
        return _own(np.tanh(motion.dq / np.array(self.widths)[:, None])), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of dq; the plain sign has none."""
        if self.widths:
            widths = np.array(self.widths)[:, None]
            gradient.dq[:] += np.concatenate(bars) / (widths * np.cosh(np.clip(motion.dq / widths, -300.0, 300.0)) ** 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Offset(JointTerm):
    """A constant torque a joint: amplifier offset, cable pull, a badly zeroed current sensor."""

    key: ClassVar[str] = "offset"
    symbol: ClassVar[str] = "To"

    def unit(self, joint: Joint) -> str:
        """Return the unit of the joint's torque."""
        return joint.effort_unit

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return ones; pointwise."""
        return _own(np.ones_like(motion.q)), state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add nothing: a constant does not depend on the motion."""
