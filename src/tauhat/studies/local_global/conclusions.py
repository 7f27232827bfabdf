"""What the comparison of local and global calibration comes to: every sentence is made of the run's own figures."""

from __future__ import annotations

from scipy.stats import binomtest

from tauhat.excitation.task_design.blocks import BLOCKS
from tauhat.studies.local_global.arms import JUDGED
from tauhat.studies.local_global.findings import Findings
from tauhat.studies.local_global.motions import GLOBAL
from tauhat.studies.study import Chapter

WARM, COLD, ELSEWHERE = JUDGED
_CHANCE = 0.05  # below which so many wins are more than chance


def conclusions(found: Findings) -> Chapter:
    """Return what follows from the figures."""
    text = (_of_work(found), _of_cold(found), _of_elsewhere(found), _of_both(found), _of_stages(found))
    others = tuple(_of_friction(found, friction) for friction in found.frictions[1:])
    return Chapter(title="Conclusions", text=(*text, *others))


def summary(found: Findings) -> str:
    """Return the answer in a few sentences."""
    arms = "one random arm" if found.count == 1 else f"{found.count} random arms"
    return (
        f"{found.robot.name}, {arms} with friction, elasticity and backlash that the model does not "
        f"know. {_of_work(found)} {_of_elsewhere(found)}"
    )


def verdict(found: Findings, fit: str, other: str, judged: str, friction: str | None = None) -> str:
    """Return whether one model predicts better than another: `better`, `worse`, or `no clear difference`.

    By a two-sided sign test over the arms, at 5 %.
    """
    wins = found.wins(fit, other, judged, friction)
    if binomtest(wins, found.count).pvalue >= _CHANCE:
        return "no clear difference"
    return "better" if 2 * wins > found.count else "worse"


def percent(part: float) -> str:
    """Return a part as a percentage."""
    return f"{100.0 * part:.3g} %"


def _against(found: Findings, fit: str, other: str, judged: str, friction: str | None = None) -> str:
    own, others = (found.quartiles(name, judged, friction).median for name in (fit, other))
    return (
        f"{percent(own)} against {percent(others)} of the torque, smaller on {found.wins(fit, other, judged, friction)}"
        f" of {found.count} arms, median ratio {found.ratio(fit, other, judged, friction).median:.3g}"
    )


def _of_work(found: Findings) -> str:
    said = {
        "better": "The model fitted where the work is predicts torque better there than the global one",
        "worse": "The model fitted where the work is predicts torque worse there than the global one",
        "no clear difference": "The model fitted where the work is does not predict torque clearly better there than "
        "the global one",
    }[verdict(found, "local", GLOBAL, WARM)]
    return f"{said}: {_against(found, 'local', GLOBAL, WARM)}."


def _of_cold(found: Findings) -> str:
    kept = verdict(found, "local", GLOBAL, COLD)
    said = {
        "better": "With cold joints it does better",
        "worse": "With cold joints it does worse",
        "no clear difference": "With cold joints there is no clear difference",
    }[kept]
    warm, cold = (found.quartiles("local", judged).median for judged in (WARM, COLD))
    return (
        f"{said}: {_against(found, 'local', GLOBAL, COLD)}. The local model itself is off by {percent(cold)} on the "
        f"cold path and by {percent(warm)} on the warm one it was recorded for."
    )


def _of_elsewhere(found: Findings) -> str:
    said = {
        "better": "Even elsewhere the local model predicts better",
        "worse": "Elsewhere the local model must not be used",
        "no clear difference": "Elsewhere there is no clear difference",
    }[verdict(found, "local", GLOBAL, ELSEWHERE)]
    return f"{said}: {_against(found, 'local', GLOBAL, ELSEWHERE)}."


def _of_both(found: Findings) -> str:
    there, away = (found.ratio("both", GLOBAL, judged).median for judged in (WARM, ELSEWHERE))
    local = found.ratio("both", "local", WARM).median
    return (
        f"Fitted to both kinds of motion, the error on the warm path is {there:.3g} times that of the global model and "
        f"{local:.3g} times that of the local one, and elsewhere {away:.3g} times that of the global one."
    )


def _of_stages(found: Findings) -> str:
    stages, whole = found.blocks["local"], found.blocks["one stage"]
    ways = [
        f"{block} {stages[block].error:.3g} against {whole[block].error:.3g} (condition {stages[block].condition:.3g} "
        f"against {whole[block].condition:.3g})"
        for block in BLOCKS
    ]
    said = verdict(found, "local", "one stage", WARM)
    return (
        f"Two stages against one of the same length: predicted parameter errors of {', '.join(ways)}; error on the "
        f"warm path {_against(found, 'local', 'one stage', WARM)}: {said}. One stage against the global model: "
        f"{_against(found, 'one stage', GLOBAL, WARM)}: {verdict(found, 'one stage', GLOBAL, WARM)}."
    )


def _of_friction(found: Findings, friction: str) -> str:
    said = verdict(found, "local", GLOBAL, WARM, friction)
    return (
        f"Where the plant's friction is {friction} instead of {found.frictions[0]}, the local model is on the warm "
        f"path {said if said != 'no clear difference' else 'not clearly different'}: "
        f"{_against(found, 'local', GLOBAL, WARM, friction)}."
    )
