"""What a contact does to the joints: MuJoCo adds its push to that of dry friction, and tells the sum only.

MuJoCo's contact sensor tells the force f of the tip on the workpiece along the normal n, which points out of the tip,
and two tangents: the force on the tool is `F = -(f0 n + f1 t + f2 n x t)`. On a joint that carries the tool it acts as
`axis (p - anchor) x F` where the joint turns, and as `axis F` where it slides.
"""

from __future__ import annotations

from numba import njit

# The contact sensor's numbers.
FOUND, FORCE, POSITION, NORMAL, TANGENT, TOUCH_SIZE = 0, 1, 4, 7, 10, 13
# What a joint is to the body that touches.
ELSEWHERE, TURNS, SLIDES = range(3)


@njit(cache=True, nogil=True, error_model="numpy")
def force_on_tool(touch):  # type: ignore[no-untyped-def]
    """Return the force on the tool in base axes; nothing where nothing touches, or nothing could."""
    if touch.size == 0 or touch[FOUND] <= 0.0:
        return 0.0, 0.0, 0.0
    n0, n1, n2 = touch[NORMAL], touch[NORMAL + 1], touch[NORMAL + 2]
    t0, t1, t2 = touch[TANGENT], touch[TANGENT + 1], touch[TANGENT + 2]
    f, g, h = touch[FORCE], touch[FORCE + 1], touch[FORCE + 2]
    return (
        -(f * n0 + g * t0 + h * (n1 * t2 - n2 * t1)),
        -(f * n1 + g * t1 + h * (n2 * t0 - n0 * t2)),
        -(f * n2 + g * t2 + h * (n0 * t1 - n1 * t0)),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def push_on_joint(engine, force, j):  # type: ignore[no-untyped-def]
    """Return the torque of a force on the tool on a joint, at the place of the last step's begin."""
    part, f0, f1, f2 = engine.carriers[j], force[0], force[1], force[2]
    if part == ELSEWHERE:
        return 0.0
    axis, anchor, touch = engine.axes[engine.dof[j]], engine.anchors[engine.dof[j]], engine.touch
    if part == SLIDES:
        return axis[0] * f0 + axis[1] * f1 + axis[2] * f2
    a0, a1, a2 = touch[POSITION] - anchor[0], touch[POSITION + 1] - anchor[1], touch[POSITION + 2] - anchor[2]
    return axis[0] * (a1 * f2 - a2 * f1) + axis[1] * (a2 * f0 - a0 * f2) + axis[2] * (a0 * f1 - a1 * f0)
