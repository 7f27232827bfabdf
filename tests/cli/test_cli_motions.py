"""Motion files: several in one call, repeated, as robot programs, for payloads; simulated and reported on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_workshop import Tauhat, Workshop, made

from tauhat.excitation import sampled_motion
from tauhat.recordings.reading import read_recording

QUICK = ("--method", "gradient", "--starts", 1, "--harmonics", 2, "--seconds", 4)


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("motion") / "motion.parquet"
    made("excite", "two_link", "-o", path, *QUICK)
    return path


def test_several_motions_are_numbered_and_each_adds_to_those_before(tmp_path: Path) -> None:
    words = ("excite", "two_link", "-o", tmp_path / "run.csv.gz", "--report", tmp_path / "page.html")
    found = json.loads(made(*words, "--motions", 2, *QUICK, "--json").stdout)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["page-1.html", "page-2.html", "run-1.csv.gz", "run-2.csv.gz"]
    first, second = found["motions"]
    assert [Path(motion["motion"]).name for motion in found["motions"]] == names[2:]
    assert found["motion"] == first["motion"]
    for key in ("condition", "log_det", "mean_error"):
        assert found[key] == second[key]
    assert found["evaluations"] == first["evaluations"] + second["evaluations"]
    assert second["mean_error"] < first["mean_error"]
    assert found["limits"] == {name: min(first["limits"][name], second["limits"][name]) for name in first["limits"]}
    runs = [read_recording(motion["motion"]).q for motion in found["motions"]]
    assert np.abs(runs[0] - runs[1]).max() > 0.1
    text = " ".join(made(*words, "--motions", 2, *QUICK).stdout.split())
    assert "Of the 2 motions together" in text
    assert "good: below" not in text


def test_one_motion_has_the_keys_of_the_contract_and_a_list_of_itself(motion: Path, tmp_path: Path) -> None:
    found = json.loads(made("excite", "two_link", "-o", tmp_path / "m.csv", *QUICK, "--json").stdout)
    assert {"condition", "log_det", "seconds", "evaluations", "seed", "limits", "motions"} <= set(found)
    assert found["mean_error_before"] is None
    (only,) = found["motions"]
    assert only["condition"] == found["condition"]
    assert np.allclose(read_recording(tmp_path / "m.csv").q, read_recording(motion).q, atol=1e-12)


def test_a_repeated_motion_is_written_period_after_period(tmp_path: Path, motion: Path) -> None:
    made("excite", "two_link", "-o", tmp_path / "m.parquet", "--periods", 3, *QUICK)
    whole, once = read_recording(tmp_path / "m.parquet"), read_recording(motion)
    assert whole.t[-1] == pytest.approx(12.0)
    assert np.abs(whole.q[400:801] - once.q).max() < 1e-9


def test_a_script_is_a_program_for_six_revolute_joints(tauhat: Tauhat, tmp_path: Path) -> None:
    made("excite", "ur5e", "-o", tmp_path / "m.script", "--periods", 2, "--model", "inertia", *QUICK)
    text = (tmp_path / "m.script").read_text()
    assert text.startswith("def excitation_motion():\n")
    assert "while done < 2:" in text
    result = tauhat("excite", "two_link", "-o", tmp_path / "two.script", *QUICK)
    assert result.exit_code == 1
    assert "six revolute joints" in result.stderr
    assert not (tmp_path / "two.script").exists()


def test_an_ending_that_nothing_writes_is_refused_before_the_search(tauhat: Tauhat, tmp_path: Path) -> None:
    result = tauhat("excite", "two_link", "-o", tmp_path / "m.txt", "--method", "no such method")
    assert result.exit_code == 1
    assert "unknown ending" in result.stderr


def test_a_payload_motion_counts_the_last_link_alone(tauhat: Tauhat, workshop: Workshop, tmp_path: Path) -> None:
    words = ("excite", "two_link", "-o", tmp_path / "m.csv", "--json", *QUICK)
    whole, payload = json.loads(made(*words).stdout), json.loads(made(*words, "--payload").stdout)
    assert payload["condition"] < whole["condition"]
    both = tauhat(*words, "--payload", "--after", workshop.estimate)
    assert both.exit_code == 2
    assert "--payload" in both.stderr


def test_a_simulated_robot_follows_a_designed_motion(tauhat: Tauhat, motion: Path, tmp_path: Path) -> None:
    words = ("simulate", "two_link", "-o", tmp_path / "log.parquet", "--motion", motion)
    said = json.loads(made(*words, "--rate", 250, "--json").stdout)
    assert said["motion"] == str(motion)
    assert said["seconds"] == pytest.approx(4.0)
    log = read_recording(tmp_path / "log.parquet")
    assert np.abs(log.q - sampled_motion(read_recording(motion)).sample(log.t).q).max() < 0.1
    truth = json.loads((tmp_path / "log.truth.json").read_text())
    assert truth["plan"]["seconds"] == pytest.approx(4.0)
    other = tauhat(*words, "--seconds", 5)
    assert other.exit_code == 2
    assert "own length" in " ".join(other.stderr.split())


def test_the_map_of_the_logs_in_a_folder_is_not_for_what_tauhat_wrote_there(
    tauhat: Tauhat, motion: Path, tmp_path: Path
) -> None:
    text = '[time]\ncolumn = 0\n[position]\ncolumns = "{1..2}"\nunit = "deg"\n[torque]\ncolumns = [3, 4]\n'
    (tmp_path / "map.toml").write_text(text)
    made("excite", "two_link", "-o", tmp_path / "motion.csv", *QUICK)
    made("simulate", "two_link", "--motion", tmp_path / "motion.csv", "-o", tmp_path / "run.parquet")
    run = read_recording(tmp_path / "run.parquet")
    assert run.tau is not None
    assert np.abs(run.q[-1] - read_recording(motion).q[-1]).max() < 0.02
    (tmp_path / "run.map.toml").write_text(text)
    assert np.allclose(read_recording(tmp_path / "run.parquet").q, np.deg2rad(run.q))


def test_motions_of_another_robot_and_files_that_hold_none_are_refused(
    tauhat: Tauhat, workshop: Workshop, motion: Path, tmp_path: Path
) -> None:
    for robot, path, reason in (
        ("ur5e", motion, "motion of another robot"),
        ("two_link", workshop.log, "velocities and accelerations"),
        ("two_link", tmp_path / "m.script", "cannot be read back"),
    ):
        result = tauhat("simulate", robot, "-o", tmp_path / "log.parquet", "--motion", path)
        assert result.exit_code == 1
        assert reason in result.stderr
        assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_motion_beyond_a_limit_is_run_with_a_warning(tauhat: Tauhat, motion: Path, tmp_path: Path) -> None:
    fast = tmp_path / "fast.csv"
    rows = [[float(cell) for cell in row.split(",")] for row in _text_of(motion, tmp_path).splitlines()[1:]]
    quick = [[row[0] / 2, *row[1:3], *(2 * v for v in row[3:5]), *(4 * a for a in row[5:7])] for row in rows]
    head = "t,q_1,q_2,dq_1,dq_2,ddq_1,ddq_2\n"
    fast.write_text(head + "\n".join(",".join(str(cell) for cell in row) for row in quick))
    words = ("simulate", "two_link", "-o", tmp_path / "log.parquet", "--motion")
    assert "warning" not in made(*words, motion).stderr
    result = made(*words, fast)
    assert "velocity" in result.stderr
    assert "tauhat view" in result.stderr


def _text_of(motion: Path, folder: Path) -> str:
    from tauhat.recordings.writing import write_recording

    write_recording(read_recording(motion), folder / "plain.csv")
    return (folder / "plain.csv").read_text()


def test_the_report_takes_a_motion_in(tauhat: Tauhat, workshop: Workshop, motion: Path, tmp_path: Path) -> None:
    page = tmp_path / "r.html"
    made("report", workshop.estimate, workshop.other_log, "-o", page)
    assert "Which parameters it sees well" not in page.read_text(encoding="utf-8")
    made("report", workshop.estimate, workshop.other_log, "-o", page, "--motion", motion)
    assert "Which parameters it sees well" in page.read_text(encoding="utf-8")
    alias = tmp_path / "alias.html"
    alias.symlink_to(motion)
    result = tauhat("report", workshop.estimate, "-o", alias, "--motion", motion)
    assert result.exit_code == 1
    assert "overwrite" in result.stderr
