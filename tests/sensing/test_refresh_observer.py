"""The refresh observer: friction that has changed is found while the arm is free and moves, and left alone else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sensed_arms import frictionless, motion

from tauhat.dynamics.passive_kernel import DAHL, LOAD_DAHL, OFFSET, SIGN, SPRING, VISCOUS, joint_elements
from tauhat.dynamics.rigid_body import gravity_torque
from tauhat.errors import SensingError
from tauhat.sensing.observers import RefreshObserver, observer_named
from tauhat.sensing.own_friction import own_friction
from tauhat.sensing.torque_observer import TorqueObserver

RATE, SECONDS = 100.0, 60.0
DRY, VISCOUS_FRICTION = 6.0, 2.0
ROWS = [(SIGN, j, 1e-3, DRY) for j in range(7)] + [(VISCOUS, j, 1.0, VISCOUS_FRICTION) for j in range(7)]
MODEL = replace(frictionless(), sliding=joint_elements(ROWS), rms=np.full(7, 0.5))
Q, RIGID = motion(MODEL.robot, SECONDS, RATE)
SPEED = np.cos(2.0 * np.arange(len(Q))[:, None] / RATE + np.arange(7))
FRICTION = DRY * np.sign(SPEED) + VISCOUS_FRICTION * SPEED


def observer(name: str = "refresh", **changes: float) -> TorqueObserver:
    kind = RefreshObserver(**changes) if name == "refresh" else observer_named(name)
    return TorqueObserver(model=MODEL, step=1.0 / RATE, observer=kind)


def rms(torque: np.ndarray) -> float:
    return float(np.sqrt(np.mean(torque[len(torque) // 2 :] ** 2)))


@pytest.mark.parametrize("part", [1.3, 1.0, 0.7])
def test_friction_that_has_changed_is_found_with_its_sign(part):
    tau = RIGID + part * FRICTION
    seer = observer()
    warmth = seer.warmth_along(Q, tau)
    error = np.abs(warmth.theta[-1] - (part - 1.0))
    assert error.max() < 0.05
    assert (error < 3.0 * np.sqrt(warmth.variance[-1])).all()
    found, plain = seer.along(Q, tau).tau, observer("momentum").along(Q, tau).tau
    if part != 1.0:
        assert rms(found) < 0.3 * rms(plain)


def test_in_contact_friction_is_left_alone_and_its_doubt_widens_the_bar():
    tau = RIGID + 1.3 * FRICTION
    free = np.arange(len(Q)) < len(Q) // 2
    warmth, told = observer(time=50.0).warmth_along(Q, tau, free=free), observer(time=50.0).along(Q, tau, free=free)
    k, n = len(Q) // 2, len(Q) - 1 - len(Q) // 2
    kept = np.exp(-n / RATE / 50.0)
    assert warmth.theta[-1] == pytest.approx(kept * warmth.theta[k], rel=1e-9)
    widened = kept**2 * warmth.variance[k] + (1.0 - kept**2) * RefreshObserver().wander ** 2
    assert warmth.variance[-1] == pytest.approx(widened, rel=1e-9)
    assert (told.variance[k + 100 :].mean(axis=0) > told.variance[k - 1000 : k].mean(axis=0)).all()
    pushed = observer(time=50.0).warmth_along(Q, tau - 3.0 * ~free[:, None], free=free)
    assert (pushed.theta == warmth.theta).all()


def test_at_rest_nothing_is_learnt():
    held, tau = np.tile(Q[0], (2000, 1)), np.tile(RIGID[0], (2000, 1)) + 0.3 * DRY
    warmth = observer().warmth_along(held, tau)
    assert warmth.theta == pytest.approx(0.0, abs=1e-12)
    assert warmth.variance[-1] == pytest.approx(RefreshObserver().spread ** 2, rel=1e-6)


def test_a_weak_push_that_does_not_turn_with_the_motion_averages_out():
    theta = observer().warmth_along(Q, RIGID + FRICTION - 1.0).theta
    assert np.abs(theta[-1]).max() < 0.05


def test_own_friction_is_what_the_joint_resists_with():
    assert own_friction(MODEL) == pytest.approx(np.tile([DRY, VISCOUS_FRICTION], (7, 1)), rel=1e-9)
    others = [(OFFSET, 0, 1.0, 4.0), (SPRING, 1, 1.0, 9.0)]
    bristles = joint_elements([(DAHL, 2, 1e-3, 5.0), (LOAD_DAHL, 1, 1e-3, 0.1)])
    model = replace(MODEL, sliding=joint_elements([*ROWS, *others]), bristles=bristles)
    dry, viscous = own_friction(model).T
    assert viscous == pytest.approx(VISCOUS_FRICTION, rel=1e-9)
    assert dry[[0, 2, 3]] == pytest.approx([DRY, DRY + 5.0, DRY], rel=1e-9)
    weight = np.abs(gravity_torque(MODEL.robot, np.random.default_rng(0).uniform(-2.0, 2.0, (2000, 7))))[:, 1].mean()
    assert dry[1] == pytest.approx(DRY + 0.1 * weight, rel=0.3)
    driving = joint_elements([(VISCOUS, 0, 1.0, -1.0), (SIGN, 1, 1e-3, -1.0)])
    assert (own_friction(replace(MODEL, sliding=driving)) == 0.0).all()


def test_without_friction_it_is_the_momentum_observer():
    bare = frictionless()
    found, usual = (
        TorqueObserver(model=bare, step=1.0 / RATE, observer=observer_named(name)).along(Q[:500], RIGID[:500] + 1.0)
        for name in ("refresh", "momentum")
    )
    for part, other in zip(found, usual, strict=True):
        assert (part == other).all()


def test_told_errors_are_stretched_and_what_is_learnt_is_not():
    tau = RIGID + 1.3 * FRICTION
    stretched = TorqueObserver(
        model=replace(MODEL, stretch=np.full(7, 0.25)), step=1.0 / RATE, observer=RefreshObserver()
    )
    assert (stretched.warmth_along(Q, tau).theta == observer().warmth_along(Q, tau).theta).all()
    variances = stretched.along(Q, tau).variance, observer().along(Q, tau).variance
    assert variances[0] == pytest.approx(variances[1] / 16.0, rel=1e-12)


@pytest.mark.parametrize("name", ["spread", "wander", "time", "limit"])
def test_settings_that_mean_nothing_are_refused(name):
    with pytest.raises(SensingError, match=f"{name} of an observer"):
        RefreshObserver(**{name: 0.0})
