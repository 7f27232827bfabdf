"""Tracking of a MuJoCo plant with identified, nominal and no model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from motion_cases import ARM, SETTINGS, rehearsed

from tauhat.control import PD, ModelFeedforward, PDFeedforward
from tauhat.errors import ModelError
from tauhat.estimation.identified_torque import identified_torque
from tauhat.simulation import simulate
from tauhat.verification.motion_tracking import Contender, compare_tracking, tracking_contenders


@cache
def comparison():
    case = rehearsed()
    return compare_tracking(case.estimate, case.unseen, truth=case.truth, settings=SETTINGS)


def total(name):
    return float(np.linalg.norm(comparison().run(name).rms))


def test_all_controllers_of_the_comparison_follow_the_plant():
    names = [run.name for run in comparison().runs]
    assert names == [
        "PD",
        "PD + gravity",
        "feedforward, nominal",
        "feedforward, identified",
        "computed torque, nominal",
        "computed torque, identified",
        "adaptive",
    ]
    assert [run.failure for run in comparison().runs] == [""] * 7
    assert [run.knows for run in comparison().runs].count("identified") == 2


@pytest.mark.parametrize("kind", ["feedforward", "computed torque"])
def test_the_identified_model_tracks_an_order_better_than_the_description_and_that_better_than_none(kind):
    assert total(f"{kind}, identified") < 0.1 * total(f"{kind}, nominal")
    assert total(f"{kind}, nominal") < 0.5 * total("PD + gravity")
    assert total("PD + gravity") < total("PD")


def test_what_adaptive_tracking_learns_in_the_first_half_serves_it_in_the_second():
    run, half = comparison().run("adaptive"), comparison().t.size // 2
    begun = comparison().run("computed torque, nominal")

    def size(errors):
        return np.linalg.norm(errors)

    assert size(run.error[half:]) < 0.7 * size(begun.error[half:])
    assert total("adaptive") < total("computed torque, nominal")


def test_the_pd_of_the_comparison_is_the_kernels_own_run():
    """The error told is that of the same law simulated by itself."""
    case = rehearsed()
    law = PD(kp=case.law.kp, kd=case.law.kd, torque_limit=case.law.torque_limit)
    settings = replace(SETTINGS, controller=law)
    known = simulate(ARM, case.unseen, rng=np.random.default_rng(1), parameters=case.truth, settings=settings).truth
    told = compare_tracking(
        case.estimate,
        case.unseen,
        truth=case.truth,
        settings=SETTINGS,
        contenders=[Contender(name="PD", knows="none", controller=law)],
    ).run("PD")
    error = known.reference.q - known.q
    np.testing.assert_allclose(told.error, error, atol=1e-12)
    np.testing.assert_allclose(told.rms, np.sqrt(np.mean(error**2, axis=0)))
    np.testing.assert_allclose(told.worst, np.abs(error).max(axis=0))
    np.testing.assert_allclose(told.effort, np.sqrt(np.mean(known.tau**2, axis=0)))


def test_an_unstable_controller_is_told_and_does_not_end_the_comparison():
    case = rehearsed()
    wild = PDFeedforward(kp=np.full(6, 1e7), kd=np.zeros(6))
    contenders = [
        Contender(
            name="wild", knows="none", controller=ModelFeedforward(torque=identified_torque(case.estimate), law=wild)
        ),
        Contender(name="PD", knows="none", controller=case.law),
    ]
    result = compare_tracking(case.estimate, case.unseen, truth=case.truth, settings=SETTINGS, contenders=contenders)
    assert "unstable" in result.run("wild").failure
    plain = result.to_dict()["controllers"]
    assert plain[0]["rms"] == [None] * 6
    assert plain[1]["failure"] == ""
    assert max(plain[1]["rms"]) < 0.1


def test_plain_data_has_every_figure():
    plain = comparison().to_dict()
    assert plain["robot"] == "ur5e"
    assert plain["seconds"] == pytest.approx(3.0)
    assert plain["units"] == ["rad"] * 6
    best = comparison().run("feedforward, identified")
    assert plain["controllers"][3]["rms"] == best.rms.tolist()
    with pytest.raises(ValueError, match="read-only"):
        best.error[0] = 1.0


def test_an_unknown_name_and_a_robot_without_masses_are_refused():
    with pytest.raises(ModelError, match=r"no such controller; expected PD, .*, got fuzzy"):
        comparison().run("fuzzy")
    case = rehearsed()
    bare = replace(ARM, joints=tuple(replace(joint, inertia=np.zeros(10)) for joint in ARM.joints))
    model = replace(case.estimate.model, robot=bare)
    with pytest.raises(ModelError, match="ur5e: the description has no masses to compare with"):
        tracking_contenders(replace(case.estimate, model=model), case.unseen, settings=SETTINGS)
