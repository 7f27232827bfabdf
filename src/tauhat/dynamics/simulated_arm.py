"""A torque model as something that moves: its parameters sorted into inertias, rotors and passive elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics import passive_kernel as element
from tauhat.dynamics.closed_loop_kernel import NO_BODY, RUNAWAY, leapfrog_kernel, runge_kutta_kernel
from tauhat.dynamics.forward import Masses, not_a_body
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import (
    INERTIAL_SYMBOLS,
    Asymmetric,
    Coulomb,
    Coupling,
    CouplingDahl,
    CubeRoot,
    Dahl,
    GasSpring,
    LoadCoulomb,
    LoadDahl,
    Offset,
    Parameter,
    PolynomialFriction,
    ShapedTerm,
    Spring,
    Stribeck,
    Term,
    Viscous,
    ViscousAsymmetry,
)
from tauhat.dynamics.terms.presliding import LENGTHS
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError, SimulationError

Integrator: TypeAlias = Literal["leapfrog", "runge-kutta"]
_KERNELS = {"leapfrog": leapfrog_kernel, "runge-kutta": runge_kutta_kernel}
_ROTOR = "Ia"
_DRY = 2  # parameters of a shared motor before those of dry friction
_COUPLED = (Coupling.key, CouplingDahl.key)
_SHARPEST = 1e-3  # [rad/s or m/s] width of a sign that the model takes as plain: none can be integrated
_TYPICAL_SPEED = 0.05  # [rad/s or m/s] the speed of a Stribeck curve before any is chosen

_ELEMENTS: Mapping[type[Term], tuple[int, ...]] = {
    Viscous: (element.VISCOUS,),
    Coulomb: (element.SIGN,),
    CubeRoot: (element.CUBE_ROOT,),
    ViscousAsymmetry: (element.SIZE,),
    Asymmetric: (element.FORWARDS, element.BACKWARDS, element.SIGN_FORWARDS, element.SIGN_BACKWARDS),
    Stribeck: (element.STRIBECK,),
    PolynomialFriction: (element.NARROW_SIGN, element.VISCOUS, element.SQUARE, element.CUBE, element.DECAY),
    Dahl: (element.DAHL, element.DAHL),
    LoadCoulomb: (element.LOAD_SIGN,),
    LoadDahl: (element.LOAD_DAHL,),
    Offset: (element.OFFSET,),
    Spring: (element.SPRING,),
    GasSpring: (element.GAS,),
}


class Gains(NamedTuple):
    """A tracking law as numbers, (n_v,) each: proportional, derivative, integral, largest torque."""

    kp: FloatArray
    kd: FloatArray
    ki: FloatArray
    limit: FloatArray


class Followed(NamedTuple):
    """What a law follows, (n_t, n_v) each: position, speed, and the torque it adds ahead."""

    q: FloatArray
    dq: FloatArray
    feedforward: FloatArray


class Stepping(NamedTuple):
    """How a motion is integrated.

    step : time between the samples [s]
    substeps : of the integrator in it
    hold : of these, for which the controller holds its torque; 0: it acts all the time
    integrator : the method
    delay : periods of the controller from a position to the torque that answers it, where torques are held
    """

    step: float
    substeps: int = 1
    hold: int = 0
    integrator: Integrator = "leapfrog"
    delay: int = 0


class Moved(NamedTuple):
    """A simulated motion in kernel layout, (n_v, n_t) each; tau is what the law asked for [Nm or N]."""

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatedArm:
    """Which parameter of a torque model plays which part in motion.

    model : the terms
    bodies : (n_i, 3) parameter, link, place among the ten of a link
    rotors : (n_r, 3) parameter, row and column of the rotor inertia
    shares : (n_r,) of the parameter there
    parameters : (n_e,) of the passive elements
    elements : (n_e,) with a weight of one
    """

    model: TorqueModel
    bodies: IntArray
    rotors: IntArray
    shares: FloatArray
    parameters: IntArray
    elements: NDArray[np.void]

    def masses(self, standard: FloatArray) -> Masses:
        """Return inertias and rotors, (n_v, n_v), of standard parameters (n_p,)."""
        n_v = self.model.robot.n_v
        inertia, rotor = np.zeros((n_v, 10)), np.zeros((n_v, n_v))
        np.add.at(inertia, (self.bodies[:, 1], self.bodies[:, 2]), standard[self.bodies[:, 0]])
        np.add.at(rotor, (self.rotors[:, 1], self.rotors[:, 2]), self.shares * standard[self.rotors[:, 0]])
        return Masses(inertia, rotor)

    def passive(self, standard: FloatArray) -> NDArray[np.void]:
        """Return the passive elements as their kernel reads them."""
        passive = self.elements.copy()
        passive["weight"] = standard[self.parameters]
        return passive


def simulated_arm(model: TorqueModel) -> SimulatedArm:
    """Return the model as something that moves.

    Raises
    ------
    ModelError
        when a term has no forward dynamics here, naming it.
    """
    driven = rotor_entries(model)
    of_rotors = {entry.parameter for entry in driven}
    bodies, places, elements = [], [], []
    for index, (term, place, parameter) in enumerate(_owned(model)):
        joint, symbol = parameter.joint, parameter.symbol
        if symbol in INERTIAL_SYMBOLS:
            bodies.append((index, joint, INERTIAL_SYMBOLS.index(symbol)))
        elif index not in of_rotors:
            places.append(index)
            elements.append(_element(term, place, joint, model.robot.n_v))
    return SimulatedArm(
        model=model,
        bodies=read_only(np.array(bodies, dtype=np.intp).reshape(-1, 3)),
        rotors=read_only(np.array([entry[:3] for entry in driven], dtype=np.intp).reshape(-1, 3)),
        shares=read_only(np.array([entry.share for entry in driven], dtype=np.float64)),
        parameters=read_only(np.array(places, dtype=np.intp)),
        elements=read_only(np.array(elements, dtype=element.ELEMENT)),
    )


class RotorEntry(NamedTuple):
    """Where a parameter stands in the matrix of rotor inertia, and how often."""

    parameter: int
    row: int
    column: int
    share: float


def rotor_entries(model: TorqueModel) -> tuple[RotorEntry, ...]:
    """Return the entries of the rotor inertia: one on the diagonal for each rotor, two beside it for a shared motor."""
    entries = []
    for index, (term, place, parameter) in enumerate(_owned(model)):
        if parameter.symbol == _ROTOR:
            entries.append(RotorEntry(index, parameter.joint, parameter.joint, 1.0))
        elif isinstance(term, Coupling) and place % _per_motor(term) == 0:
            own, other, ratio = term.motors[place // _per_motor(term)]
            entries += [RotorEntry(index, own, other, ratio), RotorEntry(index, other, own, ratio)]
    return tuple(entries)


def _owned(model: TorqueModel) -> list[tuple[Term, int, Parameter]]:
    """Return each parameter of the model with its term and its place there."""
    return [(term, *one) for term in model.terms for one in enumerate(term.parameters(model.robot))]


def _element(term: Term, place: int, joint: int, n_v: int) -> NDArray[np.void]:
    """Return the element of a term's parameter, with a weight of one."""
    made = np.zeros((), dtype=element.ELEMENT)
    made["weight"] = 1.0
    if isinstance(term, Coupling):
        _share(made, term, place)
        return made
    kinds = _kinds(term)
    made["kind"], made["joint"] = kinds[place % len(kinds)], joint
    made["shape"] = _shape(term, joint, place % len(kinds), n_v)
    if isinstance(term, GasSpring):
        d, k = term.distance, term.lever
        made["cylinder"] = d**2 + k**2, d * k, term.volume / term.area + d - k, term.angle
    return made


