"""A Universal Robots arm as a source of samples: position and motor torque of its controller's cycles, as they come.

The controller tells positions and currents of one cycle in one package (RTDE); a program of its own reads them through
`ur_rtde` (see `rtde_reader`), and a map's torque constants make them Nm at the joints. What becomes of a cycle:
    a number that is none                                          skipped, `not_finite`
    the arm is not under power, or stopped by its safety system    skipped, `stopped`: brakes may hold it, which no
                                                                   current tells
    not seen, as its neighbours' time stamps tell                  `lost`
A connection that ends, or is silent for a second, is made anew, until the robot has been away longer than `patience`.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import LiveError, MissingExtraError
from tauhat.live import rtde_reader
from tauhat.live.current_map import CurrentMap
from tauhat.live.rtde_greeting import Controller, greet
from tauhat.sensing.sample_rate import check_rate
from tauhat.sensing.sensor import ForceSensor, Sensed
from tauhat.sensing.stream import JUDGED, SensorStream

SCHEME = "ur://"
_RUNNING = 7  # the robot mode in which motors carry the arm
_MODES = {
    -1: "no controller", 0: "disconnected", 1: "confirm safety", 2: "booting", 3: "power off", 4: "power on",
    5: "idle, brakes engaged", 6: "back-drive", 8: "updating firmware",
}  # fmt: skip
_STOPS = {
    2: "protective stop", 5: "system emergency stop", 6: "robot emergency stop", 7: "emergency stop",
    8: "safety violation", 9: "safety fault",
}  # fmt: skip
_ENDS = {
    rtde_reader.NOT_CONNECTED: "the controller took no connection", rtde_reader.SILENT: "the controller fell silent",
    rtde_reader.DISCONNECTED: "the connection was closed", rtde_reader.HUNG: "ur_rtde hung",
}  # fmt: skip
_PIPE = 2**20  # [bytes] eight seconds of an e-Series
_BETWEEN = 0.25  # [s] between attempts to find a robot again
_CLOSING = 2.0  # [s] the reader is given to end


class LiveSample(NamedTuple):
    """Time stamp [s], position (n_v,) [rad] and motor torque (n_v,) [Nm], both of one cycle, joint side."""

    t: float
    q: FloatArray
    tau: FloatArray


class RobotCycle(NamedTuple):
    """What the controller told of one cycle, as it told it.

    t : since it was started [s]
    q : (6,) [rad]
    current, target_current : (6,) [A]
    target_moment : (6,) by the controller's own model [Nm]
    temperature : (6,) of the joints [deg C]
    mode : of the robot; 7 where it runs
    safety : bits of the safety system
    """

    t: float
    q: FloatArray
    current: FloatArray
    target_current: FloatArray
    target_moment: FloatArray
    temperature: FloatArray
    mode: int
    safety: int

    @property
    def state(self) -> str:
        """What the arm does: running, or why not."""
        stops = [name for bit, name in _STOPS.items() if self.safety >> bit & 1]
        if stops:
            return ", ".join(stops)
        return "running" if self.mode == _RUNNING else _MODES.get(self.mode, f"mode {self.mode}")


class LinkCounts(NamedTuple):
    """What became of a controller's cycles, and how often it was lost and found again."""

    taken: int = 0
    lost: int = 0
    stopped: int = 0
    not_finite: int = 0
    disconnects: int = 0
    reconnects: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UniversalRobot:
    """A CB3 or e-Series arm at an address of the network.

    address : name or number, also as `ur://ADDRESS`
    currents : torque constants and signs, as of the map of its logs
    rate : cycles wanted a second [Hz]: 125 or 500 over a whole number; all of them by default
    patience : how long it may be away before that is an error [s]
    silence : after which a connection counts as lost [s]
    """

    address: str
    currents: CurrentMap
    rate: float | None = None
    patience: float = 10.0
    silence: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "address", self.address.removeprefix(SCHEME).rstrip("/"))
        if not self.address or self.address.startswith("-") or not self.address.isprintable():
            raise LiveError("not an address", where=f"{SCHEME}{self.address[:80]}", expected=f"{SCHEME}NAME or NUMBER")
        for name in ("patience", "silence"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise LiveError(f"{name} of a robot", expected="above zero", got=f"{getattr(self, name)} s")

    def connect(self) -> RobotLink:
        """Return a connection, to be closed by `with`.

        Raises
        ------
        MissingExtraError
            when `ur_rtde` is not installed.
        LiveError
            nobody answers within two seconds, no controller does, it is too old, or it has no such rate.
        """
        if importlib.util.find_spec("rtde_receive") is None:
            raise MissingExtraError("ur_rtde", "universal-robots")
        return RobotLink(self, self.greeted())

    def greeted(self) -> Controller:
        """Return the controller, after it said that it is one and has the rate; errors as `connect`."""
        controller = greet(self.address, rtde_reader.VARIABLES)
        rate = controller.fastest if self.rate is None else self.rate
        parts = controller.fastest / rate if rate > 0.0 else 0.0
        if not (parts >= 1.0 and abs(parts - round(parts)) < 1e-9 * parts):
            raise LiveError(
                "a rate that the controller does not have", where=f"{SCHEME}{self.address}", got=f"{rate:g} Hz",
                expected=f"{controller.fastest:g} Hz over a whole number (software {controller.version})",
            )  # fmt: skip
        return controller


class RobotLink:
    """A connection to a robot: its samples in a loop, None for a cycle that is none, or while it is sought again.

    controller : what answered
    rate : cycles a second [Hz]
    counts : what became of the cycles so far
    state : what the arm does: running, a stop by its name, or disconnected
    """

    def __init__(self, robot: UniversalRobot, controller: Controller) -> None:
        self.robot = robot
        self.controller = controller
        self.rate = controller.fastest if robot.rate is None else robot.rate
        self.counts = LinkCounts()
        self.state = "connecting"
        self._reader = self._started()
        self._end = ""
        self._stopped = False

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the connection."""
        self.close()

    def check_rate_of(self, sensor: ForceSensor) -> None:
        """Refuse a sensor for another rate, by `SensingError`; the controller has agreed to its own."""
        check_rate(np.array([0.0, 1.0 / self.rate]), sensor.rate, where=f"{SCHEME}{self.robot.address}")

    def close(self) -> None:
        """End the connection and what reads it."""
        self.stop()
        self._put_away()

    def stop(self) -> None:
        """Let the loop over samples end at once, also one that waits in another thread; it does not wait for it."""
        self._stopped = True
        if self._reader.poll() is None:
            self._reader.terminate()

    def _put_away(self) -> None:
        """Wait until the program that reads has ended, but not for long."""
        with suppress(subprocess.TimeoutExpired):
            self._reader.wait(_CLOSING)
        if self._reader.poll() is None:
            self._reader.kill()
            self._reader.wait()
        if self._reader.stdout is not None:
            self._reader.stdout.close()

    def __iter__(self) -> Iterator[LiveSample | None]:
        """Yield samples; errors as `cycles`."""
        currents = self.robot.currents
        for cycle in self.cycles():
            yield None if cycle is None else LiveSample(cycle.t, *currents.joint_side(cycle.q, cycle.current))

    def cycles(self) -> Iterator[RobotCycle | None]:
        """Yield what the controller tells, None for a cycle that is none and at each attempt to find the robot again.

        Raises
        ------
        LiveError
            when the robot has been away for longer than `patience`.
        """
        heard = time.monotonic()
        while True:
            found = None
            for found in self._told():
                yield self._judged(found)
            heard = heard if found is None else time.monotonic()
            if self._stopped:
                return
            self._put_away()
            self._end = _ENDS.get(self._reader.returncode, f"ur_rtde ended with status {self._reader.returncode}")
            self.state = "disconnected"
            self._add(disconnects=int(found is not None))
            yield from self._sought(heard)

    def _sought(self, heard: float) -> Iterator[None]:
        """Yield until the controller answers again and is read again."""
        while not self._stopped:
            yield None
            if time.monotonic() - heard > self.robot.patience:
                raise LiveError(
                    "the robot is gone", where=f"{SCHEME}{self.robot.address}", got=self._end,
                    expected=f"back within {self.robot.patience:g} s",
                )  # fmt: skip
            time.sleep(_BETWEEN)
            try:
                self.robot.greeted()
            except LiveError as error:
                self._end = error.got or error.what
                continue
            self._reader = self._started()
            return

    def _told(self) -> Iterator[RobotCycle]:
        """Yield the cycles of one connection; count those lost in between, and the connection where it is a new one."""
        last = np.nan
        pipe = self._reader.stdout
        while pipe is not None and len(block := pipe.read(rtde_reader.CYCLE.size)) == rtde_reader.CYCLE.size:
            numbers = read_only(np.frombuffer(block, dtype="<f8").astype(np.float64))
            t = float(numbers[0])
            if np.isnan(last):
                self._add(reconnects=int(self.counts.disconnects > self.counts.reconnects))
            elif last < t:
                self._add(lost=max(0, round((t - last) * self.rate) - 1))
            last = t
            q, current, target_current, target_moment, temperature = numbers[1:31].reshape(5, 6)
            state = (int(numbers[31]), int(numbers[32]))
            yield RobotCycle(t, q, current, target_current, target_moment, temperature, *state)

    def _judged(self, cycle: RobotCycle) -> RobotCycle | None:
        self.state = cycle.state
        if self.state != "running":
            self._add(stopped=1)
        elif not (np.isfinite(cycle.t) and np.isfinite(cycle.q).all() and np.isfinite(cycle.current).all()):
            self._add(not_finite=1)
        else:
            self._add(taken=1)
            return cycle
        return None

    def _add(self, **more: int) -> None:
        self.counts = self.counts._replace(**{name: getattr(self.counts, name) + count for name, count in more.items()})

    def _started(self) -> subprocess.Popen[bytes]:
        """Return the program that reads the controller."""
        program = str(Path(rtde_reader.__file__))
        numbers = [repr(float(value)) for value in (self.rate, self.robot.silence)]
        command = [sys.executable, "-P", program, self.robot.address, *numbers]
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, pipesize=_PIPE)


def sensed(sensor: ForceSensor, samples: Iterable[LiveSample | None]) -> Iterator[tuple[LiveSample, Sensed]]:
    """Yield what a sensor makes of samples as they come; a sample that it skips is passed over.

    The rate of a link is the controller's word, that of other samples is told by their time stamps.

    Raises
    ------
    SensingError
        samples of another rate or number of joints than the sensor's.
    LiveError
        when the robot that they come from is gone.
    """
    judged: int | None = JUDGED
    if isinstance(samples, RobotLink):
        samples.check_rate_of(sensor)
        judged = None
    stream = SensorStream(sensor=sensor, name="robot", judged=judged)
    memory = stream.start()
    for sample in samples:
        if sample is None:
            continue
        memory, told = stream.take(memory, sample.t, sample.q, sample.tau)
        if told is not None:
            yield sample, told
