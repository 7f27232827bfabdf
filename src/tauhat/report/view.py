"""An arm running a motion in the browser: viser serves it on this machine alone."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import MissingExtraError, OutputError
from tauhat.report.arm_scene import draw_arm, move_arm
from tauhat.report.replay import Replay

HOST = "127.0.0.1"
_FRAMES_PER_SECOND = 30.0
_BARS_PER_SECOND = 8.0
_AWAY, _AZIMUTH = 1.78, 0.666  # of the camera: parts of the reach, [rad] from the x axis or the region
_REGION, _PATH = (47, 158, 98), (176, 68, 127)
_REGION_WIDTH, _PATH_WIDTH = 3.0, 1.5  # [px]


class Viewer:
    """A running view of a motion: the scene, its controls, and the time that is shown.

    Parameters
    ----------
    port : on this machine
    outline : lines of a region in the base frame, (n, 3) each [m]
    path : of the tool in the base frame, (n, 3) [m]
    """

    def __init__(
        self, replay: Replay, *, port: int, outline: Sequence[FloatArray] = (), path: FloatArray | None = None
    ) -> None:
        self._replay = replay
        self.server = _server(port)
        self._frames = draw_arm(self.server.scene, replay.body, reach=replay.reach)
        _draw(self.server.scene, "/region", outline, colour=_REGION, width=_REGION_WIDTH)
        _draw(self.server.scene, "/path", () if path is None else (path,), colour=_PATH, width=_PATH_WIDTH)
        self._server_looks_at(replay.reach, outline)
        gui = self.server.gui
        gui.configure_theme(show_share_button=False, show_logo=False)
        gui.main_panel.dock_right()
        self._play = gui.add_checkbox("Play", initial_value=True)
        self._time = gui.add_slider("Time (s)", 0.0, max(replay.duration, 1e-3), 1e-3, 0.0)
        self._speed = gui.add_slider("Speed", 0.05, 3.0, 0.05, 1.0)
        with gui.add_folder("Used part of the limits"):
            self._bars = gui.add_html(replay.margins(0))
        self._shown = 0.0
        self._bars_due = 0.0
        self.show(0.0)

    @property
    def url(self) -> str:
        """Where the browser finds it."""
        return f"http://{HOST}:{self.server.get_port()}"

    def show(self, moment: float) -> None:
        """Put the arm where it is at a time of the motion [s]."""
        index, poses = self._replay.index(moment), self._replay.poses
        with self.server.atomic():
            move_arm(self._frames, poses, index)
        now = time.monotonic()
        if now >= self._bars_due:
            self._bars.content = self._replay.margins(index)
            self._bars_due = now + 1.0 / _BARS_PER_SECOND

    def step(self, elapsed: float) -> None:
        """Move on by `elapsed` seconds at the chosen speed, or to where the reader dragged the time."""
        dragged = self._time.value
        if self._play.value and abs(dragged - self._shown) < 2e-3:
            after = dragged + elapsed * self._speed.value
            self._time.value = dragged = after % self._replay.duration if self._replay.duration > 0 else 0.0
        self._shown = dragged
        self.show(dragged)

    def run(self) -> None:
        """Run until the process is interrupted."""
        last = time.monotonic()
        try:
            while True:
                time.sleep(1.0 / _FRAMES_PER_SECOND)
                now = time.monotonic()
                self.step(now - last)
                last = now
        finally:
            self.stop()

    def stop(self) -> None:
        """Close the server."""
        with redirect_stdout(StringIO()):
            self.server.stop()

    def _server_looks_at(self, reach: float, outline: Sequence[FloatArray]) -> None:
        """Put the camera beside the arm, on the side where the region is if there is one."""
        camera, angle = self.server.initial_camera, _AZIMUTH
        if outline:
            x, y, _ = np.concatenate(list(outline)).mean(axis=0)
            angle += float(np.arctan2(y, x))
        camera.position = (_AWAY * reach * np.cos(angle), _AWAY * reach * np.sin(angle), reach)
        camera.look_at = (0.0, 0.0, 0.1 * reach)


def _server(port: int) -> Any:
    try:
        import viser
    except ImportError as error:
        raise MissingExtraError("viser", "view") from error
    try:
        with redirect_stdout(StringIO()):  # viser greets on standard output
            return viser.ViserServer(host=HOST, port=port, label="tauhat", verbose=False)
    except (OSError, OverflowError) as error:
        raise OutputError("the port cannot be used", got=port, remedy="choose another with --port") from error


def _draw(scene: Any, name: str, lines: Sequence[FloatArray], *, colour: tuple[int, int, int], width: float) -> None:
    """Draw lines, (n, 3) each [m]."""
    parts = [np.stack([line[:-1], line[1:]], axis=1) for line in lines if len(line) > 1]
    if parts:
        scene.add_line_segments(
            name, points=np.concatenate(parts), colors=colour, thickness=width, thickness_units="screen"
        )
