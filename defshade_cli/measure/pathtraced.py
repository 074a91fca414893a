"""A Scene's direct lighting by Mitsuba 3, path traced: the ground truth that accumulated samples converge to.

Emitters carry a null BSDF and are hidden: like ours, lights neither show nor block. `volpath` with two segments a path
is direct lighting that sees through null surfaces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import DefshadeError
from defshade_cli.measure.mitsuba_plugins import mi
from defshade_cli.measure.pathtraced_lights import emitter, transform, vector
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Drawable, Mesh
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import Matrix, normalize, transform_points

_ROUNDING = 1e-9  # of a window's width
_CHUNK = 64  # samples that Mitsuba holds in memory at a time


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """radiance: (H, W, 3) times exposure, the mean of two independent halves.

    halves: (2, H, W, 3); half of their difference is the noise of the mean.
    """

    halves: NDArray[np.float32]

    @property
    def radiance(self) -> NDArray[np.float32]:
        """(H, W, 3) scene-linear, the mean of both halves."""
        return self.halves.mean(axis=0)


def path_traced(scene: Scene, plan: Plan, samples: int) -> Reference:
    """Render with `samples` a pixel. Raises DefshadeError for what the conversion does not know."""
    world = mi.load_dict(mitsuba_world(scene, plan, {"type": "volpath", "max_depth": 2, "hide_emitters": True}))
    chunks = max(1, math.ceil(samples / 2 / _CHUNK))
    halves = [_mean(world, range(half * chunks, (half + 1) * chunks)) for half in (0, 1)]
    return Reference(np.stack(halves) * np.float32(plan.exposure))


def _mean(world: Any, seeds: range) -> NDArray[np.float32]:
    total = np.zeros((), np.float64)
    for seed in seeds:
        total = total + np.array(mi.render(world, spp=_CHUNK, seed=seed), np.float64)[..., :3]
    return (total / len(seeds)).astype(np.float32)


def mitsuba_world(scene: Scene, plan: Plan, integrator: dict[str, Any]) -> dict[str, Any]:
    """What Mitsuba's load_dict takes. Raises DefshadeError for what the conversion does not know."""
    world: dict[str, Any] = {"type": "scene", "integrator": integrator, "sensor": _sensor(plan)}
    for number, (material, part) in enumerate(_parts(scene)):
        world[f"part{number}"] = _mesh(f"part{number}", part, material)
    low, high = scene.bounds
    ball = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    return world | {f"light{number}": emitter(light, *ball) for number, light in enumerate(scene.lights)}


def _sensor(plan: Plan) -> dict[str, Any]:
    camera = plan.camera
    left, right, _, _ = camera.window
    if camera.projection != "perspective":
        raise DefshadeError(f"{camera.path}: path tracing takes perspective cameras only")
    film = {"type": "hdrfilm", "width": plan.size[0], "height": plan.size[1], "rfilter": {"type": "box"}}
    return {
        "fov_axis": "x",
        "fov": math.degrees(2.0 * math.atan((right - left) / 2.0)),
        "near_clip": plan.clip[0],
        "far_clip": plan.clip[1],
        "to_world": transform(camera.world_from_camera @ np.diag([-1.0, 1.0, -1.0, 1.0])),
        "film": film | {"component_format": "float32", "pixel_format": "rgb"},
        "sampler": {"type": "multijitter", "sample_count": _CHUNK},
    } | _lens(camera)


def _lens(camera: Camera) -> dict[str, Any]:
    left, right, bottom, top = camera.window
    if camera.f_stop <= 0.0 or camera.focus_distance <= 0.0:
        return {
            "type": "perspective",
            "principal_point_offset_x": -(left + right) / 2.0 / (right - left),
            "principal_point_offset_y": (bottom + top) / 2.0 / (top - bottom),
        }
    if max(abs(left + right), abs(bottom + top)) > _ROUNDING * (right - left):
        raise DefshadeError(f"{camera.path}: path tracing takes no shifted window behind a lens")
    radius = 0.5 * camera.focal_length / camera.f_stop
    return {"type": "thinlens", "aperture_radius": radius, "focus_distance": camera.focus_distance}


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """World-space (V, 3) points and normals, (T, 3) triangles that wind around their outside."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    triangles: NDArray[np.uint32]


def _parts(scene: Scene) -> Iterator[tuple[Material, _Part]]:
    for drawable in scene.drawables:
        for row, world_from_object in enumerate(drawable.world_from_object):
            whole = _placed(scene.meshes[drawable.mesh], world_from_object)
            for subset in drawable.subsets:
                triangles = whole.triangles[subset.first : subset.first + subset.count]
                material = _shown(scene.materials[subset.material], drawable, row)
                yield material, replace(whole, triangles=triangles)


def _placed(mesh: Mesh, world_from_object: Matrix) -> _Part:
    linear = world_from_object[:3, :3]
    mirrored = np.linalg.det(linear) < 0.0
    triangles = mesh.triangles[:, ::-1] if mirrored else mesh.triangles
    normals = normalize(mesh.normals @ np.linalg.inv(linear))
    return _Part(transform_points(world_from_object, mesh.points), normals, triangles)


def _shown(material: Material, drawable: Drawable, row: int) -> Material:
    if material.opacity_threshold > 0.0 or (material.uses_display_opacity and drawable.display_opacity[row] < 1.0):
        raise DefshadeError(f"{material.path}: path tracing takes constant opacity without a threshold only")
    if not material.uses_display_color:
        return material
    return replace(material, diffuse_color=tuple(drawable.display_color[row].tolist()))


def _mesh(name: str, part: _Part, material: Material) -> Any:
    props = mi.Properties()
    props["bsdf"] = mi.load_dict(_bsdf(material))
    mesh = mi.Mesh(name, len(part.points), len(part.triangles), props, has_vertex_normals=True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = part.points.astype(np.float32).ravel()
    parameters["vertex_normals"] = part.normals.astype(np.float32).ravel()
    parameters["faces"] = part.triangles.astype(np.uint32).ravel()
    parameters.update()
    return mesh


def _bsdf(material: Material) -> dict[str, Any]:
    base, metallic = np.array(material.diffuse_color), material.metallic
    if material.use_specular_workflow:
        metallic, f0, f90 = 0.0, np.array(material.specular_color), np.ones(3)
    else:
        f90 = 1.0 + (base - 1.0) * metallic
        dielectric = ((1.0 - material.ior) / (1.0 + material.ior)) ** 2 * f90
        f0 = dielectric + (f90 - dielectric) * metallic
    scalars = ("roughness", "clearcoat", "clearcoat_roughness", "opacity")
    return {
        "type": "preview_surface",
        "base": vector(base),
        "f0": vector(f0),
        "f90": vector(f90),
        "metallic": float(metallic),
        "is_transparent": material.is_transparent,
    } | {name: float(getattr(material, name)) for name in scalars}
