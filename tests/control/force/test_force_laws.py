"""Force laws against exact discretisations of SciPy, on springs, with a delay and a position loop beneath."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import signal
from scipy.linalg import expm

from tauhat.arrays import FloatArray
from tauhat.control.force import AdmittanceLaw, ForceLaw, PIForceLaw
from tauhat.errors import ControlError

PERIOD, STIFFNESS, UNLIMITED = 0.004, 1e4, 1e9
PI = PIForceLaw(speed_limit=UNLIMITED)
ADMITTANCE = AdmittanceLaw.tuned(speed_limit=UNLIMITED)
LAWS = [PI, ADMITTANCE, replace(PI, bandwidth=3.0, integral_part=0.1), AdmittanceLaw.tuned(bandwidth=0.4)]


def continuous(law: ForceLaw) -> tuple[FloatArray, FloatArray]:
    """Return A, B of the continuous law as its docstring has it; the last state is depth, its input the error."""
    if isinstance(law, PIForceLaw):
        by_integral = law.gain * law.integral_rate
        A = [[-law.filter_rate, 0.0, 0.0], [1.0, 0.0, 0.0], [law.gain, by_integral, 0.0]]
        return np.array(A), np.array([[law.filter_rate], [0.0], [0.0]])
    assert isinstance(law, AdmittanceLaw)
    return np.array([[-law.damping / law.mass, 0.0], [1.0, 0.0]]), np.array([[1.0 / law.mass], [0.0]])


def loop(law: ForceLaw, spring: Callable[[float, float], float], *, wanted: float, seconds: float) -> FloatArray:
    """Return forces at the samples; spring(t, depth) is the force of the surface."""
    memory, depth, forces = law.start(), 0.0, []
    for k in range(round(seconds / PERIOD)):
        force = spring(k * PERIOD, depth)
        memory, speed = law.step(memory, wanted - force, PERIOD)
        depth += PERIOD * speed
        forces.append(force)
    return np.array(forces)


@pytest.mark.parametrize("law", LAWS)
def test_depth_at_the_samples_is_that_of_the_continuous_law_under_held_errors(law: ForceLaw):
    law = replace(law, speed_limit=UNLIMITED)
    A, B = continuous(law)
    eye = np.eye(len(A))
    exact = signal.cont2discrete((A, B, eye, np.zeros_like(B)), PERIOD, method="zoh")
    errors = np.random.default_rng(1).normal(size=400) * 20.0
    wanted = signal.dlsim((*exact[:4], PERIOD), errors)[1][:, -1]
    memory, depth, depths = law.start(), 0.0, []
    for error in errors:
        depths.append(depth)
        memory, speed = law.step(memory, float(error), PERIOD)
        depth += PERIOD * speed
    np.testing.assert_allclose(depths, wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("stiffness", [2e3, 1e4])
def test_the_response_on_a_spring_is_that_of_the_continuous_closed_loop(law: ForceLaw, stiffness: float):
    law = replace(law, speed_limit=UNLIMITED)
    A, B = continuous(law)
    closed = A.copy()
    closed[:, -1:] -= stiffness * B
    fine, seconds, wanted = 5e-5, 1.0, 10.0
    memory, depth, force = law.start(), 0.0, []
    for _ in range(round(seconds / fine)):
        force.append(stiffness * depth)
        memory, speed = law.step(memory, wanted - stiffness * depth, fine)
        depth += fine * speed
    settled = np.linalg.solve(closed, -B[:, 0] * wanted)
    for k in (400, 4000, 19999):
        exact = stiffness * (settled - expm(closed * k * fine) @ settled)[-1]
        assert force[k] == pytest.approx(exact, abs=0.01)


@pytest.mark.parametrize(("law", "bandwidth"), list(zip(LAWS, (1.0, 1.0, 3.0, 0.4), strict=True)))
def test_the_loop_gain_is_one_at_the_stated_bandwidth(law: ForceLaw, bandwidth: float):
    A, B = continuous(law)
    response = np.linalg.solve(2j * np.pi * bandwidth * np.eye(len(A)) - A, B)
    assert abs(STIFFNESS * response[-1, 0]) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("law", [PI, ADMITTANCE])
def test_no_error_is_left_on_a_surface_that_stands_still(law: ForceLaw):
    forces = loop(law, lambda _, depth: STIFFNESS * (depth - 0.002), wanted=30.0, seconds=12.0)
    assert forces[-1] == pytest.approx(30.0, abs=1e-6)


def test_a_surface_that_comes_nearer_leaves_an_error_without_an_integral_and_none_with_it():
    rising = 0.25e-3  # [m/s]: 5 mrad at 50 mm/s
    for law, error in ((PI, 0.0), (ADMITTANCE, -ADMITTANCE.damping * rising)):
        forces = loop(law, lambda t, depth: STIFFNESS * (depth + rising * t), wanted=30.0, seconds=20.0)
        assert 30.0 - forces[-1] == pytest.approx(error, abs=1e-6)
    assert ADMITTANCE.damping * rising > 0.3


def delayed(law: ForceLaw, stiffness: float) -> float:
    """Return the largest pole, in size, with a sample of delay and a critically damped 10 Hz loop of the position."""
    omega = 2.0 * np.pi * 10.0
    beneath = (np.array([[0.0, 1.0], [-(omega**2), -2.0 * omega]]), np.array([[0.0], [omega**2]]))
    A, B = signal.cont2discrete((*beneath, np.eye(2), np.zeros((2, 1))), PERIOD)[:2]
    start = law.start()
    size = len(start) if isinstance(start, tuple) else 1

    def advanced(state: FloatArray) -> FloatArray:
        before, depth, position, old_force = state[:size], state[size], state[size + 1 : size + 3], state[-1]
        given: Any = type(start)(*before) if isinstance(start, tuple) else float(before[0])
        memory, speed = law.step(given, -old_force, PERIOD)
        moved = A @ position + B[:, 0] * depth
        after = depth + PERIOD * speed
        return np.concatenate([np.atleast_1d(memory), [after], moved, [stiffness * position[0]]])

    # linear in its state, so that its columns are what it makes of unit states
    matrix = np.column_stack([advanced(unit) for unit in np.eye(size + 4)])
    return float(np.abs(np.linalg.eigvals(matrix)).max())


@pytest.mark.parametrize("law", [PI, ADMITTANCE])
@pytest.mark.parametrize("part", [0.2, 0.5, 1.0, 2.0, 3.0])
def test_loops_with_delay_and_position_control_are_stable_about_the_stated_stiffness(law: ForceLaw, part: float):
    assert delayed(law, part * STIFFNESS) < 0.9999


@pytest.mark.parametrize(
    ("law", "stiffest"),
    [(PI, 51.0), (PIForceLaw(bandwidth=2.0, speed_limit=UNLIMITED), 29.0), (ADMITTANCE, 54.0)],
)
def test_loops_are_stable_up_to_the_stiffness_that_the_documents_say(law: ForceLaw, stiffest: float):
    assert delayed(law, 1e3 * (stiffest - 0.5)) < 1.0 < delayed(law, 1e3 * (stiffest + 0.5))


@pytest.mark.parametrize("law", [PIForceLaw(), AdmittanceLaw.tuned()])
def test_no_error_is_answered_faster_than_the_limit(law: ForceLaw):
    memory, rng = law.start(), np.random.default_rng(2)
    for error in rng.normal(size=500) * 10.0 ** rng.uniform(-2, 8, 500):
        memory, speed = law.step(memory, float(error), PERIOD)
        assert abs(speed) <= law.speed_limit


def test_a_law_at_its_limit_does_not_wind_up():
    def overshoot(law: ForceLaw) -> float:
        return float(loop(law, lambda _, depth: STIFFNESS * (depth - 0.02), wanted=30.0, seconds=30.0).max()) - 30.0

    class Winding(PIForceLaw):
        """The same law, whose integral goes on at the limit."""

        def step(self, memory: Any, error: float, period: float) -> tuple[Any, float]:
            memory, speed = replace(PI, bandwidth=self.bandwidth).step(memory, error, period)
            return memory, max(-self.speed_limit, min(self.speed_limit, speed))

    # a surface 20 mm away at 2 mm/s: ten seconds at the limit
    assert overshoot(PIForceLaw(speed_limit=2e-3)) < 8.0
    assert overshoot(Winding(speed_limit=2e-3)) > 60.0


def test_the_low_pass_keeps_force_noise_out_of_the_speed():
    noise = np.random.default_rng(3).normal(size=4000)

    def rattle(law: ForceLaw) -> float:
        memory, speeds = law.start(), []
        for error in noise:
            memory, speed = law.step(memory, float(error), PERIOD)
            speeds.append(speed)
        return float(np.std(np.diff(speeds)))

    assert rattle(PI) < 0.1 * rattle(replace(PI, filter_part=1000.0))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: PIForceLaw(bandwidth=0.0), "PIForceLaw: bandwidth is not positive"),
        (lambda: PIForceLaw(stiffness=np.inf), "PIForceLaw: stiffness is not positive"),
        (lambda: PIForceLaw(integral_part=-1.0), "PIForceLaw: integral_part is not positive"),
        (lambda: PIForceLaw(filter_part=np.nan), "PIForceLaw: filter_part is not positive"),
        (lambda: PIForceLaw(speed_limit=0.0), "PIForceLaw: speed_limit is not positive"),
        (lambda: AdmittanceLaw(mass=0.0, damping=1.0), "AdmittanceLaw: mass is not positive"),
        (lambda: AdmittanceLaw(mass=1.0, damping=-1.0), "AdmittanceLaw: damping is not positive"),
        (lambda: AdmittanceLaw.tuned(bandwidth=-1.0), "AdmittanceLaw: bandwidth is not positive"),
    ],
)
def test_impossible_laws_are_refused(build: Callable[[], ForceLaw], message: str):
    with pytest.raises(ControlError, match=message):
        build()
