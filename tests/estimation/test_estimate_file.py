"""The estimate file: comes back bit by bit, and is refused in one line when damaged, too new or of another robot."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import tauhat
from sample_arms import planar_arm, planar_truth, random_states
from tauhat.errors import ArrayError, EstimateError, OutputError, TauhatError
from tauhat.estimation import Estimate, identify, load_estimate
from tauhat.recordings.processing import Processing


@lru_cache
def estimate() -> Estimate:
    noise = 0.3 * np.random.default_rng(0).normal(size=(2000, 2))
    settings = Processing(cutoff=1e1 / 3, motion_cutoff=30.0, delay=1e-4 / 3)
    return identify(planar_truth().model, [planar_truth().recording(seconds=10.0, noise=noise)], processing=settings)


@pytest.fixture
def path(tmp_path):
    estimate().save(tmp_path / "arm.json")
    return tmp_path / "arm.json"


def edited(path, change):
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    return path


def test_every_array_comes_back_bit_by_bit(path):
    again = load_estimate(path)
    for name in ("values", "covariance", "joint_rms", "torque_rms"):
        assert np.array_equal(getattr(again, name), getattr(estimate(), name))
    for name in ("independent", "dependent", "unidentifiable", "regrouping"):
        assert np.array_equal(getattr(again.base, name), getattr(estimate().base, name))


def test_every_setting_comes_back(path):
    again = load_estimate(path)
    for name in ("processing", "estimator", "inputs", "degrees", "rank", "condition", "version"):
        assert getattr(again, name) == getattr(estimate(), name)
    assert again.model.terms == estimate().model.terms
    assert again.robot.fingerprint == estimate().robot.fingerprint
    assert again.summary() == estimate().summary()


def test_predictions_are_the_same(path):
    states = random_states(np.random.default_rng(1), 100, 2)
    assert np.array_equal(load_estimate(path).predict(*states), estimate().predict(*states))


def test_saving_again_gives_the_same_file(path, tmp_path):
    load_estimate(path).save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_an_infinite_condition_number_survives(tmp_path):
    replace(estimate(), condition=np.inf).save(tmp_path / "weak.json")
    assert load_estimate(tmp_path / "weak.json").condition == np.inf


def test_the_file_reads_without_the_library(path):
    data = json.loads(path.read_text())
    assert data["schema"] == "tauhat/estimate"
    assert data["schema_version"] == 1
    assert data["tauhat_version"] == tauhat.__version__
    row = data["parameters"][0]
    assert row.keys() == {"name", "formula", "value", "standard_error", "relative", "unit"}
    assert row["value"] == estimate().values[0]


@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.999])
def test_a_file_cut_short_is_refused(path, part):
    text = path.read_text()
    path.write_text(text[: int(part * len(text))])
    with pytest.raises(EstimateError, match=r"arm\.json: not a readable estimate; got .*cut off: identify again"):
        load_estimate(path)


@pytest.mark.parametrize("text", ["[]", "3", '{"schema": "else"}', "{}"])
def test_another_json_file_is_refused(path, text):
    path.write_text(text)
    with pytest.raises(EstimateError, match='not an estimate file; expected "schema": "tauhat/estimate"'):
        load_estimate(path)


def test_a_file_of_a_newer_schema_is_refused(path):
    edited(path, lambda data: data.update(schema_version=2))
    with pytest.raises(
        EstimateError, match=r"written by a newer version; expected schema_version <= 1, got 2; update tauhat"
    ):
        load_estimate(path)


def test_a_number_of_thousands_of_digits_is_refused(tmp_path):
    path = tmp_path / "long.json"
    path.write_text('{"schema": ' + "9" * 5000 + "}")
    with pytest.raises(EstimateError, match="not a readable estimate"):
        load_estimate(path)


def drop(*keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        del data[keys[-1]]

    return change


def put(value, *keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


DAMAGE = {
    "values too few": drop("values", 0),
    "covariance too narrow": drop("covariance", 0, 0),
    "covariance a row short": drop("covariance", 0),
    "no values": drop("values"),
    "values not numbers": put("many", "values"),
    "value not finite": put(None, "values", 0),
    "joint rms too long": put([1.0, 1.0, 1.0], "fit", "joint_rms"),
    "no model": drop("model"),
    "unknown term": put("magic", "model", "terms", 0, "term"),
    "unknown setting of a term": put(1.0, "model", "terms", 1, "slope"),
    "a link moved": put([0.6, 0.0, 0.0], "model", "robot", "joints", 1, "translation"),
    "gravity turned": put([0.0, 9.81, 0.0], "model", "robot", "gravity"),
    "a joint missing": drop("model", "robot", "joints", 1),
    "a parameter kept twice": put(0, "base", "independent", 0),
    "regrouping too short": drop("base", "regrouping", 0),
    "schema version not a number": put("one", "schema_version"),
    "schema version a truth value": put(True, "schema_version"),
    "schema version zero": put(0, "schema_version"),
    "an index no integer holds": put([10**30], "base", "independent"),
    "a negative variance": put(-1.0, "covariance", 0, 0),
    "processing unknown": put(1.0, "processing", "magic"),
    "cut-off negative": put(-1.0, "processing", "cutoff"),
    "inputs not logs": put([{"name": "x"}], "inputs"),
    "degrees missing": drop("fit", "degrees"),
    "fit not a table": put([], "fit"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_refused_in_one_line_that_names_the_file(path, damage):
    edited(path, DAMAGE[damage])
    with pytest.raises(EstimateError, match=r"arm\.json: ") as caught:
        load_estimate(path)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(TauhatError, match=r"none\.json"):
        load_estimate(tmp_path / "none.json")


def test_a_folder_that_is_not_there_is_refused_and_nothing_is_written(tmp_path):
    with pytest.raises(OutputError, match="nowhere"):
        estimate().save(tmp_path / "nowhere" / "arm.json")
    assert list(tmp_path.iterdir()) == []


def test_its_own_robot_is_accepted():
    estimate().check_robot(planar_arm())


def test_a_robot_mounted_otherwise_is_refused():
    with pytest.raises(EstimateError, match="same joint names, other axes, placements or gravity"):
        estimate().check_robot(planar_arm(gravity=(0.0, 9.81, 0.0)))


def test_a_robot_with_other_joints_is_refused():
    arm = planar_arm()
    renamed = replace(arm, joints=(arm.joints[0], replace(arm.joints[1], name="elbow")))
    with pytest.raises(EstimateError, match="another robot; expected j1, j2, got j1, elbow"):
        estimate().check_robot(renamed)


def test_states_of_another_width_are_refused():
    with pytest.raises(ArrayError, match="dq has the wrong shape"):
        estimate().predict(np.zeros((3, 2)), np.zeros((3, 1)), np.zeros((3, 2)))


def test_summary_has_a_line_per_base_parameter():
    rows = estimate().summary()
    assert [row.formula for row in rows] == list(estimate().base.formulas())
    assert rows[0].relative == pytest.approx(rows[0].standard_error / abs(rows[0].value))
    assert {row.name: row.unit for row in rows}["Fv_2"] == "Nm s/rad"
