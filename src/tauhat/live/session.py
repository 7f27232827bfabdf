"""One client's stream: messages in, answers into its outbox; knows nothing of sockets or clocks."""

from __future__ import annotations

import json
from collections import deque
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.live.feed import Snapshot
from tauhat.live.followers import Followers
from tauhat.live.outbox import Outbox
from tauhat.live.protocol import ZEROS, AnswerForm, Command, decoded, message_of, notice_text
from tauhat.live.service import Service
from tauhat.sensing.contact import ContactSample
from tauhat.sensing.sample_lines import Sample
from tauhat.sensing.sensor import Sensed
from tauhat.sensing.stream import JUDGED, SensorStream
from tauhat.sensing.touch import Touch, TouchFollower

_UNSHOWN = 16  # contacts that have ended since the page was shown anything: of more, the newest


class Session:
    """A stream of samples and what is said about it.

    Parameters
    ----------
    service : sensor, thresholds, limits and page
    name : how messages and the page call the stream
    outbox : where answers go
    followers : of the robot that the server reads; None where this client may not be one
    judged : as of `SensorStream`
    """

    def __init__(
        self, service: Service, *, name: str, outbox: Outbox, followers: Followers | None = None,
        judged: int | None = JUDGED,
    ) -> None:  # fmt: skip
        self.name = name
        self._service = service
        self._outbox = outbox
        self._followers = followers
        self._stream = SensorStream(sensor=service.sensor, name=name, judged=judged)
        self._memory = self._stream.start()
        self._contact = None if service.detector is None else service.detector.start()
        self._touches = None if service.detector is None else TouchFollower(service.detector)
        self._over: deque[Touch] = deque(maxlen=_UNSHOWN)
        self._form = AnswerForm(service.sensor.n_v)
        self._links = {link: json.dumps(link) for link in service.sensor.model.robot.joint_names}
        self._zero: FloatArray | None = None
        self._last: Sensed | None = None
        self._malformed = self._limited = 0
        self._told = {"skipped": -np.inf, "slowed": -np.inf, "frozen": -np.inf}

    @property
    def counts(self) -> dict[str, int]:
        """How many samples were taken, why others were not, and answers that were dropped."""
        counts = self._memory.counts._replace(malformed=self._malformed)
        return counts._asdict() | {"limited": self._limited, "dropped": self._outbox.dropped}

    @property
    def unshown(self) -> tuple[Touch, ...]:
        """Contacts that have ended since the page was shown anything, and the one that goes on, if there is one."""
        newest = None if self._touches is None else self._touches.newest
        return (*self._over, newest) if newest is not None and newest.open else tuple(self._over)

    def receive(self, data: bytes, now: float) -> None:
        """Answer a message.

        Parameters
        ----------
        data : one message as it came
        now : on any clock [s]

        Raises
        ------
        SensingError
            samples of another robot or rate: the conversation is over.
        EOFError
            the client has said that it ends.
        """
        message = message_of(decoded(data, self._service.limits), self._service.sensor.model.robot, where=self.name)
        if isinstance(message, Sample):
            self._take(message, now)
        elif isinstance(message, Command):
            if message.name == "end":
                raise EOFError
            self._obey(message.name)
        elif message is None:
            self._malformed += 1
            self._tell("skipped", now)

    def command(self, name: str) -> bool:
        """Zero or unzero this stream and say so, as its client asks, the page, or who follows it.

        Returns whether it has samples: without them there is nothing to zero, and nothing is said.
        """
        last = self._last
        if name not in ZEROS or last is None:
            return False
        self._zero = last.tau.copy() if name == "zero" else None
        if self._service.detector is not None:
            self._contact = self._service.detector.start()
        taken_off = np.zeros(self._service.sensor.n_v) if self._zero is None else self._zero
        self._outbox.put(notice_text("zero", tau_ext=[float(f"{value:.6g}") for value in taken_off]), answers=0)
        return True

    def _obey(self, name: str) -> None:
        """Do what the client asks for; a follower without samples of its own means the robot's by `zero`."""
        if name == "counts":
            self._outbox.put(notice_text("counts", counts=self.counts), answers=0)
            return
        if name == "follow":
            self._follow()
            return
        followers = self._followers
        if followers is not None and self._outbox in followers and self._last is None:
            done, why = followers.command(name), "no samples of the robot come"
        else:
            done, why = self.command(name), "you have sent no samples, and do not follow the robot"
        if not done:
            self._outbox.put(notice_text("zero", tau_ext=None, why=why), answers=0)

    def _follow(self) -> None:
        followers, robot, state = self._followers, None, None
        if followers is not None and followers.robot is not None:
            followers.add(self._outbox)
            robot, state = followers.robot, followers.state
        self._outbox.put(notice_text("follow", robot=robot, state=state), answers=0)

    def slowed(self, now: float, *, lost: int = 0) -> None:
        """Say that messages come faster than granted, and how many were lost of it."""
        self._limited += lost
        self._tell("slowed", now)

    def _take(self, sample: Sample, now: float) -> None:
        n_v, counts = self._service.sensor.n_v, self._memory.counts
        if not len(sample.q) == n_v == len(sample.tau) and counts.taken:
            self._malformed += 1
            self._tell("skipped", now)
            return
        self._memory, sensed = self._stream.take(self._memory, sample.t, np.array(sample.q), np.array(sample.tau))
        if sensed is None:
            self._tell("skipped", now)
            return
        self._last = sensed
        if self._memory.counts.frozen > counts.frozen:
            self._tell("frozen", now)
        felt = sensed.tau if self._zero is None else sensed.tau - self._zero
        found = self._judged(sensed, felt)
        standing = found.zero if found is not None and self._service.zero == "standing" else None
        tau, wrench = self._less(sensed, felt if standing is None else felt - standing)
        more = "" if found is None else self._said(sample.t, found, wrench)
        self._outbox.put(self._form.text(sample.t, (tau, sensed.variance, wrench, sensed.covariance), more))
        feed = self._service.feed
        if feed.is_due(self.name, now) and feed.publish(self._snapshot(sample.t, sensed, tau, wrench)):
            self._over.clear()

    def _less(self, sensed: Sensed, tau: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return external torque less what is taken off, and its wrench; error bars, which are the model's, stay."""
        if tau is sensed.tau:
            return tau, sensed.wrench
        return tau, self._service.solver.at(sensed.q, tau, sensed.variance + np.square(sensed.lag)).wrench

    def _judged(self, sensed: Sensed, tau: FloatArray) -> ContactSample | None:
        detector, memory = self._service.detector, self._contact
        if detector is None or memory is None:
            return None
        self._contact, found = detector.advance(memory, tau, sensed.variance, sensed.dq, settled=sensed.settled)
        return found

    def _said(self, t: float, found: ContactSample, wrench: FloatArray) -> str:
        """Return what is said of contact, as further members of the answer; an end names the link of the whole."""
        event, link = None, found.link
        if self._touches is not None and self._contact is not None:
            event = self._touches.see(t, self._contact, float(np.linalg.norm(wrench[:3])))
            if event == "end" and self._touches.newest is not None:
                link = self._touches.newest.link
                self._over.append(self._touches.newest)
        told = "null" if link is None else self._links[link]
        said = f', "contact": {"true" if found.contact else "false"}, "excess": {found.excess:.4g}, "link": {told}'
        return said if event is None else f'{said}, "event": "{event}"'

    def _snapshot(self, t: float, sensed: Sensed, tau: FloatArray, wrench: FloatArray) -> Snapshot:
        counts = self._memory.counts
        return Snapshot(
            self.name, t, sensed.q, tau, np.sqrt(sensed.variance), wrench, sensed.covariance,
            self.unshown,
            {
                "taken": counts.taken, "late": counts.late + counts.repeated, "not_finite": counts.not_finite,
                "dropped": self._outbox.dropped, "refused": self._malformed + self._limited,
                "restarts": counts.restarts, "frozen": counts.frozen,
            },
        )  # fmt: skip

    def _tell(self, kind: str, now: float) -> None:
        """Say of samples that were not taken or are frozen, not too often: the last word is with the counts."""
        if now - self._told[kind] < self._service.limits.notice:
            return
        self._told[kind] = now
        facts: dict[str, Any] = {"counts": self.counts}
        if kind == "slowed":
            facts["messages_a_second"] = self._service.limits.messages
        self._outbox.put(notice_text(kind, **facts), answers=0)
