"""Studies by name: each under its own key, with as many random cases as are asked for."""

from __future__ import annotations

from dataclasses import fields

import pytest

from tauhat.errors import ModelError
from tauhat.studies.crs_a465 import CrsA465Study
from tauhat.studies.monte_carlo import MonteCarloStudy
from tauhat.studies.registry import STUDIES, study_named


@pytest.mark.parametrize("key", sorted(STUDIES))
def test_a_study_stands_under_its_own_key_and_has_what_it_takes(key: str) -> None:
    kind = STUDIES[key]
    assert kind.key == key
    assert kind.title
    assert set(kind.needs) <= set(kind.takes) <= {field.name for field in fields(kind)}


@pytest.mark.parametrize("key", sorted(key for key, kind in STUDIES.items() if not kind.needs))
def test_a_study_that_needs_nothing_runs_by_its_name_and_takes_seeds(key: str) -> None:
    assert study_named(key) == STUDIES[key]()
    assert study_named(key, {"seeds": 3}) != STUDIES[key]()


def test_settings_reach_the_study() -> None:
    assert study_named("crs-a465", {"seeds": 7}) == CrsA465Study(seeds=7)
    assert study_named("estimators", {"estimators": ("ols",)}) == MonteCarloStudy(estimators=("ols",))


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ModelError, match=r"unknown study; expected .*crs-a465.*, got nothing"):
        study_named("nothing")


def test_a_setting_that_a_study_does_not_have_is_refused_with_those_it_has() -> None:
    with pytest.raises(ModelError, match=r"study crs-a465: not a setting of it; expected --seeds, got --cases, --data"):
        study_named("crs-a465", {"data": "x", "cases": "y", "seeds": 1})


def test_a_setting_that_a_study_needs_is_asked_for() -> None:
    with pytest.raises(ModelError, match=r"study real-logs: a setting is missing; expected --cases"):
        study_named("real-logs", {"models": ("plain",)})
