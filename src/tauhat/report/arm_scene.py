"""An arm in a 3-D scene of the browser: floor, links and joints, drawn once and then only moved."""

from __future__ import annotations

from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.limits import Body, Capsule, LinkSolid
from tauhat.excitation.limits.link_poses import LinkPoses
from tauhat.robots.transforms import quaternion

_LINKS = ((125, 176, 238), (95, 108, 128))
_JOINTS = (217, 101, 27)
_JOINT = 1.125  # radius of a joint, in parts of the links': it stands out


def draw_arm(scene: Any, body: Body, *, reach: float, width: float = 0.8) -> list[Any]:
    """Build floor, links and joints; return the frame of each link, for `move_arm`.

    Parameters
    ----------
    scene : viser's
    body : solids where the robot's description states them, capsules for the other links
    reach : of the arm, which floor and base axes are sized after [m]
    width : of capsules as drawn, in parts of their own
    """
    robot = body.robot
    size = 0.25 if reach > 0.5 else 0.05
    scene.set_up_direction("+z")
    scene.add_grid("/floor", width=4.0 * reach, height=4.0 * reach, cell_size=size, section_size=4 * size)
    scene.add_frame("/base", axes_length=0.15 * reach, axes_radius=0.006 * reach)
    frames = [scene.add_frame(f"/links/{index}", show_axes=False) for index in range(robot.n_v)]
    for index, capsule in enumerate(body.capsules):
        _draw_capsule(scene, _place(capsule.link, index), capsule, width=width)
    for index, solid in enumerate(body.solids):
        _draw_solid(scene, f"{_place(solid.link, index)}-solid", solid)
    solid_links = {solid.link for solid in body.solids}
    for index, joint in enumerate(robot.joints):
        if index in solid_links or not body.capsules:
            continue
        radius = _JOINT * width * max(capsule.radius for capsule in body.capsules)
        scene.add_cylinder(
            f"/links/{index}/joint", radius=radius, height=2.2 * radius, color=_JOINTS, wxyz=along(joint.axis)
        )
    return frames


def move_arm(frames: list[Any], poses: LinkPoses, index: int) -> None:
    """Put the links where they are in one sample of their poses."""
    for link, frame in enumerate(frames):
        frame.wxyz = quaternion(poses.rotation[link, index])
        frame.position = poses.origin[link, index]


def along(direction: FloatArray) -> FloatArray:
    """Return the quaternion (w, x, y, z) of a rotation that takes z to a direction."""
    z = direction / np.linalg.norm(direction)
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return quaternion(np.column_stack([x, np.cross(z, x), z]))


def _place(link: int, index: int) -> str:
    return f"/links/{link}/{index}" if link >= 0 else f"/base/{index}"


def _draw_capsule(scene: Any, place: str, capsule: Capsule, *, width: float) -> None:
    colour, radius = _LINKS[capsule.link % len(_LINKS)], width * capsule.radius
    middle, wxyz = 0.5 * (capsule.start + capsule.end), along(capsule.end - capsule.start)
    scene.add_cylinder(f"{place}/bar", radius=radius, height=capsule.length, color=colour, position=middle, wxyz=wxyz)
    for end, point in (("start", capsule.start), ("end", capsule.end)):
        scene.add_icosphere(f"{place}/{end}", radius=radius, color=colour, position=point)


def _draw_solid(scene: Any, place: str, solid: LinkSolid) -> None:
    """Draw the hull of a solid's corners, or what a disc or a ball about them makes of it."""
    colour = _LINKS[solid.link % len(_LINKS)]
    pose = {"position": solid.translation, "wxyz": quaternion(solid.rotation)}
    if solid.disc == 0.0 and solid.ball == 0.0:
        from scipy.spatial import ConvexHull

        faces = outward(solid.corners, ConvexHull(solid.corners).simplices)
        scene.add_mesh_simple(place, vertices=solid.corners, faces=faces, color=colour, flat_shading=True, **pose)
        return
    frame = scene.add_frame(place, show_axes=False, **pose)
    if len(solid.corners) > 1:
        radius, height = solid.disc + solid.ball, float(np.ptp(solid.corners[:, 2]))
        scene.add_cylinder(f"{frame.name}/bar", radius=radius, height=height, color=colour)
    for index, corner in enumerate(solid.corners if solid.ball > 0.0 else ()):
        scene.add_icosphere(f"{frame.name}/{index}", radius=solid.ball, color=colour, position=corner)


def outward(corners: FloatArray, faces: Any) -> Any:
    """Return the triangles (n, 3) of a convex hull with their corners in the order that shows the outside."""
    points, middle = corners[faces], corners.mean(axis=0)
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    inside = np.einsum("ni,ni->n", normals, points[:, 0] - middle) < 0.0
    return np.where(inside[:, None], faces[:, ::-1], faces)
