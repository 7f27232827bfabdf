"""The kernel that calls MuJoCo by address is the plant in Python, to the last figures."""

from __future__ import annotations

import types
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from effect_plants import with_every_effect

from tauhat.arrays import FloatArray
from tauhat.control import PD, PID, PDFeedforward, PDGravity, TrackingLaw
from tauhat.control.controller import Controller, ControlSample, TrackingController
from tauhat.errors import SimulationError, TauhatWarning
from tauhat.excitation import random_fourier
from tauhat.robots import Robot, load_robot
from tauhat.simulation import (
    KINDS,
    Encoder,
    ExperimentSettings,
    Simulation,
    TrueParameters,
    build_plant,
    simulate,
    started,
    typical_plant,
)
from tauhat.simulation import running as running_module
from tauhat.simulation.laws import LAWS, SmoothCoulomb
from tauhat.simulation.laws.program import compiled
from tauhat.simulation.native import native_functions
from tauhat.simulation.running import CHANNELS

ARM = load_robot("ur5e")
FAST = ExperimentSettings(timestep=1e-3, control_rate=1000.0, sample_rate=500.0, settle=0.1)
MakeRobot = Callable[..., Robot]


def logs(done: Simulation) -> FloatArray:
    return np.array([getattr(done.truth, name) for name in CHANNELS])


def run(robot: Robot, truth: TrueParameters | None = None, **changes: Any) -> Simulation:
    motion = random_fourier(robot, period=1.0, harmonics=3, rng=np.random.default_rng(1), margin=0.2)
    settings = replace(FAST, **changes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # weak gains may saturate
        return simulate(robot, motion, rng=np.random.default_rng(2), parameters=truth, settings=settings)


@pytest.fixture
def in_python(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    return lambda: monkeypatch.setattr(running_module, "native_functions", lambda _: None)


def same(one: FloatArray, other: FloatArray) -> None:
    scale = 1e-12 * np.abs(one).max(axis=(1, 2), keepdims=True)
    np.testing.assert_array_less(np.abs(one - other), np.broadcast_to(scale + 1e-300, one.shape))


@pytest.mark.parametrize("kind", [*KINDS, "everything"])
def test_every_plant_moves_in_the_kernel_as_in_python(kind: str, in_python: Callable[[], None]) -> None:
    robot = ARM if kind == "everything" else load_robot("two_link")
    rng = np.random.default_rng(3)
    truth = with_every_effect(ARM) if kind == "everything" else typical_plant(robot, kind, rng=rng)
    fast = logs(run(robot, truth))
    in_python()
    same(fast, logs(run(robot, truth)))
    assert np.abs(fast[CHANNELS.index("dq")]).max() > 0.1


GAINS = {"kp": np.linspace(900.0, 50.0, 6), "kd": np.linspace(60.0, 4.0, 6)}
LAW_OBJECTS = [
    PD(**GAINS),
    PDGravity(**GAINS, torque_limit=np.linspace(80.0, 4.0, 6)),
    PDFeedforward(**GAINS),
    PID(**GAINS, ki=np.linspace(3000.0, 100.0, 6), torque_limit=np.linspace(60.0, 3.0, 6)),
]
LOOPS: list[dict[str, Any]] = [
    {},
    {"control_delay": 3e-3, "encoder": Encoder(side="motor", step=1e-5, velocity="differenced")},
    {"timestep": 5e-4, "encoder": Encoder(side="motor", step=np.linspace(0.0, 1e-4, 6))},
]


class Wrapped:
    """A tracking law that does not look like one, so that Python asks it once a period."""

    def __init__(self, law: TrackingLaw) -> None:
        self.inside, self.feedforward, self.torque_limit = (
            TrackingController(law=law),
            law.feedforward,
            law.torque_limit,
        )

    def start(self, sample: ControlSample) -> Any:
        return self.inside.start(sample)

    def step(self, memory: Any, sample: ControlSample) -> tuple[Any, FloatArray]:
        return self.inside.step(memory, sample)


@pytest.mark.parametrize("loop", LOOPS, ids=["plain", "delayed encoder", "substeps"])
@pytest.mark.parametrize("law", LAW_OBJECTS, ids=lambda law: law.key)
def test_every_law_steers_in_the_kernel_as_a_controller_does_from_python(
    law: TrackingLaw, loop: dict[str, Any], in_python: Callable[[], None]
) -> None:
    truth = with_every_effect(ARM)
    fast = logs(run(ARM, truth, controller=law, **loop))
    wrapped: Controller = Wrapped(law)
    same(fast, logs(run(ARM, truth, controller=wrapped, **loop)))
    in_python()
    same(fast, logs(run(ARM, truth, controller=law, **loop)))


@pytest.mark.parametrize("parents", [(-1, 0, 0, 1, 2, -1, 5)])
def test_a_tree_that_mujoco_numbers_otherwise_keeps_its_joints(
    make_robot: MakeRobot, parents: tuple[int, ...], in_python: Callable[[], None]
) -> None:
    robot = make_robot(4, parents=parents, prismatic=(2,))
    truth = with_every_effect(robot)
    fast = logs(run(robot, truth, timestep=5e-4))
    in_python()
    same(fast, logs(run(robot, truth, timestep=5e-4)))


def test_the_kernel_knows_every_law() -> None:
    laws = {law.key: law for kind in KINDS for law in typical_plant(ARM, kind, rng=np.random.default_rng(0)).laws}
    assert set(laws) == set(LAWS)
    assert len(set(compiled(list(laws.values()), 6).kinds.tolist())) == len(LAWS)


def test_a_law_of_a_kind_that_the_kernel_does_not_know_is_refused() -> None:
    class Glue(SmoothCoulomb):
        key = "glue"

    with pytest.raises(SimulationError, match="kernel does not know this law; got glue"):
        compiled([Glue(torque=np.ones(2), width=np.ones(2))], 2)


def test_mujoco_is_stepped_by_address() -> None:
    assert started(build_plant(ARM), np.zeros(6)).native
    assert not started(build_plant(ARM), np.zeros(6)).in_python().native
    found = native_functions(mujoco)
    assert found is not None
    assert len(set(found)) == 3


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({}, "its models do not tell their address"),
        ({"_address": 1}, "no library beside nowhere/__init__.py"),
        ({"_address": 1, "__file__": mujoco.__file__, "mj_version": lambda: 1}, "of another version"),
    ],
)
def test_another_build_of_mujoco_is_stepped_from_python_with_a_warning(parts: dict[str, Any], said: str) -> None:
    other = types.ModuleType("mujoco")
    holder = type("Holder", (), {"_address": 1} if "_address" in parts else {})
    other.MjModel = other.MjData = holder  # type: ignore[attr-defined]
    other.__file__ = parts.get("__file__", "/nowhere/__init__.py")
    other.mj_version = parts.get("mj_version", mujoco.mj_version)  # type: ignore[attr-defined]
    with pytest.warns(TauhatWarning, match=f"stepped from Python, about ten times slower: .*{said}"):
        assert native_functions(other) is None
