"""`tauhat view`: an arm running a motion, in the browser."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import JsonOption, LockOption, MapOption, RowsOption
from tauhat.cli.output import show, unbroken

if TYPE_CHECKING:
    from tauhat.recordings.recording import Recording
    from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat view` takes."""

    motion: Annotated[
        Path,
        typer.Argument(
            metavar="MOTION", help="Motion or recording: CSV, Parquet, NPZ or MAT.", show_default=False, readable=False
        ),
    ]
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", metavar="ROBOT", help="Which robot runs it.", show_default="the built-in one with these joints"
        ),
    ] = None
    task: Annotated[
        Path | None,
        typer.Option(
            "--task",
            metavar="TASK.toml",
            help="Draw the region of this task and the way of the tool as well.",
            show_default=False,
            readable=False,
        ),
    ] = None
    map_file: MapOption = None
    rows: RowsOption = None
    lock: LockOption = None
    port: Annotated[int, typer.Option("--port", min=1, max=65535, help="Port on this machine.")] = 8080
    no_open: Annotated[bool, typer.Option("--no-open", help="Only print the address; open no browser.")] = False
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Show the arm running a motion in the browser, with how much of its limits it uses, until interrupted."""
    import webbrowser

    from tauhat.recordings.reading import read_recording
    from tauhat.report.replay import replay
    from tauhat.report.view import Viewer
    from tauhat.robots.library import load_robot

    recording = read_recording(options.motion, map=options.map_file, rows=options.rows)
    robot = load_robot(options.robot, locked=options.lock) if options.robot else _robot_of(recording)
    film = replay(robot, recording)
    drawn = {} if options.task is None else _drawn(options.task, robot, recording)
    viewer = Viewer(film, port=options.port, **drawn)
    document = {"url": viewer.url, "robot": robot.name, "seconds": film.duration}
    text = f"{robot.name} runs {options.motion} at\n  {viewer.url}\n(this machine only). Ctrl-C ends it."
    show(document, lambda: [unbroken(text)], as_json=options.as_json)
    if not options.no_open:
        webbrowser.open(viewer.url)
    with suppress(KeyboardInterrupt):
        viewer.run()


def _drawn(task: Path, robot: Robot, recording: Recording) -> dict[str, Any]:
    """Return the lines of a task's region, and the way of its tool."""
    from tauhat.excitation.limits import tool_frame
    from tauhat.excitation.task_design import load_task
    from tauhat.robots.kinematics import forward_kinematics

    settings = load_task(task, robot)
    frame = tool_frame(robot, settings.frame).name
    path = forward_kinematics(robot, recording.q, frame=frame).translation
    return {"outline": settings.region.outline(), "path": path}


def _robot_of(recording: Recording) -> Robot:
    """Return the only built-in robot with the joints of the recording."""
    from tauhat.errors import RobotError
    from tauhat.robots.library import builtin_names, load_robot

    fitting = [name for name in builtin_names() if load_robot(name).joint_names == recording.joint_names]
    if len(fitting) == 1:
        return load_robot(fitting[0])
    raise RobotError(
        "several robots have these joints" if fitting else "no built-in robot has these joints",
        where=recording.name,
        got=", ".join(fitting or recording.joint_names),
        remedy="name the robot with --robot",
    )
