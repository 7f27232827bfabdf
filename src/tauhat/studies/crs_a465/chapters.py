"""The chapters of the CRS A465 study: tables and charts of what was found, each with the words to read it by."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tauhat.studies.crs_a465.coordinates import coordinates
from tauhat.studies.crs_a465.experiment import CONDITIONS, TERMS, identifiable
from tauhat.studies.crs_a465.findings import Findings, against, percent
from tauhat.studies.crs_a465.fits import CASES, LONG_CONDITION, LONG_METHOD, METHODS, Case
from tauhat.studies.study import Cell, Chapter, Chart, Series, Table

_OVER_ARMS = "Medians over the arms."
_WIDE = 2.0  # standard errors on either side of a value in a drawing: about 95 %


def arm_chapter(found: Findings) -> Chapter:
    """Return the arm, how many parameters its models have, and how well the motions tell them apart."""
    full, simplified = identifiable("full"), identifiable("simplified")
    text = (
        (
            "The CRS A465 is the built-in robot with geometry from public sources and estimated masses. Its torque "
            "is that of rigid links with rotors and, on each joint, viscous friction, Coulomb friction and an "
            f"offset. Each of the {len(found.arms)} arms has true parameters of its own: those of the description "
            f"changed at random by about {percent(found.experiment.spread)}, and on every link a part that the "
            f"description does not know, {percent(found.experiment.eccentric)} of the link's mass, "
            f"{found.experiment.reach:g} radii of gyration off its centre. So no product of inertia is zero."
        ),
        (
            f"The simplified model takes all products of inertia as zero. That leaves {simplified.model.n_p} of "
            f"{full.model.n_p} standard parameters and {simplified.base.n_b} of {full.base.n_b} base parameters."
        ),
        (
            f"An arm runs a random motion of {found.experiment.seconds:g} s inside its limits. The log holds "
            f"position with noise of {1e6 * found.experiment.position_noise:g} µrad and torque with noise of one of "
            "three kinds: equal on all joints; unequal, of the same mean square; and unequal with gross errors, "
            f"which are spikes of {found.experiment.gross:g} times the joint's RMS torque in "
            f"{percent(found.experiment.spikes)} of the samples, and something that leans on each joint in "
            f"{percent(found.experiment.pushes)} of the time."
        ),
    )
    return Chapter(title="The arm and its parameters", text=text, tables=(_counts(found), _noises(found)))


def _counts(found: Findings) -> Table:
    rows = []
    for name in TERMS:
        own, (plain, scaled) = identifiable(name), found.condition(name)
        links = len(own.model.terms[0].parameters(own.model.robot))
        in_base = int(np.count_nonzero(own.base.independent < links))
        rows.append((name, own.model.n_p, links, own.base.n_b, in_base, plain, scaled))
    return Table(
        title="Parameters and condition numbers",
        header=("model", "standard", "for links", "base", "base for links", "condition", "columns scaled"),
        rows=tuple(rows),
        note="Condition number of the stacked regressor of the fitted motion without noise, as it is and with columns "
        f"of unit norm. {_OVER_ARMS}",
    )


def _noises(found: Findings) -> Table:
    torque = np.median([arm.torque_rms for arm in found.arms], axis=0)
    equal, unequal = (found.experiment.levels(condition) for condition in ("equal", "unequal"))
    names = identifiable("full").model.robot.joint_names
    spike = found.experiment.gross * torque
    rows = zip(names, torque.tolist(), equal.tolist(), unequal.tolist(), spike.tolist(), strict=True)
    return Table(
        title="Torque and its noise [Nm]",
        header=("joint", "RMS torque", "equal noise", "unequal noise", "spike"),
        rows=tuple(rows),
        note=_OVER_ARMS,
    )


def parameter_chapter(found: Findings) -> Chapter:
    """Return what the methods do to the parameters, in numbers that both models share."""
    spoiled = [Case("outliers", "full", method) for method in METHODS]
    models = [Case("unequal", name, "irls") for name in TERMS]
    text = (
        (
            "Base parameters of the two models differ in number and in what they stand for. Both are mapped to one "
            f"minimal set of {coordinates().n_c} barycentric parameters: the simplified model becomes the one full "
            "model that predicts the same torque on every motion. The map is linear and takes values and covariance "
            "alike."
        ),
        (
            "The error in standard errors is of each model's own base parameters, against the values they should "
            "have. It is about one where error bars are right; for the simplified model it also holds what the "
            "missing products of inertia push into the parameters that are left."
        ),
    )
    charts = (
        _errors_of_arm(found, spoiled, "Barycentric parameters of the first arm, full model, gross errors"),
        _errors_of_arm(found, models, "Barycentric parameters of the first arm by IRLS, full and simplified"),
    )
    return Chapter(
        title="What the methods do to the parameters",
        text=text,
        tables=(_parameter_errors(found), _first_arm(found)),
        charts=charts,
    )


def _parameter_errors(found: Findings) -> Table:
    rows = []
    for case in CASES:
        links, drives = found.relative(case)
        rows.append((*case, found.missed(case), 100 * links, 100 * drives, 100 * found.weighed(case)))
    return Table(
        title="Errors of the parameters",
        header=("noise", "model", "method", "in standard errors", "links [%]", "drives [%]", "by torque [%]"),
        rows=tuple(rows),
        note="Links, drives: median over arms and barycentric parameters of the error over the true value. By torque: "
        "norm of all errors, each times the RMS torque that one unit of the parameter causes, over the same of the "
        "true values; median over arms.",
    )


def _first_arm(found: Findings) -> Table:
    arm, shown = found.arms[0], coordinates()
    cases = (Case("outliers", "full", "ols"), Case("outliers", "full", "irls"), Case("outliers", "simplified", "irls"))
    rows: list[tuple[Cell, ...]] = []
    for index, (item, formula) in enumerate(zip(shown.parameters, shown.formulas, strict=True)):
        fits = [arm.fits[case] for case in cases]
        pairs = [float(number[index]) for fit in fits for number in (fit.values, fit.deviations)]
        rows.append((formula, item.unit, float(arm.true_values[index]), *pairs))
    names = [text for case in cases for text in (f"{case.method} {case.model}", "±")]
    return Table(
        title="Barycentric parameters of the first arm, gross errors",
        header=("parameter", "unit", "truth", *names),
        rows=tuple(rows),
        note="± is one standard error. The simplified model holds products of inertia at zero: it is sure of them "
        "because it does not ask.",
    )


def _errors_of_arm(found: Findings, cases: list[Case], title: str) -> Chart:
    """Return the errors of the links' parameters of the first arm in newton metres, with error bars."""
    arm, links = found.arms[0], slice(coordinates().n_rigid)
    names = tuple(item.name for item in coordinates().parameters[links])
    series = []
    for case in cases:
        fit = arm.fits[case]
        error = (arm.effects * (fit.values - arm.true_values))[links]
        half = _WIDE * (arm.effects * fit.deviations)[links]
        own = case.method if cases[0].model == cases[-1].model else case.model
        low, high = tuple((error - half).tolist()), tuple((error + half).tolist())
        series.append(Series(name=own, x=names, y=tuple(error.tolist()), low=low, high=high))
    return Chart(
        title=title,
        kind="lines",
        x_title="parameter",
        y_title="error as RMS torque [Nm]",
        series=tuple(series),
        note="Each error times the RMS torque that one unit of the parameter causes; bars are two standard errors on "
        "either side and should reach zero.",
    )


