"""What it costs to read a stage: microseconds a prim, and how many of them are its triangles.

    python benchmarks/reading.py [STAGE...]

Without arguments, stages are generated in memory. Each is read ROUNDS times; the least processor time counts, since
other work on the machine only adds. A triangle takes what it does in large meshes; what is left is the prim itself.
"""

from __future__ import annotations

import argparse
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from defshade_cli.usd.reader import StageReader

ROUNDS = 5


def cubes(count: int) -> Usd.Stage:
    """Implicit cubes of one size, each a prim of its own."""
    stage = Usd.Stage.CreateInMemory()
    for number in range(count):
        _place(UsdGeom.Cube.Define(stage, _path(number)), number)
    return stage


def meshes(count: int, side: int, distinct: bool = True, rewired: bool = False) -> Usd.Stage:
    """Grids of `side` x `side` quads, of which no two are equal where they are `distinct`.

    rewired: faces are in any order, and begin at any of their corners.
    """
    stage = Usd.Stage.CreateInMemory()
    rng = np.random.default_rng(0)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    quads = np.stack([corner, corner + 1, corner + side + 2, corner + side + 1], axis=1).astype(np.int32)
    x, y = np.meshgrid(np.arange(side + 1), np.arange(side + 1))
    for number in range(count):
        mesh = UsdGeom.Mesh.Define(stage, _path(number))
        height = rng.random(x.size) if distinct else np.zeros(x.size)
        points = np.stack([x.ravel(), y.ravel(), height], axis=1).astype(np.float32)
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(side * side, 4, np.int32)))
        turned = (np.arange(4) + rng.integers(4, size=(len(quads), 1))) % 4
        faces = np.take_along_axis(rng.permutation(quads), turned, axis=1) if rewired else quads
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel()))
        mesh.CreateSubdivisionSchemeAttr("none")
        _place(mesh, number)
    return stage


def surfaces(count: int, rewired: bool = False) -> Usd.Stage:
    """Meshes as above without a subdivisionScheme, which are refined as often as the picture needs."""
    stage = meshes(count, 2, rewired=rewired)
    for prim in _meshes_of(stage):
        prim.RemoveProperty("subdivisionScheme")
    return stage


def dressed(count: int) -> Usd.Stage:
    """The same with normals, texture coordinates and a material, as they are exported."""
    stage = meshes(count, 2)
    rng = np.random.default_rng(1)
    material = _material(stage, "/Looks/Grey")
    for prim in _meshes_of(stage):
        mesh = UsdGeom.Mesh(prim)
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.tile(np.float32([0, 0, 1]), (9, 1))))
        uvs = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
        uvs.Set(Vt.Vec2fArray.FromNumpy(rng.random((16, 2), np.float32)))
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)
    return stage


def inheriting(count: int) -> Usd.Stage:
    """Dressed meshes below a prim that has a colour for them."""
    stage = dressed(count)
    world = UsdGeom.Xform.Define(stage, "/World")
    color = UsdGeom.PrimvarsAPI(world).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "constant")
    color.Set([Gf.Vec3f(1, 0, 0)])
    return stage


def divided(count: int) -> Usd.Stage:
    """Dressed meshes in two subsets each, which are prims too, of a material of their own."""
    stage = dressed(count)
    materials = [_material(stage, f"/Looks/Part_{number}") for number in range(2)]
    for prim in _meshes_of(stage):
        for number, material in enumerate(materials):
            part = UsdShade.MaterialBindingAPI(prim).CreateMaterialBindSubset(
                f"part_{number}", [2 * number, 2 * number + 1], "face"
            )
            UsdShade.MaterialBindingAPI.Apply(part.GetPrim()).Bind(material)
    return stage


def with_hexagons(count: int) -> Usd.Stage:
    """Dressed meshes of which two faces are one."""
    stage = dressed(count)
    for prim in _meshes_of(stage):
        mesh = UsdGeom.Mesh(prim)
        mesh.GetFaceVertexCountsAttr().Set([6, 4, 4])
        mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 5, 4, 3, 3, 4, 7, 6, 4, 5, 8, 7])
        uvs = prim.GetAttribute("primvars:st")
        uvs.Set(Vt.Vec2fArray.FromNumpy(np.array(uvs.Get())[:14]))
    return stage


def holed(count: int) -> Usd.Stage:
    """Dressed meshes of which a face is a hole."""
    stage = dressed(count)
    for number, prim in enumerate(_meshes_of(stage)):
        UsdGeom.Mesh(prim).CreateHoleIndicesAttr([number % 4])
    return stage


