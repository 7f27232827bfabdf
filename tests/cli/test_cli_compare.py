"""`tauhat compare`: models and estimators beside each other, judged on a log that none was fitted to."""

from __future__ import annotations

import json
from pathlib import Path

from cli_workshop import Tauhat, Workshop


def words_of(workshop: Workshop, *more: object) -> tuple[object, ...]:
    return ("compare", "two_link", workshop.log, "--unseen", workshop.other_log, *more)


def test_every_model_meets_every_estimator_on_the_unseen_log(tauhat: Tauhat, workshop: Workshop) -> None:
    models = ("--model", "inertia,rotor,offset", "--model", "plain", "--estimator", "ols", "--estimator", "wls")
    result = tauhat(*words_of(workshop, *models, "--json"))
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    names = [(row["model"], row["estimator"]) for row in said["outcomes"]]
    assert names == [(m, e) for m in ("inertia,rotor,offset", "plain") for e in ("ols", "wls")]
    assert said["judged"] == ["second"]
    assert said["best"]["model"] == "plain"
    frictionless, plain = said["outcomes"][0], said["outcomes"][2]
    assert frictionless["unseen"][0] > 3 * plain["unseen"][0]


def test_a_model_that_cannot_be_fitted_does_not_stop_the_others(tauhat: Tauhat, workshop: Workshop) -> None:
    models = ("--model", "inertia,coupling", "--model", "plain+physical")
    said = json.loads(tauhat(*words_of(workshop, *models, "--json")).stdout)
    assert "no motor turns with two joints" in said["outcomes"][0]["failure"]
    assert said["outcomes"][1]["failure"] == ""
    assert said["best"]["model"] == "plain+physical"


def test_the_table_and_the_page_name_the_best(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    page = tmp_path / "compared.html"
    result = tauhat(*words_of(workshop, "--model", "inertia", "--model", "plain", "-o", page))
    assert result.exit_code == 0, result.stderr
    assert "Least error on unseen recordings: plain with wls." in result.stdout
    text = page.read_text(encoding="utf-8")
    assert "<strong>plain</strong>" in text
    assert "plotly" in text


def test_an_unknown_estimator_is_refused_with_the_known_ones(tauhat: Tauhat, workshop: Workshop) -> None:
    result = tauhat(*words_of(workshop, "--estimator", "magic"))
    assert result.exit_code == 1
    assert "unknown estimator" in result.stderr
    assert "wls" in result.stderr
