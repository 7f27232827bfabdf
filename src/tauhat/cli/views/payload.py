"""A payload and a calibration of drives as tables and sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import aligned, graded, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.estimation.drives import DriveCalibration
    from tauhat.estimation.payload import Payload

_AXES = "xyz"


def payload_view(payload: Payload) -> Iterator[RenderableType]:
    """Yield what the payload weighs, where its centre is, how its mass is spread, and how well that fits."""
    yield _body_table(payload)
    yield _fit_table(payload)
    yield _payload_sentences(payload)


def _body_table(payload: Payload) -> RenderableType:
    from rich.markup import escape

    body = payload.body
    link = escape(payload.link)
    made = table(f"Payload on the link of joint {link}, in its frame", ("quantity", "unit"), ("value", "± (95 %)"))
    made.add_row("mass", "kg", *_measured(body.mass, body.mass_half))
    for axis, value, half, seen in zip(_AXES, body.centre, body.centre_half, body.centre_seen, strict=True):
        made.add_row(f"centre of mass {axis}", "m", *(_measured(value, half) if seen else _unseen(half)))
    for a in range(3):
        for b in range(a + 1):
            figures = (float(body.inertia[a, b]), float(body.inertia_half[a, b]))
            name = f"inertia {_AXES[b]}{_AXES[a]} about it"
            made.add_row(name, "kg m^2", *(_measured(*figures) if body.inertia_seen[a][b] else _unseen(figures[1])))
    return made


def _measured(value: float, half: float) -> tuple[str, str]:
    if not half:
        return f"{value:.4g}", "known"
    value_text, half_text = aligned([value, half], like=[half])
    return value_text, half_text


def _unseen(half: float) -> tuple[str, str]:
    return "not visible", f"{half:.2g}" if half else ""


def _fit_table(payload: Payload) -> RenderableType:
    from rich.markup import escape

    joints = payload.loaded.robot.joints
    made = table("Fit of the loaded run", ("joint", "unit"), ("residual rms", "of torque"))
    residuals = payload.joint_rms.tolist()
    rows = zip(joints, aligned(residuals), residuals, payload.torque_rms.tolist(), strict=True)
    for joint, text, part, whole in rows:
        made.add_row(escape(joint.name), joint.effort_unit, text, graded(part / whole if whole else float("inf")))
    made.add_section()
    made.add_row("[bold]all joints[/bold]", "", "", graded(payload.relative_rms))
    return made


def _payload_sentences(payload: Payload) -> RenderableType:
    from rich.text import Text

    seen = payload.body.inertia_seen
    inertia = (
        ""
        if all(all(row) for row in seen)
        else "Not visible: cannot be told from zero in this motion; faster motion of the wrist shows more.\n"
    )
    return Text(
        f"A body of positive density; without that constraint the residual is {100 * payload.free_relative_rms:.2f} % "
        f"instead of {100 * payload.relative_rms:.2f} %, the mass {payload.free_values[0]:.4g} kg.\n{inertia}"
    )


def drives_view(calibration: DriveCalibration, gains: Sequence[float]) -> Iterator[RenderableType]:
    """Yield the factors of both methods with their intervals, and the gains to put into the map."""
    from rich.markup import escape
    from rich.text import Text

    numbers = ("factor", "± (95 %)", "least squares", *(("new gain",) if gains else ()))
    made = table("Measured torque times factor is the true torque", ("joint",), numbers)
    halves = calibration.half_intervals().tolist()
    columns = [aligned(values, like=halves) for values in (calibration.factors.tolist(), halves)]
    columns.append(aligned(calibration.ordinary.factors.tolist(), like=halves))
    columns += [[f"{gain:.6g}" for gain in gains]] if gains else []
    for name, *figures in zip(calibration.joint_names, *columns, strict=True):
        made.add_row(escape(name), *figures)
    yield made
    yield Text(
        f"With the torques as they are the payload of {calibration.mass:.4g} kg weighs "
        f"{calibration.found_mass:.4g} kg.\nFactors are by total least squares; least squares is drawn towards zero by "
        "the noise of the torques.\n"
    )
