"""`--model auto` adds what the truth has, adds nothing that it has not, and is never worse on unseen data."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from rough_arms import SETTINGS, rough_truth, slow_and_fast

from sample_arms import autocorrelated_noise
from tauhat.dynamics import torque_model
from tauhat.dynamics.model import ROBUST_TERMS
from tauhat.dynamics.terms import Coulomb
from tauhat.errors import RecordingError
from tauhat.estimation import OrdinaryLeastSquares, identify, load_estimate
from tauhat.estimation.structure import OPTIONAL, Selected, Structure, Trial, select_model, widest
from tauhat.recordings.recording import Recording
from tauhat.verification import verify

FRICTION = {"Fv": 0.6, "Fc": (1.0, 0.7), "To": 0.1, "Ia": 0.02}
MORE = {
    "": {},
    "viscous-asymmetry": {"Fva": (0.3, 0.2)},
    "spring": {"Ks": (2.0, 1.0)},
}


@cache
def runs(extra: str, seed: int, count: int) -> list[Recording]:
    """Return recordings of an arm with plain friction and one further term; noise of 0.1 s."""
    keys = ",".join(filter(None, ["inertia,rotor,viscous,offset", extra]))
    truth = rough_truth(Coulomb(widths=(0.05, 0.05)), keys=keys, **FRICTION, **MORE[extra])
    made = []
    for k in range(count):
        run = slow_and_fast(truth, seed=10 * seed + k, seconds=8.0)
        rng = np.random.default_rng(500 + 10 * seed + k)
        noise = 0.1 * autocorrelated_noise(rng, run.q.shape, time_constant=0.1, rate=250.0)
        made.append(replace(run, tau=run.tau + noise))
    return made


@cache
def chosen(extra: str, seed: int, start: str, count: int) -> Selected:
    """Return what is chosen on the first recordings."""
    recordings = runs(extra, seed, 5)[:count]
    return select_model(torque_model(planar(), start), recordings, processing=SETTINGS)


def planar():
    return rough_truth().model.robot


def unseen_errors(extra: str, seed: int, start: str, count: int) -> tuple[float, float]:
    """Return the unseen error of the model that was started from, and of the one that was chosen."""
    recordings = runs(extra, seed, 5)
    models = (torque_model(planar(), start), chosen(extra, seed, start, count).model)
    found = []
    for model in models:
        estimate = identify(model, recordings[:count], processing=SETTINGS)
        found.append(float(np.mean([log.relative_rms for log in verify(estimate, recordings[3:]).logs])))
    return found[0], found[1]


@pytest.mark.parametrize(("start", "seed"), [*(("plain", seed) for seed in range(6)), ("robust", 1), ("robust", 2)])
def test_a_term_that_the_truth_has_is_added_and_halves_the_unseen_error(start: str, seed: int) -> None:
    picked = chosen("viscous-asymmetry", seed, start, 3)
    assert "viscous-asymmetry" in {term.key for term in picked.model.terms}
    taken = [trial for trial in picked.structure.trials if trial.taken]
    assert (taken[0].term, taken[0].change) == ("viscous-asymmetry", "add")
    simple, better = unseen_errors("viscous-asymmetry", seed, start, 3)
    assert better < 0.65 * simple


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_added_that_the_truth_has_not(seed: int, count: int) -> None:
    picked = chosen("", seed, "plain", count)
    assert [term.key for term in picked.model.terms] == [term.key for term in torque_model(planar()).terms]
    assert {trial.term for trial in picked.structure.trials} == {"viscous-asymmetry", "spring", "coulomb"}
    assert not any(trial.taken for trial in picked.structure.trials)


@pytest.mark.parametrize("seed", range(3))
def test_the_default_stays_where_nothing_is_clearly_better(seed: int) -> None:
    picked = chosen("", seed, "robust", 3)
    assert tuple(term.key for term in picked.model.terms) == ROBUST_TERMS
    assert "the default stays" in picked.structure.words


@pytest.mark.parametrize("extra", MORE)
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("seed", range(6))
def test_it_is_never_worse_on_unseen_data_than_the_simpler_model(seed: int, count: int, extra: str) -> None:
    simple, better = unseen_errors(extra, seed, "plain", count)
    assert better <= 1.01 * simple


def test_whole_recordings_are_left_out_and_of_one_its_stretches() -> None:
    several, single = chosen("", 0, "plain", 3).structure, chosen("", 0, "plain", 1).structure
    assert (several.folds, several.whole) == (3, True)
    assert single.folds in {3, 4, 5, 6}
    assert not single.whole
    assert "3 left-out recordings" in several.words
    assert "stretches of the one recording" in single.words


def test_one_recording_must_gain_more_than_several() -> None:
    for (count, least), extra, seed in product(((1, 0.1), (3, 0.03)), MORE, range(6)):
        for trial in chosen(extra, seed, "plain", count).structure.trials:
            assert not trial.taken or trial.gain > max(least, 3.0 * trial.uncertainty)


def test_a_term_of_the_model_that_only_harms_is_dropped() -> None:
    signs = (1.0, 1.0, -1.0, -1.0)  # of an asymmetry that is another in each recording: the others mislead
    recordings = [
        replace(run, tau=run.tau + sign * np.abs(np.gradient(run.q, run.t, axis=0)))
        for sign, run in zip(signs, runs("", 1, 5)[:4], strict=True)
    ]
    picked = select_model(torque_model(planar(), "plain,viscous-asymmetry"), recordings, processing=SETTINGS)
    changed = [trial for trial in picked.structure.trials if trial.taken]
    assert [(trial.term, trial.change) for trial in changed] == [("viscous-asymmetry", "drop")]
    assert "viscous-asymmetry" not in {term.key for term in picked.model.terms}
    assert "viscous-asymmetry dropped (error" in picked.structure.words


def test_terms_that_another_stands_for_are_not_tried() -> None:
    polynomial = widest(torque_model(planar(), "inertia,polynomial"))
    assert [term.key for term in polynomial.terms] == ["inertia", "polynomial", "viscous-asymmetry", "spring"]
    asymmetric = widest(torque_model(planar(), "inertia,asymmetric"))
    assert [term.key for term in asymmetric.terms] == ["inertia", "asymmetric", "spring"]
    assert {term.key for term in widest(torque_model(planar(), "robust")).terms} == {*ROBUST_TERMS, *OPTIONAL}


def test_too_little_data_leaves_the_default_and_says_so() -> None:
    short = runs("", 0, 1)[0].rows(500, 545)
    picked = select_model(torque_model(planar(), "robust"), [short], processing=SETTINGS)
    assert picked.structure.trials == ()
    assert "too little data" in picked.structure.words
    assert tuple(term.key for term in picked.model.terms) == ROBUST_TERMS


def test_the_estimator_and_the_processing_are_those_that_were_given() -> None:
    recordings = runs("", 0, 3)
    picked = select_model(torque_model(planar()), recordings, estimator=OrdinaryLeastSquares(), processing=SETTINGS)
    assert picked.processing == SETTINGS
    weighted = chosen("", 0, "plain", 3)
    assert picked.structure.trials != weighted.structure.trials


def test_a_recording_of_another_robot_is_refused() -> None:
    run = runs("", 0, 1)[0]
    with pytest.raises(RecordingError, match="the log does not fit the robot"):
        select_model(torque_model(planar()), [replace(run, q=run.q[:, :1], tau=run.tau[:, :1], joint_names=("a",))])


def test_the_choice_survives_the_estimate_file(tmp_path) -> None:
    structure = Structure(
        folds=3, whole=True, trials=(Trial(term="spring", change="add", gain=0.25, uncertainty=0.03, taken=True),)
    )
    estimate = identify(torque_model(planar(), "plain,spring"), runs("spring", 1, 3), processing=SETTINGS)
    assert estimate.structure is None
    replace(estimate, structure=structure).save(tmp_path / "e.json")
    assert load_estimate(tmp_path / "e.json").structure == structure
    assert json.loads((tmp_path / "e.json").read_text())["structure"]["trials"][0]["term"] == "spring"
    assert structure.words == "spring added (error 25.0 % less); judged on 3 left-out recordings"
