from __future__ import annotations

import gzip
import hashlib
from pathlib import Path

import numpy as np
import pytest
from sample_logs import motion

from tauhat.errors import MapError, RecordingError, TauhatWarning
from tauhat.recordings.mapfile import parse_map
from tauhat.recordings.mat_file import mat_arrays
from tauhat.recordings.reading import read_log, read_recording
from tauhat.recordings.recognising import map_skeleton

NAMES = ["t", "q_1", "q_2", "dq_1", "dq_2", "tau_1", "tau_2"]
PLAIN = parse_map("[time]\ncolumn = 0\n[position]\ncolumns = [1, 2]\n[torque]\ncolumns = [5, 6]\n")


def table() -> np.ndarray:
    m = motion(n_t=60)
    return np.column_stack([m["t"], m["q"], m["dq"], m["tau"]])


def text(rows: np.ndarray, *, separator: str = ",", header: str = "", end: str = "\n") -> str:
    lines = [separator.join(repr(float(x)) for x in row) for row in rows]
    return header + "".join(line + end for line in lines)


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def assert_is_table(recording, rows: np.ndarray) -> None:
    np.testing.assert_array_equal(recording.t, rows[:, 0])
    np.testing.assert_array_equal(recording.q, rows[:, 1:3])
    np.testing.assert_array_equal(recording.tau, rows[:, 5:7])


@pytest.mark.parametrize(
    "content",
    {
        "comma": text(table()),
        "semicolon": text(table(), separator=";"),
        "tab": text(table(), separator="\t"),
        "blanks": text(table(), separator="   "),
        "padded": text(table(), separator=" , "),
        "padded lines": "".join(f"   {line} \n" for line in text(table(), separator="  ").splitlines()),
        "windows": text(table(), end="\r\n"),
        "header": text(table(), header=",".join(NAMES) + "\n"),
        "quoted header": text(table(), header=",".join(f'"{n}"' for n in NAMES) + "\n"),
        "bom": "\ufeff" + text(table()),
        "comments": text(table(), header="# made by hand\n\n% twice\n").replace("\n", "\n# mark\n\n", 9),
        "decimal comma": text(table(), separator=";").replace(".", ","),
        "quoted": "".join(
            ",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in text(table()).splitlines()
        ),
        "no last newline": text(table()).rstrip("\n"),
        "text column": "".join(line + ",AUTO\n" for line in text(table()).splitlines()),
    }.items(),
    ids=lambda item: item[0],
)
@pytest.mark.parametrize("packed", ["plain", "gzip"])
def test_text_logs_of_every_layout_are_read_exactly(tmp_path: Path, content: tuple[str, str], packed: str) -> None:
    data = content[1].encode()
    path = write(tmp_path / "run.csv", gzip.compress(data) if packed == "gzip" else data)  # by content, not by name
    assert_is_table(read_recording(path, map=PLAIN), table())


def test_a_header_in_a_comment_gives_the_names(tmp_path: Path) -> None:
    path = write(tmp_path / "run.txt", text(table(), separator=" ", header="# " + " ".join(NAMES) + "\n"))
    assert_is_table(read_recording(path), table())


def test_parquet_npz_and_mat_are_read_exactly(tmp_path: Path) -> None:
    import polars as pl
    import scipy.io

    rows = table()
    frame = pl.DataFrame({name: rows[:, index] for index, name in enumerate(NAMES)})
    frame.write_parquet(tmp_path / "run.parquet")
    assert_is_table(read_recording(tmp_path / "run.parquet"), rows)
    assert_is_table(read_recording(tmp_path / "run.parquet", map=PLAIN), rows)
    arrays = {"t": rows[:, 0], "q": rows[:, 1:3], "dq": rows[:, 3:5], "tau": rows[:, 5:7]}
    np.savez(tmp_path / "run.npz", **arrays)
    np.savez_compressed(tmp_path / "small.npz", **arrays)
    scipy.io.savemat(tmp_path / "run.mat", arrays)
    scipy.io.savemat(tmp_path / "lying.mat", {name: array.T for name, array in arrays.items()})
    for name in ("run.npz", "small.npz", "run.mat", "lying.mat"):
        assert_is_table(read_recording(tmp_path / name), rows)


