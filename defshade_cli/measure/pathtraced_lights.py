"""A Scene's lights as Mitsuba's emitters.

All but meshes, which are geometry, are surfaces that let light pass. A distant light of some angle is a disk far away.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.errors import DefshadeError
from defshade_cli.image.environment import sky_of
from defshade_cli.image.light_texture import with_texture
from defshade_cli.measure.mitsuba_plugins import mi
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, DomeLight, Light, RectLight, SphereLight
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.spaces import Matrix, normalize, rigid, transform_points

_FAR = 1e4  # distance of a distant light's disk over the scene's radius
_HAIR = 1e-4  # between a mesh light and the surface that it is, over the scene's radius
_TURNED = np.diag([1.0, -1.0, -1.0, 1.0])  # Mitsuba's flat shapes face +Z, USD's lights −Z
_FINER = 4  # than a sky's own are the pixels that Mitsuba interpolates: its rows reach from pole to pole


def emitter(light: Light, centre: NDArray[np.float64], radius: float) -> Any:
    """What mi.load_dict takes; centre (3,), radius: of the scene. Raises DefshadeError for what it does not know."""
    match light:
        case DistantLight():
            return _distant(light, centre, radius)
        case DomeLight():
            return _sky(light)
        case MeshLight():
            return _glowing_mesh(light, radius)
    if light.size_factor == 0.0 or (isinstance(light, SphereLight) and light.treat_as_point):
        if light.shaping or light.profile != "uniform":
            raise DefshadeError(f"{light.path}: path tracing takes no shaped light without a size")
        return {"type": "point", "position": light.position.tolist(), "intensity": rgb(light.intensity_on_axis)}
    return _shape(light) | {"bsdf": {"type": "null"}, "emitter": _area(light)}


def _distant(light: DistantLight, centre: NDArray[np.float64], radius: float) -> dict[str, Any]:
    half = math.radians(light.angle) / 2.0
    if half == 0.0:
        return {"type": "directional", "direction": light.axis.tolist(), "irradiance": rgb(light.irradiance)}
    if half > math.radians(80.0):
        raise DefshadeError(f"{light.path}: path tracing takes distant lights up to 160 degrees")
    frame = light.world_from_light.copy()
    frame[:3, :3] /= np.linalg.norm(frame[:3, :3], axis=0)
    frame[:3, 3] = centre - light.axis * (_FAR * radius)
    spread = _FAR * radius * math.tan(half)
    to_world = transform(frame @ _TURNED @ np.diag([spread, spread, 1.0, 1.0]))
    emitter = {"type": "area", "radiance": rgb(light.radiance)}
    return {"type": "disk", "to_world": to_world, "bsdf": {"type": "null"}, "emitter": emitter}


def _sky(light: DomeLight) -> dict[str, Any]:
    texels = (_refined(sky_of(light).radiance) * light.emission).astype(np.float32)
    frame = transform(rigid(light.world_from_light))
    return {"type": "envmap", "bitmap": mi.Bitmap(texels), "to_world": frame, "scale": 1.0}


def _refined(sky: NDArray[np.float32]) -> NDArray[np.float32]:
    """Between its pixels' centres, at Mitsuba's rows and columns."""
    height, width = sky.shape[:2]
    rows = np.clip(np.linspace(0.0, height, _FINER * height) - 0.5, 0.0, height - 1.0)
    columns = (np.arange(_FINER * width) + 0.5) / _FINER - 0.5
    top, left = np.floor(rows).astype(int), np.floor(columns).astype(int)
    down, right = (rows - top)[:, None, None], (columns - left)[:, None]
    across = sky[:, left % width] * (1.0 - right) + sky[:, (left + 1) % width] * right
    return across[top] * (1.0 - down) + across[np.minimum(top + 1, height - 1)] * down


def _glowing_mesh(light: MeshLight, radius: float) -> Any:
    """A surface that lets light pass a hair before the one that is drawn: rays towards both would hit either."""
    if light.shaping or np.ptp(light.tints, axis=0).any():
        raise DefshadeError(f"{light.path}: path tracing takes even mesh lights without shaping only")
    corners = transform_points(light.world_from_light, light.corners.reshape(-1, 3)).reshape(-1, 3, 3)
    a, b, c = corners.transpose(1, 0, 2)
    points = (corners + normalize(np.cross(b - a, c - a))[:, None] * (_HAIR * radius)).reshape(-1, 3)
    props = mi.Properties()
    props["bsdf"] = mi.load_dict({"type": "null"})
    props["emitter"] = mi.load_dict({"type": "area", "radiance": rgb(light.radiance)})
    mesh = mi.Mesh("glow", len(points), len(light.corners), props)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = points.astype(np.float32).ravel()
    parameters["faces"] = np.arange(len(points), dtype=np.uint32)
    parameters.update()
    return mesh


def _shape(light: Light) -> dict[str, Any]:
    """The light's surface; spheres and cylinders must not be stretched."""
    match light:
        case SphereLight(radius=r):
            return {"type": "sphere", "center": light.position.tolist(), "radius": r * _scale(light)}
        case CylinderLight(radius=r, length=length):
            ends = transform_points(light.world_from_light, np.array([[-length / 2, 0, 0], [length / 2, 0, 0]]))
            return {"type": "cylinder", "p0": ends[0].tolist(), "p1": ends[1].tolist(), "radius": r * _scale(light)}
        case DiskLight(radius=r):
            kind, sides = "disk", (r, r)
        case RectLight(width=width, height=height):
            kind, sides = "rectangle", (width / 2, height / 2)
        case _:
            raise DefshadeError(f"{light.path}: path tracing knows no {light.kind} light")
    return {"type": kind, "to_world": transform(light.world_from_light @ _TURNED @ np.diag([*sides, 1.0, 1.0]))}


