"""The polisher: approaches, presses, feeds, retracts, and gives up by rule; a pure step from a reading to a command."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tauhat.control.force.feed_profile import FeedProfile
from tauhat.control.force.force_law import ForceLaw, require_positive
from tauhat.control.force.force_source import Expected, ForceSource, MeasuredForce
from tauhat.control.force.path_joints import PathJoints
from tauhat.control.force.pi_law import PIForceLaw
from tauhat.control.force.polish_memory import Intent, Phase, PolishCommand, PolishMemory
from tauhat.control.force.polish_settings import ContactRule, PolishLimits, PolishTask
from tauhat.control.force.reading import ForceReading, Reason, Sight
from tauhat.errors import ControlError

_SPENT = 1e-9  # part of a period: times are sums of periods, which round
_ARRIVED = 1e-9  # [m] above which a tool is not yet at its height


@dataclass(frozen=True, slots=True, kw_only=True)
class Polisher:
    """Polishes along a path with a force; keeps nothing between steps but the memory that it is handed.

        memory = polisher.start()
        memory, command = polisher.step(memory, ForceReading(force=12.0, std=0.8))   # or None where no answer came

    Whatever the readings are, the tip is never deeper than `limits.deepest`, never faster than `press_speed` inwards
    and `lift_speed` outwards, and a job that was given up stays so. On a contact of stiffness k the force can therefore
    not grow faster than `k press_speed`.

    period : between two steps [s]
    task, limits, contact : what is asked for, what may not be exceeded, what counts as contact
    law : from force error to speed
    source : of the force: measured, or believed in an open loop

    Source: the division into a guarded approach, a contact transition and a force-controlled motion is that of Mason,
    "Compliance and force control for computer controlled manipulators", 1981, and of the chapter of the laws.
    """

    period: float = 0.004
    task: PolishTask = field(default_factory=PolishTask)
    limits: PolishLimits = field(default_factory=PolishLimits)
    contact: ContactRule = field(default_factory=ContactRule)
    law: ForceLaw = field(default_factory=PIForceLaw)
    source: ForceSource = field(default_factory=MeasuredForce)
    _profile: FeedProfile = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require_positive("polisher", period=self.period)
        task, force = self.task, self.task.force
        if self.contact.threshold >= force:
            expected, got = f"less than the force of {force:g} N", self.contact.threshold
            raise ControlError("contact threshold is too high", where="polisher", expected=expected, got=got)
        if self.limits.force <= force:
            expected, got = f"more than the force of {force:g} N", self.limits.force
            raise ControlError("force limit is too low", where="polisher", expected=expected, got=got)
        profile = FeedProfile(half=task.half, speed=task.feed, acceleration=task.acceleration)
        object.__setattr__(self, "_profile", profile)

    @property
    def press_speed(self) -> float:
        """Largest speed into the surface that is ever commanded [m/s]."""
        return max(self.law.speed_limit, self.limits.approach_speed, self.limits.search_speed)

    @property
    def lift_speed(self) -> float:
        """Largest speed out of the surface that is ever commanded [m/s]."""
        return max(self.law.speed_limit, self.limits.retract_speed)

    def start(self) -> PolishMemory:
        """Return the memory above the beginning of the path, at rest."""
        return PolishMemory(
            phase="approach", reason="", depth=-self.limits.height, ddepth=0.0, progress=0.0, pace=0.0, passed=0,
            wanted=0.0, touched=0.0, settled=0.0, lost=0.0, searched_from=0.0, searches=0,
            law=self.law.start(), source=self.source.start(),
        )  # fmt: skip

    def check_path(self, joints: PathJoints) -> None:
        """Refuse joints that this job would take off their path, or over their speed.

        Raises
        ------
        ControlError
            when the path is shorter than the job, or was checked for less height or depth.
        RobotError
            names the joint that is too slow.
        """
        rows = (
            ("path", self.task.half, joints.nodes[-1]),
            ("height", self.limits.height, -joints.highest),
            ("depth", self.limits.deepest, joints.deepest),
        )
        for name, wanted, there in rows:
            if wanted > there * (1.0 + _SPENT):
                expected, got = f"at least the job's {wanted:g} m", f"{there:g} m"
                raise ControlError(f"too little {name} was solved", where="path joints", expected=expected, got=got)
        joints.check_speeds(feed=self.task.feed, depth_speed=max(self.press_speed, self.lift_speed))

    def step(self, memory: PolishMemory, reading: ForceReading | None) -> tuple[PolishMemory, PolishCommand]:
        """Return the memory behind this period, and where the tool shall be at its end.

        reading : of the force, or None where no answer came
        """
        if memory.phase in {"done", "stopped"}:
            return memory, self._command(memory)
        if memory.phase == "retract":
            return self._retracted(memory)
        expected = Expected(memory.depth, self.task.force)
        watched, sight = self.source.step(memory.source, reading, expected=expected, period=self.period)
        memory = memory._replace(source=watched)
        fault = self._fault(memory, sight)
        if fault:
            return self._retracted(_leaving(memory, fault))
        if sight.reading is None or sight.trouble:
            held = self._moved(Intent(memory, 0.0, 0.0))
            return held, self._command(held)._replace(phase="hold")
        intent = self._intent(memory, sight.reading)
        if intent.memory.phase == "retract":
            return self._retracted(intent.memory)
        moved = self._moved(intent)
        return moved, self._command(moved)

    def _fault(self, memory: PolishMemory, sight: Sight) -> Reason:
        if sight.reading is not None and abs(sight.reading.force) > self.limits.force:
            return "force_limit"
        if memory.depth >= self.limits.deepest:
            return "surface_misplaced"
        return sight.fault

    def _intent(self, memory: PolishMemory, reading: ForceReading) -> Intent:
        if memory.phase == "approach":
            return self._approach(memory, reading)
        if memory.phase == "search":
            return self._search(memory, reading)
        lost = self._watched(memory, reading)
        if lost.phase != memory.phase:
            return Intent(lost, 0.0, 0.0)
        return self._first_contact(lost, reading) if memory.phase == "contact" else self._pass(lost, reading)

    def _approach(self, memory: PolishMemory, reading: ForceReading) -> Intent:
        touching, memory = self._touching(memory, reading)
        if memory.phase == "contact" and memory.depth < -self.limits.misplaced:
            memory = _leaving(memory, "surface_misplaced")
        return Intent(memory, 0.0 if touching else self.limits.approach_speed, 0.0)

    def _search(self, memory: PolishMemory, reading: ForceReading) -> Intent:
        touching, memory = self._touching(memory, reading)
        if memory.phase == "search" and memory.depth - memory.searched_from >= self.limits.search_travel:
            memory = _leaving(memory, "contact_lost")
        return Intent(memory, 0.0 if touching else self.limits.search_speed, 0.0)

    def _touching(self, memory: PolishMemory, reading: ForceReading) -> tuple[bool, PolishMemory]:
        """Return whether this reading looks like contact, and the memory, in first contact once that is sure."""
        touching = self.contact.touches(reading.force, reading.std)
        touched = memory.touched + self.period if touching else 0.0
        if touched < self.contact.hold - _SPENT * self.period:
            return touching, memory._replace(touched=touched)
        wanted = min(reading.force, self.task.force)
        return touching, memory._replace(
            phase="contact", wanted=wanted, touched=0.0, settled=0.0, lost=0.0, law=self.law.start()
        )

    def _watched(self, memory: PolishMemory, reading: ForceReading) -> PolishMemory:
        """Return the memory with the time of too low a force; searching, or given up, where contact is lost."""
        low = reading.force < self.contact.lost_part * memory.wanted
        lost = memory.lost + self.period if low else 0.0
        if lost < self.contact.lost_after - _SPENT * self.period:
            return memory._replace(lost=lost)
        if memory.searches >= self.limits.searches:
            return _leaving(memory, "contact_lost")
        return memory._replace(
            phase="search", lost=0.0, touched=0.0, searched_from=memory.depth, searches=memory.searches + 1
        )

    def _first_contact(self, memory: PolishMemory, reading: ForceReading) -> Intent:
        memory, speed = self._pressed(memory, reading)
        wanted = min(self.task.force, memory.wanted + self.task.force_rate * self.period)
        settled = memory.settled + self.period if wanted == self.task.force else 0.0
        ready = settled >= self.task.settle
        memory = memory._replace(wanted=wanted, settled=settled, phase="pass" if ready else "contact")
        return Intent(memory, speed, 0.0)

    def _pass(self, memory: PolishMemory, reading: ForceReading) -> Intent:
        memory, speed = self._pressed(memory, reading)
        if memory.progress < self._profile.duration:
            return Intent(memory, speed, 1.0)
        memory = memory._replace(progress=0.0, passed=memory.passed + 1)
        if memory.passed == self.task.passes:
            memory = _leaving(memory._replace(pace=0.0), "")
        return Intent(memory, speed, 1.0)

    def _pressed(self, memory: PolishMemory, reading: ForceReading) -> tuple[PolishMemory, float]:
        law, speed = self.law.step(memory.law, memory.wanted - reading.force, self.period)
        return memory._replace(law=law), max(-self.law.speed_limit, min(self.law.speed_limit, speed))

    def _retracted(self, memory: PolishMemory) -> tuple[PolishMemory, PolishCommand]:
        """Return the next step of the way out, which nothing stops; at its end the job is done, or given up."""
        limits = self.limits
        left, lost_a_period = memory.depth + limits.height, limits.depth_acceleration * self.period
        braking = math.sqrt(0.25 * lost_a_period**2 + 2.0 * limits.depth_acceleration * left) - 0.5 * lost_a_period
        speed = min(limits.retract_speed, braking, left / self.period)
        memory = self._moved(Intent(memory._replace(ddepth=min(0.0, memory.ddepth)), -speed, 0.0))
        if memory.depth <= _ARRIVED - limits.height and memory.pace == 0.0:
            ended: Phase = "stopped" if memory.reason else "done"
            memory = memory._replace(phase=ended, ddepth=0.0)
        return memory, self._command(memory)

    def _moved(self, intent: Intent) -> PolishMemory:
        """Return the memory with depth and feed one period on, inside their bounds."""
        memory, period, limits = intent.memory, self.period, self.limits
        change = limits.depth_acceleration * period
        speed = max(memory.ddepth - change, min(memory.ddepth + change, intent.speed))
        depth = max(-limits.height, min(limits.deepest, memory.depth + period * speed))
        gained = self.task.acceleration / self.task.feed * period
        pace = max(memory.pace - gained, min(memory.pace + gained, intent.pace))
        progress = min(self._profile.duration, memory.progress + 0.5 * period * (memory.pace + pace))
        return memory._replace(
            depth=depth, ddepth=(depth - memory.depth) / period, progress=progress, pace=pace
        )  # fmt: skip

    def _command(self, memory: PolishMemory) -> PolishCommand:
        s, ds = self._profile.at(memory.progress)
        way = -1.0 if memory.passed % 2 else 1.0
        return PolishCommand(
            way * s, way * ds * memory.pace, memory.depth, memory.ddepth, memory.phase, memory.reason
        )  # fmt: skip


def _leaving(memory: PolishMemory, reason: Reason) -> PolishMemory:
    return memory._replace(phase="retract", reason=reason)