def _share(made: NDArray[np.void], term: Coupling, place: int) -> None:
    """Fill the element of a shared motor's friction."""
    number, own = divmod(place, _per_motor(term))
    motor = term.motors[number]
    made["joint"], made["other"], made["ratio"] = motor.own, motor.other, motor.ratio
    made["shape"] = 1.0
    if own == 1:
        made["kind"] = element.COUPLING
    elif isinstance(term, CouplingDahl):
        scale = _of_motor(term, number, term.scales, 1.0)
        made["kind"], made["shape"] = element.DAHL, scale * LENGTHS[own - _DRY]
    else:
        made["kind"], made["shape"] = element.SIGN, _of_motor(term, number, term.widths, _SHARPEST)


def _of_motor(term: Coupling, number: int, shapes: tuple[float, ...], typical: float) -> float:
    if shapes and len(shapes) != len(term.motors):
        raise ModelError(f"term {term.key}: shapes", expected=f"{len(term.motors)} values", got=len(shapes))
    return shapes[number] if shapes else typical


def _per_motor(term: Coupling) -> int:
    """Return how many parameters a shared motor has: inertia, viscous friction, then dry ones."""
    return _DRY + len(term.frictions)


def _kinds(term: Term) -> tuple[int, ...]:
    if type(term) not in _ELEMENTS:
        raise ModelError(
            f"term {term.key} cannot be simulated",
            expected=", ".join(("inertia", "rotor", *_COUPLED, *(kind.key for kind in _ELEMENTS))),
            remedy="leave it out of the model, or take an estimator that does not simulate, as wls",
        )
    return _ELEMENTS[type(term)]


def _shape(term: Term, joint: int, own: int, n_v: int) -> float:
    if isinstance(term, Dahl):
        return float(term.chosen(n_v, 1.0)[joint, 0]) * LENGTHS[own]
    if isinstance(term, LoadDahl):
        return LENGTHS[0]
    if isinstance(term, Coulomb | Asymmetric | LoadCoulomb):
        return float(term.chosen(n_v, _SHARPEST)[joint, 0])
    return float(term.chosen(n_v, _TYPICAL_SPEED)[joint, 0]) if isinstance(term, ShapedTerm) else 1.0


def follow(
    arm: SimulatedArm,
    standard: FloatArray,
    reference: Followed,
    *,
    gains: Gains,
    start: FloatArray,
    stepping: Stepping,
) -> Moved:
    """Return how the arm moves under the law.

    Parameters
    ----------
    standard : (n_p,) standard parameters; base parameters do as well, the regrouped ones zero
    start : (2, n_v) position and speed at the first sample

    Raises
    ------
    ModelError
        when the mass matrix is not positive definite on the way.
    SimulationError
        when a joint runs away.
    """
    n_t, n_v = reference.q.shape
    out = np.empty((4, n_v, n_t))
    body = (kernel_tree(arm.model.robot).links, *arm.masses(standard), arm.passive(standard))
    times = (stepping.step, stepping.substeps, stepping.hold, stepping.delay if stepping.hold else 0)
    task = (tuple(gains), tuple(reference), times)
    kernel: Callable[..., tuple[int, int, int]] = _KERNELS[stepping.integrator]
    code, sample, joint = kernel(body, task, start, out)
    where = f"t = {sample * stepping.step:.4g} s"
    if code == NO_BODY:
        raise not_a_body(arm.model.robot, joint, where)
    if code:
        raise SimulationError(
            "the simulated robot went unstable",
            where=f"joint {arm.model.robot.joint_names[joint]}, {where}",
            got=f"a speed above {RUNAWAY:g}",
            remedy="the law's gains do not suit these parameters: check gains and their units, or shorten the step",
        )
    return Moved(*out)
