"""`tauhat excite --after`: the next motion counts what an estimate knows, and refuses one of another robot."""

from __future__ import annotations

import json
from pathlib import Path

from cli_workshop import Tauhat, Workshop, made

QUICK = ("--method", "gradient", "--starts", 1, "--harmonics", 2, "--seconds", 4)


def test_what_is_known_is_added_to_what_the_motion_tells(workshop: Workshop, tauhat: Tauhat, tmp_path: Path) -> None:
    words = ("excite", "two_link", "-o", tmp_path / "motion.csv", "--json", *QUICK)
    alone = json.loads(made(*words).stdout)
    after = json.loads(made(*words, "--after", workshop.estimate).stdout)
    assert after["log_det"] > alone["log_det"]
    assert after["mean_error"] < alone["mean_error"]


def test_what_is_printed_tells_the_gain_and_holds_no_bound_for_one_motion_against_both(
    workshop: Workshop, tauhat: Tauhat, tmp_path: Path
) -> None:
    words = ("excite", "two_link", "-o", tmp_path / "motion.csv", *QUICK)
    assert "good: below 10" in " ".join(made(*words).stdout.split())
    figures = json.loads(made(*words, "--after", workshop.estimate, "--json").stdout)
    assert 0.0 < figures["mean_error"] < figures["mean_error_before"]
    after = " ".join(made(*words, "--after", workshop.estimate).stdout.split())
    assert "good: below" not in after
    assert "Together with what estimate.json knows" in after
    share = 100 * figures["mean_error"] / figures["mean_error_before"]
    assert f"standard error of the parameters is {share:.3g} % of that before" in after


def test_an_estimate_of_another_robot_is_refused(workshop: Workshop, tauhat: Tauhat, tmp_path: Path) -> None:
    result = tauhat("excite", "ur5e", "-o", tmp_path / "motion.csv", "--after", workshop.estimate, *QUICK)
    assert result.exit_code == 1
    assert result.stderr.startswith("error:")
    assert not (tmp_path / "motion.csv").exists()
