"""How an estimate gives the full set of parameters, term by term."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Coupling, CouplingDahl, GasSpring, Term
from tauhat.errors import ExportError
from tauhat.estimation.estimate import Estimate
from tauhat.export.drives import CoupledMotors, LoadedGasSpring
from tauhat.export.friction import LAWS, FrictionLaw
from tauhat.export.friction_fit import fitted_friction
from tauhat.export.parameters import StandardParameters
from tauhat.robots.robot import Robot

_RIGID = ("inertia", "inertia-simple")
_DRIVES = ("spring", "gas-spring", "coupling", "coupling-dahl")

Parts: TypeAlias = Mapping[str, tuple[Term, FloatArray]]


def standard_parameters(estimate: Estimate, *, without: Collection[str] = ()) -> StandardParameters:
    """Return the full parameters of an estimate, term by term, and what stands for its friction in a simulator.

    Parameters
    ----------
    without : keys of terms to leave out

    Raises
    ------
    ExportError
        when the estimate has base parameters only, when the model has no inertia, when one of its terms cannot be told
        to another program, naming it, or when `without` names a term that it does not have.
    """
    _check_terms([term.key for term in estimate.model.terms], without)
    standard = _all_values(estimate)
    parameters = model_parameters(estimate.model, standard, without=without)
    return replace(parameters, plain=fitted_friction(estimate, parameters, standard=standard))


def model_parameters(model: TorqueModel, standard: FloatArray, *, without: Collection[str] = ()) -> StandardParameters:
    """Return a model's parameters sorted into links, rotors, drives and laws of friction.

    Parameters
    ----------
    standard : (n_p,) in the model's order
    without : keys of terms to leave out
    """
    robot = model.robot
    sizes = [len(term.parameters(robot)) for term in model.terms]
    values = np.split(np.asarray(standard), np.cumsum(sizes)[:-1])
    every = {term.key: (term, own) for term, own in zip(model.terms, values, strict=True)}
    parts = {key: part for key, part in every.items() if key not in without}
    links = next(parts[key] for key in _RIGID if key in parts)
    return StandardParameters(
        inertia=_by_joint(*links, robot, INERTIAL_SYMBOLS).T,
        rotor=_one_a_joint(parts, "rotor", robot, "Ia"),
        springs=_one_a_joint(parts, "spring", robot, "Ks"),
        friction=tuple(_law(term, own, robot) for key, (term, own) in parts.items() if key in LAWS),
        gas_spring=_gas_spring(parts),
        motors=_motors(parts),
        left_out=tuple(key for key in every if key in without),
    )


def _check_terms(keys: Sequence[str], without: Collection[str]) -> None:
    if not set(_RIGID) & set(keys):
        raise ExportError("the model has no inertia to export", expected="term inertia", got=", ".join(keys))
    optional = [key for key in keys if key not in {*_RIGID, "rotor"}]
    unknown = sorted(set(without) - set(optional))
    if unknown:
        expected = ", ".join(optional) or "no name"
        raise ExportError("no such term to leave out", expected=expected, got=", ".join(unknown))
    for key in optional:
        if key not in {*_DRIVES, *LAWS} and key not in without:
            remedy = f"identify without it, or leave it out with `--without {key}`"
            raise ExportError(f"term {key} cannot be told to another program", where="export", remedy=remedy)


def _all_values(estimate: Estimate) -> FloatArray:
    values: Any = estimate.standard
    if values is None:
        raise ExportError(
            "the estimate has base parameters only, whose sums leave open what each link weighs",
            where=estimate.robot.name,
            remedy="identify with --physical",
        )
    return frozen("standard", values, (estimate.model.n_p,), where="estimate")


def _law(term: Term, values: FloatArray, robot: Robot) -> FrictionLaw:
    form = LAWS[term.key]
    shape = np.array(getattr(term, form.shape_field)) if form.shape_field else np.zeros(0)
    carried: tuple[float, ...] = getattr(term, "inertia", ()) if form.of_load else ()
    nominal = robot.inertia if form.of_load else np.zeros((0, 10))
    return FrictionLaw(
        key=term.key,
        coefficients=_by_joint(term, values, robot, form.symbols),
        shape=shape,
        load=np.array(carried).reshape(-1, 10) if carried else nominal,
    )


def _gas_spring(parts: Parts) -> LoadedGasSpring | None:
    term, values = parts.get("gas-spring", (None, np.zeros(0)))
    return LoadedGasSpring(spring=term, energy=float(values[0])) if isinstance(term, GasSpring) else None


def _motors(parts: Parts) -> CoupledMotors | None:
    for key in ("coupling", "coupling-dahl"):
        term, values = parts.get(key, (None, np.zeros(0)))
        if isinstance(term, Coupling) and term.motors:
            table = values.reshape(len(term.motors), -1)  # Iam, Fvm, dry friction, motor by motor
            return CoupledMotors(
                motors=term.motors, inertia=table[:, 0], viscous=table[:, 1], dry=table[:, 2:],
                widths=() if isinstance(term, CouplingDahl) else term.widths,
                scales=term.scales if isinstance(term, CouplingDahl) else (),
            )  # fmt: skip
    return None


def _one_a_joint(parts: Parts, key: str, robot: Robot, symbol: str) -> FloatArray:
    return _by_joint(*parts[key], robot, (symbol,))[0] if key in parts else np.zeros(robot.n_v)


def _by_joint(term: Term, values: FloatArray, robot: Robot, symbols: Sequence[str]) -> FloatArray:
    """Return a term's values by symbol and joint, (n_symbols, n_v), zero where a joint has none."""
    table = np.zeros((len(symbols), robot.n_v))
    for parameter, value in zip(term.parameters(robot), values, strict=True):
        table[symbols.index(parameter.symbol), parameter.joint] = value
    return table
