"""The later chapters of a whole rehearsal: the model in motion, gains, poses, payload, and where the error is from."""

from __future__ import annotations

import numpy as np

from tauhat.studies.error_budget.chapters import chapters_of as budget_chapters
from tauhat.studies.study import Cell, Chapter, Chart, Series, Table
from tauhat.studies.whole_rehearsal.findings import Findings
from tauhat.studies.whole_rehearsal.proofs import BANDWIDTH

_MILLI = 1e3
_LEAST = 0.05  # of the largest gravity torque, from which a joint is drawn


def tracking(found: Findings) -> Chapter:
    """Return method 2: how closely the robot follows with each model."""
    names, unit = found.scene.robot.joint_names, _milli_unit(found)
    bend = _MILLI * np.array(found.bend)
    runs = found.tracking.runs
    rows = [(run.name, *(_MILLI * run.rms).tolist(), _MILLI * float(np.linalg.norm(run.rms))) for run in runs]
    rows.append(("(bending of the joints)", *bend.tolist(), float(np.linalg.norm(bend))))
    text = (
        (
            f"Method 2: the model drives. The simulated robot follows the task path under controllers with the same "
            f"feedback of {BANDWIDTH:g} Hz; they differ in what they know of the robot. None knows the truth."
        ),
        (
            "The error is that of the link. Joints bend, encoders sit on the motors, and what a joint bends by no "
            "controller here can see: the last row of the table is how much that is."
        ),
    )
    table = Table(
        title=f"Tracking error on the task path [{unit}]",
        header=("controller", *names, "norm"),
        rows=tuple(rows),
        note="Root mean square." + _failures(found),
    )
    chart = Chart(
        title="Tracking error by controller", kind="bars", x_title="joint", y_title=f"error, root mean square [{unit}]",
        series=(
            *(Series(name=run.name, x=names, y=tuple((_MILLI * run.rms).tolist())) for run in runs),
        ),
        logarithmic=("y",), note="The axis is logarithmic: from 10 to 1 is a tenth of the error.",
    )  # fmt: skip
    return Chapter(title="6. Method 2: the model in motion", text=text, tables=(table,), charts=(chart,))


def _failures(found: Findings) -> str:
    lost = [f" {run.name}: {run.failure}." for run in found.tracking.runs if run.failure]
    return "".join(lost)


def gains(found: Findings) -> Chapter:
    """Return what a short search for gains is worth beside the identified feedforward."""
    tuned, unit = found.tuning, _milli_unit(found)
    names = found.scene.robot.joint_names
    before, after = (_MILLI * judged.error for judged in (tuned.unseen_before, tuned.unseen_after))
    text = (
        (
            f"The gains of the feedback beside the identified feedforward, from {tuned.costs.size} trials on the "
            "rehearsed robot, whose controller is 1 ms late and sees noisy, rounded positions. The first trial is "
            f"the gains set by hand; in {tuned.unstable} trials the robot was lost, which costs nothing here."
        ),
        (
            f"Judged on another motion with other noise: {100 * tuned.improvement:.3g} % of the error is gone, mean "
            "over the joints."
        ),
    )
    table = Table(
        title="Error with gains set by hand and tuned",
        header=("joint", f"by hand [{unit}]", f"tuned [{unit}]"),
        rows=tuple((name, float(before[place]), float(after[place])) for place, name in enumerate(names)),
        note="Root mean square on a motion that the search did not see.",
    )
    trials = tuple(range(1, tuned.costs.size + 1))
    finite = tuple(float(cost) if np.isfinite(cost) else float("nan") for cost in tuned.costs)
    chart = Chart(
        title="Cost of the trials", kind="lines", x_title="trial", y_title="cost, about 1 for gains by hand",
        series=(
            Series(name="best so far", x=trials, y=tuple(tuned.best_so_far.tolist())),
            Series(name="trial", x=trials, y=finite),
        ),
        note="Gaps are trials that went unstable.",
    )  # fmt: skip
    return Chapter(title="7. Gains, by hand and tuned", text=text, tables=(table,), charts=(chart,))


