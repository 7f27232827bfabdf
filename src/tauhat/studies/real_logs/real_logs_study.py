"""Models and estimators on logs of real robots: the settings and the run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from tauhat.dynamics.named_model import AUTO
from tauhat.errors import ModelError
from tauhat.estimation.estimators import estimator_named
from tauhat.studies.comparison import PHYSICAL
from tauhat.studies.real_logs.case_file import RealCase, check_logs, load_cases
from tauhat.studies.real_logs.chapters import chapters_of, summary_of
from tauhat.studies.real_logs.figures import Figures
from tauhat.studies.real_logs.fitting import CaseFit, Piece, fits_of
from tauhat.studies.study import Study, StudyResult
from tauhat.workers import Workers

_WHOLE_MODELS = ("plain", "robust", AUTO)


@dataclass(frozen=True, slots=True, kw_only=True)
class RealLogsStudy(Study):
    """Every model with every estimator on every case of a file, judged on logs that were not fitted.

    cases : TOML file, see `load_cases`
    data : folder of the logs; that of the file by default
    estimators : by name
    models : `plain`, `robust`, `auto` or a TOML file of terms, each with `+physical` for physical constraints
    """

    key: ClassVar[str] = "real-logs"
    title: ClassVar[str] = "Models and estimators on logs of real robots"
    takes: ClassVar[tuple[str, ...]] = ("cases", "data", "estimators", "models")
    needs: ClassVar[tuple[str, ...]] = ("cases",)
    cases: Path
    data: Path | None = None
    estimators: tuple[str, ...] = ("wls", "irls", "ols", "tls", "ml")
    models: tuple[str, ...] = ("robust", AUTO)

    def __post_init__(self) -> None:
        object.__setattr__(self, "cases", Path(self.cases))
        if self.data is not None:
            object.__setattr__(self, "data", Path(self.data))
        for name in ("estimators", "models"):
            values = tuple(getattr(self, name))
            object.__setattr__(self, name, values)
            if not values or len(set(values)) < len(values):
                raise ModelError(
                    f"study {self.key}: {name}", expected="at least one, none twice", got=", ".join(values)
                )
        for key in self.estimators:
            estimator_named(key)
        for model in self.models:
            _check_model(model)

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the figures of all fits in chapters.

        Raises
        ------
        ModelError
            when the file of cases cannot be used, or a log is not there.
        """
        cases = load_cases(self.cases, data=self.data)
        check_logs(cases)
        return self.result(cases, self.fits(cases, workers, tell=tell))

    def fits(
        self, cases: Sequence[RealCase], workers: Workers, *, tell: Callable[[str], None] = lambda _: None
    ) -> tuple[CaseFit, ...]:
        """Return every fit, case by case and model by model."""
        pieces = [Piece(case=case, model=model, estimators=self.estimators) for case in cases for model in self.models]
        fits: list[CaseFit] = []
        for number, (piece, found) in enumerate(zip(pieces, workers.map(fits_of, pieces), strict=True), start=1):
            fits += found
            tell(f"{number} of {len(pieces)}: {piece.case.name}, {piece.model}")
        return tuple(fits)

    def result(self, cases: Sequence[RealCase], fits: Sequence[CaseFit]) -> StudyResult:
        """Return the figures of these fits in chapters."""
        figures = Figures.of(cases, fits)
        settings = {
            "cases": str(self.cases),
            "data": str(self.data or self.cases.parent),
            "estimators": self.estimators,
            "models": self.models,
        }
        return StudyResult(
            name=self.key,
            title=self.title,
            summary=summary_of(figures),
            chapters=chapters_of(figures),
            settings=settings,
        )


def _check_model(name: str) -> None:
    terms = name.removesuffix(PHYSICAL)
    if terms not in _WHOLE_MODELS and not terms.endswith(".toml"):
        raise ModelError(
            "unknown model",
            expected=f"{', '.join(_WHOLE_MODELS)} or a .toml file, each also with {PHYSICAL}",
            got=name,
            remedy='write single terms into a file: terms = "inertia, viscous"',
        )
