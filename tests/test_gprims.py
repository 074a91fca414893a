"""Tessellated gprims against what they stand for: closed forms, the schema's own extents, exact normals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, Vt

from defshade_cli.usd.gprims.revolution import SEGMENTS
from prims import Drawn, area, corners, is_watertight, new_stage, read, reasons, set_primvar, vector_areas, volume

STEP = 2.0 * math.pi / SEGMENTS
ROUND = math.sin(STEP) / STEP
"""Area of the polygon of SEGMENTS corners over that of its circle: by so much is a swept volume too small."""

SIZES: dict[str, list[dict[str, float]]] = {
    "Cube": [{}, {"size": 3.0}],
    "Sphere": [{}, {"radius": 0.25}],
    "Cylinder": [{}, {"height": 3.0, "radius": 0.5}],
    "Cone": [{}, {"height": 3.0, "radius": 0.5}],
    "Capsule": [{}, {"height": 3.0, "radius": 0.25}, {"height": 0.0, "radius": 1.0}],
    "Cylinder_1": [
        {},
        {"height": 3.0, "radiusTop": 0.25, "radiusBottom": 1.5},
        {"height": 1.0, "radiusTop": 2.0, "radiusBottom": 0.0},
    ],
    "Capsule_1": [
        {},
        {"height": 2.0, "radiusTop": 0.25, "radiusBottom": 0.75},
        {"height": 3.0, "radiusTop": 1.0, "radiusBottom": 0.0},
    ],
    "Plane": [{}, {"width": 3.0, "length": 5.0}],
}
CASES = [(name, sizes) for name, cases in SIZES.items() for sizes in cases]
SOLIDS = [case for case in CASES if case[0] != "Plane"]
CURVED = [case for case in SOLIDS if case[0] != "Cube"]


def define(name: str, sizes: dict[str, float], axis: str = "Z") -> UsdGeom.Gprim:
    prim = new_stage().DefinePrim("/prim", name)
    if prim.HasAttribute("axis"):
        prim.GetAttribute("axis").Set(axis)
    for attribute, value in sizes.items():
        prim.GetAttribute(attribute).Set(value)
    return UsdGeom.Gprim(prim)


def size(gprim: UsdGeom.Gprim, name: str) -> float:
    return gprim.GetPrim().GetAttribute(name).Get()


def frustum_volume(height: float, top: float, bottom: float) -> float:
    return math.pi * height / 3.0 * (top * top + top * bottom + bottom * bottom)


def capsule_volume(height: float, top: float, bottom: float) -> float:
    """A frustum, and of each sphere the cap beyond its ring: π c² (3R − c) / 3 with sagitta c."""
    slope = (bottom - top) / height if height else 0.0
    stretch = math.hypot(1.0, slope)
    caps = ((top * stretch, top * (stretch - slope)), (bottom * stretch, bottom * (stretch + slope)))
    return frustum_volume(height, top, bottom) + sum(math.pi * c * c * (3 * r - c) / 3 for r, c in caps)


def exact_volume(gprim: UsdGeom.Gprim) -> float:
    name = gprim.GetPrim().GetTypeName()
    get = {
        a: size(gprim, a)
        for a in ("size", "height", "radius", "radiusTop", "radiusBottom")
        if gprim.GetPrim().HasAttribute(a)
    }
    radii = get.get("radiusTop", get.get("radius", 0.0)), get.get("radiusBottom", get.get("radius", 0.0))
    match name:
        case "Cube":
            return get["size"] ** 3
        case "Sphere":
            return 4.0 / 3.0 * math.pi * get["radius"] ** 3
        case "Cone":
            return frustum_volume(get["height"], 0.0, get["radius"])
        case "Cylinder" | "Cylinder_1":
            return frustum_volume(get["height"], *radii)
        case _:
            return capsule_volume(get["height"], *radii)


@pytest.mark.parametrize(("name", "sizes"), SOLIDS)
@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_solids_are_closed_and_wound_outwards_and_hold_their_volume(name: str, sizes: dict, axis: str) -> None:
    """A flat profile loses the round of its section. A sphere's chords lie δ²/12 of the radius too deep on average,
    which is δ²/4 of its volume; other arcs are a part of a solid that loses less.
    """
    schema = define(name, sizes, axis)
    gprim = read(schema)
    assert is_watertight(gprim.mesh) and not gprim.issues
    flat = name in ("Cylinder", "Cylinder_1", "Cone")
    ratio = volume(gprim.mesh) / exact_volume(schema)
    if name == "Cube":
        assert ratio == pytest.approx(1.0, rel=1e-6)
    elif flat:
        assert ratio == pytest.approx(ROUND, rel=1e-5)
    else:
        assert ROUND * (1.0 - STEP**2 / 4.0) - 1e-5 < ratio < ROUND


def test_the_area_of_a_sphere() -> None:
    assert ROUND**2 < area(read(define("Sphere", {"radius": 2.0})).mesh) / (16.0 * math.pi) < 1.0


@pytest.mark.parametrize(("name", "sizes"), CASES)
@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_bounds_are_the_extent_that_the_schema_computes(name: str, sizes: dict, axis: str) -> None:
    schema = define(name, sizes, axis)
    extent = np.array(schema.ComputeExtent(Usd.TimeCode.Default()), float)
    inward = (1.0 - math.cos(STEP / 2.0)) * np.ptp(extent, axis=0).max()  # a chord at most
    bounds = read(schema).mesh.bounds
    assert (bounds[0] >= extent[0] - 1e-6).all() and (bounds[1] <= extent[1] + 1e-6).all()
    np.testing.assert_allclose(bounds, extent, atol=inward + 1e-6)


@pytest.mark.parametrize(("name", "sizes"), CASES)
def test_normals_are_unit_and_agree_with_their_triangles(name: str, sizes: dict) -> None:
    """To the half step, around and along, by which a facet turns from the surface at its corners."""
    mesh = read(define(name, sizes)).mesh
    normals = mesh.normals[mesh.triangles].astype(float)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-6)
    areas = vector_areas(mesh)
    length = np.linalg.norm(areas, axis=1)
    real = length > 1e-7 * length.max()
    cosine = np.einsum("ti,tki->tk", areas[real] / length[real, None], normals[real])
    assert cosine.min() > math.cos(STEP)


def test_normals_of_a_sphere_are_its_radii_also_at_the_poles() -> None:
    mesh = read(define("Sphere", {"radius": 3.0})).mesh
    np.testing.assert_allclose(mesh.normals, mesh.points / 3.0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "sizes"),
    [("Cone", {"height": 3.0, "radius": 2.0}), ("Cylinder_1", {"radiusTop": 0.0, "radiusBottom": 1.0})],
)
def test_interpolated_normals_of_a_cone_hold_up_to_its_apex(name: str, sizes: dict) -> None:
    """At the centre of every triangle of the mantle; below 1/256 of the base a facet may stand for the tip."""
    schema = define(name, sizes)
    mesh = read(schema).mesh
    height, radius = size(schema, "height"), sizes.get("radius", 1.0)
    tilt = math.atan2(radius, height)
    mantle = mesh.normals[mesh.triangles[:, 0], 2] > -0.5
    centre, normal = (
        values[mesh.triangles[mantle]].astype(float).mean(axis=1) for values in (mesh.points, mesh.normals)
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    radial = centre[:, :2] / np.linalg.norm(centre[:, :2], axis=1, keepdims=True)
    exact = np.column_stack([radial * math.cos(tilt), np.full(len(radial), math.sin(tilt))])
    angle = np.degrees(np.arccos(np.clip(np.einsum("ti,ti->t", normal, exact), -1.0, 1.0)))
    assert angle.max() < 0.5 * math.degrees(STEP)
    tip = corners(mesh)[mantle][:, :, 2].max(axis=1) == np.float32(0.5 * height)
    assert np.linalg.norm(corners(mesh)[mantle][tip][..., :2], axis=-1).max() <= radius / 128 + 1e-6


@pytest.mark.parametrize(("axis", "direction"), [("X", 0), ("Y", 1), ("Z", 2)])
def test_the_spine_points_along_the_axis(axis: str, direction: int) -> None:
    points = read(define("Cone", {"height": 4.0, "radius": 1.0}, axis)).mesh.points
    apex = points[points[:, direction].argmax()]
    np.testing.assert_array_equal(apex, 2.0 * np.eye(3)[direction])


@pytest.mark.parametrize(
    ("axis", "half", "normal"),
    [("X", (0, 2.5, 1.5), (1, 0, 0)), ("Y", (1.5, 0, 2.5), (0, 1, 0)), ("Z", (1.5, 2.5, 0), (0, 0, 1))],
)
def test_a_plane_lies_as_the_schema_tabulates(axis: str, half: tuple, normal: tuple) -> None:
    gprim = read(define("Plane", {"width": 3.0, "length": 5.0}, axis))
    np.testing.assert_array_equal(gprim.mesh.bounds, [np.negative(half), half])
    np.testing.assert_array_equal(gprim.mesh.normals, np.broadcast_to(normal, (4, 3)))
    np.testing.assert_allclose(vector_areas(gprim.mesh).sum(axis=0), 15.0 * np.array(normal))
    assert gprim.mesh.double_sided


def test_capsules_continue_smoothly_from_mantle_to_cap() -> None:
    """Around the ring where they meet, both carry the normal of the mantle."""
    mesh = read(define("Capsule_1", {"height": 2.0, "radiusTop": 0.25, "radiusBottom": 0.75})).mesh
    ring = np.isclose(mesh.points[:, 2], 1.0) & np.isclose(np.hypot(*mesh.points[:, :2].T), 0.25)
    tilt = math.atan2(0.5, 2.0)
    assert ring.sum() == SEGMENTS
    np.testing.assert_allclose(mesh.normals[ring, 2], math.sin(tilt), atol=1e-6)


def by_face(gprim: Drawn) -> NDArray:
    """(F, 3) the colour of each face's first triangle."""
    _, first = np.unique(gprim.mesh.faces, return_index=True)
    return gprim.mesh.display_color[gprim.mesh.triangles[first, 0]]