@pytest.mark.parametrize("packing", [False, True])
@pytest.mark.parametrize("dtype", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "bool"])
def test_mat_arrays_of_every_type_are_those_that_scipy_reads(tmp_path: Path, packing: bool, dtype: str) -> None:
    import scipy.io

    values = np.random.default_rng(2).integers(0, 2 if dtype == "bool" else 100, size=(30, 3)).astype(dtype)
    others = {"s": {"inner": 1.0}, "c": np.array([1, "x"], dtype=object), "w": "text", "z": np.ones(30) * 1j}
    arrays = {"clock": np.arange(30.0), "x": values, "a_name_longer_than_four": values[:, :2], "e": np.ones((0, 3))}
    arrays |= {"k": np.ones((1, 1)), **others}
    scipy.io.savemat(tmp_path / "run.mat", arrays, do_compression=packing)
    found = {name: array.values() for name, array in mat_arrays((tmp_path / "run.mat").read_bytes()).items()}
    theirs = scipy.io.loadmat(tmp_path / "run.mat")
    assert set(found) == {"clock", "x", "a_name_longer_than_four", "k", "e"}
    for name, array in found.items():
        np.testing.assert_array_equal(array, theirs[name])


def test_arrays_are_taken_by_key(tmp_path: Path) -> None:
    rows = table()
    np.savez(
        tmp_path / "run.npz", clock=rows[:, 0], q_actual=rows[:, 1:3], i=rows[:, 5:7].astype(np.float32), ft=np.ones(9)
    )
    log_map = parse_map(
        '[time]\ncolumn = "clock"\n[position]\ncolumns = "q_actual"\n[torque]\ncolumns = "i"\nunit = "A"\ngain = 2.0\n'
    )
    recording = read_recording(tmp_path / "run.npz", map=log_map)
    np.testing.assert_array_equal(recording.q, rows[:, 1:3])
    np.testing.assert_array_equal(recording.tau, 2.0 * rows[:, 5:7].astype(np.float32))


def test_the_source_names_file_hash_and_rows(tmp_path: Path) -> None:
    path = write(tmp_path / "run.csv", text(table()))
    source = read_recording(path, map=PLAIN, rows=(10, 40)).source
    assert (source.path, source.rows) == ("run.csv", (10, 40))
    assert source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_unknown_names_are_answered_with_the_columns_and_a_map_to_start_from(tmp_path: Path) -> None:
    rows = table()
    path = write(tmp_path / "run.csv", text(rows, header="t_ms,ang1,ang2,vel1,vel2,cur1,cur2\n"))
    with pytest.raises(MapError) as caught:
        read_recording(path)
    assert "t_ms, ang{1..2}, vel{1..2}, cur{1..2}" in str(caught.value)
    assert "run.map.toml" in str(caught.value)
    log_map = parse_map(map_skeleton(path))  # the skeleton itself is a map of this log
    assert_is_table(read_recording(path, map=log_map), rows)


def test_a_map_to_start_from_takes_what_joints_measured_in_its_unit(tmp_path: Path) -> None:
    header = "t,tcp_force1,tcp_force2,i_target1,i_target2,q_target1,q_target2,q_actual1,q_actual2,qd_actual1,qd_actual2"
    path = tmp_path / "run.csv"
    path.write_text(f"{header},i_actual1,i_actual2\n" + f"{','.join(['0'] * 13)}\n" * 3, encoding="utf-8")
    signals = parse_map(map_skeleton(path))
    assert (signals.position.columns, signals.velocity.columns, signals.torque.columns) == (
        ("q_actual1", "q_actual2"),
        ("qd_actual1", "qd_actual2"),
        ("i_actual1", "i_actual2"),
    )
    assert (signals.velocity.unit, signals.torque.unit) == (("rad/s",), ("A",))


