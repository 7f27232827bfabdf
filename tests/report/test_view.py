"""The view of a motion: the film is the robot's own kinematics, and a real browser shows the arm."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hostile_names import HOSTILE_JOINT
from hypothesis import given
from hypothesis import strategies as st

from tauhat.errors import RecordingError
from tauhat.excitation import motion_limits, random_fourier
from tauhat.excitation.task_design import BoxRegion
from tauhat.recordings.recording import Recording
from tauhat.report.replay import Replay, replay
from tauhat.robots import Robot, forward_kinematics, load_robot
from tauhat.robots.transforms import quaternion, rotation_about

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
SWITCHES = (
    "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
    "--no-first-run", "--disable-sync", "--disable-background-networking", "--disable-component-update",
    "--disable-dev-shm-usage", "--remote-debugging-port=0", "--window-size=900,700",
)  # fmt: skip


def motion_of(robot: Robot) -> Recording:
    series = random_fourier(robot, period=4.0, harmonics=3, rng=np.random.default_rng(1), margin=0.05)
    samples = series.sample(np.arange(401) / 100)
    return Recording(
        t=5.0 + samples.t, q=samples.q, dq=samples.dq, ddq=samples.ddq, joint_names=robot.joint_names, name="motion"
    )


@pytest.fixture(scope="module")
def film() -> Replay:
    robot = load_robot("ur5e")
    return replay(robot, motion_of(robot))


@given(angle=st.floats(-6.0, 6.0), seed=st.integers(0, 1000))
def test_a_quaternion_turns_vectors_as_its_matrix_does(angle: float, seed: int):
    axis = np.random.default_rng(seed).normal(size=3)
    matrix = rotation_about(axis / np.linalg.norm(axis), np.array([angle]))[0]
    w, *vector = quaternion(matrix)
    v, p = np.array(vector), np.array([0.3, -1.0, 2.0])
    assert w**2 + v @ v == pytest.approx(1.0)
    assert np.allclose(p + 2.0 * np.cross(v, np.cross(v, p) + w * p), matrix @ p, atol=1e-12)


def test_the_film_shows_the_robots_own_kinematics(film):
    robot, motion = load_robot("ur5e"), motion_of(load_robot("ur5e"))
    for link in (0, 5):
        pose = forward_kinematics(robot, motion.q, frame=robot.joint_names[link])
        assert np.allclose(film.poses.rotation[link], pose.rotation)
        assert np.allclose(film.poses.origin[link], pose.translation)


def test_time_starts_at_zero_and_frames_follow_it(film):
    assert film.duration == pytest.approx(4.0)
    assert [film.index(moment) for moment in (-1.0, 0.0, 1.001, 4.0, 9.0)] == [0, 0, 100, 400, 400]


def test_bars_tell_the_used_part_of_each_limit(film):
    limits, motion = motion_limits(load_robot("ur5e")), motion_of(load_robot("ur5e"))
    assert np.allclose(film.used[:, :, 1], np.abs(motion.dq) / limits.velocity)
    assert 0.9 < film.used.max() <= 0.95 + 1e-12
    assert f"{100 * film.used[100, 2, 1]:.0f} % (max {100 * film.used[:, 2, 1].max():.0f})" in film.margins(100)


def test_bars_of_what_is_not_recorded_are_left_out():
    robot = load_robot("two_link")
    positions = replace(motion_of(robot), dq=None, ddq=None)
    film = replay(robot, positions)
    assert film.used.shape[2] == 1
    assert "velocity" not in film.margins(0)


def test_a_hostile_joint_name_stays_text():
    robot = load_robot("two_link")
    named = replace(robot, joints=(robot.joints[0], replace(robot.joints[1], name=HOSTILE_JOINT)))
    assert HOSTILE_JOINT not in replay(named, motion_of(named)).margins(0)


def test_a_motion_of_another_robot_is_refused(film):
    with pytest.raises(RecordingError, match="a motion of another robot"):
        replay(load_robot("panda"), motion_of(load_robot("ur5e")))


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def browser(tmp_path: Path) -> list[str]:
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("no Chromium on this machine: the view was not looked at in a browser")
    return [found, *SWITCHES, f"--user-data-dir={tmp_path / 'profile'}"]


@pytest.mark.filterwarnings("default")
def test_a_browser_shows_the_arm_and_it_moves(film, browser):
    pytest.importorskip("viser", reason="viser is not installed: the view was not looked at")
    from tauhat.report.view import Viewer

    viewer = Viewer(film, port=free_port())
    shown = subprocess.Popen([*browser, viewer.url], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        client = first_client(viewer)
        viewer.show(0.0)
        before = np.asarray(client.get_render(height=120, width=160), dtype=float)
        viewer.show(2.0)
        after = np.asarray(client.get_render(height=120, width=160), dtype=float)
        moved = np.abs(after[..., :3] - before[..., :3]).max(axis=2) > 30
        assert moved.mean() > 0.01
    finally:
        shown.terminate()
        shown.wait(timeout=20)
        viewer.stop()


@pytest.mark.filterwarnings("default")
def test_a_browser_shows_the_region_of_a_task_and_the_way_of_its_tool(film, browser):
    pytest.importorskip("viser", reason="viser is not installed: the view was not looked at")
    from tauhat.report.view import Viewer

    side = BoxRegion(lower=np.array([0.3, -0.6, 0.1]), upper=np.array([0.8, 0.6, 0.9]), rotation=np.eye(3))
    path = np.array([[0.2, -1.0, 1.1], [0.2, 1.0, 1.1]])
    viewer = Viewer(film, port=free_port(), outline=side.outline(), path=path)
    shown = subprocess.Popen([*browser, viewer.url], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        picture = np.asarray(first_client(viewer).get_render(height=240, width=320), dtype=float)[..., :3]
        red, green, blue = np.moveaxis(picture, 2, 0)
        assert ((green > red + 40) & (green > blue + 20)).mean() > 0.002  # the region: green lines
        assert ((red > green + 40) & (blue > green + 20)).mean() > 0.0005  # the way: purple
    finally:
        shown.terminate()
        shown.wait(timeout=20)
        viewer.stop()


@pytest.mark.parametrize("azimuth", [0.0, 2.0, -3.0])
def test_the_camera_is_on_the_side_of_the_region(film, azimuth):
    pytest.importorskip("viser", reason="viser is not installed")
    from tauhat.report.view import Viewer

    middle = np.array([0.5 * np.cos(azimuth), 0.5 * np.sin(azimuth), 0.3])
    region = BoxRegion(lower=middle - 0.1, upper=middle + 0.1, rotation=np.eye(3))
    viewer = Viewer(film, port=free_port(), outline=region.outline())
    try:
        x, y, _ = viewer.server.initial_camera.position
        assert np.cos(np.arctan2(y, x) - azimuth) > 0.7
    finally:
        viewer.stop()


def first_client(viewer):
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        clients = list(viewer.server.get_clients().values())
        if clients:
            return clients[0]
        time.sleep(0.1)
    pytest.fail("the page did not connect within a minute")


def test_the_view_listens_on_this_machine_only_and_says_nothing(film, capsys):
    pytest.importorskip("viser", reason="viser is not installed")
    from tauhat.report.view import HOST, Viewer

    viewer = Viewer(film, port=free_port())
    try:
        assert viewer.server.get_host() == HOST == "127.0.0.1"
        viewer.step(0.5)
        assert viewer._time.value == pytest.approx(0.5)
        viewer._speed.value = 2.0
        viewer.step(2.0)
        assert viewer._time.value == pytest.approx(0.5)  # 4.5 s of a motion of 4 s that repeats
        viewer._play.value = False
        viewer.step(0.5)
        assert viewer._time.value == pytest.approx(0.5)
    finally:
        viewer.stop()
    assert not capsys.readouterr().out