def torque_chapter(found: Findings) -> Chapter:
    """Return the error of the torque on a motion that was not fitted."""
    text = (
        (
            f"The estimates predict the true torque of another random motion of {found.experiment.unseen_seconds:g} "
            "s. The error is the norm of the difference over the norm of the torque."
        ),
    )
    joints = _joints()
    rows = ((*case, *(100 * found.joints(case)).tolist(), 100 * found.torque(case)) for case in CASES)
    table = Table(
        title="Error of the torque on the unseen motion [%]",
        header=("noise", "model", "method", *joints, "all"),
        rows=tuple(rows),
        note=_OVER_ARMS,
    )
    return Chapter(title="Torque on a motion that was not fitted", text=text, tables=(table,), charts=(_bars(found),))


def _joints() -> tuple[str, ...]:
    """Return short names of the joints: headers wrap between words."""
    return tuple(f"joint {number}" for number in range(1, 1 + identifiable("full").model.robot.n_v))


def _bars(found: Findings) -> Chart:
    return Chart(
        title="Error on the unseen motion, all joints",
        kind="bars",
        x_title="noise and model",
        y_title="error [% of torque]",
        series=_by_method(found.torque),
        logarithmic=("y",),
        note=_OVER_ARMS,
    )


def _by_method(value: Callable[[Case], float]) -> tuple[Series, ...]:
    """Return the bars of each method over noise and model, in per cent."""
    groups = [(condition, name) for condition in CONDITIONS for name in TERMS]
    return tuple(
        Series(
            name=method,
            x=tuple(f"{condition}, {name}" for condition, name in groups),
            y=tuple(100 * value(Case(condition, name, method)) for condition, name in groups),
        )
        for method in METHODS
    )


