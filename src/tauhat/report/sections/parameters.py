"""The identified numbers, with error bars and with what they stand for."""

from __future__ import annotations

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
    "To": "constant offset of the torque",
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
        symbols=_SYMBOLS,
        counts={"sure": int((relative < _SURE).sum()), "unknown": int((relative >= _UNKNOWN).sum())},
        n_p=len(base.names),
        n_b=base.n_b,
        regrouped=[base.names[index] for index in base.dependent],
        silent=[base.names[index] for index in base.unidentifiable],
        degrees=estimate.degrees,
    )
    return Section(key="parameters", title="Parameters with error bars", html=html, plots=(plot,))


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
