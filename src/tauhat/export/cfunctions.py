"""The functions of the C header, each traced on its own: dynamics, friction, whole torque, exact friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.export.parameters import StandardParameters
from tauhat.export.traced_memory import STATE, SteadyStates, SteppedStates
from tauhat.export.traced_torque import TracedModel
from tauhat.export.tracing import Scalar, Trace
from tauhat.robots.robot import Robot
from tauhat.simulation.typical import top_speeds

STEADY_WIDTH = 0.003  # of the smooth sign that stands for Dahl states in steady motion, in parts of the speed limit
_FULL = ("q", "dq", "ddq")
_SAYS = {
    "inverse_dynamics": "Torque of links, rotors and springs in motion, without friction.",
    "bias": "Torque of links and springs at constant joint speeds.",
    "gravity": "Torque that holds links and springs still.",
    "friction": "Friction and offset of the joints{steady}.",
    "torque": "What the motors deliver: inverse dynamics and friction{steady}.",
    "friction_step": "Friction and offset of the joints, exact; once a sample, in order.",
    "torque_step": "What the motors deliver: inverse dynamics and exact friction; once a sample, in order.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CFunction:
    """A C function and what it calculates.

    name : behind the prefix
    says : first line of its comment
    inputs : arguments of n_v numbers each
    output : its declaration; "" when it has none
    results : what is assigned -> value
    n_bent : number of Dahl states in the caller's struct; zero for functions that take none
    """

    name: str
    says: str
    inputs: tuple[str, ...]
    output: str
    trace: Trace
    results: Mapping[str, Scalar]
    n_bent: int = 0


def c_functions(robot: Robot, parameters: StandardParameters) -> tuple[CFunction, ...]:
    """Return the functions of the header, in order; those with a state only where friction has a memory."""
    plain = (
        _without_friction(robot, parameters, "inverse_dynamics", _FULL),
        _without_friction(robot, parameters, "bias", _FULL[:2]),
        _without_friction(robot, parameters, "gravity", _FULL[:1]),
        _mass_function(robot, parameters),
        _steady_function(robot, parameters, "friction"),
        _steady_function(robot, parameters, "torque"),
    )
    if not parameters.with_memory:
        return plain
    stepped = [_stepped_function(robot, parameters, name) for name in ("friction_step", "torque_step")]
    return (*plain, _start_function(robot, parameters, stepped[0].n_bent), *stepped)


def steady_widths(robot: Robot) -> FloatArray:
    """Return the widths of the smooth sign that stands for Dahl states in steady motion, (n_v,) [rad/s or m/s]."""
    return np.asarray(STEADY_WIDTH * top_speeds(robot))


def _without_friction(robot: Robot, parameters: StandardParameters, name: str, inputs: tuple[str, ...]) -> CFunction:
    model = TracedModel(trace=Trace(), robot=robot, parameters=parameters, inputs=inputs)
    return _torque_function(model, name, _SAYS[name], model.conservative())


def _mass_function(robot: Robot, parameters: StandardParameters) -> CFunction:
    model = TracedModel(trace=Trace(), robot=robot, parameters=parameters, inputs=_FULL[:1])
    rows = enumerate(model.mass_matrix())
    results = {f"mass[{i}][{k}]": value for i, entries in rows for k, value in enumerate(entries)}
    says = "Mass matrix of links and rotors, symmetric."
    return CFunction(
        name="mass_matrix", says=says, inputs=model.inputs, output="mass", trace=model.trace, results=results
    )


def _steady_function(robot: Robot, parameters: StandardParameters, name: str) -> CFunction:
    model = TracedModel(trace=Trace(), robot=robot, parameters=parameters, inputs=_FULL)
    dry = SteadyStates(model.trace, model.argument("dq"), steady_widths(robot))
    torque = model.whole(dry) if name == "torque" else model.friction(dry)
    steady = ", what has a memory as in steady motion" if parameters.with_memory else ""
    return _torque_function(model, name, _SAYS[name].format(steady=steady), torque)


def _stepped_function(robot: Robot, parameters: StandardParameters, name: str) -> CFunction:
    model = TracedModel(trace=Trace(), robot=robot, parameters=parameters, inputs=_FULL)
    dry = SteppedStates(model.trace, model.argument("q"))
    torque = model.whole(dry) if name == "torque_step" else model.friction(dry)
    results = _assigned(torque) | dry.results()
    return CFunction(
        name=name, says=_SAYS[name], inputs=_FULL, output="tau", trace=model.trace, results=results, n_bent=dry.count
    )


def _start_function(robot: Robot, parameters: StandardParameters, n_bent: int) -> CFunction:
    model = TracedModel(trace=Trace(), robot=robot, parameters=parameters, inputs=_FULL[:1])
    results = {f"{STATE}->q[{joint}]": value for joint, value in enumerate(model.argument("q"))}
    results |= {f"{STATE}->bent[{index}]": model.trace.scalar(0.0) for index in range(n_bent)}
    says = "Begins at these positions, unbent: to be called before the first step."
    return CFunction(
        name="friction_start", says=says, inputs=_FULL[:1], output="", trace=model.trace, results=results, n_bent=n_bent
    )


def _torque_function(model: TracedModel, name: str, says: str, torque: Sequence[Scalar]) -> CFunction:
    return CFunction(
        name=name, says=says, inputs=model.inputs, output="tau", trace=model.trace, results=_assigned(torque)
    )


def _assigned(torque: Sequence[Scalar]) -> dict[str, Scalar]:
    return {f"tau[{index}]": value for index, value in enumerate(torque)}