def _scale(light: Light) -> float:
    scales = np.linalg.norm(light.world_from_light[:3, :3], axis=0)
    if np.ptp(scales) > 1e-4 * scales.max():
        raise DefshadeError(f"{light.path}: path tracing takes no stretched {light.kind} light")
    return float(scales.mean())


def _area(light: Light) -> dict[str, Any]:
    if isinstance(light, RectLight) and light.texture:
        return {"type": "area", "radiance": _shown(light)}
    if light.shaping is None:
        return {"type": "area", "radiance": rgb(light.radiance)}
    shaping, outer = light.shaping, math.radians(light.shaping.cone_angle)
    return {
        "type": "shaped_area",
        "radiance": vector(light.radiance),
        "axis": vector(light.axis),
        "cone_angle": outer,
        "cone_smooth_start": outer * (1.0 - min(max(shaping.cone_softness, 0.0), 1.0)),
        "focus": max(shaping.focus, 0.0),
        "focus_tint": vector(np.array(shaping.focus_tint)),
    }


def _shown(light: RectLight) -> dict[str, Any]:
    """The image on the light's face, its top left at (+X, +Y): seen by what it lights, and so mirrored on the shape."""
    lit = with_texture(light)
    assert isinstance(lit, RectLight)
    if light.shaping or lit.radiance_map is None:
        raise DefshadeError(f"{light.path}: path tracing takes images on lights without shaping only")
    shown = lit.radiance_map
    scale = np.divide(lit.radiance, shown.mean, out=np.zeros(3), where=shown.mean > 0)
    texels = np.ascontiguousarray(shown.radiance[:, ::-1] * scale, np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True, "filter_type": "nearest", "wrap_mode": "clamp"}


def rgb(color: NDArray[np.float64]) -> dict[str, Any]:
    """A colour (3,) as Mitsuba's dictionaries have it."""
    return {"type": "rgb", "value": color.tolist()}


def vector(values: NDArray[np.float64]) -> Any:
    """A vector (3,) of Mitsuba's."""
    return mi.ScalarVector3f(*values.tolist())


def transform(matrix: Matrix) -> Any:
    """A matrix (4, 4) of Mitsuba's."""
    return mi.ScalarTransform4f(matrix)
