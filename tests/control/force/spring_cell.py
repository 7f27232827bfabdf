"""A polisher on a spring: the tip is where it is commanded, the surface pushes back in proportion."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from tauhat.control.force import ForceReading, PolishCommand, Polisher

STIFFNESS = 1e4
Disturbance: TypeAlias = Callable[[int, ForceReading], ForceReading | None]
Heights: TypeAlias = Callable[[int, float], float]


class Ride(NamedTuple):
    """What a job did: every command, and the true force that was there before it [N]."""

    commands: list[PolishCommand]
    forces: np.ndarray

    @property
    def phases(self) -> list[str]:
        """The phases in their order, each once in a row."""
        found = [command.phase for command in self.commands]
        return [phase for k, phase in enumerate(found) if k == 0 or phase != found[k - 1]]

    def first(self, phase: str) -> int:
        """Return the index of the first command of a phase."""
        return [command.phase for command in self.commands].index(phase)


def level(_: int, s: float) -> float:
    """Return the height of a plane that is tilted by 5 mrad and half a millimetre lower than believed."""
    return 0.005 * s - 0.0005


def ride(
    polisher: Polisher,
    *,
    surface: Heights = level,
    disturb: Disturbance = lambda _, reading: reading,
    stiffness: Callable[[int], float] = lambda _: STIFFNESS,
    steps: int = 12000,
) -> Ride:
    """Return a job on a surface of heights above the believed one [m], from noisy readings that may be disturbed."""
    memory, rng, commands, forces = polisher.start(), np.random.default_rng(5), [], []
    depth, s = memory.depth, -polisher.task.half
    for k in range(steps):
        force = stiffness(k) * max(0.0, depth + surface(k, s))
        reading = ForceReading(force + float(rng.normal()) * 0.3, 0.3)
        memory, command = polisher.step(memory, disturb(k, reading))
        commands.append(command)
        forces.append(force)
        depth, s = command.depth, command.s
        if command.phase in {"done", "stopped"}:
            break
    return Ride(commands, np.array(forces))
