"""Surfaces over arc length: derivatives, right angles, circles, and their errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tauhat.control.force import CylindricalSurface, FlatSurface, Surface
from tauhat.errors import ArrayError

PLACE: dict[str, Any] = {
    "place": np.array([0.6, -0.2, 0.1]),
    "rotation": Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix(),
}
SURFACES = [
    FlatSurface(**PLACE),
    CylindricalSurface(**PLACE, radius=0.4),
    CylindricalSurface(**PLACE, radius=-0.4),
    CylindricalSurface(**PLACE, radius=1e7),
]
S, STEP = np.linspace(-0.15, 0.15, 31), 1e-5


@pytest.mark.parametrize("surface", SURFACES)
def test_tangents_are_the_derivative_of_the_points_by_arc_length(surface: Surface):
    slopes = (surface.points(S + STEP) - surface.points(S - STEP)) / (2.0 * STEP)
    np.testing.assert_allclose(surface.tangents(S), slopes, atol=1e-9)


@pytest.mark.parametrize("surface", SURFACES)
def test_curvature_turns_the_normal_towards_the_tangent(surface: Surface):
    slopes = (surface.normals(S + STEP) - surface.normals(S - STEP)) / (2.0 * STEP)
    np.testing.assert_allclose(surface.curvature * surface.tangents(S), slopes, atol=1e-9)


@pytest.mark.parametrize("surface", SURFACES)
def test_the_path_begins_as_its_place_and_rotation_say(surface: Surface):
    middle = np.zeros(1)
    np.testing.assert_allclose(surface.points(middle)[0], surface.place, atol=1e-15)
    np.testing.assert_allclose(surface.tangents(middle)[0], surface.rotation[:, 0], atol=1e-15)
    np.testing.assert_allclose(surface.normals(middle)[0], surface.rotation[:, 2], atol=1e-15)


@pytest.mark.parametrize("radius", [0.4, -0.4])
def test_a_cylinder_has_its_radius_about_an_axis_on_the_inner_side(radius: float):
    surface = CylindricalSurface(**PLACE, radius=radius)
    centre = surface.place - radius * surface.rotation[:, 2]
    outwards = surface.points(S) - centre
    np.testing.assert_allclose(outwards, radius * surface.normals(S), atol=1e-15)


def test_a_nearly_flat_cylinder_is_a_plane():
    np.testing.assert_allclose(SURFACES[3].points(S), SURFACES[0].points(S), atol=2e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rotation": 1.001 * np.eye(3)}, "rotation is not a rotation"),
        ({"rotation": np.diag([1.0, 1.0, -1.0])}, "rotation is not a rotation"),
        ({"place": [0.0, np.nan, 0.0]}, "place is not finite"),
        ({"half": 0.0}, "half is not a length"),
        ({"radius": 0.0}, "radius is not one"),
        ({"radius": 0.09}, "the path winds round the cylinder"),
    ],
)
def test_impossible_surfaces_are_refused(changes: dict[str, Any], message: str):
    with pytest.raises(ArrayError, match=message):
        CylindricalSurface(**{**PLACE, "radius": 0.3, **changes})
