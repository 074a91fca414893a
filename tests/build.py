"""Small scenes in NumPy, for tests that need no stage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Drawable, Mesh, Subset
from defshade_cli.scene.light import DistantLight, Light, SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shaping import Shaping
from defshade_cli.spaces import Matrix, translation

GREY = Material("/grey", diffuse_color=(0.5, 0.5, 0.5))


def at(*position: float) -> Matrix:
    """Unrotated, at `position`: a light there emits along −Z."""
    return translation(np.array(position))


def quad(half: float = 1.0, z: float = 0.0) -> Mesh:
    """A square around the origin that faces +Z."""
    points = [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]
    return Mesh("/quad", points, [[0, 0, 1]] * 4, [[0, 1, 2], [0, 2, 3]], [0, 0])


def sphere(radius: float = 1.0, rings: int = 32) -> Mesh:
    """A latitude-longitude sphere with analytic normals."""
    theta, phi = np.linspace(0, math.pi, rings + 1), np.linspace(0, 2 * math.pi, 2 * rings + 1)
    t, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    normals = np.column_stack([np.sin(t) * np.sin(p), np.cos(t), np.sin(t) * np.cos(p)])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij"))
    a = i * (2 * rings + 1) + j
    b = a + 2 * rings + 1
    triangles = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    return Mesh("/sphere", radius * normals, normals, triangles, np.zeros(len(triangles)))


def drawable(mesh: Mesh, index: int = 0, material: int = 0, where: Sequence[Matrix] | None = None) -> Drawable:
    """All of a mesh with one material, placed at each matrix."""
    matrices = np.array(where if where is not None else [np.eye(4)])
    count = len(matrices)
    return Drawable(
        index,
        matrices,
        (Subset(material, 0, len(mesh.triangles)),),
        (mesh.path,),
        np.arange(count, dtype=np.int32),
        np.full((count, 3), 0.18, np.float32),
        np.ones(count, np.float32),
    )


def camera(z: float = 5.0, half: float = 0.5, **options: object) -> Camera:
    """On the +Z axis, looking at the origin; `half` is the tangent of half the view angle."""
    options.setdefault("clipping_range", (0.1, 100.0))
    return Camera("/camera", at(0, 0, z), (-half, half, -half, half), **options)  # type: ignore[arg-type]


def sun(strength: float = math.pi) -> DistantLight:
    """Along −Z; π makes a white Lambertian surface that faces it read 1."""
    return DistantLight(path="/sun", world_from_light=np.eye(4), color=(1, 1, 1), intensity=strength, angle=0.0)


def bulb(*position: float, intensity: float = 10.0, cone: float | None = None, softness: float = 0.0) -> SphereLight:
    """A sphere light, or a cone light with an angle."""
    shaping = None if cone is None else Shaping(cone_angle=cone, cone_softness=softness)
    options = {"path": "/bulb", "world_from_light": at(*position), "color": (1, 1, 1), "intensity": intensity}
    return SphereLight(**options, shaping=shaping)


def scene(
    meshes: Sequence[Mesh],
    lights: Sequence[Light] = (),
    materials: Sequence[Material] = (GREY,),
    view: Camera | None = None,
    drawables: Sequence[Drawable] | None = None,
) -> Scene:
    """Each mesh placed once with the first material, unless `drawables` says otherwise."""
    placed = drawables if drawables is not None else [drawable(mesh, i) for i, mesh in enumerate(meshes)]
    return Scene("test", tuple(meshes), tuple(placed), tuple(materials), tuple(lights), view or camera())


def rotated(axis: str, degrees: float) -> Matrix:
    """Rotation about a named axis."""
    angle = math.radians(degrees)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(4)
    matrix[[i, j], [i, j]] = math.cos(angle)
    matrix[i, j], matrix[j, i] = -math.sin(angle), math.sin(angle)
    return matrix


def beauty(film_layers: dict[str, NDArray[np.float32]]) -> NDArray[np.float64]:
    """(height, width, 3) without alpha."""
    return film_layers["beauty"][..., :3].astype(np.float64)
