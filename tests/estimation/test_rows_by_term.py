"""Remembered rows tell what the recordings tell, whichever models came before; each term is made once."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from rough_arms import SETTINGS, rough_truth, slow_and_fast

from tauhat.dynamics import TERMS, TorqueModel, base_parameters
from tauhat.dynamics.terms import Coulomb, Dahl, GasSpring, LoadDahl, Stribeck, Thermal
from tauhat.dynamics.terms.inertia import Inertia
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.rows_by_term import RowsByTerm

TRUTH = rough_truth(Stribeck(speeds=(0.13, 0.05)), keys="inertia,viscous,coulomb", Fv=0.6, Fc=(1.5, 0.8), Fs=1.0)
LONG = slow_and_fast(TRUTH, seed=5, noise=0.05, seconds=40.0)
LOGS = [LONG.rows(900, LONG.n_t), slow_and_fast(TRUTH, seed=6, noise=0.05, part=0.3)]  # in motion, in three chunks


def grams(evidence: Evidence) -> list[np.ndarray]:
    return [factor.T @ factor for factor in evidence.total.factors]


@pytest.mark.parametrize("most_blocks", [1, 64])
def test_they_are_the_rows_of_the_recordings_whatever_came_before(most_blocks: int) -> None:
    rows = RowsByTerm(LOGS, SETTINGS)
    own = TRUTH.model
    models = [own, own.with_term(Stribeck(speeds=(0.4, 0.3))), own.with_term(Coulomb(widths=(0.1, 0.2))), own]
    inertia = tuple(np.arange(10.0 * own.robot.n_v))
    load = LoadDahl(inertia=inertia)
    models.append(TorqueModel(robot=own.robot, terms=(Dahl(scales=(1.0, 2.0)), load, own.terms[0])))
    models.append(TorqueModel(robot=own.robot, terms=(own.terms[0], replace(load, inertia=inertia[::-1]))))
    models.append(TorqueModel(robot=own.robot, terms=(own.terms[0], Thermal(times=(30.0, 40.0)))))
    for model in models:
        base = base_parameters(model)
        found = rows.gather(model, base, most_blocks)
        wanted = collect_all(model, base, LOGS, SETTINGS, most_blocks=most_blocks)
        assert found.n_b == wanted.n_b
        assert [block.n_t for block in found.blocks] == [block.n_t for block in wanted.blocks]
        for support, other in zip(found.supports, wanted.supports, strict=True):
            np.testing.assert_array_equal(support, other)
        for gram, other in zip(grams(found), grams(wanted), strict=True):
            np.testing.assert_allclose(gram, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())


def test_a_term_that_stays_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: Counter[str] = Counter()
    columns = Inertia.columns
    monkeypatch.setattr(Inertia, "columns", lambda *args: made.update(["inertia"]) or columns(*args))
    rows, base = RowsByTerm(LOGS[:1], SETTINGS), base_parameters(TRUTH.model)
    rows.gather(TRUTH.model, base, 1)
    once = made["inertia"]
    for speed in (0.1, 0.2, 0.3):
        rows.gather(TRUTH.model.with_term(Stribeck(speeds=(speed, speed))), base, 1)
    assert made["inertia"] == once > 0


def test_every_term_can_be_remembered() -> None:
    terms = [kind() for kind in TERMS.values() if kind is not GasSpring]
    terms.append(GasSpring(joint=0, distance=0.3, lever=0.1, angle=0.2, area=1e-4, volume=1e-4))
    assert len(set(terms)) == len(TERMS)
