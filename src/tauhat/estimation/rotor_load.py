"""Rotor inertia that the links have taken over, and which yet is no load on the gear.

The column of a rotor, `ddq_j`, is often a sum of the links' columns, and always on a first joint: a fit then finds
rotor and links in one number, in the name of a link. That makes no difference to the torque, but it does to the load:
what the rotor takes never passes through the gear. With a the part of that number which is the rotor's,
    load_j = |tau_links - a ddq_j|
Friction in proportion to the load bends with a, and so tells what the torque of rigid bodies alone cannot. To first
order a is one more unknown with the column `Fl_j d(load_j s)/da`, as a shape of a term is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, LoadCoulomb, LoadDahl, Parameter, Term
from tauhat.robots.robot import Robot

_ROTOR = "Ia"
_MOMENTS = frozenset({"m", "Ixx", "Iyy", "Izz"})  # what no body has less of than nothing
_PART = 1e-3  # of the largest weight: smaller ones are rounding, and bound nothing
_STEP = 0.05  # of the whole number, in the difference quotient


class HiddenRotor(NamedTuple):
    """A rotor in the number of a link.

    joint : that it drives
    column : its place among the regrouped parameters of the base set
    most : the largest inertia it can have [kg m^2 or kg]; the links then have none
    """

    joint: int
    column: int
    most: float


def hidden_rotors(model: TorqueModel, base: BaseParameters, values: FloatArray) -> tuple[HiddenRotor, ...]:
    """Return the rotors that are regrouped into links, on the joints whose friction grows with the load.

    Parameters
    ----------
    values : (n_b,) base parameters
    """
    term = load_term(model)
    if term is None or not term.inertia:
        return ()
    loaded = set(term.present(model.robot).tolist())
    parameters = model.parameters
    bounded = np.array([parameters[index].symbol in _MOMENTS for index in base.independent])
    found = []
    for column, (index, weights) in enumerate(zip(base.dependent, base.regrouping.T, strict=True)):
        rotor = parameters[index]
        bounds = bounded & (weights > _PART * np.abs(weights).max())
        if rotor.symbol != _ROTOR or rotor.joint not in loaded or not bounds.any():
            continue
        most = float(np.min(values[bounds] / weights[bounds]))
        if most > 0.0:
            found.append(HiddenRotor(rotor.joint, column, most))
    return tuple(found)


def load_term(model: TorqueModel) -> LoadCoulomb | LoadDahl | None:
    """Return the model's friction that grows with the load, or None."""
    return next((term for term in model.terms if isinstance(term, LoadCoulomb | LoadDahl)), None)


def with_rotors(model: TorqueModel, rotors: FloatArray) -> TorqueModel:
    """Return the model whose load friction has these rotors (n_v,) taken off its load."""
    term = load_term(model)
    return model if term is None else model.with_term(replace(term, rotors=tuple(rotors.tolist())))


def standard_with_rotors(model: TorqueModel, base: BaseParameters, values: FloatArray) -> FloatArray:
    """Return standard parameters (n_p,) that move as the base parameters (n_b,) do, and load the gears as the model's.

    Regrouped rotors are those that the load was made with, taken off the links; other regrouped parameters are zero.
    """
    term, parameters = load_term(model), model.parameters
    rotors = term.rotors if term is not None and term.rotors else (0.0,) * model.robot.n_v
    standard = np.zeros(len(base.names))
    standard[base.independent] = values
    for index, weights in zip(base.dependent, base.regrouping.T, strict=True):
        if parameters[index].symbol == _ROTOR:
            standard[index] = rotors[parameters[index].joint]
            standard[base.independent] -= standard[index] * weights
    return standard


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorLoad(Term):
    """The derivative of load friction by the rotors' parts of the regrouped numbers, one parameter a rotor.

    term : friction with the inertia that is its load
    joints : of the rotors
    coefficients : Fl on each of them
    change : (10 n_v,) of the inertia when every rotor takes the whole of its number
    """

    key: ClassVar[str] = "rotor-load"
    stateful: ClassVar[bool] = True
    term: LoadCoulomb | LoadDahl
    joints: tuple[int, ...]
    coefficients: tuple[float, ...]
    change: tuple[float, ...]

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:  # noqa: ARG002
        """Return one parameter a rotor: by how much more of the number is its own."""
        return tuple(Parameter(symbol="part", joint=joint, unit="1") for joint in self.joints)

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return each joint's own parameter: a rotor's acceleration loads no other joint."""
        return tuple(np.flatnonzero(np.array(self.joints) == joint) for joint in range(robot.n_v))

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the difference quotient; both its ends share the states of friction."""
        inertia, change = np.array(self.term.inertia), np.array(self.change)
        upper, after = self.term.after(inertia + _STEP * change).columns(robot, motion, state)
        lower, _ = self.term.after(inertia - _STEP * change).columns(robot, motion, state)
        slopes = [np.zeros((0, motion.n_t))] * robot.n_v
        for joint, coefficient in zip(self.joints, self.coefficients, strict=True):
            slopes[joint] = coefficient * (upper[joint] - lower[joint]) / (2.0 * _STEP)
        return tuple(slopes), after


def rotor_load(model: TorqueModel, base: BaseParameters, values: FloatArray) -> RotorLoad | None:
    """Return the slope of load friction in the rotors that are regrouped into links, or None where there is none.

    Parameters
    ----------
    values : (n_b,) base parameters
    """
    term, rotors = load_term(model), hidden_rotors(model, base, values)
    if term is None or not rotors:
        return None
    ratios = {
        model.parameters[index].joint: float(value)
        for index, value in zip(base.independent, values, strict=True)
        if model.parameters[index].symbol == term.symbols[0]
    }
    change = np.zeros(len(base.names))
    for rotor in rotors:
        change[base.independent] -= rotor.most * base.regrouping[:, rotor.column]
    return RotorLoad(
        term=term,
        joints=tuple(rotor.joint for rotor in rotors),
        coefficients=tuple(ratios.get(rotor.joint, 0.0) for rotor in rotors),
        change=tuple(rigid_parameters(model, change).ravel().tolist()),
    )


def rigid_parameters(model: TorqueModel, standard: FloatArray) -> FloatArray:
    """Return the inertial parameters among `standard` (n_p,), link by link, (n_v, 10); zero where there is none."""
    inertia = np.zeros((model.robot.n_v, len(INERTIAL_SYMBOLS)))
    for parameter, value in zip(model.parameters, standard, strict=True):
        if parameter.symbol in INERTIAL_SYMBOLS:
            inertia[parameter.joint, INERTIAL_SYMBOLS.index(parameter.symbol)] = value
    return inertia