def in_doubles(count: int) -> Usd.Stage:
    """Dressed meshes whose texture coordinates are doubles."""
    stage = dressed(count)
    for prim in _meshes_of(stage):
        values = np.asarray(prim.GetAttribute("primvars:st").Get(), np.float64)
        prim.RemoveProperty("primvars:st")
        uvs = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2dArray, "faceVarying")
        uvs.Set(Vt.Vec2dArray.FromNumpy(values))
    return stage


def broken(count: int) -> Usd.Stage:
    """Dressed meshes with a corner at a point that they do not have."""
    stage = dressed(count)
    for number, prim in enumerate(_meshes_of(stage)):
        attribute = UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr()
        indices = np.array(attribute.Get())
        indices[number % 16] = 99
        attribute.Set(Vt.IntArray.FromNumpy(indices))
    return stage


Stages = dict[str, Callable[[], Usd.Stage]]

SMALL, LARGE = "7,000 meshes of 8 triangles", "400 meshes of 2,592 triangles"

GENERATED: Stages = {
    SMALL: lambda: meshes(7000, 2),
    LARGE: lambda: meshes(400, 36),
    "7,000 cubes": lambda: cubes(7000),
    "7,000 equal meshes of 8 triangles": lambda: meshes(7000, 2, distinct=False),
    "7,000 of 8, wired differently": lambda: meshes(7000, 2, rewired=True),
    "2,000 of 8, dressed": lambda: dressed(2000),
    "2,000 of them that inherit a colour": lambda: inheriting(2000),
    "2,000 in two subsets each": lambda: divided(2000),
    "2,000 with a hexagon": lambda: with_hexagons(2000),
    "2,000 with holes": lambda: holed(2000),
    "2,000 with coordinates in doubles": lambda: in_doubles(2000),
    "2,000 with a broken face": lambda: broken(2000),
    "2,000 subdivision surfaces": lambda: surfaces(2000),
    "2,000 of them, wired differently": lambda: surfaces(2000, rewired=True),
}


class Cost(NamedTuple):
    """Least seconds of a first read, prims, and triangles as drawn."""

    seconds: float
    prims: int
    triangles: int


def measure(stage: Usd.Stage) -> Cost:
    """What a first read takes."""
    seconds = []
    for _ in range(ROUNDS):
        reader = StageReader(stage)
        start = time.process_time()
        scene = reader.read(None)
        seconds.append(time.process_time() - start)
    prims = sum(1 for _ in stage.TraverseAll())
    return Cost(min(seconds), prims, scene.triangle_count)


def seconds_a_triangle(small: Cost, large: Cost) -> float:
    """By what large meshes take more than small ones, which are otherwise alike."""
    more = large.seconds / large.prims - small.seconds / small.prims
    return more / (large.triangles / large.prims - small.triangles / small.prims)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stages", nargs="*", type=Path)
    paths = parser.parse_args().stages
    logging.disable()
    known = {name: measure(GENERATED[name]()) for name in (SMALL, LARGE)}
    a_triangle = seconds_a_triangle(known[SMALL], known[LARGE])
    own: Stages = {path.name: lambda path=path: Usd.Stage.Open(str(path)) for path in paths}
    print(f"us a triangle: {1e6 * a_triangle:.2f}\n")
    print(f"{'stage':36}{'seconds':>9}{'us a prim':>11}{'= prim':>9}{'+ triangles':>13}")
    for name, make in (own or GENERATED).items():
        seconds, prims, triangles = known.get(name) or measure(make())
        whole, drawn = seconds / prims, a_triangle * triangles / prims
        print(f"{name:36}{seconds:9.3f}{1e6 * whole:11.1f}{1e6 * (whole - drawn):9.1f}{1e6 * drawn:13.1f}")


def _meshes_of(stage: Usd.Stage) -> list[Usd.Prim]:
    return [prim for prim in stage.TraverseAll() if prim.IsA(UsdGeom.Mesh)]


def _material(stage: Usd.Stage, path: str) -> UsdShade.Material:
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def _path(number: int) -> str:
    return f"/World/group_{number // 100}/prim_{number}"


def _place(prim: UsdGeom.Xformable, number: int) -> None:
    prim.AddTranslateOp().Set(Gf.Vec3d(number % 100 * 3, number // 100 * 3, 0))


if __name__ == "__main__":
    main()
