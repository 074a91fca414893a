"""The float64 reference itself, against results that can be had by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from build import at, bulb, rotated, sun
from defshade_cli.measure.light import irradiance_at, shaping_factor
from defshade_cli.measure.reference import Planes, reference_radiance, shade, surface_from_planes
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.light import CylinderLight, DiskLight, Light
from defshade_cli.scene.shaping import Shaping
from defshade_cli.spaces import translation

CAMERA = Camera("/camera", at(0, 0, 5), (-0.8, 0.8, -0.45, 0.45), clipping_range=(0.1, 100.0))
WALL_Z = 0.0
SIZE = (16, 9)


def _wall(base: tuple[float, float, float] = (0.5, 0.5, 0.5), roughness: float = 1.0) -> dict[str, NDArray]:
    """A GBuffer that a wall at z = 0 fills, its last column background."""
    width, height = SIZE
    planes = {
        "base": np.zeros((height, width, 4), np.float32),
        "normal": np.zeros((height, width, 4), np.float32),
        "depth": np.full((height, width, 1), 5.0 - WALL_Z, np.float32),
    }
    planes["base"][..., :3] = base
    planes["normal"][..., 2:] = (1.0, roughness)
    planes["depth"][:, -1] = np.inf
    return planes


def _lambertian(planes: Planes, light: Light, camera: Camera = CAMERA) -> NDArray[np.float64]:
    """(H, W) red radiance with the specular response off."""
    return reference_radiance(planes, camera, [replace(light, specular=0.0)], shading="classic")[0][..., 0]


@pytest.mark.parametrize("camera", [CAMERA, replace(CAMERA, projection="orthographic")], ids=lambda c: c.projection)
def test_positions_follow_the_rays_of_the_pixels_centres(camera: Camera) -> None:
    surface, covered = surface_from_planes(_wall(), camera)
    assert covered.sum() == 15 * 9
    grid = np.full((9, 16, 3), np.nan)
    grid[covered] = surface.position
    spread = 5.0 if camera.projection == "perspective" else 1.0
    np.testing.assert_allclose(grid[0, 0], [spread * 0.8 * (-15 / 16), spread * 0.45 * (8 / 9), WALL_Z], atol=1e-12)
    np.testing.assert_allclose(grid[8, 14], [spread * 0.8 * (13 / 16), spread * 0.45 * (-8 / 9), WALL_Z], atol=1e-12)


def test_view_points_to_the_eye() -> None:
    perspective, _ = surface_from_planes(_wall(), CAMERA)
    np.testing.assert_allclose(np.linalg.norm(perspective.view, axis=1), 1.0)
    parallel = np.cross(perspective.view, np.array([0, 0, 5.0]) - perspective.position)
    np.testing.assert_allclose(parallel, 0.0, atol=1e-12)
    turned = Camera("/camera", rotated("y", 30.0), (-1, 1, -1, 1), projection="orthographic")
    orthographic, _ = surface_from_planes(_wall(), turned)
    np.testing.assert_allclose(orthographic.view[0], [0.5, 0.0, math.sqrt(0.75)], atol=1e-12)


def test_offset_of_ten_million_units_changes_nothing() -> None:
    far = replace(CAMERA, world_from_camera=translation(np.array([1e7, 1e7, 1e7])) @ CAMERA.world_from_camera)
    light = bulb(1, 2, 3, cone=40.0, softness=0.5)
    moved = replace(light, world_from_light=translation(np.array([1e7, 1e7, 1e7])) @ light.world_from_light)
    here, _ = reference_radiance(_wall(roughness=0.3), CAMERA, [light])
    there, _ = reference_radiance(_wall(roughness=0.3), far, [moved])
    np.testing.assert_allclose(there, here, rtol=1e-6)


def test_wall_that_faces_the_sun() -> None:
    """E = π on a white Lambertian returns 1; the background stays 0, exposure doubles."""
    planes = _wall(base=(1.0, 1.0, 1.0))
    radiance, covered = reference_radiance(planes, CAMERA, [replace(sun(), specular=0.0)], shading="classic")
    np.testing.assert_allclose(radiance[covered], 1.0, atol=2e-2)  # 1 − specular, at most 0.0092 on roughness 1
    assert not radiance[~covered].any()
    brighter, _ = reference_radiance(
        planes, replace(CAMERA, exposure=3.0), [replace(sun(), specular=0.0)], shading="classic", exposure=1.0
    )
    np.testing.assert_allclose(brighter, 6.0 * radiance)


def test_light_falls_with_the_square_of_the_distance() -> None:
    position = np.array([[0.0, 0.0, 0.0]])
    for distance in (1.0, 2.0, 10.0):
        direction, irradiance = irradiance_at(bulb(0, 0, distance, intensity=7.0), position)
        np.testing.assert_allclose(direction, [[0, 0, 1]])
        np.testing.assert_allclose(irradiance[0, 0], 7.0 * math.pi * 0.5**2 / distance**2)  # L · 4πr² / 4


@given(st.floats(0.0, 180.0))
def test_profiles_of_disk_and_cylinder(degrees: float) -> None:
    angle = math.radians(degrees)
    options = {"path": "/light", "world_from_light": np.eye(4), "color": (1, 1, 1), "intensity": 1.0}
    disk, cylinder = DiskLight(radius=1.0, **options), CylinderLight(radius=0.5, length=2.0, **options)
    off_axis = np.array([[math.sin(angle), 0.0, -math.cos(angle)]]) * 2.0
    _, irradiance = irradiance_at(disk, off_axis)
    np.testing.assert_allclose(irradiance[0], max(math.cos(angle), 0.0) * math.pi / 4.0, atol=1e-12)
    off_tube = np.array([[math.cos(angle), math.sin(angle), 0.0]]) * 2.0
    _, irradiance = irradiance_at(cylinder, off_tube)
    np.testing.assert_allclose(irradiance[0], math.sin(angle) * 2.0 / 4.0, atol=1e-12)  # area/π = 2rl = 2


def _shaped(degrees: float, **options: object) -> NDArray[np.float64]:
    angle = math.radians(degrees)
    emitted = np.array([[math.sin(angle), 0.0, -math.cos(angle)]])
    return shaping_factor(Shaping(**options), np.array([0.0, 0.0, -1.0]), emitted)[0]  # type: ignore[arg-type]


def test_cone_edge() -> None:
    for degrees, expected in ((0, 1), (29.9, 1), (30.1, 0), (170, 0)):
        assert _shaped(degrees, cone_angle=30.0).tolist() == [expected] * 3
    for degrees, expected in ((14, 1.0), (22.5, 0.5), (26.25, 1 - 0.84375), (31, 0.0)):
        np.testing.assert_allclose(_shaped(degrees, cone_angle=30.0, cone_softness=0.5), expected, atol=1e-12)


def test_focus_fades_to_its_tint() -> None:
    tint = (0.1, 0.0, 0.5)
    np.testing.assert_allclose(_shaped(0, focus=4.0, focus_tint=tint), 1.0)
    np.testing.assert_allclose(_shaped(60, focus=2.0, focus_tint=tint), np.array(tint) + 0.25 * (1 - np.array(tint)))
    np.testing.assert_allclose(_shaped(60, focus=-3.0, focus_tint=tint), 1.0)


def test_missing_planes_have_their_defaults() -> None:
    planes = _wall(base=(0.8, 0.4, 0.2))
    planes["base"][..., 3] = 0.25
    surface, _ = surface_from_planes(planes, CAMERA)
    edge = 0.75 + 0.25 * np.array([0.8, 0.4, 0.2])
    np.testing.assert_allclose(surface.f90[0], edge, rtol=1e-6)
    np.testing.assert_allclose(surface.f0[0], edge * (0.04 * 0.75 + 0.25), rtol=1e-6)
    assert not surface.emission.any()
    assert not surface.clearcoat.any()


def test_optional_planes_are_read() -> None:
    planes = _wall()
    planes["emission"] = np.full((9, 16, 4), 3.0, np.float32)
    planes["specular"] = np.full((9, 16, 4), 0.3, np.float32)
    planes["clearcoat"] = np.broadcast_to(np.array([0.7, 0.2], np.float32), (9, 16, 2))
    surface, _ = surface_from_planes(planes, CAMERA)
    np.testing.assert_allclose(surface.f0, 0.3, rtol=1e-6)
    np.testing.assert_allclose(surface.clearcoat, 0.7, rtol=1e-6)
    np.testing.assert_allclose(surface.clearcoat_roughness, 0.2, rtol=1e-6)
    np.testing.assert_allclose(shade(surface, []), 3.0)


def test_light_from_behind_is_not_seen() -> None:
    assert not _lambertian(_wall(), bulb(0, 0, -1)).any()


def test_lights_add() -> None:
    one, two = bulb(1, 1, 2, intensity=3.0), sun(0.5)
    together, _ = reference_radiance(_wall(roughness=0.4), CAMERA, [one, two])
    apart = sum(reference_radiance(_wall(roughness=0.4), CAMERA, [light])[0] for light in (one, two))
    np.testing.assert_allclose(together, apart)
