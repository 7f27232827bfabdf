from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tauhat.errors import MapError
from tauhat.recordings.logmap import Coupling, RowWindow, parse_rows
from tauhat.recordings.mapfile import find_map, load_map, parse_map
from tauhat.recordings.reading import read_log

MINIMAL = '[time]\ncolumn = "t"\n[position]\ncolumns = ["a", "b"]\n'
ROWS = np.column_stack([np.arange(20.0), np.arange(20.0) ** 2, 3.0 + np.arange(20.0), np.arange(20.0) - 4.0])


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    np.savetxt(path, ROWS, delimiter=",", header="t,a,b,c", comments="", fmt="%.17g")
    return path


def read(log: Path, text: str):
    return read_log(log, map=parse_map(text))


def test_a_value_is_unit_times_scale_times_sign_then_coupled_then_offset(log: Path) -> None:
    text = """
        [time]
        column = "t"
        unit = "ms"
        [position]
        columns = ["a", "b"]
        unit = ["deg", "rad"]
        scale = [2.0, 0.5]
        sign = [1, -1]
        offset = [0.25, -1.0]
        [torque]
        columns = ["b", "c"]
        unit = "A"
        gain = [10.0, 3.0]
        offset = 0.5
        [coupling]
        position = [[1.0, 0.0], [0.5, 2.0]]
        torque = [[1.0, -1.0], [0.0, 1.0]]
    """
    found = read(log, text)
    first = ROWS[:, 1] * math.pi / 180.0 * 2.0
    second = -0.5 * ROWS[:, 2]
    np.testing.assert_allclose(found.t, ROWS[:, 0] * 1e-3, rtol=1e-15)
    expected = np.column_stack([first + 0.25, 0.5 * first + 2.0 * second - 1.0])
    np.testing.assert_allclose(found.q, expected, rtol=1e-14)
    torque = np.column_stack([10.0 * ROWS[:, 2] - 3.0 * ROWS[:, 3] + 0.5, 3.0 * ROWS[:, 3] + 0.5])
    np.testing.assert_allclose(found.tau, torque, rtol=1e-14)


@pytest.mark.parametrize(
    ("section", "unit", "factor"),
    [
        ("velocity", "deg/s", math.pi / 180.0),
        ("velocity", "rpm", 2.0 * math.pi / 60.0),
        ("velocity", "mm/s", 1e-3),
        ("acceleration", "deg/s^2", math.pi / 180.0),
        ("acceleration", "m", 1.0),
    ],
)
def test_a_rate_has_the_unit_it_says(log: Path, section: str, unit: str, factor: float) -> None:
    found = read(log, MINIMAL + f'[{section}]\ncolumns = ["b", "c"]\nunit = "{unit}"\n')
    values = {"velocity": found.dq, "acceleration": found.ddq}[section]
    np.testing.assert_allclose(values, ROWS[:, 2:] * factor, rtol=1e-15)


def test_velocity_is_coupled_like_position_but_without_its_offset(log: Path) -> None:
    text = MINIMAL + 'offset = 5.0\n[velocity]\ncolumns = ["b", "c"]\n[coupling]\nposition = [[0.0, 1.0], [1.0, 0.0]]\n'
    found = read(log, text)
    np.testing.assert_array_equal(found.q, ROWS[:, [2, 1]] + 5.0)
    np.testing.assert_array_equal(found.dq, ROWS[:, [3, 2]])


def test_temperature_in_kelvin_becomes_celsius(log: Path) -> None:
    found = read(log, MINIMAL + '[temperature]\ncolumns = ["b", "c"]\nunit = "K"\n')
    np.testing.assert_allclose(found.temperature, ROWS[:, 2:] - 273.15, rtol=1e-15)


def test_a_constant_rate_makes_the_clock_from_the_row_number(log: Path) -> None:
    text = "[time]\nrate = 50.0\n[position]\ncolumns = [1]\n[rows]\nfrom = 4\nto = 9\n"
    found = read(log, text)
    np.testing.assert_allclose(found.t, np.arange(4, 9) / 50.0, rtol=1e-15)
    np.testing.assert_array_equal(found.q[:, 0], ROWS[4:9, 1])
    assert (found.first_row, found.source.rows) == (4, (4, 9))


def test_rows_given_in_the_call_override_those_of_the_map(log: Path) -> None:
    found = read_log(log, map=parse_map(MINIMAL + "[rows]\nfrom = 4\nto = 9\n"), rows=(1, None))
    np.testing.assert_array_equal(found.t, ROWS[1:, 0])


