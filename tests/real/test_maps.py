from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tauhat.recordings.checks import check_log
from tauhat.recordings.logmap import LogMap
from tauhat.recordings.mapfile import parse_map
from tauhat.recordings.reading import read_chunks, read_log, read_recording

pytestmark = pytest.mark.real

# map -> folder, logs, how many, joints, channels, samples per second
MAPS = {
    "ur10e": ("ur10e", "*.csv.gz", 8, 6, ("q", "dq", "tau"), 94),
    "ur5": ("ur5", "*.npz", 9, 6, ("q", "dq", "tau"), 125),
    "ur3": ("ur3", "*.mat", 1, 6, ("q", "dq", "tau"), 125),
    "ur3_bag": ("ur3", "*.csv.gz", 1, 6, ("q", "dq", "tau"), 125),
    "kr300": ("kr300", "*.csv.gz", 2, 6, ("q", "dq", "tau"), 250),
    "tx40": ("tx40", "pos_*.csv.gz", 1, 6, ("q", "tau"), 5000),
    "panda": ("panda", "*_positions.txt.gz", 1, 7, ("q", "dq", "tau"), 978),
    "emps": ("emps", "*.mat", 2, 1, ("q", "tau"), 1000),
    "kinova_gen3": ("kinova_gen3", "*.csv.gz", 8, 7, ("q", "dq", "tau", "temperature"), 1000),
}
# what the data's own notes say is wrong; everything else is a false alarm
JITTER = {"ur10e", "panda"}
EARLY_UR5 = {"Movement_No1", "Movement_No2", "Movement_No3_Acc"}


def logs(real_data: Path, name: str) -> list[Path]:
    folder, pattern, count, *_ = MAPS[name]
    if not (real_data / folder).is_dir():
        pytest.skip(f"no folder {folder} in {real_data}")
    found = sorted((real_data / folder).glob(pattern))
    assert len(found) == count
    return found


def test_every_map_of_the_examples_is_tested(real_maps: Path) -> None:
    contents = {path.stem: tomllib.loads(path.read_text()) for path in real_maps.glob("*.toml")}
    assert {name for name, content in contents.items() if {"time", "position"} <= set(content)} == set(MAPS)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_reads_every_log_of_its_robot(real_data: Path, real_maps: Path, name: str) -> None:
    *_, joints, channels, rate = MAPS[name]
    for path in logs(real_data, name):
        recording = read_recording(path, map=real_maps / f"{name}.toml")
        assert (recording.n_v, recording.channels()) == (joints, channels)
        assert recording.rate == pytest.approx(59.5 if recording.name in EARLY_UR5 else rate, rel=0.02)
        assert np.abs(recording.q).max() < 3.0 * np.pi


@pytest.mark.parametrize("name", MAPS)
def test_the_checks_find_what_is_known_to_be_wrong_and_nothing_else(
    real_data: Path, real_maps: Path, name: str
) -> None:
    for path in logs(real_data, name):
        log = read_log(path, map=real_maps / f"{name}.toml")
        found = {finding.code for finding in check_log(log) if finding.severity in {"warning", "error"}}
        expected = {"time_jitter"} if name in JITTER or log.name in EARLY_UR5 else set()
        assert found == expected | ({"velocity_lag"} if name == "kr300" else set()), path.name


def test_the_lead_of_position_to_velocity_of_the_kr300_is_a_sample(real_data: Path, real_maps: Path) -> None:
    for path in logs(real_data, "kr300"):
        (lag,) = [f for f in check_log(read_log(path, map=real_maps / "kr300.toml")) if f.code == "velocity_lag"]
        assert lag.number == pytest.approx(1.1, abs=0.1)


def variant(real_maps: Path, name: str, old: str, new: str) -> LogMap:
    text = (real_maps / f"{name}.toml").read_text()
    assert text.count(old) == 1
    return parse_map(text.replace(old, new), where=name)


@pytest.mark.parametrize(
    ("name", "old", "new", "code"),
    [
        ("kr300", 'unit = "deg"\n', 'unit = "rad"\n', "position_unit"),
        ("kr300", 'unit = "deg/s"\n', 'unit = "rad/s"\n', "velocity_scale"),
        ("kinova_gen3", 'unit = "ms"\n', 'unit = "s"\n', "time_unit"),
        ("ur3", 'columns = "mdq"\n', 'columns = "mdq"\nsign = -1\n', "velocity_sign"),
        ("ur10e", 'columns = "{7..12}"', 'columns = [8, 7, 9, 10, 11, 12]', "velocity_mismatch"),
    ],
)  # fmt: skip
def test_a_wrong_map_of_a_real_log_is_found(
    real_data: Path, real_maps: Path, name: str, old: str, new: str, code: str
) -> None:
    path = next(p for p in logs(real_data, name) if "12harm" in p.name or name != "ur10e")
    findings = check_log(read_log(path, map=variant(real_maps, name, old, new)))
    assert code in {finding.code for finding in findings}


def test_the_motors_of_the_tx40_are_decoupled_as_its_gears_say(real_data: Path, real_maps: Path) -> None:
    (path,) = logs(real_data, "tx40")
    log = read_log(path, map=real_maps / "tx40.toml")
    motors = read_log(path, map=parse_map('[time]\nrate = 5000.0\n[position]\ncolumns = "Joint_{1..6}"\n'))
    ratio = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    ratio[5, 4] = 32.0
    zero = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    np.testing.assert_allclose((log.q - zero) @ ratio.T, motors.q, atol=1e-9)


def test_chunks_of_a_log_in_several_files_are_the_whole(real_data: Path, real_maps: Path) -> None:
    (path,) = logs(real_data, "panda")
    whole = read_recording(path, map=real_maps / "panda.toml")
    chunks = list(read_chunks(path, map=real_maps / "panda.toml", chunk=5000))
    assert len(chunks) == 5
    for name in ("t", "q", "dq", "tau"):
        np.testing.assert_array_equal(np.concatenate([getattr(c, name) for c in chunks]), getattr(whole, name))
