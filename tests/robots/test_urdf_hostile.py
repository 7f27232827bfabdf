from __future__ import annotations

import time
import warnings

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robot_texts import TREE, TWO_LINKS, joint, link, robot

from tauhat.errors import RobotError, TauhatError, TauhatWarning
from tauhat.robots import Robot, load_robot, robot_from_dh, robot_from_urdf

BOMB = (
    '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip("abcdefgh", "bcdefghi", strict=True))
    + ']><robot name="&i;"><link name="x"/></robot>'
)
LOOP = robot(
    *(link(name) for name in ("base", "a", "b", "c")),
    joint("j0", "revolute", "base", "a"),
    joint("j1", "revolute", "c", "b"),
    joint("j2", "revolute", "b", "c"),
)
DEEP = "<robot name='deep'>" + "<x>" * 200 + "</x>" * 200 + "</robot>"


def changed(old: str, new: str) -> str:
    assert old in TWO_LINKS
    return TWO_LINKS.replace(old, new)


REFUSED = {
    "entity bomb": (BOMB, "document types and entities are refused"),
    "external entity": (
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>',
        "entities are refused",
    ),
    "cut off": (TREE[:400], "not well-formed XML"),
    "not a robot": ("<sdf><model/></sdf>", "not a URDF; expected <robot>"),
    "xacro": (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/></robot>',
        "run `xacro",
    ),
    "xacro value": (changed('value="1.5"', 'value="${mass}"'), "expand the file with xacro"),
    "deep": (DEEP, "absurdly deep XML"),
    "empty robot": ('<robot name="r"/>', "no links"),
    "loop": (LOOP, "links form a loop.*got b, c"),
    "only a loop": (
        robot(link("a"), link("b"), joint("j", "revolute", "a", "b"), joint("k", "revolute", "b", "a")),
        "no link is the root",
    ),
    "two parents": (
        robot(link("a"), link("b"), link("c"), joint("j", "revolute", "a", "c"), joint("k", "revolute", "b", "c")),
        "link c: a link has two parents; got a and b",
    ),
    "two roots": (robot(link("a"), link("b"), link("c"), joint("j", "revolute", "a", "b")), "several root links.*a, c"),
    "doubled link": (robot(link("a"), link("a")), "two <link> elements have the same name; got a"),
    "doubled joint": (
        robot(link("a"), link("b"), link("c"), joint("j", "revolute", "a", "b"), joint("j", "revolute", "b", "c")),
        "two <joint> elements have the same name",
    ),
    "nameless link": ("<robot name='r'><link/></robot>", "<link> without a name"),
    "endless name": (f"<robot name='r'><link name='{'x' * 5000}'/></robot>", "absurdly long name"),
    "many links": ("<robot>" + "".join(f"<link name='l{n}'/>" for n in range(3000)) + "</robot>", "absurd number of"),
    "missing link": (changed('parent link="base"', 'parent link="bass"'), "parent link is missing.*did you mean base"),
    "no child": (changed('<child link="arm"/>', ""), "<joint> has no <child>"),
    "negative mass": (changed('value="1.5"', 'value="-1.5"'), r"link arm: negative mass; got -1\.5 kg"),
    "absurd mass": (changed('value="1.5"', 'value="1e9"'), "absurd mass"),
    "absurd inertia": (changed('ixx="0.031"', 'ixx="1e154"'), "absurd inertia"),
    "text for a mass": (changed('value="1.5"', 'value="heavy"'), "value is not a number; got 'heavy'"),
    "nan mass": (changed('value="1.5"', 'value="nan"'), "value is not finite"),
    "infinite mass": (changed('value="1.5"', 'value="1e999"'), "value is not finite"),
    "no mass": (changed('<mass value="1.5"/>', ""), "<inertial> has no <mass>"),
    "no moment": (changed('ixx="0.031"', ""), "<inertia> has no ixx"),
    "millimetres": (changed("0.1 0.02 -0.3", "100 20 -300"), "joint turn: absurd size.*got 300 m.*millimetres"),
    "centre in millimetres": (changed("0.03 -0.02 0.11", "30 -20 110"), "link arm: absurd size.*millimetres"),
    "two numbers": (changed("0.1 0.02 -0.3", "0.1 0.02"), "xyz has the wrong length; expected 3 numbers"),
    "four numbers": (changed("0.1 0.02 -0.3", "0.1 0.02 1 1"), "xyz"),
    "nan place": (changed("0.1 0.02 -0.3", "nan 0 0"), "xyz is not finite"),
    "no axis": (changed('axis xyz="0.6 0 -0.8"', 'axis xyz="0 0 0"'), "axis has no direction"),
    "floating": (changed('type="revolute"', 'type="floating"'), "floating joints are not supported; make it fixed"),
    "planar": (changed('type="revolute"', 'type="planar"'), "planar joints are not supported"),
    "unknown kind": (changed('type="revolute"', 'type="ball"'), "unknown type of joint; expected revolute"),
    "crossed limits": (changed('lower="-2"', 'lower="4"'), r"lower limit above upper limit; got \[4, 2\.5\]"),
    "negative speed": (changed('velocity="3"', 'velocity="-3"'), "velocity limit is negative"),
    "negative friction": (changed("</joint>", '<dynamics friction="-1"/></joint>'), "friction is negative"),
    "no inertia": (
        robot(link("base"), link("arm", None), joint("turn", "revolute", "base", "arm")),
        "no moving link has a mass; add <inertial>",
    ),
    "all fixed": (changed('type="revolute"', 'type="fixed"'), "no movable joint"),
    "too many joints": (
        robot(
            *(link(f"l{n}") for n in range(250)),
            *(joint(f"j{n}", "revolute", f"l{n}", f"l{n + 1}") for n in range(249)),
        ),
        "absurd number of joints",
    ),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_a_broken_urdf_is_refused_with_one_line_that_names_the_fault(text, message, capfd) -> None:
    with pytest.raises(RobotError, match=message) as caught:
        robot_from_urdf(text)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500
    assert capfd.readouterr() == ("", "")  # nor does the C++ parser below print anything


def test_a_sound_urdf_prints_nothing(capfd) -> None:
    assert robot_from_urdf(TREE).n_v == 5
    assert capfd.readouterr() == ("", "")


def test_an_entity_bomb_costs_no_time() -> None:
    start = time.perf_counter()
    with pytest.raises(RobotError):
        robot_from_urdf(BOMB)
    assert time.perf_counter() - start < 5.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\x00\x01\xff\xfebinary\x00garbage" * 20, "not well-formed XML"),
        (b'<?xml version="1.0" encoding="klingon"?><robot name="x"/>', "encoding"),
        (b"<robot name='\xff\xfe'/>", "not well-formed XML"),
    ],
)
def test_a_file_that_is_no_text_is_refused(tmp_path, content, message) -> None:
    path = tmp_path / "bad.urdf"
    path.write_bytes(content)
    with pytest.raises(RobotError, match=message):
        load_robot(path)


