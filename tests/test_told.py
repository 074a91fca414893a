"""Small meshes asked together: what comes out is what comes out of each read by itself."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from defshade_cli.usd.polygons.checked import check_all
from defshade_cli.usd.polygons.lying import sound_carried
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, count_elements, read_carried
from defshade_cli.usd.polygons.told import told_of
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.said import said_of
from defshade_cli.usd.surfaces.geometry import read_surface
from stages import stage_of

QUADS = """
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
    uniform token subdivisionScheme = "none"
"""
TIME = Usd.TimeCode.Default()
SIX = ", ".join(f"({n}, {n % 3})" for n in range(6))

ALONE = {
    "holes": "int[] holeIndices = [1]",
    "a hole that is no face": "int[] holeIndices = [2]",
    "doubles": f'texCoord2d[] primvars:st = [{SIX}] (interpolation = "vertex")',
    "halfs": f'half2[] primvars:st = [{SIX}] (interpolation = "varying")',
    "one pair for all": "float2 primvars:st = (1, 2)",
    "three numbers": f'texCoord3f[] primvars:st = [{SIX.replace(")", ", 1)")}] (interpolation = "vertex")',
    "a third that is not finite": 'texCoord3f[] primvars:st = [(0, 0, inf)] (interpolation = "constant")',
    "out of float": 'texCoord2d[] primvars:st = [(1e300, 0)] (interpolation = "constant")',
    "a colour in doubles": 'color3d[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "uniform")',
    "a colour in sRGB": 'color3f[] primvars:displayColor = [(.5, 0, 0)] (colorSpace = "srgb_rec709_scene")',
    "a colour like coordinates": "texCoord3f[] primvars:displayColor = [(1, 0, 0)]",
    "one opacity": "float primvars:displayOpacity = 0.5",
    "no value": "texCoord2f[] primvars:st",
    "indices": "texCoord2f[] primvars:st = [(0, 1), (1, 1)]\n int[] primvars:st:indices = [1]",
    "indices of nothing": "texCoord2f[] primvars:st = [(0, 1), (1, 1)]\n int[] primvars:st:indices = [2]",
    "normals": 'normal3f[] normals = [(0, 0, 2), (0, 1, 1)] (interpolation = "uniform")',
    "normals in doubles": 'double3[] primvars:normals = [(0, 0, 2), (0, 1, 1)] (interpolation = "uniform")',
    "normals by indices": f"""normal3f[] primvars:normals = [(0, 0, 2), (0, 1, 1)] (interpolation = "faceVarying")
        int[] primvars:normals:indices = [{", ".join("01100110")}]""",
    "normals by wrong ones": f"""normal3f[] primvars:normals = [(0, 0, 2), (0, 1, 1)] (interpolation = "faceVarying")
        int[] primvars:normals:indices = [{", ".join("01100119")}]""",
    "one normal for all": "normal3f[] primvars:normals = [(0, 0, 2)]",
}


@pytest.mark.parametrize("said", ALONE.values(), ids=ALONE)
def test_of_one_mesh(said: str) -> None:
    stage = stage_of(f'def Mesh "m" {{ {QUADS} {said} \n }}')
    prim = stage.GetPrimAtPath("/m")
    told = told_of(said_of(prim), TIME, DISPLAY_COLOR)
    together = check_all([told])[0] if told else None
    alone = read_surface(prim, TIME)
    assert alone is not None
    assert together is None or together.without_constants().digest == alone.polygons.without_constants().digest
    assert together is None or not alone.issues


def test_what_is_common_is_asked_so() -> None:
    for said in (ALONE[name] for name in ("holes", "doubles", "a colour in doubles", "indices", "normals by indices")):
        stage = stage_of(f'def Mesh "m" {{ {QUADS} {said} \n }}')
        prim = stage.GetPrimAtPath("/m")
        told = told_of(said_of(prim), TIME, DISPLAY_COLOR)
        assert told and check_all([told])[0]


@pytest.mark.parametrize("said", ALONE.values(), ids=ALONE)
def test_of_a_solid(said: str) -> None:
    stage = stage_of(f'def Cube "c" {{ {said} \n }}')
    prim = stage.GetPrimAtPath("/c")
    elements = count_elements(6, 8, 24)
    together = sound_carried(said_of(prim), TIME, DISPLAY_COLOR, elements)
    issues: list[str] = []
    alone = read_carried(prim, TIME, elements, issues)
    if together:
        bare = Polygons(np.zeros((8, 3), np.float32), np.full(6, 4), np.zeros(24, int), np.arange(6, dtype=np.int32))
        assert not issues
        assert together.laid_on(bare).digest == alone.laid_on(bare).digest


OWN = f"""
    def Mesh "bare" {{ {QUADS}
    }}
    def Mesh "own" {{ {QUADS}
        texCoord2f[] primvars:st = [{SIX}] (interpolation = "vertex")
    }}
    def Mesh "blocked" {{ {QUADS}
        color3f[] primvars:displayColor = None
    }}
    def Mesh "declared" {{ {QUADS}
        texCoord2f[] primvars:st
        float[] primvars:displayOpacity
    }}
    def Mesh "otherwise" {{ {QUADS}
        string primvars:st = "none"
        texCoord2f[] primvars:map1 = [(1, 1)]
    }}
"""
INHERITED = f"""
def Xform "world" {{
    color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")
    texCoord2f[] primvars:st = [(0.25, 0.5), (1, 0)] (interpolation = "constant")
    int[] primvars:st:indices = [0]
    {OWN}
    def "untyped" {{
        color3f[] primvars:displayColor = [(0, 1, 0), (0, 0, 1)] (interpolation = "uniform")
        float[] primvars:displayOpacity = [0.5]
        {OWN}
    }}
    def Scope "blocking" {{
        color3f[] primvars:displayColor = None
        float2[] primvars:map1 = [(3, 3)]
        {OWN}
    }}
    def Mesh "parent" {{ {QUADS}
        color3f[] primvars:displayColor = [(0, 0, 1)]
        {OWN}
    }}
}}
"""


def test_what_is_inherited() -> None:
    """As UsdGeomPrimvarsAPI finds it for each mesh, whatever has stood above it in the walk."""
    stage = stage_of(INHERITED)
    scene = StageReader(stage).read(None)
    found = {path: (scene.meshes[d.mesh], d) for d in scene.drawables for path in d.paths}
    meshes = [prim for prim in stage.TraverseAll() if prim.IsA(UsdGeom.Mesh)]
    assert found.keys() == {str(prim.GetPath()) for prim in meshes}
    for prim in meshes:
        alone = read_surface(prim, TIME)
        mesh, drawable = found[str(prim.GetPath())]
        assert alone is not None
        assert list(mesh.uvs) == list(alone.polygons.uvs)
        assert (mesh.display_color is None) == (alone.polygons.without_constants().display_color is None)
        color = (0.18, 0.18, 0.18) if alone.display_color is None else alone.display_color
        row = drawable.paths.index(str(prim.GetPath()))
        np.testing.assert_array_equal(drawable.display_color[row], np.array(color, np.float32))
        opacity = 1.0 if alone.display_opacity is None else alone.display_opacity
        assert drawable.display_opacity[row] == opacity
