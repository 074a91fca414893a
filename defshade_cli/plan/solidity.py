"""Opacity from images that are 1 wherever a surface reads them, as exporters connect them.

Where the triangles of a mesh lie in an image, each by the box around its texture coordinates, no texel may be below 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.geometry import Mesh, Subset
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import FIRST_UDIM, STATED_SPACES, TextureInput

Boxes = tuple[NDArray[np.float64], NDArray[np.float64]]
"""(T, 2) the least and the greatest texture coordinates of triangles."""

_SOME = 1024
"""Triangles that are looked at before all others: of what is cut out they tell."""

_KNOWN: WeakKeyDictionary[Mesh, dict[tuple[Subset, TextureInput], bool]] = WeakKeyDictionary()


def solid_materials(scene: Scene) -> tuple[Material, ...]:
    """Those whose opacity an image feeds that is 1 where they are seen; not what shows one side alone."""
    fed = {number: m for number, m in enumerate(scene.materials) if "opacity" in m.inputs and not m.one_sided}
    return tuple(m for number, m in fed.items() if _may_be_one(m.inputs["opacity"]) and _is_solid(scene, number, m))


def _may_be_one(fed: TextureInput) -> bool:
    first = "rgba".index(fed.channel[0])
    as_stored = first == 3 or fed.texture.color_space in STATED_SPACES
    return as_stored and fed.scale[first] > 0.0 and fed.scale[first] + fed.bias[first] >= 1.0


def _is_solid(scene: Scene, number: int, material: Material) -> bool:
    fed = material.inputs["opacity"]
    for mesh, subset in _shown_on(scene, number):
        known = _KNOWN.setdefault(mesh, {})
        if (subset, fed) not in known:
            triangles = mesh.triangles[subset.first : subset.first + subset.count]
            some = triangles[:: 1 + len(triangles) // _SOME]
            known[subset, fed] = all(_is_one_over(fed, _boxes(mesh, each, fed)) for each in (some, triangles))
        if not known[subset, fed]:
            return False
    return True


def _shown_on(scene: Scene, number: int) -> Iterator[tuple[Mesh, Subset]]:
    runs = ((d.mesh, subset) for d in scene.drawables for subset in d.subsets if subset.material == number)
    return ((scene.meshes[mesh], subset) for mesh, subset in dict.fromkeys(runs))


def _boxes(mesh: Mesh, triangles: NDArray[np.uint32], fed: TextureInput) -> Boxes:
    """Where triangles (T, 3) are in the image; without coordinates at its corner."""
    s, t = mesh.uvs.get(fed.uv, np.zeros((len(mesh.points), 2), np.float32)).astype(np.float64).T
    at = np.column_stack([s * x + t * y + offset for x, y, offset in fed.texture_from_uv])
    a, b, c = (at[corner] for corner in triangles.T)
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _is_one_over(fed: TextureInput, boxes: Boxes) -> bool:
    """Is every texel 1 that the triangles are on? Not where a file cannot be read, or coordinates lead past its end."""
    from defshade_cli.image.whiteness import below_one

    texture, (low, high) = fed.texture, boxes
    if not len(low) or not np.isfinite(high - low).all():
        return not len(low)
    try:
        below = {number - FIRST_UDIM: below_one(file, fed.channel) for number, file in texture.tiles}
    except OSError:  # told where the image is loaded
        return False
    wraps = {texture.wrap_s, texture.wrap_t}
    if not (texture.udim or wraps & {"black", "useMetadata"} or any(sums[-1, -1] for sums in below.values())):
        return True
    cells = np.floor(low)
    if wraps == {"repeat"} and not texture.udim:
        low, high, cells = low - cells, high - cells, np.zeros_like(cells)
    tiles = cells @ (1.0, 10.0)
    if (cells < 0.0).any() or cells[:, 0].max() > 9.0 or tiles.max() > max(below):
        return False
    for tile in np.flatnonzero(np.bincount(tiles.astype(np.intp))).tolist():
        there = tiles == tile
        if tile not in below or _touches(below[tile], low[there] - cells[there], high[there] - cells[there]):
            return False
    return True


def _touches(sums: NDArray[np.int32], low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Does a box within the image, or the half texel that is filtered around it, meet a cell below 1, or end beyond?"""
    if (high > 1.0).any():
        return True
    size = np.array(sums.shape[::-1]) - 1
    first = np.clip(np.floor(low * size - 0.5), 0, size - 1).astype(np.intp)
    end = np.clip(np.floor(high * size + 0.5), 0, size - 1).astype(np.intp) + 1
    (x0, y0), (x1, y1) = first.T, end.T
    return bool((sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]).any())
