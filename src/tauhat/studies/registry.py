"""Every study by its name."""

from __future__ import annotations

from collections.abc import Callable

from tauhat.errors import ModelError
from tauhat.studies.crs_a465 import CrsA465Study
from tauhat.studies.monte_carlo import MonteCarloStudy
from tauhat.studies.study import Study
from tauhat.studies.whole_rehearsal import WholeRehearsalStudy

_KINDS: tuple[type[Study], ...] = (CrsA465Study, MonteCarloStudy, WholeRehearsalStudy)
STUDIES: dict[str, type[Study]] = {kind.key: kind for kind in _KINDS}


def study_named(key: str, *, seeds: int | None = None) -> Study:
    """Return the study of this name.

    Parameters
    ----------
    seeds : how many random cases it has; the study's own number by default

    Raises
    ------
    ModelError
        when there is none, or the number does not suit it.
    """
    if key not in STUDIES:
        raise ModelError("unknown study", expected=", ".join(STUDIES), got=key)
    make: Callable[..., Study] = STUDIES[key]
    return make() if seeds is None else make(seeds=seeds)
