from __future__ import annotations

import errno
import gzip
import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from sample_logs import full_recording, motion

from tauhat.errors import OutputError, RecordingError, TauhatError
from tauhat.files import read_text, replace_file, sha256_of, write_text
from tauhat.recordings.reading import read_recording
from tauhat.recordings.recording import Recording
from tauhat.recordings.writing import write_columns, write_recording

CHANNELS = ("t", "q", "dq", "ddq", "tau", "temperature", "wrench")


def test_parquet_gives_every_channel_and_the_joint_names_back_exactly(tmp_path: Path) -> None:
    write_recording(full_recording(), tmp_path / "run.parquet")
    found = read_recording(tmp_path / "run.parquet")
    for name in CHANNELS:
        np.testing.assert_array_equal(getattr(found, name), getattr(full_recording(), name))
    assert (found.joint_names, found.name) == (("shoulder", "elbow"), "run")


@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz"])
def test_csv_gives_every_channel_back_to_the_last_digit(tmp_path: Path, name: str) -> None:
    write_recording(full_recording(), tmp_path / name)
    found = read_recording(tmp_path / name)
    for channel in CHANNELS:
        np.testing.assert_allclose(getattr(found, channel), getattr(full_recording(), channel), rtol=1e-15, atol=0)


def test_a_gzip_log_is_the_same_bytes_each_time(tmp_path: Path) -> None:
    write_recording(full_recording(), tmp_path / "a.csv.gz")
    write_recording(full_recording(), tmp_path / "b.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    head = gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).splitlines()[0]
    assert head.startswith(b"t,q_1,q_2,dq_1,dq_2,ddq_1")
    assert head.endswith(b"fx,fy,fz,mx,my,mz")


def test_only_measured_channels_are_written(tmp_path: Path) -> None:
    m = motion(n_v=1)
    write_recording(Recording(t=m["t"], q=m["q"]), tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().splitlines()[0] == "t,q_1"
    assert read_recording(tmp_path / "run.csv").channels() == ("q",)


def test_any_columns_can_be_written(tmp_path: Path) -> None:
    write_columns({"t": np.arange(3.0), "x": np.array([0.1, -np.inf, 1e-320])}, tmp_path / "x.csv")
    assert (tmp_path / "x.csv").read_text().splitlines()[1] == "0.0,0.1"


@pytest.mark.parametrize("name", ["run.xlsx", "run", "csv"])
def test_an_unknown_ending_is_refused_with_the_known_ones(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutputError, match=r"expected \.parquet, \.csv, \.csv\.gz"):
        write_recording(full_recording(), tmp_path / name)
    assert not list(tmp_path.iterdir())


SCRIPT = """
import resource, sys
from sample_logs import full_recording
from tauhat.errors import OutputError
from tauhat.recordings.writing import write_recording
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
try:
    write_recording(full_recording(), sys.argv[1])
except OutputError as error:
    sys.stdout.write(str(error))
    sys.exit(7)
"""


@pytest.mark.parametrize("name", ["run.parquet", "run.csv", "run.csv.gz"])
def test_a_disk_that_takes_no_more_leaves_the_old_file_and_nothing_else(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("old")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / name)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 7, done.stderr
    assert f"{name}: cannot be written" in done.stdout
    assert str(errno.EFBIG) in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "old"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_device_is_not_replaced_by_a_file() -> None:
    with pytest.raises(OutputError, match="not a regular file"):
        write_text("/dev/full", "x")
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)


def test_a_write_that_fails_half_way_leaves_nothing(tmp_path: Path) -> None:
    def write(part: Path) -> None:
        part.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OutputError, match="No space left on device") as caught:
        replace_file(tmp_path / "x.txt", write)
    assert f"errno {errno.ENOSPC}" in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_other_errors_pass_through_and_leave_nothing(tmp_path: Path) -> None:
    def write(part: Path) -> None:
        part.write_text("half")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        replace_file(tmp_path / "x.txt", write)
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="make the folder first"):
        write_text(tmp_path / "no" / "x.txt", "x")
    with pytest.raises(OutputError, match="name a file"):
        write_text(tmp_path, "x")


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_text_comes_back_and_is_bounded(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    write_text(path, "naïve τ̂\n")
    assert read_text(path, error=RecordingError) == "naïve τ̂\n"
    with pytest.raises(RecordingError, match="absurd size; expected at most 5 bytes"):
        read_text(path, error=RecordingError, largest=5)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TauhatError, match="not a text file"):
        read_text(path)


def test_the_hash_of_several_files_is_that_of_their_bytes_in_a_row(tmp_path: Path) -> None:
    for name, data in (("a", "one"), ("b", "two"), ("c", "onetwo")):
        (tmp_path / name).write_text(data)
    assert sha256_of([tmp_path / "a", tmp_path / "b"]) == sha256_of([tmp_path / "c"])
