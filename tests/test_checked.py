"""Small meshes that are looked into together are what each is alone, and what is to say of them is the same."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Complexity
from defshade_cli.usd import memory
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.surfaces import tessellation

INTERPOLATIONS = ("constant", "uniform", "varying", "vertex", "faceVarying")
INHERITED = (
    ("displayColor", "color3f[]", Gf.Vec3f(1, 0, 0)),
    ("st", "texCoord2f[]", Gf.Vec2f(0.5, 0.25)),
    ("displayColor", "texCoord2f[]", Gf.Vec2f(0, 1)),
)
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
POINTS = np.array([[x, y, 0] for y in range(3) for x in range(3)], np.float32)


def random_stage(seed: int, count: int = 40) -> Usd.Stage:
    """Meshes with all that may lie on them, a part of it of the wrong length, type or value."""
    rng = np.random.default_rng(seed)
    stage = Usd.Stage.CreateInMemory()
    looks = [_material(stage, f"/Looks/m{n}", reads="tint" if n == 2 else None) for n in range(3)]
    for group in range(3):
        above = UsdGeom.Xform.Define(stage, f"/World/g{group}").GetPrim()
        if rng.random() < 0.3:
            name, kind, value = INHERITED[rng.integers(len(INHERITED))]
            UsdGeom.PrimvarsAPI(above).CreatePrimvar(name, Sdf.ValueTypeNames.Find(kind)).Set([value])
        if rng.random() < 0.5:
            _bind(rng, above, looks)
    for number in range(count):
        mesh = UsdGeom.Mesh.Define(stage, f"/World/g{rng.integers(3)}/mesh{number}")
        _shape(rng, mesh)
        _dress(rng, mesh)
        if rng.random() < 0.5:
            _bind(rng, mesh.GetPrim(), looks)
        mesh.AddTranslateOp().Set(Gf.Vec3d(number % 8 * 3, number // 8 * 3, 0))
    return stage


def _material(stage: Usd.Stage, path: str, reads: str | None) -> UsdShade.Material:
    material, shader = UsdShade.Material.Define(stage, path), UsdShade.Shader.Define(stage, path + "/s")
    shader.CreateIdAttr("UsdPreviewSurface")
    if reads:
        reader = UsdShade.Shader.Define(stage, path + "/r")
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(reads)
        output = reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(output)
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def _bind(rng: np.random.Generator, prim: Usd.Prim, looks: list[UsdShade.Material]) -> None:
    strength = UsdShade.Tokens.strongerThanDescendants if rng.random() < 0.3 else UsdShade.Tokens.fallbackStrength
    purpose = str(rng.choice(["", "", "", "preview"]))
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(looks[rng.integers(len(looks))], strength, purpose)
    if rng.random() < 0.1:
        prim.GetRelationship("material:binding").SetTargets(["/Looks/missing"])


def _shape(rng: np.random.Generator, mesh: UsdGeom.Mesh) -> None:
    faces: list[list[int]] = []
    for quad in rng.permutation(QUADS)[: rng.integers(1, 5)].tolist():
        faces += [quad[:3], [quad[0], quad[2], quad[3]]] if rng.random() < 0.3 else [quad]
    counts, indices = [len(face) for face in faces], [int(index) for face in faces for index in face]
    points = POINTS + rng.normal(scale=0.3, size=POINTS.shape).astype(np.float32)
    wrong = rng.random()
    if wrong < 0.04:
        points[rng.integers(9)] = np.nan
    elif wrong < 0.08:
        indices[rng.integers(len(indices))] = int(rng.choice([-1, 99]))
    elif wrong < 0.12:
        indices.pop()
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(indices)
    mesh.CreateSubdivisionSchemeAttr(str(rng.choice(["none", "none", "catmullClark", "bilinear"])))
    if rng.random() < 0.2:
        mesh.CreateOrientationAttr("leftHanded")
    if rng.random() < 0.1:
        mesh.CreateHoleIndicesAttr([0])
    if rng.random() < 0.1:
        mesh.CreateCreaseIndicesAttr(indices[:2])
        mesh.CreateCreaseLengthsAttr([2])
        mesh.CreateCreaseSharpnessesAttr([2.0])
    if rng.random() < 0.2:
        api = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
        api.CreateMaterialBindSubset("some", Vt.IntArray([0, int(rng.integers(3))]), "face")


def _dress(rng: np.random.Generator, mesh: UsdGeom.Mesh) -> None:
    sizes = {"uniform": len(mesh.GetFaceVertexCountsAttr().Get()), "vertex": 9, "varying": 9}
    sizes |= {"constant": 1, "faceVarying": len(mesh.GetFaceVertexIndicesAttr().Get())}

    def values(width: int) -> tuple[str, int, NDArray[np.float32]]:
        interpolation = INTERPOLATIONS[rng.integers(len(INTERPOLATIONS))]
        due = sizes[interpolation]
        length = max(due + int(rng.choice([-1, 0, 0, 0, 0, 0, 0, 2])), 0)
        found = rng.integers(0, 3, (length, width)).astype(np.float32)
        if rng.random() < 0.1 and length:
            found[0] = rng.choice([np.nan, np.inf])
        return interpolation, due, found

    if rng.random() < 0.5:
        interpolation, _, normals = values(3)
        normals -= 1
        normals[:, 2] = rng.choice([1, 1, -2])
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
        mesh.SetNormalsInterpolation(interpolation)
    api = UsdGeom.PrimvarsAPI(mesh)
    for name, type_name, width in (
        ("st", "texCoord2f[]", 2),
        ("map1", "float2[]", 2),
        ("deep", "texCoord3f[]", 3),
        ("displayColor", "color3f[]", 3),
        ("tint", "float3[]", 3),
        ("displayOpacity", "float[]", 1),
        ("normals", "normal3f[]", 3),
    ):
        if rng.random() < 0.75:
            continue
        interpolation, due, found = values(width)
        primvar = api.CreatePrimvar(name, Sdf.ValueTypeNames.Find(type_name), interpolation)
        array = {1: Vt.FloatArray, 2: Vt.Vec2fArray, 3: Vt.Vec3fArray}[width]
        primvar.Set(array.FromNumpy(np.ascontiguousarray(found[:, 0] if width == 1 else found)))
        if rng.random() < 0.3:
            primvar.SetIndices(Vt.IntArray(rng.integers(0, max(len(found), 1), due).tolist()))


def said(scene: Scene) -> list[object]:
    """All that the scene holds, arrays as bytes."""

    def told(value: object) -> object:
        if isinstance(value, np.ndarray):
            return str(value.dtype), value.shape, value.tobytes()
        return {name: told(each) for name, each in value.items()} if isinstance(value, dict) else repr(value)

    meshes = [[told(getattr(mesh, field.name)) for field in fields(mesh)] for mesh in scene.meshes]
    drawables = [[told(getattr(each, field.name)) for field in fields(each)] for each in scene.drawables]
    return [meshes, drawables, repr(scene.materials), scene.unsupported]


def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "told_of", lambda *_: None)
    monkeypatch.setattr(tessellation, "shape_all", lambda _: {})
    monkeypatch.setattr(tessellation, "_refined", lambda _: {})


@pytest.mark.parametrize("complexity", ["low", "medium"])
@pytest.mark.parametrize("seed", range(6))
def test_together_is_as_alone(seed: int, complexity: Complexity, monkeypatch: pytest.MonkeyPatch) -> None:
    stage, options = random_stage(seed), ReadOptions(complexity=complexity)
    together = said(StageReader(stage, options).read(None))
    alone(monkeypatch)
    for found, expected in zip(together, said(StageReader(stage, options).read(None)), strict=True):
        assert found == expected
