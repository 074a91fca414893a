"""What it costs to read a stage: microseconds a prim and microseconds a triangle.

    python benchmarks/reading.py [STAGE...]

Without arguments, stages are generated in memory. Each is read ROUNDS times; the least processor time counts, since
other work on the machine only adds.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

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


def surfaces(count: int) -> Usd.Stage:
    """Meshes as above without a subdivisionScheme, which are refined as often as the picture needs."""
    stage = meshes(count, 2)
    for prim in stage.TraverseAll():
        prim.RemoveProperty("subdivisionScheme")
    return stage


def dressed(count: int) -> Usd.Stage:
    """The same with normals, texture coordinates and a material, as they are exported."""
    stage = meshes(count, 2)
    rng = np.random.default_rng(1)
    material = UsdShade.Material.Define(stage, "/Looks/Grey")
    shader = UsdShade.Shader.Define(stage, "/Looks/Grey/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    for prim in [prim for prim in stage.TraverseAll() if prim.IsA(UsdGeom.Mesh)]:
        mesh = UsdGeom.Mesh(prim)
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.tile(np.float32([0, 0, 1]), (9, 1))))
        uvs = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
        uvs.Set(Vt.Vec2fArray.FromNumpy(rng.random((16, 2), np.float32)))
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)
    return stage


GENERATED: dict[str, Callable[[], Usd.Stage]] = {
    "7,000 cubes": lambda: cubes(7000),
    "7,000 equal meshes of 8 triangles": lambda: meshes(7000, 2, distinct=False),
    "7,000 meshes of 8 triangles": lambda: meshes(7000, 2),
    "7,000 of 8, wired differently": lambda: meshes(7000, 2, rewired=True),
    "2,000 of 8, dressed": lambda: dressed(2000),
    "2,000 subdivision surfaces": lambda: surfaces(2000),
    "400 meshes of 2,592 triangles": lambda: meshes(400, 36),
}


def measure(stage: Usd.Stage) -> tuple[float, int, int]:
    """(least seconds of a first read, prims, triangles authored)."""
    seconds = []
    for _ in range(ROUNDS):
        reader = StageReader(stage)
        start = time.process_time()
        scene = reader.read(None)
        seconds.append(time.process_time() - start)
    prims = sum(1 for _ in stage.TraverseAll())
    return min(seconds), prims, scene.triangle_count


def main(paths: list[str]) -> None:
    stages = {Path(path).name: lambda path=path: Usd.Stage.Open(path) for path in paths} or GENERATED
    print(f"{'stage':36}{'seconds':>9}{'us a prim':>11}{'us a triangle':>15}")
    for name, make in stages.items():
        seconds, prims, triangles = measure(make())
        print(f"{name:36}{seconds:9.3f}{1e6 * seconds / prims:11.1f}{1e6 * seconds / max(triangles, 1):15.2f}")


def _path(number: int) -> str:
    return f"/World/group_{number // 100}/prim_{number}"


def _place(prim: UsdGeom.Xformable, number: int) -> None:
    prim.AddTranslateOp().Set(Gf.Vec3d(number % 100 * 3, number // 100 * 3, 0))


if __name__ == "__main__":
    main(sys.argv[1:])