def test_an_estimate_is_not_taken_for_a_log(tmp_path: Path) -> None:
    path = tmp_path / "estimate.json"
    path.write_text('{\n "schema": "tauhat/estimate"\n}', encoding="utf-8")
    with pytest.raises(RecordingError, match=r"JSON, not a log; expected CSV, Parquet, NPZ or MAT"):
        read_recording(path)


def test_a_log_without_a_header_gets_a_map_of_indices(tmp_path: Path) -> None:
    path = write(tmp_path / "run.csv", text(table()))
    with pytest.raises(MapError, match="7 columns without names"):
        read_recording(path)
    assert_is_table(read_recording(path, map=parse_map(map_skeleton(path))), table())


@pytest.mark.parametrize(
    ("width", "torque"),
    [(31, "{13..18}"), (13, "{7..12}"), (22, "{15..21}"), (15, "{8..14}"), (7, "{5..6}"), (25, "{13..18}")],
)
def test_columns_without_names_are_taken_for_six_or_seven_joints_where_they_fit(
    tmp_path: Path, width: int, torque: str
) -> None:
    path = tmp_path / "run.csv"
    path.write_text(f"{','.join(['0'] * width)}\n" * 3, encoding="utf-8")
    assert f'[torque]\ncolumns = "{torque}"' in map_skeleton(path)


def damaged(number: int) -> str:
    """A log whose line `number` is cut after half of its characters."""
    lines = text(table()).splitlines(keepends=True)
    lines[number] = ",".join(lines[number].split(",")[:4]) + "\n"
    return "".join(lines)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty file"),
        (b"\n\n# nothing\n", "only comments"),
        (",".join(NAMES) + "\n", "no rows"),
        (text(table()[:1]), "too few rows; expected >= 16, got 1"),
        (damaged(37), "row 37: row cut short; expected 7 cells, got 4"),
        (damaged(59), "row 59: row cut short"),
        (text(table()).replace("\n", ",1,2\n", 12).replace(",1,2\n", "\n", 11), "row 11: row too long"),
        (text(table()).replace("0.1,", "0.1,oops", 1), "row 20, column 1: text where a number should be; got 'oops"),
        (text(table()).replace("\n", "\nnan,0,0,0,0,0,0\n", 1), "row 1, time: t is not a number"),
        (text(table()).replace("\n0.1,", "\n0.1,nan,0,0,0,0,0\n0.1,", 1), "row 20, joint joint_1: q is not a number"),
        (text(table()).replace("\n0.1,", "\n0.099,,0,0,0,0,0\n0.1,", 1), "q is not a number"),
        (text(table()).replace("\n0.1,", "\n0.099,0,0,0,0,1e154,0\n0.1,", 1), "tau holds an impossible value"),
        (text(table()).replace("\n0.1,", "\n0.04,0,0,0,0,0,0\n0.1,", 1), "row 20: time goes back; got a step of -0.05"),
        (text(table()).replace("\n0.1,", "\n0.1,0,0,0,0,0,0\n0.1,", 1), "row 21: two samples at one time"),
        (b"\x89HDF\r\n\x1a\n" + bytes(600), "MATLAB 7.3"),
        (b"MATLAB 7.3 MAT-file" + bytes(600), "MATLAB 7.3"),
        (bytes(range(256)) * 4, "neither text nor a known format"),
        (text(table()).encode("utf-16"), "UTF-16 text; expected UTF-8"),
        (b"1" * 2**20, "absurdly long line"),
        (b"PAR1" + bytes(200), "damaged Parquet file"),
        (b"PK\x03\x04" + bytes(200), "damaged array file"),
        (b"MATLAB 5.0 MAT-file" + bytes(300), "damaged array file"),
        (gzip.compress(text(table()).encode())[:-300], "damaged gzip file"),
        (gzip.compress(text(table()).encode())[:400] + bytes(300), "damaged gzip file"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_that_says_what_and_where(tmp_path: Path, content: str | bytes, words: str) -> None:
    path = write(tmp_path / "run.csv", content)
    with pytest.raises(RecordingError) as caught:
        read_recording(path, map=PLAIN)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file"):
        read_recording(tmp_path / "none.csv")
    with pytest.raises(RecordingError, match="got a folder"):
        read_recording(tmp_path)
    with pytest.raises(RecordingError, match=r"not a usable file name|no such file"):
        read_recording("run\0.csv")


def test_rows_beyond_the_end_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "run.csv", text(table()))
    for rows in ((0, 61), (60, None), (99, 120)):
        with pytest.raises(RecordingError, match="no such rows"):
            read_recording(path, map=PLAIN, rows=rows)