def length_chapter(found: Findings) -> Chapter:
    """Return what the simplification costs, and after how much data it still pays."""
    bias, rounding = found.exact("simplified"), found.exact("full")
    text = (
        (
            f"On a log of {found.experiment.seconds:g} s without any noise the full model predicts the unseen motion "
            f"up to {rounding:.1g} of its torque, which is rounding and the filters. The simplified model is off by "
            f"{percent(bias)}: its bias, which no amount of data removes."
        ),
        (
            f"With noise the full model pays for its {_more_parameters()} more base parameters in variance, the more "
            "the shorter the log. Here the same motion is cut off earlier or run on longer, with unequal noise, and "
            f"fitted by {LONG_METHOD.upper()}."
        ),
    )
    quartiles = {name: 100 * found.after_lengths(name) for name in TERMS}
    wins = found.simplified_wins()
    rows = tuple(
        (length, float(quartiles["full"][1, k]), float(quartiles["simplified"][1, k]), 100 * float(wins[k]))
        for k, length in enumerate(found.lengths)
    )
    table = Table(
        title=f"Error on the unseen motion after a log of each length [%], noise {LONG_CONDITION}",
        header=("seconds", "full", "simplified", "arms better simplified [%]"),
        rows=rows,
        note=_OVER_ARMS,
    )
    series = tuple(
        Series(name=name, x=found.lengths, y=tuple(q[1].tolist()), low=tuple(q[0].tolist()), high=tuple(q[2].tolist()))
        for name, q in quartiles.items()
    )
    chart = Chart(
        title="When the simplified model wins",
        kind="lines",
        x_title="length of the fitted log [s]",
        y_title="error on the unseen motion [% of torque]",
        series=series,
        logarithmic=("x", "y"),
        note="Medians and quartiles over the arms. The lower line predicts better.",
    )
    return Chapter(title="What simplification costs, and when it pays", text=text, tables=(table,), charts=(chart,))


def _more_parameters() -> int:
    return identifiable("full").base.n_b - identifiable("simplified").base.n_b


def interval_chapter(found: Findings) -> Chapter:
    """Return how often the 95 % intervals hold the truth."""
    held = {case: found.inside(case) for case in CASES}
    text = (
        (
            "Error bars are of use when the truth lies in 95 of 100 of the 95 % intervals. For the simplified model "
            "the truth is what its parameters stand for, computed from the true links without their products of "
            "inertia."
        ),
    )
    rows = ((*case, 100 * float(share.mean()), 100 * float(share.min())) for case, share in held.items())
    table = Table(
        title="Share of 95 % intervals that hold the truth [%]",
        header=("noise", "model", "method", "all parameters", "worst parameter"),
        rows=tuple(rows),
        note=f"Over {len(found.arms)} arms; the worst parameter is the one whose intervals miss most often.",
    )
    chart = Chart(
        title="Intervals that hold the truth",
        kind="bars",
        x_title="noise and model",
        y_title="share of 95 % intervals [%]",
        series=_by_method(lambda case: float(held[case].mean())),
        note="95 is right.",
    )
    return Chapter(title="Whether the error bars hold", text=text, tables=(table,), charts=(chart,))


def plant_chapter(found: Findings, seconds: float) -> Chapter:
    """Return the same on arms that a controller moves in MuJoCo."""
    cases = list(found.plants[0])
    best = {name: found.on_plants(Case("outliers", name, "irls"))[0] for name in TERMS}
    text = (
        (
            f"{len(found.plants)} more arms are moved by a controller in MuJoCo, {seconds:g} s to fit and "
            f"{seconds:g} s unseen. Their Coulomb friction is a true sign, their encoders are quantised, and filters "
            "and widths of friction are chosen from each log as tauhat identify does. The error is against the "
            "true torque."
        ),
        (
            f"With gross errors IRLS is off by {percent(best['full'])} with the full model and by "
            f"{percent(best['simplified'])} with the simplified one, {against(best['simplified'], best['full'])}."
        ),
    )
    joints = _joints()
    rows = []
    for case in cases:
        whole, parts = found.on_plants(case)
        rows.append((*case, *(100 * parts).tolist(), 100 * whole))
    table = Table(
        title="Error of the torque on the plants' unseen motion [%]",
        header=("noise", "model", "method", *joints, "all"),
        rows=tuple(rows),
        note="Medians over the plants.",
    )
    return Chapter(title="The same on a simulated plant", text=text, tables=(table,))
