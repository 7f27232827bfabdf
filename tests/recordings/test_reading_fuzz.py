from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import scipy.io
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from sample_logs import motion

from tauhat.errors import MapError, TauhatError, TauhatWarning
from tauhat.recordings.checks import check_log
from tauhat.recordings.findings import Finding
from tauhat.recordings.log import Log
from tauhat.recordings.logmap import LogMap, parse_rows
from tauhat.recordings.mapfile import parse_map
from tauhat.recordings.reading import read_chunks, read_log
from tauhat.recordings.recording import Recording

MAPS = (
    None,
    parse_map("[time]\ncolumn = 0\n[position]\ncolumns = [1]\n"),
    parse_map("[time]\nrate = 9.0\n[position]\ncolumns = [0]\n"),
)
MANY = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


def arrays() -> dict[str, np.ndarray]:
    m = motion(n_t=40)
    return {"t": m["t"], "q": m["q"], "tau": m["tau"]}


def frame() -> pl.DataFrame:
    m = arrays()
    return pl.DataFrame(
        {"t": m["t"], "q_1": m["q"][:, 0], "q_2": m["q"][:, 1], "tau_1": m["tau"][:, 0], "tau_2": m["tau"][:, 1]}
    )


def packed(write) -> bytes:
    buffer = io.BytesIO()
    write(buffer)
    return buffer.getvalue()


SEEDS = {
    "csv": packed(lambda file: file.write(frame().write_csv().encode())),
    "parquet": packed(lambda file: frame().write_parquet(file)),
    "npz": packed(lambda file: np.savez(file, **arrays())),
    "packed npz": packed(lambda file: np.savez_compressed(file, **arrays())),
    "mat": packed(lambda file: scipy.io.savemat(file, arrays())),
    "packed mat": packed(lambda file: scipy.io.savemat(file, arrays(), do_compression=True)),
    "old mat": packed(lambda file: scipy.io.savemat(file, arrays(), format="4")),
}


def read_all_ways(path: Path) -> None:
    """Read by every door with every map; anything but a result or a TauhatError fails the test."""
    for log_map in MAPS:
        try:
            log = read_log(path, map=log_map)
            assert isinstance(log, Log)
            assert all(isinstance(finding, Finding) for finding in check_log(log))
            assert isinstance(log.recording(), Recording)
            assert all(isinstance(part, Recording) for part in read_chunks(path, map=log_map, chunk=16))
        except TauhatError as error:
            refuse_many_lines(error)


def refuse_many_lines(error: TauhatError) -> None:
    if "\n" in str(error):
        pytest.fail(f"an error of several lines: {error}")


def attempt(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        read_all_ways(path)


@MANY
@given(data=st.binary(max_size=400), ending=st.sampled_from([".csv", ".mat", ".npz", ".parquet"]))
@example(data=b"PAR1PAR1", ending=".csv")
@example(data=b"PK\x05\x06" + bytes(18), ending=".npz")
def test_random_bytes_give_a_recording_or_our_own_error(tmp_path: Path, data: bytes, ending: str) -> None:
    attempt(tmp_path / f"run{ending}", data)


@MANY
@given(text=st.text(alphabet="0123456789.,;-+eE nainfq_t\t\n#%\"'", max_size=300))
@example(text="t,q_1\n" + "1,2\n" * 30)
def test_random_tables_give_a_recording_or_our_own_error(tmp_path: Path, text: str) -> None:
    attempt(tmp_path / "run.csv", text.encode())


@pytest.mark.parametrize("kind", SEEDS)
@MANY
@given(
    edits=st.lists(st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 255)), max_size=6),
    keep=st.one_of(st.just(1.0), st.floats(0.0, 1.0)),
)
def test_a_damaged_log_gives_a_recording_or_our_own_error(
    tmp_path: Path, kind: str, edits: list[tuple[float, int]], keep: float
) -> None:
    data = bytearray(SEEDS[kind])
    for place, value in edits:
        data[int(place * len(data))] = value
    attempt(tmp_path / ("run.mat" if "mat" in kind else "run.log"), bytes(data[: int(keep * len(data))]))


@pytest.mark.parametrize("kind", SEEDS)
def test_the_undamaged_seeds_are_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / ("run.mat" if "mat" in kind else "run.log")
    path.write_bytes(SEEDS[kind])
    np.testing.assert_array_equal(read_log(path).tau, arrays()["tau"])


KEYS = ["column", "columns", "rate", "unit", "scale", "gain", "sign", "offset", "delay_samples", "file", "from", "to"]
SECTIONS = ["time", "position", "velocity", "torque", "wrench", "rows", "joints", "coupling", "other"]
VALUES = st.sampled_from(
    ['"t"', '"q_{1..3}"', "0", "-1", "1e400", "nan", "[1, 2]", "[[1.0, 0.0], [0.0, 1.0]]",
     '"deg"', "true", "[]", '""', "{}",
     "1979-05-27",
     '"q{1..99999}"', "[[], []]", '"../x.csv"', "9999999999999999999999", '"\\u0000"']
)  # fmt: skip


@MANY
@given(
    sections=st.dictionaries(
        st.sampled_from(SECTIONS),
        st.dictionaries(st.sampled_from([*KEYS, "names", "position"]), VALUES, max_size=4),
        max_size=4,
    )
)
def test_any_toml_gives_a_map_that_reads_or_our_own_error(tmp_path: Path, sections: dict[str, dict[str, str]]) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(SEEDS["csv"])
    text = ""
    for name, keys in sections.items():
        text += f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())
    try:
        log_map = parse_map(text)
        assert isinstance(log_map, LogMap)
        read_log(path, map=log_map)
    except TauhatError as error:
        refuse_many_lines(error)


@MANY
@given(text=st.text(max_size=200))
def test_any_text_as_a_map_is_refused(text: str) -> None:
    with pytest.raises(MapError):
        parse_map(text)


@MANY
@given(text=st.text(alphabet="0123456789:+- \u0663", max_size=12))
def test_any_window_is_parsed_or_refused(text: str) -> None:
    try:
        start, stop = parse_rows(text)
    except MapError:
        return
    assert start >= 0
    assert stop is None or stop > start
