"""Small URDFs and DH tables that the tests of the robots room share."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

INERTIAL = (
    '<inertial><origin xyz="0.03 -0.02 0.11" rpy="0.3 -0.2 0.5"/><mass value="{mass}"/>'
    '<inertia ixx="0.031" ixy="0.002" ixz="-0.001" iyy="0.027" iyz="0.003" izz="0.012"/></inertial>'
)
LIMIT = '<limit lower="-2" upper="2.5" effort="60" velocity="3"/>'
LABELS = (
    '<visual><geometry><mesh filename="package://nowhere/missing.dae"/></geometry></visual>'
    '<collision><geometry><mesh filename="file:///not/there.stl"/></geometry></collision>'
)


def link(name: str, mass: float | None = 1.5) -> str:
    return f'<link name="{name}">{LABELS}{"" if mass is None else INERTIAL.format(mass=mass)}</link>'


def joint(name: str, kind: str, parent: str, child: str, inside: str = LIMIT) -> str:
    origin = '<origin xyz="0.1 0.02 -0.3" rpy="0.4 -0.7 1.1"/><axis xyz="0.6 0 -0.8"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{origin}{inside}</joint>'
    )


def robot(*parts: str) -> str:
    return f'<?xml version="1.0"?><robot name="made">{"".join(parts)}</robot>'


# a tree: revolute, prismatic, continuous, two fixed joints (one on the base), a branch, siblings out of order by name
TREE = robot(
    link("world", None),
    link("base", 7.0),
    *(link(name, mass) for name, mass in (("a", 4.0), ("b", 3.0), ("plate", 0.8), ("c", 2.0), ("d", 1.0), ("e", 0.5))),
    link("tool", None),
    joint("mount", "fixed", "world", "base", ""),
    joint("waist", "continuous", "base", "a", '<dynamics damping="1.5" friction="0.7" armature="0.2"/>'),
    joint("slide", "prismatic", "a", "b"),
    joint("bolt", "fixed", "b", "plate", ""),
    joint("wrist", "revolute", "plate", "c"),
    joint("branch", "revolute", "a", "d"),
    joint("branch_slide", "prismatic", "d", "e"),
    joint("screwed", "fixed", "c", "tool", ""),
)

TWO_LINKS = robot(link("base", None), link("arm"), joint("turn", "revolute", "base", "arm"))


def dh_text(convention: str, rows: list[Mapping[str, object]], head: str = "") -> str:
    lines = ['name = "made"', f'convention = "{convention}"', head]
    for row in rows:
        lines.append("[[joints]]")
        lines.extend(f"{key} = {_toml(value)}" for key, value in row.items())
    return "\n".join(lines)


def _toml(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, np.ndarray | list | tuple):
        return "[" + ", ".join(repr(float(number)) for number in value) + "]"
    return repr(float(value))  # type: ignore[arg-type]


def homogeneous_dh(convention: str, row: Mapping[str, float], position: float) -> np.ndarray:
    """One link's pose in the last, multiplied out from the textbook's elementary motions."""
    theta, d = float(row.get("theta", 0.0)), float(row.get("d", 0.0))
    if row.get("kind", "revolute") == "revolute":
        theta += position
    else:
        d += position
    a, alpha = float(row.get("a", 0.0)), float(row.get("alpha", 0.0))
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    if convention == "standard":
        return np.array([
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ])  # fmt: skip
    return np.array([
        [ct, -st, 0, a],
        [st * ca, ct * ca, -sa, -sa * d],
        [st * sa, ct * sa, ca, ca * d],
        [0, 0, 0, 1],
    ])  # fmt: skip
