"""`tauhat excite --limits`: the limits of the file are kept and shown, and mistakes in it are one line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat, made

from tauhat.errors import ExcitationError
from tauhat.excitation import DesignSettings, design, load_limits
from tauhat.robots import load_robot

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


IMPOSSIBLE = {
    "start in collision": (
        "[start]\nq = [0, 0]\n[[boxes]]\nname = 'crate'\nsize = [1, 1, 1]\nxyz = [0.8, 0, 0]",
        r"crate: start pose in collision; got link of joint_\d: [\d.]+ mm deep",
    ),
    "start outside": ("[start]\nq = [200, 0]\nunit = 'deg'", "joint joint_1: start pose outside joint limits"),
    "lower above upper": ("[joints]\nlower = 2\nupper = 1", "joint joint_1: lower limit above upper limit"),
    "box upside down": ("[tool]\nlower = [1, 0, 0]\nupper = [0, 1, 1]", "tool box: lower above upper"),
    "box out of reach": (
        "[tool]\nlower = [2, -1, -1]\nupper = [3, 1, 1]",
        r"tool box: no pose keeps the limit; got lowest x of the tool: 1100 mm outside",
    ),
    "torque below gravity": (
        "[torque]\nlargest = [2.0, 0.5]",
        r"torque: no pose keeps the limit; got joint joint_2: 0\.6 of 0\.5 Nm with friction; gravity and friction",
    ),
    "nothing to excite": (
        "[joints]\nlower = { joint_2 = 0 }\nupper = { joint_2 = 1e-6 }",
        r"joint joint_2: no motion was found that excites \w+_2 of the term \w+",
    ),
}


@pytest.mark.parametrize(("text", "message"), IMPOSSIBLE.values(), ids=IMPOSSIBLE.keys())
def test_what_no_motion_can_keep_or_excite_is_one_line_with_the_reason(
    tauhat: Tauhat, tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(text)
    robot = load_robot("two_link")
    with pytest.raises(ExcitationError, match=message):
        design(
            robot,
            rng=np.random.default_rng(0),
            settings=DesignSettings(limits=load_limits(path, robot), harmonics=2, period=4.0),
        )
    result = tauhat("excite", "two_link", "-o", tmp_path / "motion.csv", "--limits", path, *QUICK)
    assert result.exit_code == 1
    assert result.stdout == ""
    assert re.search(message, result.stderr)
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "motion.csv").exists()


def test_a_motion_from_a_stated_start_begins_and_ends_there(tauhat: Tauhat, tmp_path: Path) -> None:
    path, motion = tmp_path / "limits.toml", tmp_path / "motion.csv"
    path.write_text("[start]\nq = [30, -60]\nunit = 'deg'")
    made("excite", "two_link", "-o", motion, "--limits", path, *QUICK)
    rows = np.loadtxt(motion, delimiter=",", skiprows=1)
    np.testing.assert_allclose(np.rad2deg(rows[[0, -1], 1:3]), [[30, -60], [30, -60]], atol=1e-6)