def test_files_of_different_length_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "run.csv", text(table()))
    write(tmp_path / "tau.csv", text(table()[:50, 5:7]))
    log_map = parse_map(
        '[time]\ncolumn = 0\n[position]\ncolumns = [1, 2]\n[torque]\nfile = "tau.csv"\ncolumns = "{0..1}"\n'
    )
    with pytest.raises(RecordingError, match=r"tau\.csv ends before run\.csv"):
        read_recording(path, map=log_map)
    assert read_recording(path, map=log_map, rows=(0, 50)).n_t == 50


def test_an_incomplete_last_sample_of_interleaved_numbers_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "q.txt", "".join(f"{x}\n" for x in range(101)))
    log_map = parse_map("[time]\nrate = 10.0\n[position]\ninterleaved = 2\n")
    with pytest.raises(RecordingError, match="last sample is cut short"):
        read_recording(path, map=log_map)


def test_arrays_of_different_length_and_of_text_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t=np.arange(30.0), q=np.ones((29, 2)))
    with pytest.raises(RecordingError, match="different length; got t 30, q 29"):
        read_recording(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", t=np.arange(30.0), q=np.array(["x"] * 30))
    with pytest.raises(MapError, match="no map"):
        read_recording(tmp_path / "b.npz")


def test_objects_in_an_npz_are_never_unpickled(tmp_path: Path) -> None:
    np.savez(tmp_path / "evil.npz", t=np.arange(30.0), q=np.array([{"x": 1}] * 30, dtype=object))
    with pytest.raises(MapError, match="no map"):
        read_recording(tmp_path / "evil.npz")


def test_an_npz_that_claims_a_huge_array_is_refused_before_memory_is_taken(tmp_path: Path) -> None:
    import io
    import zipfile

    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w") as archive:
        archive.writestr("t.npy", header.getvalue())
    with pytest.raises(RecordingError, match="cut short"):
        read_recording(tmp_path / "bomb.npz")


def test_text_columns_of_a_parquet_are_refused_where_they_are_wanted(tmp_path: Path) -> None:
    import polars as pl

    pl.DataFrame({"t": np.arange(20.0), "q_1": ["x"] * 20}).write_parquet(tmp_path / "run.parquet")
    with pytest.raises(RecordingError, match="column q_1: not a column of numbers"):
        read_recording(tmp_path / "run.parquet")


def test_exact_duplicates_are_dropped_with_a_warning_that_counts_them(tmp_path: Path) -> None:
    rows = np.repeat(table(), [3, *[1] * 59], axis=0)
    path = write(tmp_path / "run.csv", text(rows))
    with pytest.warns(TauhatWarning, match="2 exact duplicate rows dropped"):
        recording = read_recording(path, map=PLAIN)
    assert_is_table(recording, table())


def test_a_sound_log_is_read_without_a_warning(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    read_recording(write(tmp_path / "run.csv", text(table())), map=PLAIN)
    assert not recwarn.list


def test_a_log_keeps_what_a_recording_refuses(tmp_path: Path) -> None:
    rows = table()
    rows[5, 1] = np.nan
    rows[9, 0] = 0.0
    log = read_log(write(tmp_path / "run.csv", text(rows)), map=PLAIN)
    np.testing.assert_array_equal(log.q, rows[:, 1:3])
    np.testing.assert_array_equal(log.t, rows[:, 0])
    with pytest.raises(ValueError, match="read-only"):
        log.q[0, 0] = 1.0