def test_colours_a_face_of_a_cube_lie_where_hydra_puts_them() -> None:
    schema = define("Cube", {})
    set_primvar(schema, "displayColor", Vt.Vec3fArray.FromNumpy(np.eye(6, 3, dtype=np.float32)), "uniform")
    gprim = read(schema)
    np.testing.assert_array_equal(by_face(gprim), np.eye(6, 3))
    outward = vector_areas(gprim.mesh)[::2] / 2.0
    np.testing.assert_allclose(outward, [[0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]])


def test_a_varying_colour_has_no_meaning_on_a_sphere() -> None:
    schema = define("Sphere", {})
    set_primvar(schema, "displayColor", [(1, 0, 0)] * 92, "vertex")
    gprim = read(schema)
    assert gprim.display_color is None and gprim.mesh.display_color is None
    assert reasons(gprim) == ["primvars:displayColor has 92 vertex values where 0 are due: it is left out"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_a_size_that_is_none_leaves_the_gprim_out(value: float) -> None:
    gprim = read(define("Cylinder", {"height": value}))
    assert not len(gprim.mesh.triangles) and not gprim.groups
    assert reasons(gprim) == ["it is left out: height is no size"]


def test_a_blocked_size_leaves_the_gprim_out() -> None:
    schema = define("Sphere", {})
    schema.GetPrim().GetAttribute("radius").Block()
    assert reasons(read(schema)) == ["it is left out: radius is no size"]


@pytest.mark.parametrize(("name", "sizes"), [("Cube", {"size": -2.0}), ("Sphere", {"radius": -1.0})])
def test_a_negative_size_counts_as_positive(name: str, sizes: dict) -> None:
    gprim = read(define(name, sizes))
    assert volume(gprim.mesh) > 4.0
    assert reasons(gprim) == [f"{next(iter(sizes))} is negative; its absolute value is taken"]


@pytest.mark.parametrize("name", SIZES)
def test_sizes_of_zero_do_no_harm(name: str) -> None:
    prim = define(name, {}).GetPrim()
    zero = {
        a: 0.0
        for a in ("size", "radius", "radiusTop", "radiusBottom", "height", "width", "length")
        if prim.HasAttribute(a)
    }
    gprim = read(define(name, zero))
    np.testing.assert_allclose(np.linalg.norm(gprim.mesh.normals, axis=1), 1.0, atol=1e-6)
    assert not gprim.issues


def test_an_unknown_axis_is_said() -> None:
    assert reasons(read(define("Cone", {}, "W"))) == ["axis 'W' is none of X, Y, Z; Z is taken"]


def test_orientation_is_of_no_account() -> None:
    schema = define("Sphere", {})
    schema.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    assert volume(read(schema).mesh) > 4.0
