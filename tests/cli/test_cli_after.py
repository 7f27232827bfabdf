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


def test_an_estimate_of_another_robot_is_refused(workshop: Workshop, tauhat: Tauhat, tmp_path: Path) -> None:
    result = tauhat("excite", "ur5e", "-o", tmp_path / "motion.csv", "--after", workshop.estimate, *QUICK)
    assert result.exit_code == 1
    assert result.stderr.startswith("error:")
    assert not (tmp_path / "motion.csv").exists()
