"""Physical constraints in a TOML file: what is stated is what is kept, and each mistake is one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tauhat.errors import ModelError
from tauhat.estimation.constraints_file import load_constraints
from tauhat.estimation.physical_constraints import Box, Ellipsoid, EntropicPull, PhysicalConstraints

WHOLE = """
margin = 1e-5
least_mass = 0.01
unbounded = ["Ia"]
[pull]
kind = "entropic"
deviation = 3
[[link]]
joint = "elbow"
mass = [1.0, 5.0]
centre = { lower = [-0.1, -0.1, 0.0], upper = [0.1, 0.1, 0.4] }
body = { centre = [0.0, 0.0, 0.2], semi_axes = [0.1, 0.1, 0.3] }
trust = 2.0
"""


def load(folder: Path, text: str) -> PhysicalConstraints:
    path = folder / "constraints.toml"
    path.write_text(text)
    return load_constraints(path)


def test_what_is_stated_is_what_is_kept(tmp_path):
    made = load(tmp_path, WHOLE)
    assert (made.margin, made.least_mass, made.unbounded) == (1e-5, 0.01, ("Ia",))
    assert made.pull == EntropicPull(deviation=3.0)
    (link,) = made.links
    assert (link.joint, link.mass, link.trust) == ("elbow", (1.0, 5.0), 2.0)
    assert isinstance(link.centre, Box)
    assert isinstance(link.body, Ellipsoid)
    assert np.array_equal(link.centre.upper, [0.1, 0.1, 0.4])
    assert np.array_equal(link.body.semi_axes, [0.1, 0.1, 0.3])


def test_an_empty_file_is_physics_alone(tmp_path):
    made, alone = load(tmp_path, ""), PhysicalConstraints()
    assert (made.margin, made.least_mass, made.links, made.pull) == (
        alone.margin, alone.least_mass, alone.links, alone.pull,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("margin = 'much'", "not a readable constraints file"),
        ("margin = 0.5", "margin out of range"),
        ("colour = 1", "top level: unknown key"),
        ("[pull]\nkind = 'strong'", "unknown pull"),
        ("[[link]]\nmass = [1, 2]", "needs the name of the joint"),
        ("[[link]]\njoint = 'a'\nmass = [2, 1]", "no mass is within these bounds"),
        ("[[link]]\njoint = 'a'\nmass = [2]", r"\[smallest, largest\]"),
        ("[[link]]\njoint = 'a'\ncentre = { lower = [0, 0, 0] }", "not a readable constraints file"),
        ("[[link]]\njoint = 'a'\nbody = { centre = [0, 0, 0], semi_axes = [0, 1, 1] }", "semi-axes must be positive"),
        ("margin =", "not a readable constraints file"),
    ],
)
def test_each_mistake_is_one_line(tmp_path, text, message):
    with pytest.raises(ModelError, match=message) as caught:
        load(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert "constraints.toml" in str(caught.value)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(ModelError, match=r"none\.toml") as caught:
        load_constraints(tmp_path / "none.toml")
    assert str(caught.value).count("none.toml") == 1
