"""The identified numbers, with error bars and with what they stand for."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from typing import NamedTuple

import numpy as np

from tauhat.estimation.estimate import ParameterRow
from tauhat.report.case import Case, Section
from tauhat.report.figures import parameter_plot
from tauhat.report.formatting import value_and_half
from tauhat.report.rendering import rendered
from tauhat.report.uncertainty import relative_halves

_SURE, _UNKNOWN = 0.1, 1.0
_SYMBOLS = {
    "m": "mass",
    "mx, my, mz": "mass times centre of mass",
    "Ixx … Izz": "inertia about the joint frame's origin, in link axes",
    "Ia": "rotor inertia, joint side of the gear",
    "Fv": "viscous friction",
    "Fc": "Coulomb friction",
    "Fr": "friction in proportion to the cube root of the speed",
    "Fs": "Stribeck friction, on top at low speed",
    "Fd, Fe": "dry friction that builds up over a short and over a longer displacement",
    "Fl": "friction as a part of the rigid-body torque on the joint",
    "Hd, Hv": "change of dry and of viscous friction by one unit of the joint's warmth",
    "Fva": "half the difference of viscous friction forwards and backwards",
    "Fv+, Fv-, Fc+, Fc-": "viscous and Coulomb friction forwards and backwards",
    "k0, k1, k2, k3, k4": "friction as a polynomial of the speed, and its Stribeck part k4",
    "To": "constant offset of the torque",
    "Iam, Fvm": "rotor inertia and viscous friction of a motor that turns with two joints",
    "Fsm": "Coulomb friction of such a motor",
    "Fdm, Fem": "dry friction of such a motor over a short and over a longer displacement",
    "Ks": "rate of a spring on the joint",
    "Gs": "pressure times volume of a gas spring",
}


class Row(NamedTuple):
    """One base parameter as the table shows it; `style` says how sure it is."""

    name: str
    value: str
    half: str
    relative: float
    unit: str
    formula: str
    style: str


def parameters(case: Case) -> Section:
    """Return the base parameters joint by joint: value, 95 % interval, unit, formula; and what was regrouped."""
    estimate, base = case.estimate, case.estimate.base
    relative = relative_halves(estimate)
    standard = estimate.model.parameters
    order = np.array(sorted(range(base.n_b), key=lambda k: standard[base.independent[k]].joint))
    plot = parameter_plot([base.names[base.independent[k]] for k in order], relative[order], key="parameters")
    html = rendered(
        "parameters.html.j2",
        plot=plot,
        groups=_groups(case),
        symbols=_symbols(parameter.symbol for parameter in standard),
        counts={"sure": int((relative < _SURE).sum()), "unknown": int((relative >= _UNKNOWN).sum())},
        n_p=len(base.names),
        n_b=base.n_b,
        regrouped=[base.names[index] for index in base.dependent],
        silent=[base.names[index] for index in base.unidentifiable],
        degrees=estimate.degrees,
    )
    return Section(key="parameters", title="Parameters with error bars", html=html, plots=(plot,))


def _symbols(present: Iterable[str]) -> dict[str, str]:
    """Return what the symbols of this model mean."""
    known = set(present)
    return {key: meaning for key, meaning in _SYMBOLS.items() if known.intersection(_members(key))}


def _members(key: str) -> list[str]:
    return ["Ixx", "Iyy", "Izz"] if key.startswith("Ixx") else key.split(", ")


def _groups(case: Case) -> list[tuple[str, list[Row]]]:
    """Return the rows under their joints' names, joints in order."""
    estimate = case.estimate
    standard, joints = estimate.model.parameters, estimate.robot.joint_names
    rows = zip(estimate.summary(), estimate.half_intervals(), relative_halves(estimate), strict=True)
    keyed = [
        (standard[index].joint, _row(line, float(half), float(part)))
        for index, (line, half, part) in zip(estimate.base.independent, rows, strict=True)
    ]
    keyed.sort(key=lambda pair: pair[0])
    return [(joints[joint], [row for _, row in members]) for joint, members in groupby(keyed, key=lambda pair: pair[0])]


def _row(line: ParameterRow, half: float, relative: float) -> Row:
    value, half_shown = value_and_half(line.value, half)
    style = "sure" if relative < _SURE else "unknown" if relative >= _UNKNOWN else "loose"
    return Row(
        name=line.name,
        value=value,
        half=half_shown,
        relative=relative,
        unit=line.unit,
        formula=line.formula,
        style=style,
    )
