"""The report says which terms the model has, how they were chosen, and what their symbols mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sample_arms import planar_arm
from tauhat.dynamics import TERMS, TorqueModel, base_parameters
from tauhat.estimation import Estimate, Structure, Trial
from tauhat.report.advice import next_steps
from tauhat.report.case import Case
from tauhat.report.sections.given import given
from tauhat.report.sections.parameters import _SYMBOLS, _members, parameters

TRIALS = (
    Trial(term="viscous-asymmetry", change="add", gain=0.312, uncertainty=0.041, taken=True),
    Trial(term="load-dahl", change="drop", gain=-0.125, uncertainty=0.02, taken=False),
)


def page(estimate: Estimate) -> str:
    return " ".join(str(given(Case(estimate=estimate, verification=None)).html).split())


def test_a_chosen_structure_is_explained_with_every_trial(estimate: Estimate) -> None:
    html = page(replace(estimate, structure=Structure(folds=3, whole=True, trials=TRIALS)))
    assert "How the terms were chosen" in html
    assert "Every recording was left out in turn" in html
    assert "viscous-asymmetry added (error 31.2 % less); judged on 3 left-out recordings" in html
    assert html.count('<th scope="row">viscous-asymmetry</th>') == 1
    assert "-31.2 %" in html
    assert "12.5 %" in html
    assert "4.1 %" in html


def test_a_choice_from_one_recording_says_that_stretches_share_much(estimate: Estimate) -> None:
    html = page(replace(estimate, structure=Structure(folds=5, whole=False, trials=TRIALS[1:])))
    assert "each of 5 stretches of time was left out in turn" in html
    assert "the default stays" in html


def test_a_choice_without_trials_has_no_table(estimate: Estimate) -> None:
    html = page(replace(estimate, structure=Structure(folds=1, whole=False, trials=())))
    assert "too little data" in html
    assert "Change of the unseen error" not in html


def test_a_model_that_was_given_explains_no_choice(estimate: Estimate) -> None:
    assert "How the terms were chosen" not in page(estimate)


def test_every_symbol_of_every_term_is_explained() -> None:
    explained = {symbol for key in _SYMBOLS for symbol in _members(key)} | {"mx", "my", "mz", "Ixy", "Ixz", "Iyz"}
    robot = planar_arm()
    needed = {"Iam", "Fvm", "Fsm", "Fdm", "Fem", "Gs"}
    for key, kind in TERMS.items():
        if key not in {"gas-spring", "coupling", "coupling-dahl"}:
            needed |= {parameter.symbol for parameter in kind().parameters(robot)}
    assert needed - explained == set()


def test_only_the_symbols_of_the_model_are_explained(estimate: Estimate) -> None:
    html = str(parameters(Case(estimate=estimate, verification=None)).html)
    assert "Coulomb friction</dd>" in html
    assert "Stribeck" not in html
    assert "gas spring" not in html


@pytest.mark.parametrize("keys", [("viscous", "coulomb"), ("cube-root", "dahl"), ("asymmetric",)], ids=str)
def test_advice_sees_negative_friction_of_any_law(estimate: Estimate, keys: tuple[str, ...]) -> None:
    model = TorqueModel(robot=estimate.robot, terms=tuple(TERMS[key]() for key in ("inertia", *keys)))
    base = base_parameters(model)
    friction = np.array([base.names[index][0] == "F" for index in base.independent])
    changes = {"model": model, "base": base, "covariance": 1e-6 * np.eye(base.n_b)}
    driving = replace(estimate, **changes, values=np.where(friction, -1.0, 1.0))
    braking = replace(estimate, **changes, values=np.where(friction, 1.0, -1.0))
    assert "Check the sign of the torque of j1, elbow" in " ".join(
        next_steps(Case(estimate=driving, verification=None))
    )
    assert "Check the sign" not in " ".join(next_steps(Case(estimate=braking, verification=None)))


def test_friction_that_may_be_zero_raises_no_alarm(estimate: Estimate) -> None:
    unsure = replace(estimate, values=-estimate.values, covariance=1e6 * estimate.covariance)
    assert "Check the sign" not in " ".join(next_steps(Case(estimate=unsure, verification=None)))