@pytest.mark.parametrize(("delay", "rows"), [(1, (0, 19)), (-2, (2, 20)), (0.25, (0, 19)), (-1.5, (2, 20))])
def test_a_delay_moves_a_channel_back_and_trims_the_rows_without_a_value(
    log: Path, delay: float, rows: tuple[int, int]
) -> None:
    found = read(log, MINIMAL + f'[torque]\ncolumns = ["b", "c"]\ndelay_samples = {delay}\n')
    assert found.source.rows == rows
    start, stop = rows
    np.testing.assert_array_equal(found.q, ROWS[start:stop, 1:3])
    np.testing.assert_allclose(found.tau, ROWS[start:stop, 2:] + delay, rtol=1e-14)  # the columns rise by 1 a row


def test_a_delay_inside_a_window_of_rows_costs_none_of_them(log: Path) -> None:
    text = MINIMAL + '[torque]\ncolumns = ["b", "c"]\ndelay_samples = 2\n'
    found = read_log(log, map=parse_map(text), rows=(3, 10))
    assert found.source.rows == (3, 10)
    np.testing.assert_array_equal(found.tau, ROWS[5:12, 2:])


def test_ranges_of_columns_are_written_out() -> None:
    log_map = parse_map('[time]\ncolumn = 0\n[position]\ncolumns = "q_{1..3}"\n[velocity]\ncolumns = ["{7..8}", "x"]\n')
    assert log_map.position.columns == ("q_1", "q_2", "q_3")
    assert log_map.velocity is not None
    assert log_map.velocity.columns == (7, 8, "x")


def test_a_second_file_beside_the_log_gives_its_columns(tmp_path: Path, log: Path) -> None:
    np.savetxt(tmp_path / "torque.txt", 7.0 * ROWS[:, 1:3], fmt="%.17g")
    found = read(log, MINIMAL + '[torque]\nfile = "torque.txt"\ncolumns = [0, 1]\n')
    np.testing.assert_array_equal(found.tau, 7.0 * ROWS[:, 1:3])


def test_interleaved_numbers_become_samples(tmp_path: Path, log: Path) -> None:
    np.savetxt(tmp_path / "q.txt", ROWS[:, 1:].ravel(), fmt="%.17g")
    found = read(log, '[time]\ncolumn = "t"\n[position]\nfile = "q.txt"\ninterleaved = 3\n')
    np.testing.assert_array_equal(found.q, ROWS[:, 1:])


