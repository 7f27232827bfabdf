from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sample_logs import full_recording

from tauhat.errors import RecordingError, TauhatWarning
from tauhat.recordings.mapfile import parse_map
from tauhat.recordings.reading import read_chunks, read_recording
from tauhat.recordings.recording import Recording
from tauhat.recordings.writing import write_recording

DELAYED = parse_map(
    '[time]\ncolumn = "t"\n[position]\ncolumns = "q_{1..2}"\n[velocity]\ncolumns = "dq_{1..2}"\ndelay_samples = -1.5\n'
    '[torque]\ncolumns = "tau_{1..2}"\ndelay_samples = 2.25\n'
)


def joined(chunks: list[Recording], name: str) -> np.ndarray:
    return np.concatenate([getattr(chunk, name) for chunk in chunks])


@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz", "run.parquet"])
@pytest.mark.parametrize("chunk", [16, 97, 128, 390, 5000])
@pytest.mark.parametrize("log_map", [None, DELAYED], ids=["plain", "delayed"])
@pytest.mark.parametrize("rows", [None, (0, 200), (33, 311)])
def test_chunks_joined_are_the_whole_log(tmp_path: Path, name: str, chunk: int, log_map, rows) -> None:
    path = tmp_path / name
    write_recording(full_recording(), path)
    whole = read_recording(path, map=log_map, rows=rows)
    chunks = list(read_chunks(path, map=log_map, rows=rows, chunk=chunk))
    assert all(part.channels() == whole.channels() for part in chunks)
    for channel in ("t", *whole.channels()):
        np.testing.assert_array_equal(joined(chunks, channel), getattr(whole, channel))
    assert all(part.n_t == chunk for part in chunks[:-1])
    bounds = [part.source.rows for part in chunks]
    assert [stop for _, stop in bounds[:-1]] == [start for start, _ in bounds[1:]]
    assert (bounds[0][0], bounds[-1][1]) == whole.source.rows
    assert {part.source.sha256 for part in chunks} == {whole.source.sha256}


def test_a_log_of_several_blocks_of_text_is_read_without_a_seam(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("tauhat.recordings.text_table._BLOCK", 1000)
    path = tmp_path / "run.csv"
    write_recording(full_recording(), path)
    recording = read_recording(path)
    np.testing.assert_allclose(recording.tau, full_recording().tau, rtol=1e-15)
    np.testing.assert_array_equal(joined(list(read_chunks(path, chunk=50)), "tau"), recording.tau)


def test_a_parquet_log_of_several_slices_is_read_without_a_seam(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("tauhat.recordings.parquet_table._SLICE", 77)
    path = tmp_path / "run.parquet"
    write_recording(full_recording(), path)
    np.testing.assert_array_equal(read_recording(path).tau, full_recording().tau)
    np.testing.assert_array_equal(read_recording(path, rows=(70, 170)).tau, full_recording().tau[70:170])


def edited(path: Path, row: int, line: str) -> None:
    lines = path.read_text().splitlines()
    lines.insert(row + 1, line)
    path.write_text("\n".join(lines) + "\n")


def test_time_going_back_between_two_chunks_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    write_recording(full_recording(), path)
    early = path.read_text().splitlines()[10]
    edited(path, 100, early)
    chunks = read_chunks(path, chunk=100)
    assert next(chunks).n_t == 100
    with pytest.raises(RecordingError, match="row 100: time goes back"):
        next(chunks)


def test_a_row_repeated_between_two_chunks_is_dropped(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    write_recording(full_recording(), path)
    edited(path, 100, path.read_text().splitlines()[100])
    chunks = list(read_chunks(path, chunk=100))
    with pytest.warns(TauhatWarning, match="1 exact duplicate"):
        whole = read_recording(path)
    np.testing.assert_array_equal(joined(chunks, "t"), whole.t)


def test_too_small_a_chunk_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    write_recording(full_recording(), path)
    with pytest.raises(RecordingError, match="chunk is too small"):
        read_chunks(path, chunk=15)