def test_an_absurdly_large_file_is_refused_before_it_is_parsed(tmp_path) -> None:
    path = tmp_path / "large.urdf"
    with path.open("wb") as stream:
        stream.write(b"<robot>")
        stream.truncate(21_000_000)
    with pytest.raises(RobotError, match=r"absurdly large; expected at most 20 MB"):
        robot_from_urdf(path)
    with pytest.raises(RobotError, match="absurdly large"):
        robot_from_urdf("<" + " " * 20_000_001)


@pytest.mark.parametrize("source", ["nowhere.urdf", "", "/dev/zero", "a\x00b.urdf", "x" * 5000])
def test_a_path_that_is_no_file_is_refused(source) -> None:
    with pytest.raises(RobotError):
        robot_from_urdf(source)
    with pytest.raises(RobotError):
        load_robot(source)


def is_robot_or_own_error(read, text: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        try:
            made = read(text)
        except TauhatError as error:
            made = str(error)
    assert isinstance(made, Robot) or "\n" not in made


@settings(max_examples=150, deadline=2000, derandomize=True)
@given(st.text(max_size=200))
def test_any_text_gives_a_robot_or_our_own_error(text) -> None:
    is_robot_or_own_error(robot_from_urdf, text)
    is_robot_or_own_error(robot_from_urdf, f"<{text}")
    is_robot_or_own_error(robot_from_dh, f"{text}\n")
    is_robot_or_own_error(load_robot, text)


fragments = st.sampled_from(
    [
        "",
        "nan",
        "-1",
        "1e154",
        "1e999",
        "0",
        "é",
        "<",
        "/>",
        '"',
        "&x;",
        "1 2",
        "fixed",
        "link",
        "base",
        "</robot>",
        "\x00",
    ]
)


@settings(max_examples=300, deadline=2000, derandomize=True)
@given(st.integers(0, len(TREE)), st.integers(0, 40), fragments)
def test_a_damaged_urdf_gives_a_robot_or_our_own_error(start, length, fragment) -> None:
    is_robot_or_own_error(robot_from_urdf, TREE[:start] + fragment + TREE[start + length :])
