"""Which estimators belong together, and which of them take long."""

from __future__ import annotations

from collections.abc import Mapping

OTHERS = "Online and in steps"
FAMILIES: Mapping[str, tuple[str, ...]] = {
    "Least squares": (
        *("ols", "wls", "irls", "irls-huber", "irls-bisquare", "tls"),
        *("ridge", "prior", "ml", "recursive", "hybrid"),
    ),
    "With a simulated robot": ("idim-iv", "didim", "clie", "cloe"),
    "Kalman filters": ("parameter-kalman", "ekf", "ekf-root", "ukf", "ukf-root", "cdkf", "cdkf-root"),
    OTHERS: ("adaline", "hopfield", "adaptive", "sequential"),
}
SLOW: tuple[str, ...] = ("clie", "cloe", "ekf", "ekf-root", "ukf", "ukf-root", "cdkf", "cdkf-root", "adaptive")


def family_of(estimator: str) -> str:
    """Return the family of an estimator; one that has none is among the last."""
    return next((family for family, keys in FAMILIES.items() if estimator in keys), OTHERS)
