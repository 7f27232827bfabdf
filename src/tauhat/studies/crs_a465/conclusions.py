"""What the CRS A465 study concludes: every sentence is made of the run's own figures."""

from __future__ import annotations

import numpy as np

from tauhat.studies.crs_a465.experiment import TERMS, identifiable
from tauhat.studies.crs_a465.findings import Findings, against, listed, percent
from tauhat.studies.crs_a465.fits import METHODS, Case
from tauhat.studies.study import Chapter

_NEAR = 2.0  # times the error without gross errors: a method that stays below has survived them


def conclusions(found: Findings) -> Chapter:
    """Return what follows from the figures."""
    text = (_of_weights(found), _of_gross_errors(found), _of_losses(found), _of_models(found), _of_intervals(found))
    return Chapter(title="Conclusions", text=text)


def summary(found: Findings) -> str:
    """Return the answer in a few sentences."""
    ols, irls = (found.torque(Case("outliers", "full", method)) for method in ("ols", "irls"))
    return (
        f"Over {len(found.arms)} random CRS A465 arms with unequal joint noise and gross errors, ordinary least "
        f"squares is off by {percent(ols)} of the torque on an unseen motion and IRLS by {percent(irls)}. "
        f"{_of_models(found)}"
    )


def _of_weights(found: Findings) -> str:
    cases = {c: [Case(c, "full", method) for method in ("ols", "wls")] for c in ("equal", "unequal")}
    equal, unequal = ([found.torque(case) for case in cases[condition]] for condition in cases)
    ols, wls = (found.joints(case) for case in cases["unequal"])
    most = int(np.argmax(ols / wls))
    joint = identifiable("full").model.robot.joint_names[most]
    return (
        f"Weights of the joints: where the noise is unequal, WLS is off by {percent(unequal[1])} and OLS by "
        f"{percent(unequal[0])}, WLS {against(unequal[1], unequal[0])}; {joint} gains most, from {percent(ols[most])} "
        f"to {percent(wls[most])}. Where the noise is equal, they are off by {percent(equal[1])} and "
        f"{percent(equal[0])}, {against(equal[1], equal[0])}."
    )


def _of_gross_errors(found: Findings) -> str:
    words, survivors = [], []
    for method in METHODS:
        before, after = (found.torque(Case(condition, "full", method)) for condition in ("unequal", "outliers"))
        words.append(f"{method} from {percent(before)} to {percent(after)}")
        if after < _NEAR * before:
            survivors.append(method)
    kept = f"less than {_NEAR:g} times the error: {', '.join(survivors) or 'no method'}"
    return f"Gross errors take {'; '.join(words)}. They cost {kept}."


def _of_losses(found: Findings) -> str:
    cauchy, huber = (found.torque(Case("outliers", "full", method)) for method in ("irls", "irls-huber"))
    wls, irls = (found.torque(Case("unequal", "full", method)) for method in ("wls", "irls"))
    return (
        f"What the loss matters: with gross errors Cauchy's (irls) is off by {percent(cauchy)} and Huber's by "
        f"{percent(huber)}, {against(huber, cauchy)}. Without them IRLS is off by {percent(irls)} and WLS by "
        f"{percent(wls)}, IRLS {against(irls, wls)}, which is what reweighting costs where it is not needed."
    )


def _of_models(found: Findings) -> str:
    medians = {name: found.after_lengths(name)[1] for name in TERMS}
    parts = []
    for name in ("simplified", "full"):
        own, other = medians[name], medians[_other(name)]
        won = np.flatnonzero(own < other)
        if won.size:
            times = listed([found.lengths[k] for k in won], "s")
            errors = f"{percent(own[won[-1]])} against {percent(other[won[-1]])}"
            parts.append(f"the {name} model predicts better after logs of {times} ({errors} after the longest)")
    said = ", and ".join(parts) or "neither model predicts better after any of the logs"
    bias = percent(found.exact("simplified"))
    return f"The model without products of inertia has a bias of {bias} of the torque: {said}."


def _other(name: str) -> str:
    return next(other for other in TERMS if other != name)


def _of_intervals(found: Findings) -> str:
    words, shares = [], {}
    for name in TERMS:
        unequal, outliers = (found.inside(Case(condition, name, "irls")) for condition in ("unequal", "outliers"))
        shares[name] = float(unequal.mean())
        words.append(
            f"{percent(unequal.mean())} and {percent(outliers.mean())} of the {name} model's (of the worst parameter "
            f"{percent(unequal.min())} and {percent(outliers.min())})"
        )
    less = (
        ": error bars tell of noise, and not of what a model leaves out"
        if shares["simplified"] < shares["full"]
        else ""
    )
    return f"IRLS's 95 % intervals, without and with gross errors, hold the truth in {', and in '.join(words)}{less}."
