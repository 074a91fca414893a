"""The cages of solids against Hydra's: ten segments, the subdivision that makes them round, and the room they take."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import stages
from defshade_cli.usd.gprims.cages import SEGMENTS, capsule_cage, cone_cage, frustum_cage, sphere_cage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.polygons.control import smooth_control
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.refiner import Refiner
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.surfaces.extent import extents_of, stage_extent
from defshade_cli.usd.surfaces.geometry import read_surface
from prims import DEFAULT, new_stage

CAGES = {
    "sphere": (sphere_cage(2.0), 92, 100),
    "cylinder": (frustum_cage(2.0, 1.0, 1.0), 42, 30),
    "cone": (cone_cage(2.0, 1.0), 31, 20),
    "capsule": (capsule_cage(1.0, 0.5, 0.5), 82, 90),
}
"""Points and faces as GeomUtil's generators make them."""


def outward(polygons: Polygons) -> np.ndarray:
    """(F,) how far the faces' vector areas point away from the origin."""
    areas = []
    for face in np.split(polygons.indices, np.cumsum(polygons.counts)[:-1]):
        points = polygons.points[face].astype(np.float64)
        areas.append(
            np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0) @ points.mean(axis=0)
        )
    return np.array(areas)


@pytest.mark.parametrize("name", CAGES)
def test_points_and_faces_are_hydras(name: str) -> None:
    polygons, points, faces = CAGES[name]
    assert (len(polygons.points), len(polygons.counts)) == (points, faces)
    assert polygons.scheme == "catmullClark" and (outward(polygons) > 0.0).all()


def test_a_refined_sphere_shrinks_to_the_limit_of_its_rings() -> None:
    """The limit mask of a regular point, 1 4 1 along and across over 36, at a point of the equator."""
    cage = sphere_cage(1.0)
    control = smooth_control(cage)
    assert control is not None
    refined = Refiner(control, 3).refine(cage)
    around, along = (
        (4.0 + 2.0 * math.cos(2.0 * math.pi / SEGMENTS)) / 6.0,
        (4.0 + 2.0 * math.cos(math.pi / SEGMENTS)) / 6.0,
    )
    equator = np.abs(refined.points[:, 2]) < 1e-6
    radius = np.linalg.norm(refined.points[equator], axis=1)
    assert radius.max() == pytest.approx(around * along, rel=1e-6)


def test_only_a_fixed_complexity_makes_cages() -> None:
    stage = stages.stage_of('def Sphere "ball" {\n}\n')
    options = ReadOptions(), ReadOptions(complexity="low")
    smooth, cage = (StageReader(stage, each).read(None).meshes[0] for each in options)
    assert (smooth.level, cage.level) == (None, 0)
    assert len(cage.points) == 92 < len(smooth.points)


def test_tapered_capsules_touch_their_spheres_tangents() -> None:
    """Every point lies on the smaller cap's sphere or the larger one's."""
    points = capsule_cage(3.0, 0.5, 1.0).points.astype(np.float64)
    on_lower = np.linalg.norm(points - (0, 0, -1.5), axis=1) - 1.0
    on_upper = np.linalg.norm(points - (0, 0, 1.5), axis=1) - 0.5
    np.testing.assert_allclose(np.minimum(np.abs(on_lower), np.abs(on_upper)), 0.0, atol=1e-6)


def test_an_extent_is_the_authored_one_then_usds() -> None:
    stage = new_stage()
    ball = UsdGeom.Sphere.Define(stage, "/ball")
    ball.CreateRadiusAttr(2.0)
    surface = read_surface(ball.GetPrim(), DEFAULT, as_cages=True)
    assert surface is not None
    np.testing.assert_array_equal(extents_of(stage, [surface], DEFAULT)[0], [[-2] * 3, [2] * 3])
    ball.CreateExtentAttr([(-3, -3, -3), (3, 3, 3)])
    np.testing.assert_array_equal(extents_of(stage, [surface], DEFAULT)[0], [[-3] * 3, [3] * 3])
    ball.GetExtentAttr().Set([(1, 1, 1), (-1, -1, -1)])
    np.testing.assert_array_equal(extents_of(stage, [surface], DEFAULT)[0], surface.polygons.bounds)


def test_what_cannot_be_drawn_takes_the_room_that_it_says() -> None:
    """As in usdrecord, whose camera frames extents."""
    text = 'def Cube "seen" {\n}\ndef Mesh "empty" {\n    float3[] extent = [(-9, -9, -9), (9, 9, 9)]\n}\n'
    alone, both = (stages.read(body).camera.position[2] for body in (text.partition("def Mesh")[0], text))
    assert both > 5.0 * alone


def test_the_stages_extent_is_of_the_purposes() -> None:
    stage: Usd.Stage = stages.stage_of(
        'def Cube "near" {\n}\ndef Cube "far" {\n    uniform token purpose = "guide"\n    double size = 8\n}\n'
    )
    np.testing.assert_allclose(stage_extent(stage, ["default"]), [[-1] * 3, [1] * 3])
    np.testing.assert_allclose(stage_extent(stage, ["default", "guide"]), [[-4] * 3, [4] * 3])
