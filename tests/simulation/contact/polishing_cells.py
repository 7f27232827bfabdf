"""Small polishing cells, and an arm that is pressed on its workpiece or drawn along it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.surface import CylindricalSurface, FlatSurface, Surface
from tauhat.robots import inverse_kinematics, load_robot
from tauhat.robots.inverse_kinematics import FrameKinematics
from tauhat.simulation import TrueParameters, nominal_parameters
from tauhat.simulation.contact import TIP, Cell, CellSample, LoadCell, RunningCell, start_cell

ARM = load_robot("ur10e")
SEED = np.array([0.2, -1.5, 2.0, -2.0, -1.57, 0.0])
PERFECT = LoadCell(noise=0.0, offset_spread=0.0, drift=0.0, walk=0.0)
TILT = np.array([[0.99, -0.1, 0.05], [0.1, 0.99, 0.02], [-0.05, -0.02, 0.995]])
PLACE = np.array([0.7, 0.15, 0.2])


def tilted() -> FloatArray:
    left, _, right = np.linalg.svd(TILT)
    return np.asarray(left @ right)


def plane() -> FlatSurface:
    return FlatSurface(place=PLACE, rotation=tilted())


def barrel(radius: float = 0.3) -> CylindricalSurface:
    return CylindricalSurface(place=PLACE, rotation=tilted(), radius=radius)


def frictionless() -> TrueParameters:
    return replace(nominal_parameters(ARM), coulomb=np.zeros(ARM.n_v))


def cell_on(surface: Surface | None, **changes: Any) -> Cell:
    settings: dict[str, Any] = {
        "robot": ARM, "parameters": frictionless(), "surface": surface, "load_cell": PERFECT, "settle": 0.2,
    }  # fmt: skip
    return Cell(**(settings | changes))


def pose_above(cell: Cell, s: float, gap: float, *, surface: Surface | None = None) -> FloatArray:
    """Return the joints' positions (n_v,) where the unloaded tip is a gap [m] above a place of the path."""
    surface = surface or cell.surface
    assert surface is not None
    pose = cell.mount.poses(surface, np.array([s]), -gap)[0]
    return np.asarray(inverse_kinematics(ARM, pose, frame=cell.mount.frame, seed=SEED))


def started_above(cell: Cell, s: float = 0.0, gap: float = 0.001, *, seed: int = 0) -> RunningCell:
    return start_cell(cell, pose_above(cell, s, gap), rng=np.random.default_rng(seed))


class Driver:
    """Moves the reference of the unloaded tip along a direction in base axes."""

    def __init__(self, running: RunningCell, q: FloatArray) -> None:
        self.running, self.q = running, q
        self._kinematics = FrameKinematics(running.cell.robot_with_tip, TIP)

    def move(self, velocity: FloatArray, seconds: float) -> list[CellSample]:
        """Return the samples on a way with a velocity (3,) [m/s], without turning."""
        rate = self.running.cell.sample_rate
        samples = []
        for _ in range(round(seconds * rate)):
            dq = np.linalg.solve(self._kinematics.at(self.q).jacobian, np.append(velocity, np.zeros(3)))
            self.q = self.q + dq / rate
            samples.append(self.running.advance(self.q, dq))
        return samples

    def hold(self, seconds: float) -> list[CellSample]:
        """Return the samples of standing still."""
        still = np.zeros(self.q.size)
        return [self.running.advance(self.q, still) for _ in range(round(seconds * self.running.cell.sample_rate))]


def pressed(cell: Cell, *, s: float = 0.0, depth: float = 0.003, hold: float = 3.0) -> RunningCell:
    """Return a cell whose arm presses from 1 mm above to a depth [m], and stands."""
    q = pose_above(cell, s, 0.001)
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    assert cell.surface is not None
    driver = Driver(running, q)
    driver.move(-0.01 * cell.surface.normals(np.array([s]))[0], (depth + 0.001) / 0.01)
    driver.hold(hold)
    return running
