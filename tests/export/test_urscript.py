"""The robot program: what its text makes a controller do, step by step, is the designed motion."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from tauhat.errors import OutputError
from tauhat.excitation import FourierSeries, random_fourier
from tauhat.export import ServoSettings, urscript, write_urscript
from tauhat.robots import Robot, load_robot

WORDS = {  # of the language, and the functions of the controller that the program may use
    *("def", "end", "local", "while", "if", "else"),
    *("movej", "servoj", "stopj", "sleep", "get_steptime", "sin", "cos"),
    *("a", "v", "t", "lookahead_time", "gain"),
}


@dataclass
class Controller:
    """A controller that runs a program by its text and notes what it is told to do."""

    step: float
    number: Callable[[float], float] = float
    calls: list[tuple[str, tuple, dict]] = field(default_factory=list)

    def run(self, text: str) -> None:
        lines = [line for line in text.splitlines() if line.strip() != "end"]
        code = "\n".join(line.replace("local ", "", 1) for line in lines)
        code = re.sub(r"(?<![\w.])\d+\.\d+", lambda found: f"number({found[0]})", code)
        names = {
            "number": self.number,
            "sin": lambda x: self.number(math.sin(x)),
            "cos": lambda x: self.number(math.cos(x)),
            "get_steptime": lambda: self.number(self.step),
        }
        for name in ("movej", "servoj", "stopj", "sleep"):
            names[name] = self.noting(name)
        exec(code, {"__builtins__": {}, **names}, scope := {})  # noqa: S102 - our own text
        scope["excitation_motion"]()

    def noting(self, name: str) -> Callable[..., None]:
        return lambda *given, **named: self.calls.append((name, given, named))

    def told(self, name: str) -> list[tuple[tuple, dict]]:
        return [(given, named) for called, given, named in self.calls if called == name]

    def targets(self) -> np.ndarray:
        return np.array([given[0] for given, _ in self.told("servoj")])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ur5e")


@pytest.fixture(scope="module")
def series(robot: Robot) -> FourierSeries:
    return random_fourier(robot, period=7.3, harmonics=5, rng=np.random.default_rng(1))


@pytest.mark.parametrize("step", [0.002, 0.008, 0.0031])
@pytest.mark.parametrize("periods", [1, 3])
def test_every_step_of_the_written_loop_is_the_motion_at_its_time(robot, series, step, periods):
    controller = Controller(step)
    controller.run(urscript(robot, series, settings=ServoSettings(periods=periods)))
    count = math.ceil(periods * series.period / step - 1e-9)
    expected = series.sample(np.arange(count) * step).q
    assert np.abs(controller.targets()[:count] - expected).max() < 1e-9
    assert all(named["t"] == step for _, named in controller.told("servoj"))


def test_the_program_comes_from_its_start_pose_and_comes_to_rest_there(robot, series):
    controller = Controller(0.002)
    controller.run(urscript(robot, series, settings=ServoSettings(pause=0.5)))
    start = series.sample(np.zeros(1)).q[0]
    assert [name for name, _, _ in controller.calls[:3]] == ["movej", "sleep", "servoj"]
    assert controller.calls[-1][0] == "stopj"
    (((pose,), how),) = controller.told("movej")
    assert np.abs(np.array(pose) - start).max() < 1e-12
    assert how == {"a": 0.5, "v": 0.3}
    held = controller.targets()[-250:]  # for half a second
    assert np.abs(held - start).max() < 1e-12


def test_steps_never_jump_between_periods(robot, series):
    controller = Controller(0.0031)
    controller.run(urscript(robot, series, settings=ServoSettings(periods=4)))
    largest = np.abs(np.diff(controller.targets(), axis=0)).max()
    assert largest <= 1.001 * 0.0031 * series.envelope().velocity.max()


def test_a_controller_of_single_precision_follows_to_a_hundredth_of_a_milliradian(robot, series):
    controller = Controller(0.002, number=np.float32)
    controller.run(urscript(robot, series, settings=ServoSettings(periods=5)))
    count = math.floor(4.9 * series.period / 0.002)
    assert np.abs(controller.targets()[:count] - series.sample(np.arange(count) * 0.002).q).max() < 1e-5


def test_the_program_uses_only_words_of_the_language_and_numbers_without_exponent(robot):
    small = random_fourier(robot, period=600.0, harmonics=2, rng=np.random.default_rng(0))
    text = urscript(robot, FourierSeries(period=600.0, coefficients=1e-7 * small.coefficients, offset=small.offset))
    code = "\n".join(line.split("#")[0] for line in text.splitlines())
    assigned = set(re.findall(r"local (\w+) =", code))
    assert not re.search(r"\d[eE]", code)
    assert set(re.findall(r"[A-Za-z_]\w*", code)) - WORDS == assigned - WORDS | {"excitation_motion"}
    assert text.count("while ") + text.count("if ") + text.count("def ") == len(
        re.findall(r"^ *end$", text, re.MULTILINE)
    )


def test_names_of_others_stay_in_their_comment(robot, series):
    hostile = replace(robot, name="arm\n  stopj(9)\r\u2028  halt")
    lines = urscript(hostile, series).splitlines()
    assert sum("stopj(9)" in line for line in lines) == 1
    assert all(line.lstrip().startswith("#") for line in lines if "stopj(9)" in line or "halt" in line)


@pytest.mark.parametrize("name", ["two_link", "panda"])
def test_a_robot_without_six_revolute_joints_is_refused(tmp_path: Path, name, series):
    with pytest.raises(OutputError, match="six revolute joints"):
        write_urscript(tmp_path / "m.script", load_robot(name), series)
    assert not list(tmp_path.iterdir())


def test_a_motion_of_another_robot_and_settings_that_servoj_refuses_are_errors(robot):
    planar = random_fourier(load_robot("two_link"), period=5.0, harmonics=2, rng=np.random.default_rng(0))
    with pytest.raises(OutputError, match="motion of another robot"):
        urscript(robot, planar)
    for wrong in ({"periods": 0}, {"lookahead": 0.3}, {"gain": 50.0}, {"pause": 0.0}, {"approach_speed": np.nan}):
        with pytest.raises(OutputError, match="UR program"):
            ServoSettings(**wrong)