def static(found: Findings) -> Chapter:
    """Return gravity and friction at rest beside the model's."""
    check = found.static
    names = found.scene.robot.joint_names
    text = [
        (
            "Without any dynamics or filter: each pose is reached from below and from above and held. Half the sum "
            "of the two torques is gravity, half the difference is friction, or less where the robot has come to "
            "rest inside its friction."
        )
    ]
    text += [f"{finding.message}: {finding.advice}." for finding in check.findings]
    if not check.findings:
        text.append("No difference from the model is beyond its 95 % interval and 5 % of the torque.")
    rows = tuple(
        (
            joint.name, joint.poses, joint.gravity_rms, joint.gravity_difference, joint.gravity_half, joint.friction,
            joint.model_friction,
        )
        for joint in check.joints
    )  # fmt: skip
    unit = _torque_unit(found)
    table = Table(
        title="Held poses against the model",
        header=(
            *("joint", "poses", f"gravity, root mean square [{unit}]", f"measured less model [{unit}]"),
            *(f"half its 95 % interval [{unit}]", f"friction, at least [{unit}]", f"friction of the model [{unit}]"),
        ),
        rows=rows,
        note="Friction of a held pose is a lower bound: only a model with less is contradicted. Below zero, the torque "
        "has relaxed past the middle.",
    )
    heaviest = max(joint.gravity_rms for joint in check.joints)
    shown = [place for place, joint in enumerate(check.joints) if joint.poses and joint.gravity_rms > _LEAST * heaviest]
    pairs = [pair for place in shown for pair in check.pairs if pair.joint == place]
    places = tuple(f"{names[pair.joint]} at {pair.position:.2f}" for pair in pairs)
    series = (
        Series(name="measured", x=places, y=tuple(pair.gravity for pair in pairs)),
        Series(name="model", x=places, y=tuple(pair.model_gravity for pair in pairs)),
    )
    chart = Chart(
        title="Gravity in held poses", kind="bars", x_title="joint and its position [rad or m]",
        y_title=f"torque [{unit}]", series=series,
        note="A pair of bars for each held pose, on the joints that carry a twentieth of the most or more.",
    )  # fmt: skip
    return Chapter(title="8. At rest", text=tuple(text), tables=(table,), charts=(chart,) if pairs else ())


def payload(found: Findings) -> Chapter:
    """Return the payload that was known beside the one that was found."""
    check, body = found.payload, found.scene.payload
    text = (
        (
            f"The robot runs the designed motion again with {body.mass:g} kg on its last link, and the model finds it "
            "without knowing it."
        ),
        (
            f"Error of the loaded log's torque: {100 * check.ignored:.3g} % with the payload ignored, "
            f"{100 * check.found:.3g} % with the one that was found."
        ),
        _constants(found),
    )
    rows: list[tuple[Cell, ...]] = []
    for number in check.numbers:
        seen = number.found is not None and number.half is not None
        values: tuple[Cell, ...] = (number.found or 0.0, number.half or 0.0) if seen else ("not seen", "")
        verdict = {True: "yes", False: "no", None: ""}[number.inside]
        rows.append((f"{number.quantity} [{number.unit}]", number.known, *values, verdict))
    table = Table(
        title="The payload as known and as found",
        header=("quantity", "known", "found", "half its 95 % interval", "inside"),
        rows=tuple(rows),
        note="Not seen: the motion moves no torque by it. Outside while the torque fits well: the torque constants are "
        "wrong, which no unloaded log can tell.",
    )
    return Chapter(title="9. A payload that is known", text=text, tables=(table,))


def _constants(found: Findings) -> str:
    """Return how far the mass is off beside the errors of the torque constants, which only a rehearsal knows."""
    mass, factor = found.payload.numbers[0], found.scene.experiment.settings.sensors.torque_factor
    off = 100.0 * (np.asarray(factor) * np.ones(found.scene.robot.n_v) - 1.0)
    wrong = f"{off.min():+.2g} to {off.max():+.2g} %"
    if mass.found is None:
        return f"The motion does not show the mass. The torque constants are off by {wrong}."
    return (
        f"The mass is off by {100.0 * (mass.found / mass.known - 1.0):+.2g} %; the torque constants of this robot "
        f"are off by {wrong}. A log in wrong newton metres makes wrong kilograms."
    )


def budget(found: Findings) -> Chapter:
    """Return the ranked causes and what to do about them."""
    causes, remedies, *_ = budget_chapters(found.budget_settings, found.budget)
    settings = found.budget_settings
    start = (
        f"The same experiment on {settings.seeds} other true robots, identified by the {settings.terms} model with "
        "each cause of error switched off alone and on alone. Here the joints are "
        f"{settings.warmer:g} K warmer on the unseen motion than in the fitted log; in the chapters above they are "
        "as cold as they were."
    )
    return Chapter(
        title="10. Where the error is from", text=(start, *causes.text, *remedies.text), tables=causes.tables,
        charts=causes.charts,
    )  # fmt: skip


def _milli_unit(found: Findings) -> str:
    return " or ".join(dict.fromkeys({"rad": "mrad", "m": "mm"}[unit] for unit in found.tracking.units))


def _torque_unit(found: Findings) -> str:
    return " or ".join(dict.fromkeys(joint.effort_unit for joint in found.scene.robot.joints))
