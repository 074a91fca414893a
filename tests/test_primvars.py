"""displayColor and displayOpacity of every interpolation, indexed, inherited, and wrong."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Sdf, UsdGeom, Vt

from prims import DEFAULT, define_cube, define_mesh, read, reasons, set_primvar
from test_material import READER, issues, of_cube, surface

POINTS = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0]]
FACES = [[0, 1, 4, 5], [1, 2, 3, 4]]
VALUES = {"uniform": 2, "vertex": 6, "varying": 6, "faceVarying": 8}


def pair() -> UsdGeom.Mesh:
    """Two quads, faceted, side by side."""
    return define_mesh(POINTS, FACES)


def ramp(count: int) -> np.ndarray:
    """(count, 3) colours that tell their index."""
    return np.stack([np.arange(count), np.full(count, 0.5), np.zeros(count)], axis=1).astype(np.float32)


def index_at(interpolation: str) -> list[int]:
    """The value due at each of the 8 corners."""
    points = [point for face in FACES for point in face]
    return {
        "uniform": [0] * 4 + [1] * 4,
        "vertex": points,
        "varying": points,
        "faceVarying": list(range(8)),
    }[interpolation]


@pytest.mark.parametrize("interpolation", VALUES)
def test_a_varying_colour_and_opacity_lie_on_the_mesh(interpolation: str) -> None:
    mesh, colors = pair(), ramp(VALUES[interpolation])
    set_primvar(mesh, "displayColor", Vt.Vec3fArray.FromNumpy(colors), interpolation)
    set_primvar(mesh, "displayOpacity", (colors[:, 0] / 10).tolist(), interpolation, "float[]")
    gprim = read(mesh)
    assert gprim.display_color is None and gprim.display_opacity is None and not gprim.issues
    np.testing.assert_array_equal(gprim.mesh.display_color, colors[index_at(interpolation)])
    np.testing.assert_allclose(gprim.mesh.display_opacity, colors[index_at(interpolation), 0] / 10, rtol=1e-6)


def test_points_stay_shared_while_nothing_splits_them() -> None:
    mesh = pair()
    mesh.CreateNormalsAttr([(0, 0, 1)] * 6)
    set_primvar(mesh, "displayColor", Vt.Vec3fArray.FromNumpy(ramp(6)), "vertex")
    gprim = read(mesh)
    np.testing.assert_array_equal(gprim.mesh.points, POINTS)
    np.testing.assert_array_equal(gprim.mesh.display_color, ramp(6))


def test_indexed_values_are_looked_up() -> None:
    mesh = pair()
    set_primvar(mesh, "displayColor", [(1, 0, 0), (0, 1, 0)], "uniform").SetIndices(Vt.IntArray([1, 0]))
    np.testing.assert_array_equal(read(mesh).mesh.display_color[[0, 4]], [[0, 1, 0], [1, 0, 0]])


def test_a_constant_is_no_part_of_the_mesh() -> None:
    mesh = pair()
    set_primvar(mesh, "displayColor", [(0.1, 0.2, 0.3)], "constant")
    set_primvar(mesh, "displayOpacity", [0.25], "constant", "float[]")
    gprim = read(mesh)
    np.testing.assert_allclose(gprim.display_color, [0.1, 0.2, 0.3], rtol=1e-6)
    assert gprim.display_opacity == 0.25
    assert gprim.mesh.display_color is None and gprim.mesh.display_opacity is None


def test_nothing_authored_is_nothing() -> None:
    gprim = read(pair())
    assert gprim.display_color is None and gprim.display_opacity is None
    assert gprim.mesh.display_color is None and not gprim.issues


def test_a_constant_is_inherited_and_a_varying_one_is_not() -> None:
    mesh = pair()
    stage = mesh.GetPrim().GetStage()
    parent = UsdGeom.Xform.Define(stage, "/parent")
    set_primvar(parent, "displayColor", [(1, 0, 0)], "constant")
    set_primvar(parent, "displayOpacity", [0.5, 0.25], "uniform", "float[]")
    gprim = read(UsdGeom.Sphere.Define(stage, "/parent/child"))
    np.testing.assert_array_equal(gprim.display_color, [1, 0, 0])
    assert gprim.display_opacity is None


@pytest.mark.parametrize("type_name", ["color3f[]", "color3d[]", "color3h[]", "float3[]"])
def test_any_float_type_will_do(type_name: str) -> None:
    mesh = pair()
    set_primvar(mesh, "displayColor", [(0.5, 0.25, 1.0)], "constant", type_name)
    np.testing.assert_array_equal(read(mesh).display_color, [0.5, 0.25, 1.0])


def mistyped(declaration: str) -> UsdGeom.Mesh:
    """A mesh whose displayColor a layer declares with another type than the schema's, which USD lets pass."""
    mesh = pair()
    other = Sdf.Layer.CreateAnonymous(".usda")
    other.ImportFromString(f'#usda 1.0\nover "mesh" {{\n{declaration}\n}}')
    mesh.GetPrim().GetStage().GetRootLayer().subLayerPaths.append(other.identifier)
    return mesh


