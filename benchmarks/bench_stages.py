"""The stages that run times are stated for, generated.

    python benchmarks/bench_stages.py FOLDER [NAME...]

simple      25 spheres of 4k triangles, metallic x roughness, on a plane; 1 distant, 4 sphere lights and 1 cone
manylights  the same under 256 sphere lights
heavy       1 million triangles in 400 meshes, 9 lights
instanced   100,000 instances of 4 meshes
textured    64 squares, each with a 4K texture of its own
animated    simple over 100 frames in which one prim moves

No two meshes are equal, for usdc stores equal arrays once and we draw equal meshes as instances.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

FRAMES = 100


def simple(stage: Usd.Stage) -> None:
    _spheres(stage, 5, 45)
    _plane(stage, 20.0)
    _distant_light(stage)
    for number, (x, z) in enumerate([(-4, -4), (4, -4), (-4, 4), (4, 4)]):
        _sphere_light(stage, f"bulb_{number}", (x, 4, z), 0.3, 60.0)
    shaping = UsdLux.ShapingAPI.Apply(_sphere_light(stage, "spot", (0, 7, 4), 0.2, 800.0).GetPrim())
    shaping.CreateShapingConeAngleAttr(25.0)
    shaping.CreateShapingConeSoftnessAttr(0.3)


def manylights(stage: Usd.Stage) -> None:
    _spheres(stage, 5, 45)
    _plane(stage, 20.0)
    rng = np.random.default_rng(1)
    for number, (x, z) in enumerate(np.ndindex(16, 16)):
        position = (0.9 * (x - 7.5), 1.2 + rng.random(), 0.9 * (z - 7.5))
        light = _sphere_light(stage, f"bulb_{number}", position, 0.05, 20.0)
        light.CreateColorAttr(Gf.Vec3f(*(0.3 + 0.7 * rng.random(3))))


def heavy(stage: Usd.Stage) -> None:
    """400 meshes of 2,500 triangles."""
    _spheres(stage, 20, 36, spacing=0.5)
    _plane(stage, 20.0)
    _distant_light(stage)
    for number in range(8):
        x, z = 4 * np.cos(number * np.pi / 4), 4 * np.sin(number * np.pi / 4)
        _sphere_light(stage, f"bulb_{number}", (x, 4, z), 0.3, 40.0)


def instanced(stage: Usd.Stage) -> None:
    rng = np.random.default_rng(2)
    side = 317
    x, z = np.meshgrid(np.arange(side), np.arange(side))
    places = np.column_stack([x.ravel(), np.zeros(side * side), z.ravel()])[:100_000] * 0.05 - np.array([7.9, 0, 7.9])
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/crowd")
    for number in range(4):
        path = f"/World/crowd/kind_{number}"
        _mesh(stage, path, *_ball(8, 0.02 + 0.005 * number, number))
        _bind(stage, path, (0.8, 0.2 * number, 0.3), 0.0, 0.4)
        instancer.CreatePrototypesRel().AddTarget(path)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places.astype(np.float32)))
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(rng.integers(0, 4, len(places), dtype=np.int32)))
    _distant_light(stage)


def textured(stage: Usd.Stage) -> None:
    folder = Path(stage.GetRootLayer().realPath).parent
    for number, (row, column) in enumerate(np.ndindex(8, 8)):
        path = f"/World/card_{number}"
        points = np.array([[-0.45, 0, -0.45], [-0.45, 0, 0.45], [0.45, 0, 0.45], [0.45, 0, -0.45]])
        mesh = _mesh(stage, path, points + np.array([column - 3.5, 0, row - 3.5]), np.array([[0, 1, 2, 3]]))
        primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
        primvar.Set([(0, 1), (0, 0), (1, 0), (1, 1)])
        _write_texture(folder / f"texture_{number:02}.png", number)
        _bind(stage, path, (1.0, 1.0, 1.0), 0.0, 0.5, f"./texture_{number:02}.png")
    _distant_light(stage)


def animated(stage: Usd.Stage) -> None:
    simple(stage)
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(FRAMES)
    move = UsdGeom.Xformable(stage.GetPrimAtPath("/World/ball_12")).AddTranslateOp()
    for frame in range(1, FRAMES + 1):
        move.Set(Gf.Vec3d(0, 1 + np.sin(frame * 2 * np.pi / FRAMES), 0), frame)


GENERATED: dict[str, Callable[[Usd.Stage], None]] = {
    each.__name__: each for each in (simple, manylights, heavy, instanced, textured, animated)
}


def generate(folder: Path, name: str) -> Path:
    """The stage `name` in `folder`, written where it is not there yet."""
    path = folder / name / f"{name}.usdc"
    if path.exists():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    _camera(stage)
    GENERATED[name](stage)
    stage.GetRootLayer().Save()
    return path


def _spheres(stage: Usd.Stage, side: int, rings: int, spacing: float = 2.0) -> None:
    """side² spheres; metallic goes by the row, roughness by the column."""
    radius = 0.42 * spacing
    for number, (row, column) in enumerate(np.ndindex(side, side)):
        path = f"/World/ball_{number}"
        points, faces = _ball(rings, radius, number)
        where = np.array([column - (side - 1) / 2, 0.0, row - (side - 1) / 2]) * spacing + np.array([0, radius, 0])
        _mesh(stage, path, points + where, faces)
        _bind(stage, path, (0.8, 0.5, 0.3), row / (side - 1), 0.1 + 0.8 * column / (side - 1))


def _ball(rings: int, radius: float, seed: int) -> tuple[NDArray, NDArray]:
    """(V, 3) points, (F, 4) quads: `rings` by `rings`, so 2 rings² triangles; dented a little, each in its own way."""
    theta, phi = np.meshgrid(np.linspace(1e-3, np.pi - 1e-3, rings + 1), np.linspace(0, 2 * np.pi, rings + 1))
    unit = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)
    dent = 1.0 + 1e-3 * np.sin(3.0 * theta + seed)
    corner = (np.arange(rings)[:, None] * (rings + 1) + np.arange(rings)).ravel()
    quads = np.stack([corner, corner + rings + 1, corner + rings + 2, corner + 1], axis=1)
    return (unit * dent[..., None] * radius).reshape(-1, 3), quads


def _plane(stage: Usd.Stage, half: float) -> None:
    points = np.array([[-half, 0, -half], [-half, 0, half], [half, 0, half], [half, 0, -half]])
    _mesh(stage, "/World/plane", points, np.array([[0, 1, 2, 3]]))
    _bind(stage, "/World/plane", (0.5, 0.5, 0.5), 0.0, 0.6)


def _mesh(stage: Usd.Stage, path: str, points: NDArray, faces: NDArray) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), faces.shape[1], np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr("none")
    if len(points) > 4:
        centre = (points.max(axis=0) + points.min(axis=0)) / 2
        normals = (points - centre) / np.linalg.norm(points - centre, axis=1, keepdims=True)
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals.astype(np.float32)))
        mesh.SetNormalsInterpolation("vertex")
    return mesh


def _bind(
    stage: Usd.Stage, path: str, color: tuple[float, ...], metallic: float, roughness: float, texture: str = ""
) -> None:
    """A material of its own, with the image as its diffuse colour where there is one."""
    material = UsdShade.Material.Define(stage, f"/Looks/{Sdf.Path(path).name}")
    shader = UsdShade.Shader.Define(stage, material.GetPath().AppendChild("surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    diffuse = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    diffuse.Set(Gf.Vec3f(*color))
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(float(metallic))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(float(roughness))
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    if texture:
        diffuse.ConnectToSource(_image(stage, material, texture).ConnectableAPI(), "rgb")
    prim = stage.GetPrimAtPath(path)
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def _image(stage: Usd.Stage, material: UsdShade.Material, file: str) -> UsdShade.Shader:
    reader = UsdShade.Shader.Define(stage, material.GetPath().AppendChild("st"))
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    image = UsdShade.Shader.Define(stage, material.GetPath().AppendChild("image"))
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    return image


def _write_texture(path: Path, seed: int) -> None:
    """4096 x 4096 pixels of stripes that no other texture has."""
    import OpenImageIO as oiio

    x, y = np.meshgrid(np.arange(4096, dtype=np.uint16), np.arange(4096, dtype=np.uint16))
    pixels = np.stack([(x * (seed + 1)) >> 6, (y * (seed + 3)) >> 5, x ^ y], axis=-1).astype(np.uint8)
    image = oiio.ImageBuf(pixels)
    image.specmod().attribute("png:compressionLevel", 1)
    image.write(str(path))


def _camera(stage: Usd.Stage) -> None:
    camera = UsdGeom.Camera.Define(stage, "/World/camera")
    view = Gf.Matrix4d().SetLookAt(Gf.Vec3d(0, 9, 13), Gf.Vec3d(0, 0, 0), Gf.Vec3d(0, 1, 0))
    camera.AddTransformOp().Set(view.GetInverse())
    camera.CreateFocalLengthAttr(35.0)
    camera.CreateHorizontalApertureAttr(36.0)
    camera.CreateVerticalApertureAttr(20.25)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.1, 1000.0))


def _distant_light(stage: Usd.Stage) -> None:
    light = UsdLux.DistantLight.Define(stage, "/World/sun")
    light.CreateIntensityAttr(1.0)
    light.CreateNormalizeAttr(True)
    light.CreateAngleAttr(0.5)
    light.AddRotateXYZOp().Set(Gf.Vec3f(-50, 30, 0))


def _sphere_light(
    stage: Usd.Stage, name: str, position: tuple[float, ...], radius: float, intensity: float
) -> UsdLux.SphereLight:
    light = UsdLux.SphereLight.Define(stage, f"/World/{name}")
    light.CreateRadiusAttr(radius)
    light.CreateNormalizeAttr(False)
    light.CreateIntensityAttr(float(intensity))
    light.AddTranslateOp().Set(Gf.Vec3d(*map(float, position)))
    return light


if __name__ == "__main__":
    for chosen in sys.argv[2:] or GENERATED:
        print(generate(Path(sys.argv[1]), chosen))
