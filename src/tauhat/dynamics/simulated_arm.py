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
    CubeRoot,
    Dahl,
    LoadCoulomb,
    LoadDahl,
    Offset,
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
    rotors : (n_r, 2) parameter, joint
    elements : (n_e, 3) parameter, kind, joint of the passive elements
    shapes : (n_e,) of the elements
    """

    model: TorqueModel
    bodies: IntArray
    rotors: IntArray
    elements: IntArray
    shapes: FloatArray

    def masses(self, standard: FloatArray) -> Masses:
        """Return inertias and rotors of standard parameters (n_p,)."""
        n_v = self.model.robot.n_v
        inertia, rotor = np.zeros((n_v, 10)), np.zeros(n_v)
        np.add.at(inertia, (self.bodies[:, 1], self.bodies[:, 2]), standard[self.bodies[:, 0]])
        np.add.at(rotor, self.rotors[:, 1], standard[self.rotors[:, 0]])
        return Masses(inertia, rotor)

    def passive(self, standard: FloatArray) -> NDArray[np.void]:
        """Return the passive elements as their kernel reads them."""
        passive = np.empty(self.shapes.size, dtype=element.ELEMENT)
        passive["kind"], passive["joint"] = self.elements[:, 1], self.elements[:, 2]
        passive["shape"], passive["weight"] = self.shapes, standard[self.elements[:, 0]]
        return passive


def simulated_arm(model: TorqueModel) -> SimulatedArm:
    """Return the model as something that moves.

    Raises
    ------
    ModelError
        when a term has no forward dynamics here, naming it.
    """
    bodies, rotors, elements, shapes = [], [], [], []
    first, n_v = 0, model.robot.n_v
    for term in model.terms:
        parameters = term.parameters(model.robot)
        for place, parameter in enumerate(parameters):
            index, joint, symbol = first + place, parameter.joint, parameter.symbol
            if symbol in INERTIAL_SYMBOLS:
                bodies.append((index, joint, INERTIAL_SYMBOLS.index(symbol)))
                continue
            if symbol == _ROTOR:
                rotors.append((index, joint))
                continue
            kinds = _kinds(term)
            elements.append((index, kinds[place % len(kinds)], joint))
            shapes.append(_shape(term, joint, place % len(kinds), n_v))
        first += len(parameters)
    return SimulatedArm(
        model=model,
        bodies=read_only(np.array(bodies, dtype=np.intp).reshape(-1, 3)),
        rotors=read_only(np.array(rotors, dtype=np.intp).reshape(-1, 2)),
        elements=read_only(np.array(elements, dtype=np.intp).reshape(-1, 3)),
        shapes=read_only(np.array(shapes, dtype=np.float64)),
    )


def _kinds(term: Term) -> tuple[int, ...]:
    if type(term) not in _ELEMENTS:
        raise ModelError(
            f"term {term.key} cannot be simulated",
            expected=", ".join(("inertia", "rotor", *(kind.key for kind in _ELEMENTS))),
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
