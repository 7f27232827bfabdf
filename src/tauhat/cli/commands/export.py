"""`tauhat export`: an estimate as URDF, MuJoCo model or C code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import EstimateArgument, JsonOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from rich.console import RenderableType

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
    from tauhat.estimation.estimate import load_estimate
    from tauhat.export import standard_parameters
    from tauhat.files import check_output

    _check_options(options)
    estimate = load_estimate(options.estimate)
    for path in (options.urdf, options.mjcf, options.c):
        if path is not None:
            check_output(path, inputs=[options.estimate, *([options.source] if options.source else [])])
    without = tuple(key.strip() for key in options.without.split(",") if key.strip())
    parameters = standard_parameters(estimate, without=without)
    with working("writing"):
        written = _written(options, estimate, parameters)
    document = {"robot": estimate.robot.name, "without": list(parameters.left_out), **written}
    show(document, lambda: _view(document), as_json=options.as_json)


def _check_options(options: Options) -> None:
    if options.urdf is None and options.mjcf is None and options.c is None:
        raise typer.BadParameter("nothing to write; give --urdf, --mjcf or --c")
    if options.source is not None and options.urdf is None:
        raise typer.BadParameter("--source is of use with --urdf only")


def _written(options: Options, estimate: Estimate, parameters: StandardParameters) -> dict[str, Any]:
    """Write what is asked for; return format -> path and what the format cannot say."""
    from tauhat.export import ccode, mjcf

    documents: dict[str, Any] = {}
    if options.urdf is not None:
        documents["urdf"] = _write_urdf(options.urdf, options.source, estimate, parameters)
    if options.mjcf is not None:
        model = mjcf(estimate.robot, parameters)
        model.save(options.mjcf)
        documents["mjcf"] = {"path": str(options.mjcf), "left_out": dict(model.left_out)}
    if options.c is not None:
        fingerprint = estimate.model.fingerprint
        header = ccode(estimate.robot, parameters, prefix=options.prefix, fingerprint=fingerprint)
        header.save(options.c)
        documents["c"] = {"path": str(options.c), "left_out": dict(header.left_out)}
    return documents


def _write_urdf(path: Path, source: Path | None, estimate: Estimate, parameters: StandardParameters) -> dict[str, Any]:
    from tauhat.errors import ExportError
    from tauhat.export import fill_urdf, new_urdf

    if source is not None:
        filled = fill_urdf(source, estimate.robot, parameters)
        filled.save(path)
        links = {"filled": list(filled.filled), "emptied": list(filled.emptied), "kept": list(filled.kept)}
        return {"path": str(path), "left_out": dict(filled.left_out), **links}
    if estimate.robot.source.lower().endswith(".urdf"):
        raise ExportError("the robot has a URDF of its own", where=estimate.robot.source, remedy="give it by --source")
    made = new_urdf(estimate.robot, parameters)
    made.save(path)
    return {"path": str(path), "left_out": dict(made.left_out)}


def _view(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    if document["without"]:
        yield f"Left out as asked: {', '.join(document['without'])}."
    for name in ("urdf", "mjcf", "c"):
        told = document.get(name)
        if told is None:
            continue
        yield unbroken(f"Written: {told['path']}")
        if told.get("emptied"):
            yield f"  fixed to a moving link, which holds their inertia now: {', '.join(told['emptied'])}"
        if told.get("kept"):
            yield f"  behind locked joints, kept as they were: {', '.join(told['kept'])}"
        if told["left_out"]:
            sizes = ", ".join(f"{key} (up to {size:.3g})" for key, size in told["left_out"].items())
            yield f"  the format has no word for: {sizes}"
