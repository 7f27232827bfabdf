"""The catalogue of effects that residuals are searched for: what each looks like, and which term would model it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.verification.probes import LENGTHS, STRIBECK_SPEEDS, Probes
from tauhat.verification.series import PredictedRows

_PLAY = 0.05  # of the root mean square load: how close to zero the teeth change sides

Dependence: TypeAlias = Literal[
    "speed", "direction", "position", "acceleration", "load", "time", "temperature", "another joint", "constant"
]


class JointView(NamedTuple):
    """What the columns of one joint's candidates are made from.

    rows : of the recording, with the probes' columns
    joint : index
    step : time between the rows [s]
    temperature : (n,) of the joint [deg C], where it was logged
    """

    rows: PredictedRows
    joint: int
    step: float
    temperature: FloatArray | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate:
    """An effect and its columns on one joint.

    effect : in a few words
    dependence : what of the motion the residual depends on
    term : of the torque model that has it; empty where none does
    advice : what to do
    columns : (k, n); none where the recording cannot show the effect
    choices : rows of the columns that are one choice each, of which the training data takes the best; none: all
    labels : of the choices
    """

    effect: str
    dependence: Dependence
    term: str
    advice: str
    columns: FloatArray
    choices: tuple[tuple[int, ...], ...] = ()
    labels: tuple[float, ...] = field(default=())


def candidates(view: JointView, probes: Probes, present: frozenset[str]) -> tuple[Candidate, ...]:
    """Return what may be missing on one joint: all of the catalogue but the terms that the model has.

    Parameters
    ----------
    present : keys of the model's terms, and of those that they stand for
    """
    found = [
        Candidate(
            effect=effect, dependence=dependence, term=term, columns=made,
            advice=_ADVICE.get(effect) or f"add the term {term} (`identify --model`, or `--model auto`)",
        )
        for effect, dependence, term, make in _CATALOGUE
        if term not in present and (made := make(view, probes)).size and _lives(made)
    ]  # fmt: skip
    ripple = _ripple(view, probes)
    return (*found, ripple) if ripple.columns.size else tuple(found)


def _lives(columns: FloatArray) -> bool:
    return bool(np.isfinite(columns).all() and columns.any())


def _own(*names: str) -> Callable[[JointView, Probes], FloatArray]:
    return lambda view, probes: view.rows.probes[view.joint][[probes.place(name) for name in names]]


def _constant(view: JointView, _: Probes) -> FloatArray:
    return np.ones((1, view.rows.t.size))


def _drift(view: JointView, _: Probes) -> FloatArray:
    return _centred(view.rows.t)[None]


def _warm_up(view: JointView, probes: Probes) -> FloatArray:
    return np.asarray(_centred(view.rows.t) * _own("dq", "sign")(view, probes))


def _heat(view: JointView, probes: Probes) -> FloatArray:
    if view.temperature is None:
        return np.zeros((0, view.rows.t.size))
    return np.asarray((view.temperature - view.temperature.mean()) * _own("dq", "sign")(view, probes))


def _slope(values: FloatArray, step: float) -> FloatArray:
    return np.asarray(np.gradient(values, step))


def _delay(view: JointView, _: Probes) -> FloatArray:
    return _slope(view.rows.predicted[view.joint], view.step)[None]


def _bending(view: JointView, _: Probes) -> FloatArray:
    load = view.rows.load[view.joint]
    return _slope(_slope(load, view.step), view.step)[None]


def _play(view: JointView, _: Probes) -> FloatArray:
    load = view.rows.load[view.joint]
    side = np.tanh(load / max(_PLAY * float(np.sqrt(np.mean(load**2))), 1e-12))
    return _slope(_slope(side, view.step), view.step)[None]


def _neighbours(view: JointView, probes: Probes) -> FloatArray:
    near = [joint for joint in (view.joint - 1, view.joint + 1) if 0 <= joint < len(view.rows.probes)]
    rows = [probes.place(name) for name in ("dq", "sign", "ddq")]
    return np.concatenate([np.zeros((0, view.rows.t.size)), *(view.rows.probes[joint][rows] for joint in near)])


def _ripple(view: JointView, probes: Probes) -> Candidate:
    rows = view.rows.probes[view.joint]
    orders = probes.orders[view.joint]
    return Candidate(
        effect="ripple", dependence="position", term="", columns=rows[probes.ripple_places(0)[0] :],
        advice="no term has it: calibrate cogging or the encoder's eccentricity, and compensate it",
        choices=tuple((2 * place, 2 * place + 1) for place in range(len(orders))), labels=orders,
    )  # fmt: skip


def _centred(t: FloatArray) -> FloatArray:
    middle = 0.5 * (t[0] + t[-1])
    return np.asarray((t - middle) / max(float(t[-1]) - middle, 1e-9))


_ADVICE: Mapping[str, str] = {
    "gravity-like shape": "check the inertia of the links, cables and hoses, and the robot's gravity; "
    "a gas spring is the term gas-spring",
    "warm-up": "friction changes as the gears warm up: record a warm-up of tens of minutes and add the term thermal",
    "drift": "check the zero of the torque or current sensors",
    "temperature": "friction depends on the temperature: record a warm-up and add the term thermal-measured, or "
    "thermal where temperatures will not be logged",
    "delay": "position and torque are not at the same time: `delay_samples` in the map, see `tauhat check`",
    "elasticity": "the joint bends: no term has it, stay below its resonance with `--cutoff`",
    "backlash": "the gear has play where its load changes sign: no term has it",
    "coupling with a neighbour": "a motor turns with two joints: the map's [coupling] section and the term coupling",
}
_CATALOGUE: tuple[tuple[str, Dependence, str, Callable[[JointView, Probes], FloatArray]], ...] = (
    ("constant", "constant", "offset", _constant),
    ("viscous friction", "speed", "viscous", _own("dq")),
    ("Coulomb friction", "direction", "coulomb", _own("sign")),
    ("degressive friction", "speed", "cube-root", _own("cube root")),
    ("Stribeck friction", "speed", "stribeck", _own(*(f"stribeck {k}" for k in range(len(STRIBECK_SPEEDS))))),
    ("friction by direction", "speed", "viscous-asymmetry", _own("speed")),
    ("pre-sliding", "direction", "dahl", _own(*(f"dahl {k}" for k in range(len(LENGTHS))))),
    ("friction by load", "load", "load-coulomb", _own("load sign")),
    ("pre-sliding by load", "load", "load-dahl", _own("load dahl")),
    ("rotor inertia", "acceleration", "rotor", _own("ddq")),
    ("spring", "position", "spring", _own("q")),
    ("gravity-like shape", "position", "", _own("sine", "cosine")),
    ("coupling with a neighbour", "another joint", "coupling", _neighbours),
    ("delay", "acceleration", "", _delay),
    ("elasticity", "acceleration", "", _bending),
    ("backlash", "load", "", _play),
    ("warm-up", "time", "thermal", _warm_up),
    ("drift", "time", "", _drift),
    ("temperature", "temperature", "thermal-measured", _heat),
)
