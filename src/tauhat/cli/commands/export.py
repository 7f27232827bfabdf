"""`tauhat export`: an estimate as URDF, MuJoCo model or C code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import EstimateArgument, JsonOption
from tauhat.cli.output import show
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from tauhat.estimation.estimate import Estimate
    from tauhat.export import StandardParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat export` takes."""

    estimate: EstimateArgument
    urdf: Annotated[
        Path | None, typer.Option("--urdf", metavar="OUT.urdf", help="URDF to write.", show_default=False)
    ] = None
    source: Annotated[
        Path | None,
        typer.Option(
            "--source",
            metavar="ORIGINAL.urdf",
            help="The robot's own URDF, of which only inertials and joint dynamics change.",
            show_default=False,
            readable=False,
        ),
    ] = None
    mjcf: Annotated[
        Path | None, typer.Option("--mjcf", metavar="OUT.xml", help="MuJoCo model to write.", show_default=False)
    ] = None
    c: Annotated[Path | None, typer.Option("--c", metavar="OUT.h", help="C99 header to write.", show_default=False)] = (
        None
    )
    prefix: Annotated[
        str, typer.Option("--prefix", metavar="NAME", help="Of all names in the C header.", show_default="the robot's")
    ] = ""
    without: Annotated[
        str,
        typer.Option("--without", metavar="TERMS", help="Terms to leave out, comma separated.", show_default=False),
    ] = ""
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Write an estimate for other programs: the robot's own URDF, a MuJoCo model, C code for a controller."""
    from tauhat.cli.views.export import export_view
    from tauhat.estimation.estimate import load_estimate
    from tauhat.export import standard_parameters

    _check_options(options)
    estimate = load_estimate(options.estimate)
    _check_outputs(options, estimate)
    without = tuple(key.strip() for key in options.without.split(",") if key.strip())
    parameters = standard_parameters(estimate, without=without)
    with working("writing"):
        written = _written(options, estimate, parameters)
    document = _document(estimate, parameters, written)
    show(document, lambda: export_view(document), as_json=options.as_json)


def _check_options(options: Options) -> None:
    if options.urdf is None and options.mjcf is None and options.c is None:
        raise typer.BadParameter("nothing to write; give --urdf, --mjcf or --c")
    if options.source is not None and options.urdf is None:
        raise typer.BadParameter("--source is of use with --urdf only")


def _check_outputs(options: Options, estimate: Estimate) -> None:
    """Refuse outputs that cannot be written, and a new URDF in the place of the robot's own."""
    from tauhat.errors import OutputError
    from tauhat.files import check_output

    inputs = [options.estimate, *([options.source] if options.source else [])]
    for path in (options.urdf, options.mjcf, options.c):
        if path is not None:
            check_output(path, inputs=inputs)
    own = options.urdf
    if own is not None and options.source is None and own.name == estimate.robot.source and own.exists():
        remedy = "choose another name; --source fills it with what was identified"
        raise OutputError("would overwrite the robot's own URDF", where=own, remedy=remedy)


def _written(options: Options, estimate: Estimate, parameters: StandardParameters) -> dict[str, Any]:
    """Write what is asked for; return format -> path and what the format cannot say."""
    from tauhat.export import ccode, mjcf

    documents: dict[str, Any] = {}
    if options.urdf is not None:
        documents["urdf"] = _write_urdf(options.urdf, options.source, estimate, parameters)
    if options.mjcf is not None:
        model = mjcf(estimate.robot, parameters)
        model.save(options.mjcf)
        documents["mjcf"] = _told(options.mjcf, model.left_out, model.set_to_zero)
    if options.c is not None:
        fingerprint = estimate.model.fingerprint
        header = ccode(estimate.robot, parameters, prefix=options.prefix, fingerprint=fingerprint)
        header.save(options.c)
        memory = {"memory": list(parameters.with_memory)}
        documents["c"] = _told(options.c, header.left_out, header.set_to_zero) | memory
    return documents


def _write_urdf(path: Path, source: Path | None, estimate: Estimate, parameters: StandardParameters) -> dict[str, Any]:
    from tauhat.export import fill_urdf, new_urdf

    if source is None:
        made = new_urdf(estimate.robot, parameters)
        made.save(path)
        own = estimate.robot.source if estimate.robot.source.lower().endswith(".urdf") else None
        return _told(path, made.left_out, made.set_to_zero) | {"own": own}
    filled = fill_urdf(source, estimate.robot, parameters)
    filled.save(path)
    links = {"filled": list(filled.filled), "emptied": list(filled.emptied), "kept": list(filled.kept)}
    return _told(path, filled.left_out, filled.set_to_zero) | links


def _told(path: Path, left_out: Mapping[str, float], set_to_zero: Mapping[str, float]) -> dict[str, Any]:
    return {"path": str(path), "left_out": dict(left_out), "set_to_zero": dict(set_to_zero)}


def _document(estimate: Estimate, parameters: StandardParameters, written: Mapping[str, Any]) -> dict[str, Any]:
    fitted = parameters.plain_friction.approximations if written.keys() & {"urdf", "mjcf"} else ()
    return {
        "robot": estimate.robot.name,
        "without": list(parameters.left_out),
        "approximations": [asdict(one) for one in fitted],
        **written,
    }
