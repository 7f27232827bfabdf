"""A program of its own that reads a Universal Robots controller through `ur_rtde`: cycles to standard output.

Of its own, because the library is compiled and ends the process when an answer of the controller surprises it, prints
what it likes, and has calls without a time limit. Here that ends this program only; whoever started it goes on. Nothing
but the standard library and `ur_rtde` is imported: it starts in a tenth of a second.

    python -P rtde_reader.py ADDRESS RATE SILENCE        33 little-endian doubles a cycle, in the order of VARIABLES

All numbers of a cycle are of one package of the controller: the library takes a package as a whole, and a cycle during
whose reading the time stamp changed is read again.
"""

from __future__ import annotations

import faulthandler
import math
import os
import struct
import sys
import time
from typing import Any

VARIABLES = (
    "timestamp", "actual_q", "actual_current", "target_current", "target_moment", "joint_temperatures", "robot_mode",
    "safety_status_bits",
)  # fmt: skip
CYCLE = struct.Struct("<33d")
PARENT_GONE, NO_LIBRARY, NOT_CONNECTED, SILENT, DISCONNECTED, HUNG = 0, 3, 4, 5, 6, 1

_JOINTS = 6
_HANGS = 5.0  # [s] after which a call into the library is taken to hang
_OFTEN = 20.0  # looks a cycle takes at most before its package is there


def main(address: str, rate: float, silence: float) -> int:
    """Write the controller's cycles until there are no more, and end with why as the exit status.

    At once where there was a connection: to take its object apart the library waits for the controller, which takes
    three seconds when that is silent.
    """
    pipe = _own_pipe()
    watching = open(os.devnull, "w")  # noqa: PTH123, SIM115
    faulthandler.dump_traceback_later(_HANGS, exit=True, file=watching)
    try:
        from rtde_receive import RTDEReceiveInterface
    except ImportError:
        return NO_LIBRARY
    try:
        receiver = RTDEReceiveInterface(address, rate, list(VARIABLES))
    except (RuntimeError, ValueError):
        return NOT_CONNECTED
    try:
        status = _pass_on(receiver, pipe, (rate, silence), watching)
    except BrokenPipeError:
        status = PARENT_GONE
    os._exit(status)


def _own_pipe() -> int:
    """Return where the cycles go, after sending elsewhere what the library prints."""
    pipe = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    if os.name == "posix":
        os.set_blocking(pipe, False)
    return pipe


def _pass_on(receiver: Any, pipe: int, times: tuple[float, float], watching: Any) -> int:
    rate, silence = times
    last, heard, watched = math.nan, time.monotonic(), -math.inf
    while True:
        now = time.monotonic()
        if now - watched > 1.0:
            faulthandler.dump_traceback_later(_HANGS, exit=True, file=watching)
            watched = now
        stamp = receiver.getTimestamp()
        cycle = None if stamp == last or math.isnan(stamp) else _cycle(receiver, stamp)
        if cycle is not None:
            _write(pipe, cycle)
            last, heard = stamp, now
            time.sleep(0.4 / rate)
            continue
        if not receiver.isConnected():
            return DISCONNECTED
        if now - heard > silence:
            return SILENT
        time.sleep(1.0 / (_OFTEN * rate))


def _cycle(receiver: Any, stamp: float) -> bytes | None:
    """Return a cycle's numbers, None where the next package came in between."""
    joints = (
        receiver.getActualQ(), receiver.getActualCurrent(), receiver.getTargetCurrent(), receiver.getTargetMoment(),
        receiver.getJointTemperatures(),
    )  # fmt: skip
    state = (receiver.getRobotMode(), receiver.getSafetyStatusBits())
    if receiver.getTimestamp() != stamp or any(len(values) != _JOINTS for values in joints):
        return None
    return CYCLE.pack(stamp, *(value for values in joints for value in values), *state)


def _write(pipe: int, cycle: bytes) -> None:
    try:
        os.write(pipe, cycle)  # whole or not at all: shorter than what a pipe takes at once
    except BlockingIOError:
        return  # nobody reads: the cycle is lost, and its time stamp will tell


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3])))
