"""Estimators that simulate, on an arm with a gas spring whose second motor turns with the first joint, too."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from simulated_logs import LATE, LAW, RATE

from sample_arms import motion_from_rest, planar_arm
from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.dynamics import Coulomb, TorqueModel, base_parameters, gravity_torque
from tauhat.dynamics.simulated_arm import Followed, Gains, Stepping, follow, simulated_arm
from tauhat.dynamics.terms import Coupling, CouplingDahl, GasSpring, Inertia, RotorInertia, Viscous
from tauhat.estimation import collect
from tauhat.estimation.closed_loop import ClosedLoop, SampledReference
from tauhat.estimation.didim import DirectInverse
from tauhat.estimation.idim_iv import InstrumentalVariables
from tauhat.estimation.output_error import ClosedLoopInputError, ClosedLoopOutputError
from tauhat.estimation.problem import Problem
from tauhat.recordings.recording import Recording

ARM = planar_arm()
SPRING = GasSpring(joint=0, distance=0.8, lever=0.2, angle=0.4, area=1e-3, volume=1e-3)
COUPLINGS = (Coupling(motors=((1, 0, -1.2),), widths=(0.08,)), CouplingDahl(motors=((1, 0, -1.2),), scales=(30.0,)))
TRUE = {"Ia": 0.2, "Fv": 0.9, "Fc": 0.5, "Gs": 30.0, "Iam": 0.06, "Fvm": 0.4, "Fsm": 0.6, "Fdm": 0.6, "Fem": 0.3}


@cache
@single_threaded
def task(coupling: Coupling) -> tuple[Problem, ClosedLoop, FloatArray]:
    """Return a log of the arm in its loop, simulated more finely than estimators do, and the true base parameters."""
    terms = (Inertia(), RotorInertia(), Viscous(), Coulomb(widths=(0.05, 0.08)), SPRING, coupling)
    model = TorqueModel(robot=ARM, terms=terms)
    base = base_parameters(model)
    standard = np.concatenate([ARM.inertia.ravel(), [TRUE[item.symbol] for item in model.parameters[20:]]])
    t = np.arange(0.0, 8.0, 1.0 / RATE)
    q, dq, ddq = motion_from_rest(2, t, seed=3)
    moved = follow(
        simulated_arm(model), standard, Followed(q, dq, gravity_torque(ARM, q)),
        gains=Gains(LAW.kp, LAW.kd, LAW.integral_gain, LAW.torque_limit), start=np.array([q[0], dq[0]]),
        stepping=Stepping(1.0 / RATE, 8, 0, "runge-kutta"),
    )  # fmt: skip
    noise = np.random.default_rng(0).normal(size=(2, *q.shape))
    log = Recording(t=t, q=moved.q.T + 1e-5 * noise[0], tau=moved.tau.T + 0.01 * noise[1], name="coupled")
    evidence = collect(model, base, log, LATE)
    problem = Problem(model=model, base=base, recordings=(log,), processing=LATE, evidence=evidence)
    loop = ClosedLoop(law=LAW, references=(SampledReference(t=t, q=q, dq=dq, ddq=ddq),))
    return problem, loop, base.projection @ standard


@pytest.mark.parametrize("coupling", COUPLINGS, ids=lambda term: term.key)
@pytest.mark.parametrize(
    "method", [InstrumentalVariables, DirectInverse, ClosedLoopInputError, ClosedLoopOutputError], ids=lambda m: m.key
)
def test_an_estimator_that_simulates_finds_the_coupling_and_the_spring(method, coupling):
    problem, loop, expected = task(coupling)
    threads = {"threads": 1} if method in (ClosedLoopInputError, ClosedLoopOutputError) else {}
    solution = method(loop=loop, **threads).fit_problem(problem)
    assert solution.cause.startswith("converged")
    errors = (solution.values - expected) / np.maximum(np.abs(expected), 0.05)
    names = [problem.base.names[index] for index in problem.base.independent]
    assert {"Gs_1", "Fvm_2"} <= set(names)  # with parallel axes the inertia of the shared motor is in that of the links
    assert np.abs(errors).max() < 0.05, dict(zip(names, errors.round(3), strict=True))
