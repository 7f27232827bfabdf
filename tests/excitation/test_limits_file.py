"""`limits.toml`: every key arrives, every mistake is one line that names it, and designs keep what it says."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.dynamics.motion import motion_from_rows
from tauhat.errors import ExcitationError
from tauhat.excitation import DesignSettings, GeneticSettings, design, load_limits, parse_limits
from tauhat.excitation.limits import LimitSet
from tauhat.robots import Robot, load_robot

QUICK = DesignSettings(harmonics=3, period=5.0, genetic=GeneticSettings(population=20, generations=4))

EVERYTHING = """
home = [0.6, 0.5]
[joints]
lower = { joint_2 = -2.0 }
upper = [2.0, 2.1]
velocity = 1.5
jerk = 40
[torque]
fraction = 0.8
[tool]
frame = "tool"
lower = [-0.6, -0.1, 0.05]
upper = [0.9, 0.1, 0.88]
speed = 0.9
[collision]
clearance = 0.02
radius = { joint_2 = 0.03, base = 0.05 }
[[capsules]]
link = "joint_1"
from = [0, 0, 0]
to = [0.5, 0, 0]
radius = 0.04
[[planes]]
name = "floor"
normal = [0, 0, 1]
offset = -0.3
[[boxes]]
name = "crate"
size = [0.2, 0.4, 0.2]
xyz = [0.9, 0, 0.75]
rpy = [0, 0.2, 0]
[[meshes]]
name = "fixture"
file = "fixture.obj"
scale = 0.001
xyz = [-0.6, 0, 0.2]
"""
FIXTURE = "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def two_link() -> Robot:
    return load_robot("two_link")


def smallest_margins(found, limits: LimitSet, count: int = 2000) -> dict[str, float]:
    """Return every further limit's smallest margin along a motion, at times the search knows."""
    t = np.arange(count) * (found.trajectory.period / count)
    samples = found.trajectory.sample(t)
    motion = motion_from_rows(samples.q, samples.dq, samples.ddq)
    return {limit.name: float(limit.margins(motion).min()) for limit in limits.others}


def test_every_key_of_the_file_arrives(tmp_path):
    (tmp_path / "fixture.obj").write_text(FIXTURE)
    (tmp_path / "limits.toml").write_text(EVERYTHING)
    limits = load_limits(tmp_path / "limits.toml", two_link())
    assert limits.robot.lower.tolist() == [-np.pi, -2.0]
    assert limits.robot.upper.tolist() == [2.0, 2.1]
    assert limits.robot.velocity_limit.tolist() == [1.5, 1.5]
    assert limits.jerk.tolist() == [40.0, 40.0]
    assert limits.home.tolist() == [0.6, 0.5]
    assert [limit.name for limit in limits.others] == ["torque", "tool box", "tool speed", "floor", "crate", "fixture"]
    torque, floor = limits.others[0], limits.others[3]
    assert torque.largest.tolist() == [48.0, 16.0]
    assert sorted({(c.link, c.radius) for c in floor.body.capsules}) == [(0, 0.04), (1, 0.03)]
    assert floor.clearance == 0.02


@pytest.mark.parametrize("method", ["gradient", "both"])
def test_a_design_keeps_everything_in_the_file_on_the_fine_grid(tmp_path, method):
    (tmp_path / "fixture.obj").write_text(FIXTURE)
    (tmp_path / "limits.toml").write_text(EVERYTHING)
    limits = load_limits(tmp_path / "limits.toml", two_link())
    settings = DesignSettings(harmonics=3, period=5.0, limits=limits, method=method, genetic=QUICK.genetic, margin=0.1)
    found = design(two_link(), rng=np.random.default_rng(0), settings=settings)
    margins = smallest_margins(found, limits)
    relative = {limit.name for limit in limits.others if limit.relative}
    assert all(margin >= (0.1 if name in relative else 0.0) - 1e-12 for name, margin in margins.items()), margins
    assert {name: found.margins[name] for name in margins} == pytest.approx(margins, abs=1e-9)
    assert min(found.margins[name] for name in ("position", "velocity", "acceleration", "jerk")) >= 0.1 - 1e-9
    finer = smallest_margins(found, limits, 20_011)
    assert all(margin >= (0.1 if name in relative else 0.0) - 1e-9 for name, margin in finer.items()), finer


def test_genetic_design_alone_keeps_further_limits_and_its_seed_decides():
    limits = parse_limits('[torque]\nfraction = 0.6\n[[planes]]\nname = "floor"\noffset = -0.4', two_link())
    settings = DesignSettings(harmonics=3, period=5.0, limits=limits, method="genetic", genetic=QUICK.genetic)
    runs = [design(two_link(), rng=np.random.default_rng(1), settings=settings) for _ in range(2)]
    assert min(smallest_margins(runs[0], limits).values()) >= -1e-12
    assert np.array_equal(runs[0].trajectory.coefficients, runs[1].trajectory.coefficients)


