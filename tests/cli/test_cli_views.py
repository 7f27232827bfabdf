"""What people see: tables that fit a narrow terminal, plain text where there is no terminal."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from cli_workshop import Tauhat, Workshop

from tauhat.cli.views.tables import aligned
from tauhat.estimation import load_estimate
from tauhat.plain_data import without_infinities


def test_every_view_fits_eighty_columns(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    views = (
        ("robots",),
        ("inspect", "ur5e"),
        ("check", workshop.log),
        ("identify", "two_link", workshop.log, "-o", tmp_path / "e.json"),
        ("verify", workshop.estimate, workshop.other_log),
    )
    for words in views:
        result = tauhat(*words)
        assert result.exit_code == 0
        assert max(len(line) for line in result.stdout.splitlines() if str(workshop.folder) not in line) <= 80
        assert "\x1b" not in result.stdout


def test_inspect_shows_limits_formulas_and_what_no_motion_tells(tauhat: Tauhat) -> None:
    text = tauhat("inspect", "two_link").stdout
    assert "[rad/s]" in text
    assert "mx_1 + 0.5 m_2" in text
    assert "Never, they act on no joint (13): m_1, mz_1" in text


def test_identify_shows_friction_with_units_and_the_next_command(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path
) -> None:
    result = tauhat("identify", "two_link", workshop.log, "-o", tmp_path / "e.json", "--model", "plain")
    text = result.stdout
    assert "Friction in steady motion" in text
    assert "Nm" in text.split("Friction in steady motion")[1]
    assert "tauhat verify" in text
    words = " ".join(text.split())
    assert "Terms: inertia, rotor, viscous, coulomb, offset." in words
    assert "13 of 13 base parameters determined" in words


def test_parameters_that_were_dropped_are_not_counted_as_known(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path
) -> None:
    words = ("identify", "two_link", workshop.log, "-o", tmp_path / "e.json", "--rows", "0:300", "--model", "plain")
    for more, instead in (((), "are zero"), (("--physical",), "follow from the constraints")):
        text = " ".join(tauhat(*words, "--essential", *more).stdout.split())
        found = re.search(r"(\d+) of 13 base parameters determined, (\d+) of them", text)
        assert found is not None
        fitted, known = map(int, found.groups())
        assert known <= fitted < 13
        assert instead in text


def test_friction_shown_is_that_of_the_estimate_whatever_terms_make_it(
    tauhat: Tauhat, workshop: Workshop, tmp_path: Path
) -> None:
    for model in ("plain", "robust"):
        path = tmp_path / f"{model}.json"
        text = tauhat("identify", "two_link", workshop.log, "-o", path, "--model", model).stdout
        table = text.split("Friction in steady motion")[1]
        row = next(line for line in table.splitlines() if "joint_1" in line)
        shown = [float(cell) for cell in row.replace("│", " ").split() if cell.replace(".", "").lstrip("-").isdigit()]
        estimate = load_estimate(path)
        expected = [estimate.friction(part * estimate.robot.velocity_limit).torque[0] for part in (0.05, 0.5)]
        assert shown[::2] == pytest.approx(expected, rel=0.05, abs=0.05)


def test_identify_without_friction_shows_no_friction(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    text = tauhat("identify", "two_link", workshop.log, "-o", tmp_path / "e.json", "--model", "inertia").stdout
    assert "Friction" not in text
    assert "Fit of two_link" in text


def test_verify_grades_in_words(tauhat: Tauhat, workshop: Workshop) -> None:
    text = tauhat("verify", workshop.estimate, workshop.other_log).stdout
    assert "very good" in text
    assert "at [s]" in text


def test_check_gives_repeated_advice_once(tauhat: Tauhat, workshop: Workshop) -> None:
    lines = workshop.text_log.read_text().splitlines()
    degrees = workshop.folder / "degrees.csv"
    head, *rows = lines
    cells = [[float(cell) for cell in row.split(",")] for row in rows]
    degrees.write_text(
        "\n".join([head, *(",".join(map(str, [t, 57.3 * a, 57.3 * b, *tau])) for t, a, b, *tau in cells)])
    )
    text = tauhat("check", degrees, "--robot", "two_link").stdout
    assert text.count("the limit is") >= 2
    assert text.count("check unit, sign and offset") == 1


def test_aligned_numbers_show_two_digits_of_the_smallest() -> None:
    assert aligned([12.3456, 0.04567]) == ["12.346", "0.046"]
    assert aligned([123.4, 567.8]) == ["123", "568"]
    assert aligned([1.23456, 2.0], like=[0.01, 0.5]) == ["1.235", "2.000"]
    assert aligned([math.inf, 0.0, 1.0]) == ["–", "0.0", "1.0"]
    assert aligned([5.427e25, 12.0]) == ["5e+25", "12"]


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_what_json_cannot_hold_becomes_null(value: float) -> None:
    assert without_infinities({"a": [value, 1.5, {"b": (value, "x")}]}) == {"a": [None, 1.5, {"b": [None, "x"]}]}
