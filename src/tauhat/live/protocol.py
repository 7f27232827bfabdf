"""What goes over the wire: one JSON object a message, text in UTF-8, the same on every channel.

From the client
    {"t": 0.004, "q": [0.1, -1.2], "tau": [3.1, 20.4]}    a sample: s, rad or m, Nm or N, joint side; may name "joints"
    {"command": "zero"}                                   what is sensed now is nothing; "unzero" forgets that
    {"command": "counts"}                                 how many samples were taken, and why others were not
    {"command": "follow"}                                 the answers to the robot that the server itself reads
    {"command": "end"}                                    no more will come; over UDP, which has no other end
    {"token": "..."}                                      the first message where the server asks for a token

From the server
    {"hello": "tauhat", "protocol": 1, "robot": ..}       once, when samples may come
    {"t": .., "tau_ext": [..], "tau_ext_std": [..], ..}   the answer to the sample with this time stamp
    {"notice": "dropped", ..}                             something that changes no answer; see `notice_text`
    {"refused": ".."}                                     why the server ends the conversation

Size and nesting are judged on the bytes, before anything is decoded; nothing but JSON is ever decoded.
"""

from __future__ import annotations

import json
import re
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.live.limits import Limits
from tauhat.robots.robot import Robot
from tauhat.sensing.sample_lines import Sample, sample_of

PROTOCOL = 1
ZEROS = ("zero", "unzero")
COMMANDS = (*ZEROS, "counts", "follow", "end")
_NO_NUMBER = re.compile(r"-?(?:nan|inf)")
_LARGEST_REFUSAL = 300  # [characters]; on datagrams an answer shall not be much longer than what it answers


class Command(NamedTuple):
    """What a client asks for."""

    name: str


class Token(NamedTuple):
    """Who a client says it is."""

    token: object


Message: TypeAlias = "Sample | Command | Token"


def decoded(data: bytes, limits: Limits) -> dict[str, Any] | None:
    """Return the JSON object of a message, None for one that is none, too long or too deep.

    Openings are counted, not followed: they bound the nesting, in a microsecond and on any bytes.
    """
    if len(data) > limits.message or data.count(b"[") + data.count(b"{") > limits.openings:
        return None
    try:
        found = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def message_of(found: dict[str, Any] | None, robot: Robot, *, where: str) -> Message | None:
    """Return what a decoded message says, None where it is no sample, command or token.

    Raises
    ------
    SensingError
        samples that name the joints of another robot.
    """
    if found is None:
        return None
    if "t" in found:
        return sample_of(found, robot, where=where)
    name = found.get("command")
    if isinstance(name, str) and name in COMMANDS:
        return Command(name)
    return Token(found["token"]) if "token" in found else None


class AnswerForm:
    """How answers of an arm are written: a line with places for numbers, filled in one go.

    Parameters
    ----------
    n_v : number of joints
    """

    __slots__ = ("_form",)

    def __init__(self, n_v: int) -> None:
        joints, wrench = ("[" + ", ".join(["%.6g"] * count) + "]" for count in (n_v, 6))
        self._form = (
            f'{{"t": %r, "tau_ext": {joints}, "tau_ext_std": {joints}, "wrench": {wrench}, "wrench_std": {wrench}'
        )

    def text(self, t: float, values: tuple[FloatArray, ...], more: str = "") -> str:
        """Return an answer; numbers that are none become null.

        Parameters
        ----------
        t : time stamp of the sample [s]
        values : external torque (n_v,), its variance (n_v,), wrench (6,), its covariance (6, 6)
        more : further members, each behind a comma
        """
        tau, variance, wrench, covariance = values
        spread, wrench_spread = np.sqrt(variance), np.sqrt(covariance.diagonal())
        line = self._form % (t, *tau.tolist(), *spread.tolist(), *wrench.tolist(), *wrench_spread.tolist())
        if "nan" in line or "inf" in line:
            line = _NO_NUMBER.sub("null", line)
        return f"{line}{more}}}"


def hello_text(**facts: Any) -> str:
    """Return the server's first message."""
    return json.dumps({"hello": "tauhat", "protocol": PROTOCOL, **facts})


def notice_text(kind: str, **facts: Any) -> str:
    """Return a notice.

    dropped : a reader is too slow; `count` answers were dropped before the next, `total` so far
    skipped : samples were not taken; `counts` of all kinds
    frozen : samples repeat to the bit, as of a controller that hangs; `counts` of all kinds
    slowed : more messages a second than granted; they are read more slowly, datagrams skipped
    zero : what is taken off the external torque, `tau_ext`; null where there is nothing to take it off, and `why`
    counts : as asked for
    follow : the answers to `robot`, which is in `state`, are yours from now on; null where the server reads none
    robot : the robot that is followed is in another `state`: running, or why not
    ended : the server ends
    """
    return json.dumps({"notice": kind, **facts})


def refusal_text(reason: object) -> str:
    """Return why the conversation ends."""
    return json.dumps({"refused": str(reason)[:_LARGEST_REFUSAL]})
