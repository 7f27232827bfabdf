"""The chapters of a whole rehearsal in their order, and the first ones: arm, motion, model, torque, residual."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.studies.study import Cell, Chapter, Chart, Series, Table
from tauhat.studies.whole_rehearsal.conclusions import conclusions
from tauhat.studies.whole_rehearsal.findings import JUDGED, SEARCHED, Findings
from tauhat.studies.whole_rehearsal.proof_chapters import budget, gains, payload, static, tracking
from tauhat.studies.whole_rehearsal.scene import UNSEEN, MotionName
from tauhat.verification.prediction import LogPrediction

_POINTS = 240  # of a line in a drawing
_SHOWN: MotionName = "point to point"  # the unseen motion whose torque is drawn
_WINDOW = 5.0  # [s] of it


def chapters_of(found: Findings) -> tuple[Chapter, ...]:
    """Return all chapters, the conclusions first."""
    return (
        conclusions(found), _arm(found), _motion(found), _model(found), _torque(found), _residuals(found),
        tracking(found), gains(found), static(found), payload(found), budget(found),
    )  # fmt: skip


def _arm(found: Findings) -> Chapter:
    scene = found.scene
    experiment, sensors, robot = scene.experiment, scene.experiment.settings.sensors, scene.robot
    every = np.ones(robot.n_v)
    factor, offset = 100.0 * (sensors.torque_factor * every - 1.0), sensors.torque_offset * every
    noise = sensors.torque_noise * every
    text = (
        (
            f"{robot.name}, {robot.n_v} joints. What the methods are given is its description: links, masses, rotors, "
            "friction. What moves in MuJoCo is another robot, drawn once: every parameter about "
            f"{100 * experiment.spread:g} % off, friction of the kind {experiment.friction}, which depends on "
            "temperature, joints that bend where they have a rotor."
        ),
        (
            f"Its sensors are of the kind {experiment.sensors}, and drawn once, too: a log shows position and torque "
            f"{experiment.settings.sample_rate:g} times a second, no velocity. No method knows the columns below."
        ),
    )
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (joint.name, float(robot.effort_limit[place]), *(float(part[place]) for part in (noise, factor, offset)))
        for place, joint in enumerate(robot.joints)
    )
    unit = _unit(found)
    table = Table(
        title="What the sensors of this robot do",
        header=(
            *("joint", f"largest torque [{unit}]", f"white noise [{unit}]"),
            *("torque constant off by [%]", f"offset of the torque [{unit}]"),
        ),
        rows=rows,
        note="Beside these: steps of the encoder, ripple, drift and a torque that is read late.",
    )
    return Chapter(title="1. The arm and its sensors", text=text, tables=(table,))


def _motion(found: Findings) -> Chapter:
    design, motions = found.scene.design, found.scene.motions
    fitted = motions["designed"]
    text = (
        (
            f"The motion is designed on the description alone: {fitted.duration:.3g} s within the limits of position, "
            f"speed and acceleration. Condition number of its regressor with scaled columns: {design.condition:.3g}; "
            "near 1 every parameter is seen alike, above 100 some hide behind others."
        ),
        "The motions that the model is judged on are of other kinds: "
        + ", ".join(f"{name} of {motions[name].duration:.3g} s" for name in UNSEEN)
        + ".",
    )
    t = np.linspace(0.0, fitted.duration, _POINTS)
    q = fitted.sample(t).q
    series = tuple(
        Series(name=name, x=_cells(t), y=_cells(q[:, place]))
        for place, name in enumerate(found.scene.robot.joint_names)
    )
    chart = Chart(
        title="The designed motion", kind="lines", x_title="time [s]", y_title="position [rad or m]", series=series,
        note="All joints move at once, so that their couplings show; it starts and ends at rest.",
    )  # fmt: skip
    margins = Table(
        title="Room that is left to the limits",
        header=("limit", "unused part [%]"),
        rows=tuple((name, 100.0 * value) for name, value in design.margins.items()),
        note="The smallest over all joints and times.",
    )
    return Chapter(title="2. A motion that excites", text=text, tables=(margins,), charts=(chart,))


def _model(found: Findings) -> Chapter:
    models, first = found.models, found.models.first
    text = [
        (
            f"The log of the designed motion is filtered at {first.processing.cutoff:.3g} Hz, chosen from the log, "
            f"and fitted by {first.estimator['name']}. The first model has the terms "
            f"{', '.join(term.key for term in first.model.terms)}: {first.base.n_b} base parameters, condition number "
            f"{first.condition:.3g}."
        )
    ]
    if models.added:
        text.append(
            f"The second one has {', '.join(models.added)} as well, which chapter 5 finds missing: "
            f"{models.final.base.n_b} base parameters. All proofs below are of the second model."
        )
    inside = models.final_truth[0].share_inside
    text.append(
        f"Of its 95 % intervals {100 * inside:.0f} % hold the true parameter. An interval knows the noise of the log; "
        "it knows nothing of wrong torque constants, of offsets of the sensors, and of what the model does not have."
    )
    fit = 100.0 * models.final.joint_rms / models.final.torque_rms
    table = Table(
        title="Residual of the fit",
        header=("joint", "torque, root mean square", "residual", "residual over torque [%]"),
        rows=tuple(
            (name, float(models.final.torque_rms[place]), float(models.final.joint_rms[place]), float(fit[place]))
            for place, name in enumerate(found.scene.robot.joint_names)
        ),
        note=f"In {_unit(found)}, through the filters. Small here proves nothing: the next chapter does.",
    )
    return Chapter(title="3. The identified model", text=tuple(text), tables=(table,))


def _torque(found: Findings) -> Chapter:
    models = found.models
    text = [
        (
            "Method 1: the model predicts the torque of motions that it was not fitted to. Against the log it is "
            "judged as on a real robot; against the true torque only as in a rehearsal."
        )
    ]
    if models.added:
        both = found.pooled
        text.append(
            f"On {' and '.join(JUDGED)}, which had no part in choosing its terms, the second model is off by "
            f"{100 * both.final:.3g} %, the first by {100 * both.first:.3g} %."
        )
    tables = (_errors(found), _coverage(found))
    return Chapter(
        title="4. Method 1: torque on unseen motions", text=tuple(text), tables=tables,
        charts=(_error_chart(found), *_torque_charts(found)),
    )  # fmt: skip


def _errors(found: Findings) -> Table:
    models = found.models
    rows: list[tuple[Cell, ...]] = []
    for place, name in enumerate(UNSEEN):
        first, final, truth = models.verified.logs[place], models.log(name), models.final_truth[place]
        errors = (first.relative_rms, final.relative_rms, final.moving_relative_rms, truth.relative_rms)
        rows.append((name, *(100.0 * error for error in errors)))
    return Table(
        title="Error of the torque on unseen motions",
        header=(
            *("motion", "first model [%]", "final model [%]", "final, while moving [%]"),
            "final, against the true torque [%]",
        ),
        rows=tuple(rows),
        note=f"Norm of the error over norm of the torque, all joints stacked. The {SEARCHED} was searched for missing "
        "terms, so that its error of the final model is not an unseen one.",
    )


def _coverage(found: Findings) -> Table:
    bands = [[joint.band for joint in found.models.log(name).joints] for name in UNSEEN]
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (joint, *(100.0 * band[place].covered for band in bands), 1.96 * float(found.models.final.joint_rms[place]))
        for place, joint in enumerate(found.scene.robot.joint_names)
    )
    return Table(
        title="How often the 95 % bands hold the measured torque [%]",
        header=("joint", *UNSEEN, f"half the band from the residual [{_unit(found)}]"),
        rows=rows,
        note="95 where the unseen motion is like the fitted one. Much less: the motion shows something that the fit "
        "did not; the residual tests say what.",
    )


def _error_chart(found: Findings) -> Chart:
    names = found.scene.robot.joint_names
    series = tuple(
        Series(name=name, x=names, y=tuple(100.0 * joint.relative_rms for joint in found.models.log(name).joints))
        for name in UNSEEN
    )
    return Chart(
        title="Error of the torque joint by joint", kind="bars", x_title="joint",
        y_title="error over torque of the joint [%]", series=series,
        note="Joints that carry little torque show large parts of it: noise and friction stay the same.",
    )  # fmt: skip


def _torque_charts(found: Findings) -> tuple[Chart, ...]:
    """Return the torque of the joint that carries most, and of the one that is predicted worst."""
    log = found.models.log(_SHOWN)
    most = int(np.argmax(np.sqrt(np.mean(log.tau**2, axis=0))))
    worst = int(np.argmax([joint.relative_rms for joint in log.joints]))
    told = {
        most: "This joint carries the largest torque.",
        worst: "This joint is predicted worst, in parts of its torque.",
    }
    return tuple(_torque_chart(found, joint, words) for joint, words in told.items())


def _torque_chart(found: Findings, joint: int, words: str) -> Chart:
    log = found.models.log(_SHOWN)
    shown = np.flatnonzero(log.t - log.t[0] <= _WINDOW)
    rows = shown[:: max(1, shown.size // _POINTS)]
    return Chart(
        title=f"Measured and predicted torque of {found.scene.robot.joint_names[joint]}, {_SHOWN}", kind="lines",
        x_title="time [s]", y_title=f"torque [{_unit(found)}]", series=_torque_series(log, joint, rows),
        note=f"{words} The shaded area is the 95 % band of the prediction.",
    )  # fmt: skip


def _torque_series(log: LogPrediction, joint: int, rows: IntArray) -> tuple[Series, ...]:
    t, half = _cells(log.t[rows]), log.whole_band[rows, joint]
    predicted = log.predicted[rows, joint]
    return (
        Series(name="predicted", x=t, y=_cells(predicted), low=_cells(predicted - half), high=_cells(predicted + half)),
        Series(name="measured", x=t, y=_cells(log.tau[rows, joint])),
    )


def _residuals(found: Findings) -> Chapter:
    models = found.models
    text = [
        (
            f"The residual of the first model on the {SEARCHED} is searched for a catalogue of effects. An effect is "
            "named where it removes a part of the squared residual on stretches of time on which it was not fitted."
        )
    ]
    if models.added:
        text.append(f"Terms that are named and that the model lacks: {', '.join(models.added)}.")
    elif models.failure:
        text.append(
            f"Terms that are named: {', '.join(models.named)}. The model with them is not taken: {models.failure}."
        )
    else:
        text.append("Nothing is named that a term of the library would describe and the model does not have.")
    missing = [("missing", joint.name, effect) for joint in models.residuals.joints for effect in joint.missing]
    changed = [("changed", joint.name, effect) for joint in models.residuals.joints for effect in joint.changed]
    rows = tuple(
        (kind, joint, effect.effect, effect.term or "none", 100.0 * effect.share)
        for group in (missing, changed)
        for kind, joint, effect in sorted(group, key=lambda row: -row[2].share)
    )
    table = Table(
        title="Effects that the residual holds",
        header=("kind", "joint", "effect", "term", "share of the squared residual [%]"),
        rows=rows,
        note="Missing: the model has no such term. Changed: parameters that are others here than in the fit, as they "
        "are where the fit has bent them to make up for a missing term.",
    )
    return Chapter(title="5. What the residual still holds", text=tuple(text), tables=(table,) if rows else ())


def _unit(found: Findings) -> str:
    return " or ".join(dict.fromkeys(joint.effort_unit for joint in found.scene.robot.joints))


def _cells(values: FloatArray) -> tuple[float, ...]:
    return tuple(values.tolist())
