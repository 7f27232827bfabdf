"""Task design: regions hold the poses they pick, blocks are what they say, programs keep limits and tell more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tauhat.dynamics import base_parameters, torque_model
from tauhat.dynamics.motion import Motion
from tauhat.errors import ExcitationError
from tauhat.excitation import GeneticSettings, information, motion_limits, parse_limits
from tauhat.excitation.task_design import (
    BLOCKS,
    BoxRegion,
    Freedom,
    PathRegion,
    PosesRegion,
    TaskDesign,
    TaskSettings,
    TaskStage,
    blocks_of,
    design_task,
    one_stage,
    reach_of,
    told_of,
    two_stages,
)
from tauhat.excitation.task_design.search import sampled
from tauhat.robots import Pose, forward_kinematics, load_robot
from tauhat.workers import LocalWorkers

HOME = np.array([0.0, -1.3, 1.6, -1.8, -1.4, 0.0])
UR5E = load_robot("ur5e")
AT_HOME = forward_kinematics(UR5E, HOME, frame="tool")
HERE = LocalWorkers(count=1)


def box(**freedom: float) -> BoxRegion:
    half = np.array([0.12, 0.12, 0.08])
    return BoxRegion(
        lower=AT_HOME.translation - half, upper=AT_HOME.translation + half, rotation=AT_HOME.rotation,
        freedom=Freedom(**freedom),
    )  # fmt: skip


def turned(vector: tuple[float, float, float], shift: tuple[float, float, float]) -> Pose:
    rotation = AT_HOME.rotation @ Rotation.from_rotvec(vector).as_matrix()
    return Pose(rotation=rotation, translation=AT_HOME.translation + np.array(shift))


def poses() -> PosesRegion:
    return PosesRegion(poses=(turned((0, 0, 0), (0, 0, 0)), turned((0.4, 0, 0), (0.1, 0, 0))), clearance=0.03)


def path(clearance: float = 0.02) -> PathRegion:
    points = (turned((0, 0, 0), (0, 0, 0)), turned((0, 0, 0.6), (0.2, 0, 0)), turned((0, 0, 0.6), (0.2, 0.1, 0)))
    return PathRegion(poses=points, clearance=clearance, freedom=Freedom(tilt=0.2, spin=0.3))


def tiny(**changes: object) -> TaskSettings:
    stages = tuple(replace(stage, points=3) for stage in two_stages())
    small = {"stages": stages, "genetic": GeneticSettings(population=6, generations=2), "islands": 1} | changes
    return TaskSettings(region=box(tilt=0.2, spin=0.5), home=HOME, **small)


@pytest.fixture(scope="module")
def found() -> TaskDesign:
    return design_task(UR5E, tiny(), rng=np.random.default_rng(1), workers=HERE)


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip(a @ b, -1.0, 1.0)))


@pytest.mark.parametrize(
    "region", [box(tilt=0.3, spin=0.5), poses(), path(), path(0.0)], ids=["box", "poses", "path", "line"]
)
def test_every_pose_that_genes_pick_is_inside_its_region_and_near_genes_pick_near_poses(region):
    rng = np.random.default_rng(4)
    genes = rng.random((200, region.n_genes))
    picked = [region.pose(row) for row in genes]
    assert region.outside(np.array([pose.translation for pose in picked])).max() < 1e-12
    for row, pose in zip(genes, picked, strict=True):
        near = region.pose(np.clip(row + 1e-6, 0.0, 1.0)) if region.kind != "poses" else pose
        assert np.abs(near.translation - pose.translation).max() < 1e-5
        assert np.abs(near.rotation - pose.rotation).max() < 1e-4
        assert Rotation.from_matrix(pose.rotation).as_matrix() == pytest.approx(pose.rotation, abs=1e-12)


def test_the_tool_tilts_and_spins_no_further_than_it_may():
    region, rng = box(tilt=0.3, spin=0.5), np.random.default_rng(5)
    rotations = [region.pose(row).rotation for row in rng.random((500, 6))]
    tilts = [angle_between(rotation[:, 2], AT_HOME.rotation[:, 2]) for rotation in rotations]
    assert 0.27 < max(tilts) <= 0.3 + 1e-12
    still = [box(spin=0.5).pose(row).rotation for row in rng.random((500, 6))]
    spins = [angle_between(rotation[:, 0], AT_HOME.rotation[:, 0]) for rotation in still]
    assert 0.49 < max(spins) <= 0.5 + 1e-12
    assert box().pose(rng.random(6)).rotation == pytest.approx(AT_HOME.rotation, abs=1e-15)


def test_distances_from_a_region_are_those_of_geometry():
    assert box().outside(box().upper + np.array([[0.3, 0.0, 0.4], [-0.1, -0.1, -0.1]])) == pytest.approx([0.5, 0.0])
    beside = path().poses[0].translation + np.array([[0.1, -0.07, 0.0], [-0.05, 0.0, 0.0], [0.1, 0.0, 0.01]])
    assert path().outside(beside) == pytest.approx([0.05, 0.03, 0.0])
    assert poses().outside(poses().poses[1].translation + np.array([[0.0, 0.05, 0.0]])) == pytest.approx([0.02])


def test_a_path_passes_its_poses_in_order():
    region = path(0.0)
    start, middle, end = (replace(region, freedom=Freedom()).pose(np.array([s, *[0.5] * 6])) for s in (0.0, 2 / 3, 1.0))
    for pose, given in zip((start, middle, end), region.poses, strict=True):
        assert pose.translation == pytest.approx(given.translation, abs=1e-12)
        assert pose.rotation == pytest.approx(given.rotation, abs=1e-9)


@pytest.mark.parametrize("region", [box(), poses(), path()], ids=["box", "poses", "path"])
def test_outlines_lie_on_the_surface_of_their_regions(region):
    lines = region.outline()
    assert lines
    for line in lines:
        assert region.outside(line).max() < 1e-12
    around = np.concatenate(lines)
    assert np.ptp(around, axis=0).min() > 0.0


def test_reached_positions_have_their_poses_on_the_branch_of_home():
    region, limits = box(tilt=0.2, spin=0.5), motion_limits(UR5E, margin=0.05)
    reach = reach_of(UR5E, region, home=HOME, frame="tool", limits=limits)
    assert reach.share > 0.95
    genes = np.random.default_rng(6).random((50, 6))
    q = reach.positions(genes)
    reached = forward_kinematics(UR5E, q, frame="tool")
    wanted = [region.pose(row) for row in genes]
    error = np.abs(reached.translation - np.array([pose.translation for pose in wanted])).max(axis=1)
    assert np.mean(error < 1e-9) > 0.95  # the others fall back to a pose that is reached
    assert region.outside(reached.translation).max() < 1e-9
    assert (np.sign(np.sin(q[:, [2, 4]])) == np.sign(np.sin(HOME[[2, 4]]))).all()  # elbow and wrist do not flip


def test_what_is_not_reached_is_refused():
    limits = motion_limits(UR5E)
    away = replace(box(), lower=np.array([2.0, 0.0, 0.0]), upper=np.array([2.2, 0.2, 0.2]))
    with pytest.raises(ExcitationError, match=r"region is not reached.*home in the region"):
        reach_of(UR5E, away, home=HOME, frame="tool", limits=limits)
    with pytest.raises(ExcitationError, match="home is outside the joint limits"):
        reach_of(UR5E, box(), home=HOME + 7.0, frame="tool", limits=limits)
    two_link = load_robot("two_link")
    with pytest.raises(ExcitationError, match="six joints or more; got 2 joints"):
        reach_of(two_link, box(), home=np.zeros(2), frame="tool", limits=motion_limits(two_link))


@pytest.mark.parametrize("name", ["ur5e", "staubli_tx40", "two_link", "crs_a465", "panda"])
def test_blocks_are_told_apart_by_what_loads_the_joints(name):
    model = torque_model(load_robot(name), "plain")
    facts = information(model)
    blocks = blocks_of(facts)
    places = np.concatenate([blocks.of((block,)) for block in BLOCKS])
    assert sorted(places) == list(range(facts.n))
    assert list(blocks.of(BLOCKS)) == list(range(facts.n))
    rng = np.random.default_rng(8)
    q, ddq, still = *rng.uniform(-2.0, 2.0, (2, model.robot.n_v, 40)), np.zeros((model.robot.n_v, 40))
    at_rest, pushed = (facts.matrix(Motion(q=q, dq=still, ddq=push)) for push in (still, ddq))
    told = {block: (np.diag(at_rest)[blocks.of((block,))], np.diag(pushed)[blocks.of((block,))]) for block in BLOCKS}
    assert (told["gravity"][0] > 1e-6).all()
    assert told["inertial"][0].max() < 1e-12 < told["inertial"][1].min()
    friction = told["friction"]
    assert friction[1] == pytest.approx(friction[0], abs=1e-15)  # acceleration alone changes no friction


def test_the_information_on_a_block_is_the_inverse_of_its_covariance():
    rng = np.random.default_rng(9)
    rows = rng.normal(size=(40, 7))
    matrix, counted = rows.T @ rows, np.array([1, 4, 5])
    covariance = np.linalg.inv(matrix)[np.ix_(counted, counted)]
    assert told_of(matrix, counted) == pytest.approx(np.linalg.inv(covariance), rel=1e-6)
    blind = matrix.copy()
    blind[0], blind[:, 0] = 0.0, 0.0  # a column that was never moved hides nothing of the others
    rest = np.delete(np.delete(blind, 0, axis=0), 0, axis=1)
    seen = np.linalg.inv(np.linalg.inv(rest)[np.ix_(counted - 1, counted - 1)])
    assert told_of(blind, counted) == pytest.approx(seen, rel=1e-6)


def test_programs_stay_inside_joint_limits_and_their_points_in_the_region(found):
    limits = motion_limits(UR5E, margin=0.05)
    for stage in found.stages:
        fine = sampled(stage.motion, 20_000)
        assert (fine.q >= limits.lower[:, None] - 1e-9).all()
        assert (fine.q <= limits.upper[:, None] + 1e-9).all()
        assert np.abs(fine.dq / limits.velocity[:, None]).max() <= 1.0 + 1e-6
        assert np.abs(fine.ddq / limits.acceleration[:, None]).max() <= 1.0 + 1e-6
        targets = np.array([move.target for move in stage.motion.moves])
        assert box().outside(forward_kinematics(UR5E, targets, frame="tool").translation).max() < 1e-9
        assert stage.repeats * stage.motion.duration <= stage.stage.seconds


def test_stages_move_as_fast_as_they_are_told_to(found):
    for stage in found.stages:
        asked = stage.stage
        for move in stage.motion.moves:
            assert asked.speed[0] - 1e-12 <= move.speed <= asked.speed[1] + 1e-12
            assert asked.acceleration[0] - 1e-12 <= move.acceleration <= asked.acceleration[1] + 1e-12
            assert move.zone is None or move.zone.part <= asked.zone
    fast, slow = (stage.motion.duration / len(stage.motion.moves) for stage in found.stages)
    assert slow > 1.5 * fast


def test_the_whole_is_the_weighted_sum_of_its_stages(found):
    seconds = np.array([stage.repeats * stage.motion.duration for stage in found.stages])
    weighted = sum(part * stage.information for part, stage in zip(seconds / seconds.sum(), found.stages, strict=True))
    assert found.information() == pytest.approx(weighted, rel=1e-12)
    heavy = replace(found.stages[1], stage=replace(found.stages[1].stage, weight=3.0))
    other = replace(found, stages=(found.stages[0], heavy)).information()
    shares = seconds * [1.0, 3.0] / (seconds @ [1.0, 3.0])
    expected = sum(part * stage.information for part, stage in zip(shares, found.stages, strict=True))
    assert other == pytest.approx(expected, rel=1e-12)


def test_figures_are_those_of_the_regressor_of_the_motion(found):
    stage = found.stages[0]
    t = (np.arange(4000) + 0.5) * stage.motion.duration / 4000
    samples = stage.motion.sample(t)
    model = torque_model(UR5E, "plain")
    base = base_parameters(model)
    motion = Motion(q=samples.q.T.copy(), dq=samples.dq.T.copy(), ddq=samples.ddq.T.copy())
    layout = model.layout(base.independent)
    rows, _ = model.columns(motion, layout)
    dense = np.zeros((UR5E.n_v, t.size, base.n_b))
    place = {int(parameter): index for index, parameter in enumerate(base.independent)}
    for joint in range(UR5E.n_v):
        for row in range(*layout.of_joint(joint).indices(len(rows))):
            dense[joint, :, place[int(layout.parameters[row])]] = rows[row]
    scaled = (dense / found.facts.scales).reshape(-1, base.n_b) / np.sqrt(t.size)
    assert stage.information == pytest.approx(scaled.T @ scaled, rel=1e-9, abs=1e-12)
    counted = found.blocks.inertial
    others = np.setdiff1d(np.arange(base.n_b), counted)
    left = (
        scaled[:, counted] - scaled[:, others] @ np.linalg.lstsq(scaled[:, others], scaled[:, counted], rcond=None)[0]
    )
    expected = np.linalg.svd(left, compute_uv=False)
    assert found.singular_values("inertial", stage.information) == pytest.approx(expected, rel=1e-4)


def test_more_stages_never_make_a_parameter_less_sure(found):
    # Readings add up, so what the second stage adds can only help.
    assert (found.errors() <= found.errors(1) * (1.0 + 1e-9)).all()
    assert set(found.visible(1)) <= set(found.visible())
    figures = found.to_dict()
    assert figures["together"]["visible"] == len(found.visible())
    assert sum(len(stage["became_visible"]) for stage in figures["stages"]) == len(found.visible())


def test_the_search_finds_more_than_its_first_population():
    values = []
    for generations in (1, 6):
        settings = tiny(
            stages=(replace(two_stages()[0], points=4),), genetic=GeneticSettings(population=8, generations=generations)
        )
        design = design_task(UR5E, settings, rng=np.random.default_rng(2), workers=HERE)
        values.append(settings.criterion.evaluate(told_of(design.information(), design.blocks.inertial))[0])
    assert values[1] < values[0]


def test_equal_seeds_give_equal_programs_on_one_process_or_two():
    stages = (replace(two_stages()[0], points=3),)
    settings = tiny(stages=stages, islands=2, genetic=GeneticSettings(population=4, generations=1))
    one, other = (
        design_task(UR5E, settings, rng=np.random.default_rng(1), workers=LocalWorkers(count=count)) for count in (1, 2)
    )
    assert one.stages[0].motion.to_dict() == other.stages[0].motion.to_dict()


def test_repeated_programs_are_recorded_as_one_motion(found):
    stage = found.stages[0]
    assert stage.repeats > 1
    recording = stage.recording(rate=100.0)
    once = stage.motion.recording(rate=100.0)
    assert recording.t[-1] == pytest.approx(stage.repeats * stage.motion.duration, abs=0.01)
    inside = recording.t < once.t[-2]
    assert recording.q[inside] == pytest.approx(once.q[: inside.sum()], abs=1e-12)
    assert recording.dq[[0, -1]] == pytest.approx(0.0, abs=1e-12)


def test_other_limits_are_kept_and_named_where_they_cannot_be():
    low = float(AT_HOME.translation[2] - 0.08)
    kept = f"[[planes]]\nname = 'table'\nnormal = [0, 0, 1]\noffset = {low - 0.15}\n[tool]\nspeed = 1.2\n"
    limits = parse_limits(kept, UR5E)
    design = design_task(UR5E, tiny(limits=limits), rng=np.random.default_rng(3), workers=HERE)
    for stage in design.stages:
        fine = sampled(stage.motion, 10_000)
        for limit in limits.others:
            assert limit.margins(fine).min() > -1e-3
            assert stage.margins[limit.name] >= 0.0
    walled = parse_limits("[[planes]]\nname = 'wall'\nnormal = [0, 0, 1]\noffset = 1.0\n", UR5E)
    with pytest.raises(ExcitationError, match=r"^stage fast, link of \w+: no program keeps the limit wall"):
        design_task(UR5E, tiny(limits=walled), rng=np.random.default_rng(3), workers=HERE)


def test_jerk_is_bounded_where_limits_state_it():
    limits = parse_limits("[joints]\njerk = 60.0\n", UR5E)
    settings = tiny(limits=limits, stages=(replace(two_stages()[0], points=3),))
    motion = design_task(UR5E, settings, rng=np.random.default_rng(3), workers=HERE).stages[0].motion
    fine = sampled(motion, 40_000)
    jerk = np.abs(np.diff(fine.ddq, axis=1)) / (motion.duration / 40_000)
    assert np.quantile(jerk, 0.999) <= 60.0 * 1.01


def test_too_many_points_for_the_time_are_refused_by_name():
    short = tuple(replace(stage, seconds=1.0) for stage in two_stages())
    with pytest.raises(ExcitationError, match=r"^stage fast: no program is short enough; expected 1 s.*more seconds"):
        design_task(UR5E, tiny(stages=short), rng=np.random.default_rng(3), workers=HERE)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": ""}, "name of a stage"),
        ({"counted": ()}, "one block or more"),
        ({"counted": ("inertial", "inertial")}, "none twice"),
        ({"counted": ("mass",)}, "unknown block of columns; expected inertial, gravity, friction, got mass"),
        ({"points": 0}, "via-points"),
        ({"seconds": 0.0}, "seconds"),
        ({"weight": -1.0}, "weight"),
        ({"speed": (0.5, 0.2)}, "speed"),
        ({"acceleration": (0.0, 0.2)}, "acceleration"),
        ({"zone": 0.5}, "zone"),
        ({"dwell": -1.0}, "dwell"),
        ({"moves": "arc"}, "joint or line"),
    ],
)
def test_stages_that_mean_nothing_are_refused(changes, message):
    with pytest.raises(ExcitationError, match=message):
        TaskStage(**({"name": "one", "counted": ("inertial",)} | changes))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Freedom(tilt=4.0), "tilt of a region"),
        (lambda: Freedom(spin=-1.0), "spin of a region"),
        (lambda: replace(box(), lower=box().upper + 1.0), "corners"),
        (lambda: replace(box(), rotation=np.ones((3, 3))), "orientation"),
        (lambda: replace(poses(), poses=()), "one pose or more"),
        (lambda: replace(poses(), clearance=-0.1), "clearance"),
        (lambda: replace(path(), poses=path().poses[:1]), "two points or more"),
        (lambda: replace(path(), poses=(path().poses[0],) * 2), "each other than the last"),
        (lambda: tiny(stages=()), "stages of a task"),
        (lambda: tiny(stages=(two_stages()[0],) * 2), "no name twice"),
        (lambda: tiny(islands=0), "populations"),
    ],
)
def test_settings_that_mean_nothing_are_refused(make, message):
    with pytest.raises(ExcitationError, match=message):
        make()


def test_a_stage_without_columns_in_the_model_is_refused():
    settings = tiny(stages=(replace(two_stages()[1], counted=("friction",)),))
    with pytest.raises(ExcitationError, match=r"^stage slow: a stage without columns"):
        design_task(UR5E, settings, terms="inertia", rng=np.random.default_rng(0), workers=HERE)


def test_one_stage_is_as_long_as_both():
    (whole,), pair = one_stage(), two_stages()
    assert whole.points == sum(stage.points for stage in pair)
    assert whole.seconds == sum(stage.seconds for stage in pair)
    assert set(whole.counted) == {block for stage in pair for block in stage.counted} == set(BLOCKS)
