"""Other ways to a well conditioned motion, for `excitation.py`: each returns when it had which condition number.

The population methods get our batched kernels and our joint limits; the finite-difference one is what public tools do:
a Python loop over Pinocchio's regressor, a singular value decomposition, SciPy's SLSQP.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion
from tauhat.excitation.criteria import ConditionNumber
from tauhat.excitation.genetic import SAMPLES, GeneticSettings, evolve, population_values
from tauhat.excitation.gradient import polish
from tauhat.excitation.information import Information
from tauhat.excitation.space import FourierSpace, random_points
from tauhat.robots.kinematics import pinocchio_model


class TimeUpError(Exception):
    """The budget of a method is used up."""


@dataclass(frozen=True, kw_only=True)
class Watched(ConditionNumber):
    """The condition criterion, noting the exact condition number and the time of every evaluation."""

    began: float = field(default_factory=time.perf_counter, compare=False)
    budget: float = np.inf
    trace: list[tuple[float, float]] = field(default_factory=list, compare=False)

    def of_lifted(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        self.note(float(np.sqrt(eigenvalues[-1] / max(eigenvalues[0], 1e-300))))
        return ConditionNumber.of_lifted(self, eigenvalues)

    def note(self, condition: float) -> None:
        seconds = time.perf_counter() - self.began
        self.trace.append((seconds, condition))
        if seconds > self.budget:
            raise TimeUpError


def seconds_to(trace: list[tuple[float, float]], target: float) -> float:
    """When the target was first met [s]; infinite when it was not."""
    return next((seconds for seconds, condition in trace if condition <= target), np.inf)


def watch(run: Callable[[Watched], object], budget: float) -> list[tuple[float, float]]:
    watched = Watched(budget=budget)
    with contextlib.suppress(TimeUpError):
        run(watched)
    return watched.trace


def gradient(facts: Information, space: FourierSpace, seed: int, budget: float) -> list[tuple[float, float]]:
    start = random_points(space, 1, np.random.default_rng(seed))[0]
    return watch(lambda watched: polish(facts, space, start, criterion=watched), budget)


def genetic(facts: Information, space: FourierSpace, seed: int, budget: float) -> list[tuple[float, float]]:
    settings = GeneticSettings(population=100, generations=100_000)
    rng = np.random.default_rng(seed)
    return watch(lambda watched: evolve(facts, space, criterion=watched, rng=rng, settings=settings), budget)


def cma_es(facts: Information, space: FourierSpace, seed: int, budget: float) -> list[tuple[float, float]]:
    import cma

    starts = random_points(space, 100, np.random.default_rng(seed))
    size, grid = starts.std(axis=0), space.grid(SAMPLES)

    def run(watched: Watched) -> None:
        options = {"seed": seed + 1, "verbose": -9, "popsize": 30, "CMA_stds": size.ravel()}
        strategy = cma.CMAEvolutionStrategy(starts[0].ravel(), 0.5, options)
        while True:
            asked = strategy.ask()
            points = np.array([space.shrunk(flat) for flat in asked])
            strategy.tell(asked, population_values(facts, grid, points, watched).tolist())

    return watch(run, budget)


def finite_difference_slsqp(
    facts: Information, space: FourierSpace, seed: int, budget: float
) -> list[tuple[float, float]]:
    """SLSQP with forward differences on a Pinocchio loop of 500 samples, limits on 50; each iterate is shrunk, noted."""
    from scipy.optimize import LinearConstraint, minimize

    start = random_points(space, 1, np.random.default_rng(seed))[0]
    regressor = PinocchioRegressor(facts, space)
    rows = space.grid(50).rows()
    n_v, n_r, n_x = rows.shape
    whole = np.zeros((n_v * n_r, n_v * n_x))
    for joint in range(n_v):
        whole[joint * n_r : (joint + 1) * n_r, joint * n_x : (joint + 1) * n_x] = rows[joint]

    def run(watched: Watched) -> None:
        def value(flat: FloatArray) -> float:
            if time.perf_counter() - watched.began > watched.budget:
                raise TimeUpError
            return float(np.log(regressor.condition(flat)))

        minimize(
            value, start.ravel(), method="SLSQP", constraints=[LinearConstraint(whole, -1.0, 1.0)],
            callback=lambda flat: watched.note(regressor.condition(space.shrunk(flat))), options={"maxiter": 10_000},
        )  # fmt: skip

    return watch(run, budget)


class PinocchioRegressor:
    """The scaled base regressor sample by sample, the way scripts around Pinocchio build it."""

    def __init__(self, facts: Information, space: FourierSpace) -> None:
        robot = facts.model.robot
        self.facts, self.space, self.grid = facts, space, space.grid(500)
        self.model = pinocchio_model(robot)
        self.data = self.model.createData()
        parameters = [facts.model.parameters[index] for index in facts.columns]
        owner = [term.key for term in facts.model.terms for _ in term.parameters(robot)]
        kinds = np.array([owner[index] for index in facts.columns])
        self.inertial = facts.columns[kinds == "inertia"]
        self.others = [
            (kind, parameter.joint)
            for kind, parameter in zip(kinds, parameters, strict=True)
            if kind != "inertia"
        ]  # fmt: skip
        self.slow = 0.02 * space.limits.velocity

    def condition(self, x: FloatArray) -> float:
        motion = self.grid.motion(x)
        return float(np.linalg.cond(self.stacked(motion) / self.facts.scales))

    def stacked(self, motion: Motion) -> FloatArray:
        q, dq, ddq = (np.ascontiguousarray(part.T) for part in (motion.q, motion.dq, motion.ddq))
        n_t, n_v = q.shape
        out = np.zeros((n_t, n_v, self.facts.n))
        for k in range(n_t):
            full = pin.computeJointTorqueRegressor(self.model, self.data, q[k], dq[k], ddq[k])
            out[k, :, : self.inertial.size] = full[:, self.inertial]
        signals = {"viscous": dq, "coulomb": np.tanh(dq / self.slow), "rotor": ddq, "offset": np.ones_like(q)}
        for place, (kind, joint) in enumerate(self.others, start=self.inertial.size):
            out[:, joint, place] = signals[kind][:, joint]
        return out.reshape(n_t * n_v, -1)
