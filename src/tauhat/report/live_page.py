"""The live page: the arm, the force on it with its error, the last seconds, contacts, and a button that zeroes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.report.contact_log import ContactLog
from tauhat.report.force_marks import ErrorEllipsoid, direction_text, error_ellipsoid, full_scale
from tauhat.report.live_panel import (
    STYLE,
    boxed,
    contacts_html,
    counts_html,
    joints_html,
    size_of_force,
    status_html,
    wrench_html,
)
from tauhat.report.live_plots import History, Plots
from tauhat.report.live_scene import LiveScene
from tauhat.robots.robot import Robot
from tauhat.sensing.touch import Touch
from tauhat.sensing.wrench import Axes

_REFRESH = 0.1  # [s] between drawings of words and plots
_SILENT = 1.0  # [s] without a new sample
_WIDE = 100.0  # [N] error bar along a direction beyond which the force is said to be unknown there
_LEAST = 10.0  # [N] smallest full scale of the arrow
_MOST_STREAMS = 16
_BETWEEN_ZEROS = 1.0  # [s]: a button pressed twice is meant once
_PANEL = 430  # [px]
_LAST = "Its client has left: the arm and the numbers are as last told, and no force is drawn."
_HINT = "Take what is felt now for zero. Nothing may touch the arm."


class Reading(Protocol):
    """One moment of one stream, as the server's `Snapshot` states it."""

    @property
    def stream(self) -> str:
        """Its name."""

    @property
    def t(self) -> float:
        """Time stamp [s]."""

    @property
    def q(self) -> FloatArray:
        """Position, (n_v,) [rad or m]."""

    @property
    def tau(self) -> FloatArray:
        """External torque, (n_v,) [Nm or N]."""

    @property
    def tau_std(self) -> FloatArray:
        """Its standard error, (n_v,)."""

    @property
    def wrench(self) -> FloatArray:
        """Force and moment at the frame, (6,) [N, Nm]."""

    @property
    def covariance(self) -> FloatArray:
        """Of the wrench, (6, 6)."""

    @property
    def contacts(self) -> tuple[Touch, ...]:
        """Those that have ended since the last reading, and last the one that goes on, if there is one."""

    @property
    def counts(self) -> Mapping[str, int]:
        """What became of the samples, by name."""


class _Stream:
    """What is kept of one stream: newest reading, when it began and last went on, its last seconds, its contacts.

    has_ended : whether its client has left
    """

    def __init__(self, n_v: int, now: float) -> None:
        self.newest: Reading | None = None
        self.has_ended = False
        self.began_at = self.alive_at = now
        self.history = History(n_v)
        self.contacts = ContactLog()

    def take(self, reading: Reading, now: float) -> None:
        if self.newest is None or reading.t != self.newest.t:
            self.alive_at = now
        self.newest = reading
        force, variances = np.asarray(reading.wrench)[:3], np.diagonal(reading.covariance)[:3]
        self.history.add(reading.t, force, np.sqrt(np.maximum(variances, 0.0)), reading.tau)
        for touch in reading.contacts:
            self.contacts.see(touch)

    def end(self, contacts: Sequence[Touch]) -> None:
        self.has_ended = True
        for touch in contacts:
            self.contacts.see(touch)
        self.contacts.end()

    def is_alive(self, now: float) -> bool:
        return not self.has_ended and now - self.alive_at < _SILENT


