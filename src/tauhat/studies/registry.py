"""Every study by its name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from tauhat.errors import ModelError
from tauhat.studies.crs_a465 import CrsA465Study
from tauhat.studies.force_sensing import ForceSensingStudy
from tauhat.studies.local_global import LocalGlobalStudy
from tauhat.studies.monte_carlo import MonteCarloStudy
from tauhat.studies.polishing import PolishingStudy
from tauhat.studies.real_logs import RealLogsStudy
from tauhat.studies.study import Study
from tauhat.studies.whole_rehearsal import WholeRehearsalStudy

_KINDS: tuple[type[Study], ...] = (
    CrsA465Study,
    ForceSensingStudy,
    LocalGlobalStudy,
    MonteCarloStudy,
    PolishingStudy,
    RealLogsStudy,
    WholeRehearsalStudy,
)
STUDIES: dict[str, type[Study]] = {kind.key: kind for kind in _KINDS}


def study_named(key: str, settings: Mapping[str, Any] | None = None) -> Study:
    """Return the study of this name.

    Parameters
    ----------
    settings : by name, of those that the study takes; its own for all that is left out

    Raises
    ------
    ModelError
        when there is no such study, it has no such setting, needs another, or a value does not suit it.
    """
    if key not in STUDIES:
        raise ModelError("unknown study", expected=", ".join(STUDIES), got=key)
    kind, given = STUDIES[key], dict(settings or {})
    strange = sorted(set(given) - set(kind.takes))
    if strange:
        raise ModelError(
            "not a setting of it", where=f"study {key}", expected=_options(kind.takes), got=_options(strange)
        )
    missing = [name for name in kind.needs if name not in given]
    if missing:
        raise ModelError("a setting is missing", where=f"study {key}", expected=_options(missing))
    make: Callable[..., Study] = kind
    return make(**given)


def _options(names: Iterable[str]) -> str:
    """Return settings as the command line calls them."""
    return ", ".join(f"--{name}" for name in names)