def test_names_and_units_of_joints_come_from_the_map(log: Path) -> None:
    found = read(log, MINIMAL + 'unit = ["mm", "deg"]\n[joints]\nnames = ["slide", "turn"]\n')
    assert (found.joint_names, found.units) == (("slide", "turn"), ("m", "rad"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[tim]\n", "unknown section [tim]"),
        ('[time]\ncolum = "t"\n', "unknown key colum"),
        (MINIMAL + "scales = 2\n", "expected one of columns, unit, scale"),
        ("time = 3\n", "not a section"),
        ("[time]\ncolumn = 0\n", "[position] is missing"),
        ("[position]\ncolumns = [1]\n", "[time] is missing"),
        ("[time]\n[position]\ncolumns = [1]\n", "either column or rate"),
        ("[time]\ncolumn = 0\nrate = 5.0\n[position]\ncolumns = [1]\n", "either column or rate"),
        ("[time]\nrate = 0\n[position]\ncolumns = [1]\n", "not a positive number"),
        ("[time]\nrate = true\n[position]\ncolumns = [1]\n", "not a number"),
        ("[time]\nrate = inf\n[position]\ncolumns = [1]\n", "not a finite number"),
        ('[time]\ncolumn = 0\nunit = "h"\n[position]\ncolumns = [1]\n', "expected s, ms, us, ns"),
        ("[time]\ncolumn = [0, 1]\n[position]\ncolumns = [1]\n", "not one column"),
        ("[time]\ncolumn = 0\n[position]\ncolumns = []\n", "no columns"),
        ("[time]\ncolumn = 0\n[position]\n", "no columns"),
        ("[time]\ncolumn = 0\n[position]\ncolumns = [-1]\n", "zero-based"),
        ('[time]\ncolumn = 0\n[position]\ncolumns = "q{3..1}"\n', "{FIRST..LAST}"),
        (MINIMAL + 'unit = "grad"\n', "unknown unit"),
        (MINIMAL + 'unit = "count"\n', "give scale"),
        (MINIMAL + '[torque]\ncolumns = ["c"]\nunit = "A"\n', "give gain"),
        (MINIMAL + '[torque]\ncolumns = ["c"]\nscale = 3.0\n', "unknown key scale"),
        (MINIMAL + "scale = 0.0\n", "scale is zero"),
        (MINIMAL + "sign = 2\n", "neither 1 nor -1"),
        (MINIMAL + "delay_samples = 1e9\n", "absurd delay"),
        (MINIMAL + "interleaved = 0\n", "absurd count"),
        (MINIMAL + "[rows]\nfrom = 5\nto = 5\n", "empty window"),
        (MINIMAL + "[rows]\nfrom = -1\n", "not a whole number"),
        (MINIMAL + '[joints]\nnames = ["x", "x"]\n', "not unique"),
        (MINIMAL + "[coupling]\nposition = [[1.0, 2.0], [2.0, 4.0]]\n", "not an invertible"),
        (MINIMAL + "[coupling]\nposition = [[1.0, 2.0]]\n", "not an invertible"),
        (MINIMAL + "[coupling]\ntorque = [[1.0, 2.0], [1.0]]\n", "different length"),
        (MINIMAL + "[coupling]\ntorque = 3\n", "not a matrix"),
        ("[time\n", "not valid TOML"),
    ],
)
def test_a_wrong_map_is_refused_with_the_key_and_what_is_legal(text: str, words: str) -> None:
    with pytest.raises(MapError) as caught:
        parse_map(text, where="run.map.toml")
    assert words in str(caught.value)
    assert str(caught.value).startswith("run.map.toml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MINIMAL + "scale = [1.0, 2.0, 3.0]\n", "expected 1 or 2, got 3"),
        (MINIMAL + "offset = [1.0, 2.0, 3.0]\n", "expected 1 or 2, got 3"),
        (MINIMAL + '[velocity]\ncolumns = ["c"]\n', "dq has the wrong number of columns"),
        (
            MINIMAL + '[wrench]\ncolumns = ["a", "b", "c"]\n',
            "wrench has the wrong number of columns; expected 6, got 3",
        ),
        (MINIMAL + '[joints]\nnames = ["x"]\n', "wrong number of joint names"),
        (MINIMAL + "[coupling]\nposition = [[1.0]]\n", "matrix does not fit position"),
        ('[time]\ncolumn = "t"\n[position]\ncolumns = ["z"]\n', "no column 'z' in run.csv; there are t, a, b, c"),
        ('[time]\ncolumn = "t"\n[position]\ncolumns = [4]\n', "expected 0 to 3"),
    ],
)
def test_a_map_that_does_not_fit_its_log_is_refused(log: Path, text: str, words: str) -> None:
    with pytest.raises(MapError) as caught:
        read(log, text)
    assert words in str(caught.value)


def test_the_map_beside_a_log_is_found_before_that_of_the_folder(tmp_path: Path) -> None:
    log = tmp_path / "run.csv.gz"
    assert find_map(log) is None
    (tmp_path / "map.toml").write_text(MINIMAL)
    assert find_map(log) == tmp_path / "map.toml"
    (tmp_path / "run.map.toml").write_text(MINIMAL)
    assert find_map(log) == tmp_path / "run.map.toml"
    assert load_map(tmp_path / "run.map.toml").position.columns == ("a", "b")


def test_a_missing_map_file_says_so(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="no such file"):
        load_map(tmp_path / "none.toml")


@pytest.mark.parametrize(("text", "rows"), [("634:3510", (634, 3510)), (" 5 : ", (5, None)), (":7", (0, 7))])
def test_rows_are_parsed(text: str, rows: tuple[int, int | None]) -> None:
    assert parse_rows(text) == rows


@pytest.mark.parametrize("text", ["", "5", "a:b", "-1:4", "4:4", "5:2", "1:2:3", "1.5:3", "٣:٥", "9" * 400 + ":"])
def test_rows_that_are_no_window_are_refused(text: str) -> None:
    with pytest.raises(MapError):
        parse_rows(text)


def test_map_parts_are_read_only() -> None:
    coupling = Coupling(position=np.eye(2))
    with pytest.raises(ValueError, match="read-only"):
        coupling.position[0, 0] = 2.0
    with pytest.raises(AttributeError):
        RowWindow(start=1).start = 2
