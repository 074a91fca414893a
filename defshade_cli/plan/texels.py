"""How large textures are seen: those whose texels would be smaller than pixels everywhere are reduced as they are read.

Where a mesh is nearest to the eye, and as it may lie there, a unit of texture coordinates is so many pixels long; an
image with as many texels a side has one a pixel. Twice that is kept, in a power of two, so that what is read stays the
same over most moves of a camera, and what is seen are mip levels that the whole image has too.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from weakref import WeakKeyDictionary

import numpy as np

from defshade_cli.scene.geometry import Drawable, Mesh, world_boxes
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import Texture, TextureInput
from defshade_cli.scene.view import View

_MARGIN = 2.0
_QUANTILE = 0.99
"""Of a mesh's area that must be served; a few triangles may be stretched beyond all measure."""
_MOST_TRIANGLES = 4096
"""Of a mesh that are looked at."""

_STRETCHES: WeakKeyDictionary[Mesh, dict[str, float]] = WeakKeyDictionary()


def seen_texels(scene: Scene, view: View) -> Mapping[Texture, float]:
    """Texels a side that each texture is worth in the picture; infinite where nothing tells."""
    needed: dict[Texture, float] = defaultdict(float)
    for drawable in scene.drawables:
        inputs = list(_inputs(scene, drawable))
        if not inputs:
            continue
        pixels = _pixels_per_unit(scene.meshes[drawable.mesh], drawable, view)
        for texture_input in inputs:
            stretch = _stretch(scene.meshes[drawable.mesh], texture_input.uv)
            texels = stretch * pixels / math.sqrt(_area(texture_input) or math.inf) if stretch else math.inf
            needed[texture_input.texture] = max(needed[texture_input.texture], texels)
    return {texture: _power_of_two(_MARGIN * texels) for texture, texels in needed.items()}


def _inputs(scene: Scene, drawable: Drawable) -> Iterator[TextureInput]:
    for number in dict.fromkeys(subset.material for subset in drawable.subsets):
        yield from scene.materials[number].inputs.values()


def _pixels_per_unit(mesh: Mesh, drawable: Drawable, view: View) -> float:
    """How large an object-space unit may appear in the nearest of the drawable's instances."""
    scale = np.linalg.norm(drawable.world_from_object[:, :3, :3], axis=1).max(axis=1)
    density = view.pixels_per_unit(world_boxes(mesh.bounds, drawable.world_from_object))
    return float(np.max(scale * density, initial=0.0))


def _stretch(mesh: Mesh, uv: str) -> float:
    """Object-space units a unit of texture coordinates, of the widest part; 0 where there are no coordinates."""
    known = _STRETCHES.setdefault(mesh, {})
    if uv not in known:
        known[uv] = _measured(mesh, uv) if uv in mesh.uvs and len(mesh.triangles) else 0.0
    return known[uv]


def _measured(mesh: Mesh, uv: str) -> float:
    triangles = mesh.triangles[:: -(-len(mesh.triangles) // _MOST_TRIANGLES)]
    corners, at = mesh.points[triangles].astype(np.float64), mesh.uvs[uv][triangles].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    (a, b), (c, d) = (at[:, 1] - at[:, 0]).T, (at[:, 2] - at[:, 0]).T
    with np.errstate(divide="ignore", invalid="ignore"):
        stretch = np.sqrt(area / np.abs(a * d - b * c))
    order = np.argsort(stretch)
    share = np.cumsum(area[order])
    if not share[-1] > 0.0:
        return 0.0
    return float(stretch[order[np.searchsorted(share, _QUANTILE * share[-1]).clip(max=len(order) - 1)]])


def _area(texture_input: TextureInput) -> float:
    """How much larger texture_from_uv makes an area; the image is seen that much smaller."""
    (a, b, _), (c, d, _) = texture_input.texture_from_uv
    return abs(a * d - b * c)


def _power_of_two(texels: float) -> float:
    return 2.0 ** math.ceil(math.log2(max(texels, 1.0))) if math.isfinite(texels) else math.inf