def test_limits_cost_information_and_looser_ones_cost_less():
    errors = []
    for speed in (0.3, 1.0, 30.0):
        limits = parse_limits(f"[tool]\nspeed = {speed}", two_link())
        settings = DesignSettings(harmonics=3, period=5.0, limits=limits)
        errors.append(design(two_link(), rng=np.random.default_rng(2), settings=settings).mean_error)
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[joint]", "limits: unknown key; got joint; did you mean joints"),
        ("[joints]\nlowest = 1", "unknown key"),
        ("[joints]\nlower = { joint_9 = 1 }", "unknown joint; got joint_9; did you mean joint_"),
        ("[joints]\nlower = [1, 2, 3]", "lower has the wrong form; expected 2 numbers"),
        ("[joints]\nlower = 2\nupper = 1", "joint joint_1: lower limit above upper limit"),
        ("[joints]\nlower = 1\nupper = 1", "joint joint_1: the limits leave the joint no room"),
        ("[joints]\nvelocity = -1", "limit is negative"),
        ("[joints]\njerk = 0", "a jerk limit must be positive"),
        ("[joints]\nvelocity = nan", "velocity is not finite"),
        ("[joints]\nvelocity = true", "velocity is not a number"),
        ("[torque]\nfraction = 1.5", "not a fraction"),
        ("[torque]\nlargest = -3", "a torque limit must be positive"),
        ("[tool]\nframe = 'hand'", "no such frame; got hand"),
        ("[tool]\nlower = [0, 0, 0]", "a key is missing; expected upper"),
        ("[tool]\nlower = [1, 0, 0]\nupper = [0, 1, 1]", "tool box: lower above upper"),
        ("[tool]\nspeed = 0", "not a speed"),
        ("[collision]\nclearance = -1", "not a clearance"),
        ("[collision]\nradius = -1", "not a radius"),
        ("[collision]\nself = 3", "self is neither true nor false"),
        ("[[planes]]\nnormal = [0, 0, 0]", "a normal of no direction"),
        ("[[planes]]\n[[planes]]", "two limits of one name; got plane"),
        ("[[boxes]]\nsize = [1, 1]", "size has the wrong form; expected 3 numbers"),
        ("[[boxes]]\nsize = [1, 1, 0]", "box: not a box"),
        ("[[boxes]]\nname = 7\nsize = [1, 1, 1]", "name is not a text"),
        ("[[meshes]]\nfile = 'gone.stl'", "no such file"),
        ("[[capsules]]\nlink = 'x'", "unknown joint; got x"),
        ("home = [0]", "home has the wrong form"),
        ("planes = 3", "planes is not a list of tables"),
        ("torque = 3", "torque is not a table"),
        ("home = [", "not valid TOML"),
        ("a = " + 5000 * "[", "not valid TOML"),
    ],
)
def test_each_mistake_in_the_file_is_one_line_that_names_it(text, message):
    with pytest.raises(ExcitationError) as caught:
        parse_limits(text, two_link())
    line = str(caught.value)
    assert message in line
    assert line.startswith("limits")
    assert "\n" not in line


def test_a_file_that_is_none_is_refused(tmp_path):
    (tmp_path / "limits.toml").write_bytes(b"\xff\xfe")
    (tmp_path / "broken.stl").write_text("no mesh")
    for path, message in (
        (tmp_path, "a folder"),
        (tmp_path / "x", "no such file"),
        (tmp_path / "limits.toml", "UTF-8"),
    ):
        with pytest.raises(ExcitationError, match=message):
            load_limits(path, two_link())
    with pytest.raises(ExcitationError, match="not a mesh of a solid"):
        parse_limits("[[meshes]]\nfile = 'broken.stl'", two_link(), folder=tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[tool]\nlower = [2, -1, -1]\nupper = [3, 1, 1]", "tool box: no pose keeps the limit; got lowest x of"),
        ("[torque]\nlargest = [2.0, 0.5]", "torque: no pose keeps the limit; got joint joint_2: 0.6"),
        ("[torque]\nlargest = [2.0, 0.5]", "gravity and friction alone need that in the best pose"),
        ("[[planes]]\nname = 'floor'\noffset = 1.5", "floor: no pose keeps the limit"),
        ("[[boxes]]\nname = 'block'\nsize = [3, 3, 3]", "block: no pose keeps the limit"),
        ("home = [0, 0]\n[[boxes]]\nname = 'crate'\nsize = [1, 1, 1]\nxyz = [0.8, 0, 0]",
         "crate: the home pose does not keep the limit; got link of joint_"),
        ("home = [4, 0]\n[tool]\nspeed = 1", "joint joint_1: the home pose is not inside the position limits"),
        ("[tool]\nlower = [0.4, -1, 0.4]\nupper = [0.9, 1, 0.9]\n[[planes]]\nnormal = [0, 0, -1]\noffset = -0.3",
         "no pose was found that keeps all limits at once"),
    ],
)  # fmt: skip
def test_limits_that_no_motion_keeps_are_named_with_the_reason(text, message):
    limits = parse_limits(text, two_link())
    with pytest.raises(ExcitationError) as caught:
        design(two_link(), rng=np.random.default_rng(0), settings=DesignSettings(limits=limits))
    assert message in str(caught.value)
