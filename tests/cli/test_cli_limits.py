"""`tauhat excite --limits`: the limits of the file are kept and shown, and mistakes in it are one line."""

from __future__ import annotations

import json
from pathlib import Path

from cli_workshop import Tauhat, made

FILE = '[torque]\nfraction = 0.7\n[tool]\nspeed = 0.8\n[[planes]]\nname = "bench"\noffset = -0.3\n'
QUICK = ("--method", "gradient", "--starts", 1, "--harmonics", 2, "--seconds", 4)


def test_the_limits_of_the_file_are_kept_and_shown(tauhat: Tauhat, tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(FILE)
    words = ("excite", "two_link", "-o", tmp_path / "motion.csv", "--limits", path, *QUICK)
    margins = json.loads(made(*words, "--json").stdout)["limits"]
    assert set(margins) == {"position", "velocity", "acceleration", "torque", "tool speed", "bench"}
    assert min(margins["torque"], margins["tool speed"]) >= 0.05 - 1e-9
    assert margins["bench"] >= 0.0
    shown = made(*words).stdout
    assert "tool speed" in shown
    assert "mm" in shown


def test_a_mistake_in_the_file_is_one_line_and_no_motion_is_written(tauhat: Tauhat, tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    for text, message in (
        ("[tolo]", "unknown key"),
        ('[[planes]]\nname = "roof"\noffset = 3', "no pose keeps the limit"),
    ):
        path.write_text(text)
        result = tauhat("excite", "two_link", "-o", tmp_path / "motion.csv", "--limits", path, *QUICK)
        assert result.exit_code == 1
        assert message in result.stderr
        assert result.stderr.count("\n") == 1
        assert not (tmp_path / "motion.csv").exists()
