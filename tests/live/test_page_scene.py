"""What the page draws, read from viser itself: arrow and ellipsoid are where kinematics and covariance say."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tauhat.errors import MissingExtraError
from tauhat.live.feed import Snapshot
from tauhat.robots import Robot, forward_kinematics, load_robot
from tauhat.sensing.touch import Touch

pytest.importorskip("viser", reason="viser is not installed: there is no page")
pytestmark = pytest.mark.filterwarnings("default")

SHAPED = """
<robot name="shaped"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0.2 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision>
  <collision><geometry><sphere radius="0.08"/></geometry></collision></link>
<link name="lower"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.06 0.06"/></geometry></collision></link>
<link name="tip"/>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" velocity="2" effort="50"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="50"/></joint>
<joint name="c" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.4 0 0"/></joint>
</robot>"""  # noqa: E501


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Any]:
    from tauhat.report.hidden_viser import hidden_server

    server = hidden_server(tmp_path / "door")
    yield server
    server.stop()


def reading(robot: Robot, q: np.ndarray, force: np.ndarray, covariance: np.ndarray, **more: Any) -> Snapshot:
    whole = np.zeros((6, 6))
    whole[:3, :3] = covariance
    values = {"stream": "arm", "t": 0.0, "contacts": (), "counts": {}} | more
    return Snapshot(
        q=q,
        tau=np.zeros(robot.n_v),
        tau_std=np.ones(robot.n_v),
        wrench=np.r_[force, 0, 0, 0],
        covariance=whole,
        **values,
    )


@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_the_arrow_begins_at_the_frame_and_its_ellipsoid_sits_on_its_tip(server, name):
    from tauhat.report.live_page import LivePage

    robot = load_robot(name)
    page = LivePage(server, robot, frame="tool")
    q, force = np.linspace(-1.0, 1.0, robot.n_v), np.array([3.0, -4.0, 12.0])
    covariance = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 0.0], [0.0, 0.0, 1.0]])
    page.show(reading(robot, q, force, covariance))
    scene = page._scene
    start, tip = np.asarray(scene._arrow.points)[0]
    assert np.allclose(start, forward_kinematics(robot, q, frame="tool").translation, atol=1e-6)
    metres = scene.full_length / 20.0  # the force has 13 N: the next full scale is 20 N
    assert np.allclose(tip - start, metres * force, atol=1e-6)
    assert np.allclose(scene._error.position, tip, atol=1e-6)
    shares = np.linalg.eigvalsh(covariance)
    assert np.allclose(scene._error.scale, metres * 2.7955 * np.sqrt(shares), rtol=1e-4)


def test_a_force_in_the_frames_own_axes_is_drawn_turned_as_the_frame_is(server):
    from tauhat.report.live_page import LivePage

    robot = load_robot("panda")
    page = LivePage(server, robot, frame="tool", axes="frame")
    q, covariance = np.linspace(-1.0, 1.0, 7), np.diag([9.0, 4.0, 1.0])
    page.show(reading(robot, q, np.array([0.0, 0.0, 10.0]), covariance))
    rotation = forward_kinematics(robot, q, frame="tool").rotation
    start, tip = np.asarray(page._scene._arrow.points)[0]
    assert np.allclose((tip - start) / np.linalg.norm(tip - start), rotation[:, 2], atol=1e-5)
    w, *vector = page._scene._error.wxyz
    turned = rotation_of(w, np.array(vector))
    drawn = turned @ np.diag(np.square(page._scene._error.scale)) @ turned.T
    assert np.allclose(drawn / np.trace(drawn), rotation @ covariance @ rotation.T / 14.0, atol=1e-5)


def rotation_of(w: float, vector: np.ndarray) -> np.ndarray:
    return np.array([p + 2.0 * np.cross(vector, np.cross(vector, p) + w * p) for p in np.eye(3)]).T


def test_a_hidden_direction_stays_in_the_picture(server):
    from tauhat.report.live_page import LivePage

    robot = load_robot("ur5e")
    page = LivePage(server, robot)
    page.show(reading(robot, np.zeros(6), np.array([5.0, 0.0, 0.0]), np.diag([1.0, 1.0, 9e4])))
    assert max(page._scene._error.scale) == pytest.approx(0.6 * page._scene.reach)


def test_an_arm_with_shapes_is_drawn_with_them(server, tmp_path):
    from tauhat.report.live_page import LivePage

    (tmp_path / "shaped.urdf").write_text(SHAPED)
    robot = load_robot(tmp_path / "shaped.urdf")
    page = LivePage(server, robot, frame="tip")
    page.show(reading(robot, np.array([0.3, 0.4]), np.array([1.0, 0.0, 0.0]), np.eye(3)))
    drawn = {type(handle).__name__ for handle in server.scene._handle_from_node_name.values()}
    assert {"CylinderHandle", "IcosphereHandle", "MeshHandle"} <= drawn
    assert not any(name.endswith("/joint") for name in server.scene._handle_from_node_name)


def test_streams_are_chosen_among_and_too_many_are_forgotten(server):
    from tauhat.report.live_page import LivePage

    robot = load_robot("two_link")
    page = LivePage(server, robot, clock=iter(np.arange(1e3)).__next__)
    for k in range(40):
        page.show(reading(robot, np.full(2, 0.1 * k), np.zeros(3), np.eye(3), stream=f"arm {k}"))
    assert len(page._streams) == 16
    assert page._choice.visible
    assert set(page._choice.options) == set(page._streams)
    assert page._choice.value in page._streams


def test_a_button_pressed_twice_is_meant_once(server):
    from tauhat.report.live_page import LivePage

    now = [0.0]
    page = LivePage(server, load_robot("two_link"), clock=lambda: now[0])
    for moment in (10.0, 10.2, 12.0):
        now[0] = moment
        page._ask_for_zero()
    assert page.commands() == ["zero", "zero"]
    assert page.commands() == []


def test_a_client_that_came_again_is_looked_at_unless_another_was_chosen_by_hand(server):
    from tauhat.report.live_page import LivePage

    now = [0.0]
    robot = load_robot("two_link")
    page = LivePage(server, robot, clock=lambda: now[0])

    def looked_at(moment: float, stream: str) -> str:
        now[0] = moment
        page.show(reading(robot, np.zeros(2), np.zeros(3), np.eye(3), stream=stream, t=moment))
        return str(page._choice.value)

    assert looked_at(0.0, "first") == "first"
    assert looked_at(0.1, "beside") == "first"
    assert looked_at(0.5, "first") == "first"
    assert looked_at(9.0, "beside") == "first"  # it ran before: nobody mistakes one robot for another
    assert looked_at(9.1, "again") == "again"
    page._choice.value = "first"
    page._hear_choice(SimpleNamespace(client=object()))
    assert looked_at(20.0, "third") == "first"


def test_a_stream_that_is_chosen_is_drawn_though_it_says_nothing_any_more(server, monkeypatch):
    from tauhat.report.live_page import LivePage

    robot = load_robot("two_link")
    page = LivePage(server, robot, clock=iter(np.arange(99.0)).__next__)
    drawn = {}
    for name, q in (("first", np.array([0.5, 0.5])), ("second", np.zeros(2))):
        page.show(reading(robot, q, np.array([1.0, 0.0, 0.0]), np.eye(3), stream=name))
        assert page._choice.value == name
        drawn[name] = np.array(page._scene._arrow.points)
    assert not np.allclose(drawn["first"], drawn["second"], atol=0.1)
    page._choice.value = "first"
    monkeypatch.setattr(server, "get_clients", lambda: {0: None})
    page.refresh()
    assert (np.array(page._scene._arrow.points) == drawn["first"]).all()


def test_a_stream_that_has_ended_shows_no_force_also_when_it_is_chosen_again(server, monkeypatch):
    from tauhat.report.live_page import LivePage

    robot = load_robot("two_link")
    page = LivePage(server, robot, clock=iter(np.arange(99.0)).__next__)
    touch = Touch(2, "joint2", 0.0, 0.0, 9.0, open=True)
    touches = touch._replace(number=1, open=False), touch
    page.show(reading(robot, np.zeros(2), np.array([9.0, 0.0, 0.0]), np.eye(3), stream="first", contacts=touches))
    assert page._streams["first"].contacts.contacts == touches[::-1]
    scene = page._scene
    assert scene._arrow.visible
    page.end("first")
    assert (scene._arrow.visible, scene._error.visible) == (False, False)
    assert not page._streams["first"].contacts.contacts[0].open
    page.show(reading(robot, np.zeros(2), np.array([9.0, 0.0, 0.0]), np.eye(3), stream="second"))
    assert page._choice.value == "second"
    assert scene._arrow.visible
    page._choice.value = "first"
    monkeypatch.setattr(server, "get_clients", lambda: {0: None})
    page.refresh()
    assert (scene._arrow.visible, scene._error.visible) == (False, False)
    assert "the stream has ended" in page._status.content
    assert "Arrow" not in page._notes.content


def test_without_viser_the_extra_is_named(tmp_path, monkeypatch):
    from tauhat.report.hidden_viser import hidden_server

    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingExtraError, match=r"tauhat\[live\]"):
        hidden_server(tmp_path / "door")


def test_a_page_may_press_and_choose_and_nothing_else(server):
    """What viser would take beside it: any attribute of a button, and files that nobody asked for."""
    from viser import _messages as messages

    button = server.gui.add_button("Zero")
    pressed: list[object] = []
    button.on_click(pressed.append)
    interface = server.gui._websock_interface

    def told(message: Any) -> None:
        coming = interface._handle_incoming_message(0, message)
        asyncio.run_coroutine_threadsafe(coming, server._event_loop).result(timeout=5.0)

    uuid, props = button._impl.uuid, button._impl.props
    for updates in ({"props": 5}, {"value": True, "removed": True}, 5):
        told(messages.GuiUpdateMessage(uuid, updates))
    told(messages.FileTransferStartUpload(uuid, "x", "name", "text/plain", part_count=9, size_bytes=9))
    assert button._impl.props is props
    assert not button._impl.removed
    assert server.gui._current_file_upload_states == {}
    told(messages.GuiUpdateMessage(uuid, {"value": True}))
    assert button.value is True
