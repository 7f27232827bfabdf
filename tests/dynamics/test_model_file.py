"""Models in TOML files: what they can say, and one line for every mistake."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sample_arms import planar_arm
from tauhat.dynamics.model import ROBUST_TERMS
from tauhat.dynamics.model_file import load_model
from tauhat.dynamics.terms import Coulomb, Coupling, GasSpring, LoadDahl, Viscous
from tauhat.errors import ModelError
from tauhat.robots.shared_motor import SharedMotor

GAS = """
[[term]]
term = "gas-spring"
joint = "j2"
distance = 0.8
lever = 0.2
angle = 0.1
area = 1e-3
volume = 1e-3
"""


def model(folder: Path, text: str):
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return load_model(path, planar_arm())


def test_names_and_a_term_with_settings_make_a_model(tmp_path: Path) -> None:
    made = model(tmp_path, f'terms = "robust"\n{GAS}')
    assert [term.key for term in made.terms] == [*ROBUST_TERMS, "gas-spring"]
    assert made.terms[-1] == GasSpring(joint=1, distance=0.8, lever=0.2, angle=0.1, area=1e-3, volume=1e-3)


def test_a_term_with_settings_takes_the_place_of_the_one_of_its_name(tmp_path: Path) -> None:
    made = model(tmp_path, 'terms = "viscous, coulomb, offset"\n[[term]]\nterm = "coulomb"\nwidths = [0.1, 0.2]\n')
    assert [term.key for term in made.terms] == ["viscous", "coulomb", "offset"]
    assert made.terms[1] == Coulomb(widths=(0.1, 0.2))


def test_joints_go_by_name_or_by_number(tmp_path: Path) -> None:
    by_name = model(tmp_path, '[[term]]\nterm = "viscous"\njoints = ["j2"]\n')
    by_flag = model(tmp_path, '[[term]]\nterm = "viscous"\njoints = [false, true]\n')
    assert by_name.terms == by_flag.terms == (Viscous(joints=(False, True)),)
    motors = [
        model(tmp_path, f'[[term]]\nterm = "coupling"\nmotors = [{m}]\n')
        for m in ('["j2", "j1", -1.5]', "[1, 0, -1.5]")
    ]
    assert motors[0].terms == motors[1].terms == (Coupling(motors=(SharedMotor(1, 0, -1.5),)),)
    assert model(tmp_path, GAS.replace('"j2"', "0")).terms[0].joint == 0


def test_settings_of_load_friction_are_numbers_of_every_link(tmp_path: Path) -> None:
    inertia = planar_arm().inertia.ravel().tolist()
    (term,) = model(tmp_path, f'[[term]]\nterm = "load-dahl"\ninertia = {inertia}\n').terms
    assert isinstance(term, LoadDahl)
    assert np.array_equal(term.inertia, inertia)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("terms = ", "not a readable model file"),
        ('model = "robust"', r"unknown key; expected terms, \[\[term\]\], got model"),
        ('terms = ["inertia"]', r"terms must be a string and \[\[term\]\] a table"),
        ("term = 3", r"terms must be a string and \[\[term\]\] a table"),
        ("", "at least one term"),
        ('terms = "inertia,friction"', "unknown term; expected plain, robust, inertia, .*, got friction"),
        ('terms = "inertia,inertia"', "a term is given twice; got inertia, inertia"),
        ('terms = "inertia,gas-spring"', "term gas-spring needs joint, distance"),
        ('terms = "polynomial"\n[[term]]\nterm = "viscous"', "polynomial cannot be told apart from viscous"),
        ("term = [1]", "unknown term; expected inertia, .*, got 1"),
        ("[[term]]\njoint = 1", "unknown term; expected inertia, .*, got None"),
        ('[[term]]\nterm = ["viscous"]', "unknown term"),
        ('[[term]]\nterm = "bank"', "unknown term; .*, got bank"),
        (GAS + GAS, r"a \[\[term\]\] is given twice; got gas-spring, gas-spring"),
        (GAS.replace("lever = 0.2\n", ""), "term gas-spring: settings that it does not take; got .*lever"),
        (GAS.replace("0.2", '"short"'), "term gas-spring: settings that it does not take"),
        (GAS.replace("0.2", "2.0"), "the lever must be shorter than the distance"),
        (GAS.replace('"j2"', '"elbow"'), "no such joint; expected j1, j2, got elbow"),
        (GAS.replace('"j2"', "2"), "no such joint; expected 0 to 1, got 2"),
        (GAS.replace('"j2"', "0.5"), "the joint is not an index"),
        (GAS.replace("volume", "size"), "settings that it does not take; got .*'size'"),
        ('[[term]]\nterm = "coulomb"\nwidths = 0.1', "term coulomb: settings that it does not take"),
        ('[[term]]\nterm = "coulomb"\nwidths = ["a", "b"]', "term coulomb: settings that it does not take"),
        ('[[term]]\nterm = "coulomb"\nwidths = [0.1, -0.1]', "term coulomb: the widths must be positive"),
        ('[[term]]\nterm = "dahl"\nlengths = [1e-4]', "term dahl: settings that it does not take; got .*'lengths'"),
        ('[[term]]\nterm = "viscous"\njoints = ["elbow"]', "no such joint; expected j1, j2, got elbow"),
        ('[[term]]\nterm = "viscous"\njoints = [0, 2]', "joints; expected true or false for each"),
        ('[[term]]\nterm = "viscous"\njoints = [true]', "joints; expected 2 values, got 1"),
        ('[[term]]\nterm = "viscous"\njoints = 1', "term viscous: settings that it does not take"),
        ('[[term]]\nterm = "coupling"\nmotors = [1, 0, 1.0]', r"a motor is not \[own joint, other"),
        ('[[term]]\nterm = "coupling"\nmotors = [[1, 0]]', "a motor is not"),
        ('[[term]]\nterm = "coupling"\nmotors = [[1, 1, 1.0]]', "a motor turns with two different joints"),
        ('[[term]]\nterm = "coupling"\nmotors = [[1, 5, 1.0]]', "no such joint; expected 0 to 1"),
        ('[[term]]\nterm = "coupling"\nmotors = [["j2", "hand", 1.0]]', "no such joint; expected j1, j2, got hand"),
        ('[[term]]\nterm = "load-dahl"\ninertia = ["heavy"]', "term load-dahl: settings that it does not take"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_that_names_the_file(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(ModelError, match=match) as caught:
        model(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "model.toml"))


def test_a_missing_file_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"nothing\.toml"):
        load_model(tmp_path / "nothing.toml", planar_arm())