def test_a_lone_value_counts_as_an_array_of_one() -> None:
    gprim = read(mistyped("color3f primvars:displayColor = (0.5, 0.25, 1)"))
    np.testing.assert_array_equal(gprim.display_color, [0.5, 0.25, 1.0])


@pytest.mark.parametrize(
    "declared",
    [
        "color4f[] primvars:displayColor = [(1, 0, 0, 1)]",
        'token[] primvars:displayColor = ["red"]',
        "bool primvars:displayColor = 1",
        'string primvars:displayColor = "red"',
    ],
)
def test_what_is_no_colour_is_left_out(declared: str) -> None:
    gprim = read(mistyped(declared))
    assert gprim.display_color is None
    assert reasons(gprim) == ["primvars:displayColor is left out: its type is not 3 floats a value"]


@pytest.mark.parametrize(
    ("values", "interpolation", "reason"),
    [
        ([(1, 0, 0)] * 5, "vertex", "5 vertex values where 6 are due: it is left out"),
        ([(1, 0, 0)] * 3, "faceVarying", "3 faceVarying values where 8 are due: it is left out"),
        ([(1, 0, 0)] * 5, "instance", "5 instance values where 0 are due: it is left out"),
        ([(1, np.nan, 0)], "constant", "not all of its values are finite"),
    ],
)
def test_what_does_not_fit_is_left_out(values: list, interpolation: str, reason: str) -> None:
    mesh = pair()
    primvar = set_primvar(mesh, "displayColor", values, "constant")
    primvar.GetAttr().SetMetadata("interpolation", interpolation)
    gprim = read(mesh)
    assert gprim.display_color is None and gprim.mesh.display_color is None
    assert len(gprim.issues) == 1 and reason in reasons(gprim)[0]
    assert len(gprim.mesh.triangles) == 4


def test_of_too_many_values_the_first_are_taken() -> None:
    mesh = pair()
    set_primvar(mesh, "displayColor", Vt.Vec3fArray.FromNumpy(ramp(9)), "constant")
    gprim = read(mesh)
    np.testing.assert_array_equal(gprim.display_color, ramp(1)[0])
    assert reasons(gprim) == ["primvars:displayColor has 9 constant values where 1 are due: the first are taken"]


@pytest.mark.parametrize("indices", [[0, 2], [-1, 0]])
def test_indices_out_of_range_leave_the_primvar_out(indices: list[int]) -> None:
    mesh = pair()
    set_primvar(mesh, "displayColor", [(1, 0, 0), (0, 1, 0)], "uniform").SetIndices(Vt.IntArray(indices))
    gprim = read(mesh)
    assert gprim.mesh.display_color is None
    assert reasons(gprim) == ["primvars:displayColor is left out: its indices are out of range"]


def test_an_empty_array_says_nothing() -> None:
    mesh = pair()
    set_primvar(mesh, "displayColor", Vt.Vec3fArray(), "vertex")
    assert not read(mesh).issues


def test_values_of_dropped_faces_go_with_them() -> None:
    """Faces 1 and 3 of 6 cannot be drawn; the others keep their own colours and corners."""
    mesh = define_cube()
    counts = mesh.GetFaceVertexCountsAttr().Get()
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    indices[5], indices[12] = 99, -1
    mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(indices))
    set_primvar(mesh, "displayColor", Vt.Vec3fArray.FromNumpy(ramp(6)), "uniform")
    set_primvar(mesh, "displayOpacity", np.arange(24.0).tolist(), "faceVarying", "float[]")
    gprim = read(mesh, DEFAULT)
    assert len(counts) == 6 and np.unique(gprim.mesh.faces).tolist() == [0, 2, 4, 5]
    drawn = gprim.mesh.triangles
    np.testing.assert_array_equal(gprim.mesh.display_color[drawn, 0], np.repeat(gprim.mesh.faces[:, None], 3, axis=1))
    np.testing.assert_array_equal(gprim.mesh.display_opacity[drawn] // 4, gprim.mesh.display_color[drawn, 0])


@pytest.mark.parametrize("name", ["emissiveColor", "metallic", "roughness", "ior", "opacity", "normal", "displacement"])
def test_a_reader_of_what_is_missing_gives_its_fallback(name: str) -> None:
    reader = READER.format(type="float", name="worn", fallback="float inputs:fallback = 0.25")
    text = surface("m", f"float inputs:{name}.connect = </m/reader.outputs:result>", reader)
    if name in ("normal", "displacement"):
        assert issues(text) == [f"without {name} (primvar worn)"]
    else:  # the cube has no such primvar
        assert issues(text) == []
        assert of_cube(text) == of_cube(surface("m", f"float inputs:{name} = 0.25"))
