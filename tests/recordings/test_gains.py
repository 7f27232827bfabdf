"""New gains go into a map's text and nothing else of it changes."""

from __future__ import annotations

import pytest

from tauhat.errors import MapError
from tauhat.recordings import parse_map
from tauhat.recordings.gains import corrected_gains, with_gains

HEAD = '[time]\ncolumn = "t"\n[position]\ncolumns = "q{1..2}"\n'
TAIL = '\n[joints] # gain = 7\nnames = ["a", "b"]\n'


@pytest.mark.parametrize(
    "line",
    ["gain = 3", "gain=[3, 4]", "gain = [3,\n  4]  # Nm/A", '  gain = 3.0e0 # as "gain"', "offset = 1\ngain = 3"],
)
def test_gains_are_replaced_where_they_stand(line):
    text = f'{HEAD}[torque]\ncolumns = "i{{1..2}}"\nunit = "A"\n{line}\n{TAIL}'
    new = with_gains(text, (1.5, 2.25))
    assert parse_map(new).torque.scale == (1.5, 2.25)
    assert new.startswith(text[: text.index("gain")])
    assert new.endswith(TAIL)
    assert new.count("[1.5, 2.25]") == 1


@pytest.mark.parametrize("end", ["", TAIL])
def test_gains_are_added_where_there_were_none(end):
    text = f'{HEAD}[torque]\ncolumns = "tau{{1..2}}"{end}'
    new = with_gains(text, (0.9, 1.1))
    assert parse_map(new).torque.scale == (0.9, 1.1)
    assert new.replace("gain = [0.9, 1.1]\n", "") == text


def test_gains_are_multiplied_and_spread():
    one = parse_map(f'{HEAD}[torque]\ncolumns = "i{{1..2}}"\nunit = "A"\ngain = 10')
    assert corrected_gains(one, (0.5, 2.0)) == (5.0, 20.0)
    none = parse_map(f'{HEAD}[torque]\ncolumns = "i{{1..2}}"')
    assert corrected_gains(none, (0.5, 2.0)) == (0.5, 2.0)


def test_coupled_torques_have_no_gain_of_a_joint():
    coupled = parse_map(f'{HEAD}[torque]\ncolumns = "i{{1..2}}"\n[coupling]\ntorque = [[1, 0], [1, 1]]')
    with pytest.raises(MapError, match="coupled"):
        corrected_gains(coupled, (1.0, 1.0))
    scaled = parse_map(f'{HEAD}[torque]\ncolumns = "i{{1..2}}"\n[coupling]\ntorque = [[2, 0], [0, 3]]')
    assert corrected_gains(scaled, (2.0, 1.0)) == (2.0, 1.0)


def test_maps_without_torque_are_refused():
    with pytest.raises(MapError, match="no section"):
        corrected_gains(parse_map(HEAD), (1.0,))
    with pytest.raises(MapError, match="no section"):
        with_gains(HEAD, (1.0,))


def test_a_text_too_unusual_is_refused_rather_than_spoiled():
    text = f'{HEAD}[torque]\ncolumns = "i{{1..2}}"\n"gain" = 3\n'
    with pytest.raises(MapError, match="cannot be written"):
        with_gains(text, (1.0, 2.0))