class LivePage:
    """A page that shows readings as they come.

    Parameters
    ----------
    server : viser's
    frame : where the force acts; the robot's last where not stated
    axes : whose axes readings are along
    clock : seconds that never run backwards
    """

    def __init__(
        self,
        server: Any,
        robot: Robot,
        *,
        frame: str | None = None,
        axes: Axes = "base",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._server, self._robot, self._axes, self._clock = server, robot, axes, clock
        self._streams: dict[str, _Stream] = {}
        self._commands: deque[str] = deque(maxlen=4)
        self._zeroed_at = -np.inf
        self._drawn_at = -np.inf
        self._scale = _LEAST
        self._scene = LiveScene(server, robot, frame=frame, axes=axes)
        gui = server.gui
        gui.configure_theme(show_share_button=False, show_logo=False)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_PANEL)
        gui.add_html(STYLE)
        self._status = gui.add_html(status_html("waiting", "waiting for the first sample", ""))
        self._choice = gui.add_dropdown("Stream", ("",), visible=False)
        self._choice.on_update(self._hear_choice)
        self._chosen = ""  # by hand
        self._drawn: Reading | None = None
        self._plotted: Reading | None = None
        self._wrench = gui.add_html("")
        self._zero = gui.add_button("Zero", hint=_HINT, icon="circle")
        self._zero.on_click(lambda _: self._ask_for_zero())
        self._notes = gui.add_html("")
        self._plots = Plots(gui, robot.n_v)
        self._contacts = gui.add_html(contacts_html(()))
        self._counts = gui.add_html("")

    def show(self, reading: Reading) -> None:
        """Take a reading, and draw the arm and the force if its stream is the one that is looked at."""
        now = self._clock()
        stream = self._streams.get(reading.stream)
        if stream is None:
            stream = self._begin(reading.stream, now)
        stream.take(reading, now)
        self._follow(reading.stream, now)
        if stream is self._seen():
            self._draw(stream, reading)

    def end(self, name: str, contacts: Sequence[Touch] = ()) -> None:
        """Take note that a stream has ended: no force is drawn any more, and its last contact is over.

        Parameters
        ----------
        contacts : of the stream since its last reading
        """
        stream = self._streams.get(name)
        if stream is None:
            return
        stream.end(contacts)
        if stream is self._seen():
            self._scene.hide_force()

    def refresh(self) -> None:
        """Draw words and plots if it is time to and somebody looks; call it often."""
        now = self._clock()
        if now - self._drawn_at < _REFRESH or not self._server.get_clients():
            return
        self._drawn_at = now
        stream = self._seen()
        if stream is None or stream.newest is None:
            return
        reading = stream.newest
        with self._server.atomic():
            if self._drawn is not reading:  # another stream was chosen, and says nothing
                self._draw(stream, reading)
            self._wrench.content = wrench_html(reading.wrench, reading.covariance, axes=self._axes)
            self._plots.words.content = joints_html(self._robot.joint_names, reading.tau, reading.tau_std)
            self._contacts.content = contacts_html(stream.contacts.contacts)
            self._counts.content = counts_html(reading.counts)
            self._say_state(stream, reading, now)
            if stream.is_alive(now) or self._plotted is not reading:
                self._plots.show(stream.history)
                self._plotted = reading

    def commands(self) -> list[str]:
        """Return what was asked for on the page since the last call: `zero`."""
        asked = []
        while self._commands:
            asked.append(self._commands.popleft())
        return asked

    def _begin(self, name: str, now: float) -> _Stream:
        """Return a new stream; of too many, one that has ended is forgotten, or that has been silent longest."""
        if len(self._streams) >= _MOST_STREAMS:
            known = self._streams
            del known[min(known, key=lambda one: (not known[one].has_ended, known[one].alive_at))]
        self._streams[name] = stream = _Stream(self._robot.n_v, now)
        self._choice.options = tuple(self._streams)
        self._choice.visible = len(self._streams) > 1
        return stream

    def _follow(self, name: str, now: float) -> None:
        """Look at this stream if it began after the one that is looked at ended or fell silent: its client came again.

        A stream that was chosen by hand stays, and none that ran beside it takes its place.
        """
        seen = self._seen()
        if seen is not None and (self._choice.value == self._chosen or seen.is_alive(now)):
            return
        if seen is None or self._streams[name].began_at > seen.alive_at:
            self._choice.value = name

    def _hear_choice(self, event: Any) -> None:
        if event.client is not None:
            self._chosen = self._choice.value

    def _seen(self) -> _Stream | None:
        return self._streams.get(self._choice.value)

    def _draw(self, stream: _Stream, reading: Reading) -> None:
        error = self._error(reading, stream.history)
        self._scene.show(reading.q, np.asarray(reading.wrench)[:3], error, scale=self._scale)
        if stream.has_ended:
            self._scene.hide_force()
        self._drawn = reading

    def _error(self, reading: Reading, history: History) -> ErrorEllipsoid:
        """Return the error as it is drawn, and let arrow and ellipsoid fit the picture."""
        covariance = np.asarray(reading.covariance)[:3, :3]
        widest = error_ellipsoid(covariance, largest=np.inf).widest
        size = max(float(np.linalg.norm(np.asarray(reading.wrench)[:3])), history.largest_force(), min(widest, _WIDE))
        self._scale = full_scale(size, least=_LEAST, current=self._scale)
        return error_ellipsoid(covariance, largest=self._scene.largest_error(self._scale))

    def _say_state(self, stream: _Stream, reading: Reading, now: float) -> None:
        silent = now - stream.alive_at
        self._scene.colour(stale=silent >= _SILENT)
        error = self._error(reading, stream.history)
        touch = reading.contacts[-1] if reading.contacts else None
        if stream.has_ended:
            state, words = "ended", "the stream has ended"
        elif silent >= _SILENT:
            state, words = "silent", f"silent for {silent:.0f} s"
        elif error.bar > _WIDE:
            place = direction_text(error.axes[:, -1])
            state, words = "wide", f"live, error bar too wide: ± {error.bar:.0f} N along {place}"
        else:
            state, words = "live", f"live, contact at {touch.link}" if touch is not None and touch.open else "live"
        where = f"{reading.stream}, t = {reading.t:.1f} s"
        self._status.content = status_html(state, words, where)
        caption = _LAST if stream.has_ended else self._caption(reading, error, now)
        self._notes.content = boxed(f'<span class="faint">{caption}</span>')

    def _caption(self, reading: Reading, error: ErrorEllipsoid, now: float) -> str:
        size, bar = size_of_force(np.asarray(reading.wrench), np.asarray(reading.covariance))
        asked = f"Zero was asked for {now - self._zeroed_at:.0f} s ago. " if now - self._zeroed_at < 30.0 else ""
        doubt = "The force is within its error bar. " if size < bar else ""
        cut = "".join(f" Cut off along {direction_text(one)}: the joints tell too little there." for one in error.cut)
        return (
            f"{asked}{doubt}Arrow: force on the arm, {100 * self._scene.full_length:.0f} cm is {self._scale:g} N. "
            f"Ellipsoid: where its tip is with 95 % probability, in all directions at once; ± is 95 % along one.{cut}"
        )

    def _ask_for_zero(self) -> None:
        now = self._clock()
        if now - self._zeroed_at >= _BETWEEN_ZEROS:
            self._zeroed_at = now
            self._commands.append("zero")
