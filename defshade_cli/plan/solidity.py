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
            known[subset, fed] = _is_one_over(fed, _boxes(mesh, subset, fed))
        if not known[subset, fed]:
            return False
    return True


def _shown_on(scene: Scene, number: int) -> Iterator[tuple[Mesh, Subset]]:
    runs = ((d.mesh, subset) for d in scene.drawables for subset in d.subsets if subset.material == number)
    return ((scene.meshes[mesh], subset) for mesh, subset in dict.fromkeys(runs))


def _boxes(mesh: Mesh, subset: Subset, fed: TextureInput) -> Boxes:
    """Where the triangles are in the image; without coordinates at its corner."""
    uvs = mesh.uvs.get(fed.uv, np.zeros((len(mesh.points), 2), np.float32))
    linear = np.array(fed.texture_from_uv)
    at = uvs.astype(np.float64) @ linear[:, :2].T + linear[:, 2]
    corners = at[mesh.triangles[subset.first : subset.first + subset.count]]
    return corners.min(axis=1), corners.max(axis=1)


def _is_one_over(fed: TextureInput, boxes: Boxes) -> bool:
    """Is every texel 1 that the triangles are on? Not where a file cannot be read, or coordinates lead past its end."""
    from defshade_cli.image.whiteness import below_one

    texture, (low, high) = fed.texture, boxes
    if not np.isfinite(high - low).all():
        return False
    try:
        below = {_cell(number): below_one(file, fed.channel) for number, file in texture.tiles}
    except OSError:  # told where the image is loaded
        return False
    wraps = {texture.wrap_s, texture.wrap_t}
    if not (texture.udim or wraps & {"black", "useMetadata"} or any(b.any() for b in below.values())):
        return True
    cells = np.floor(low)
    if wraps == {"repeat"} and not texture.udim:
        low, high, cells = low - cells, high - cells, np.zeros_like(cells)
    return all(
        cell in below and not _touches(below[cell], low[there] - cell, high[there] - cell)
        for cell, there in ((tuple(each), (cells == each).all(axis=1)) for each in np.unique(cells, axis=0))
    )


def _cell(number: int) -> tuple[float, float]:
    """Of a UDIM tile, its least texture coordinates."""
    row, column = divmod(number - FIRST_UDIM, 10)
    return float(column), float(row)


def _touches(below: NDArray[np.bool_], low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Does a box within the image, or the half texel that is filtered around it, meet any of (H, W), or end beyond?"""
    if (high > 1.0).any():
        return True
    size = np.array(below.shape[::-1])
    first = np.clip(np.floor(low * size - 0.5), 0, size - 1).astype(np.intp)
    end = np.clip(np.floor(high * size + 0.5), 0, size - 1).astype(np.intp) + 1
    sums = np.pad(below, ((1, 0), (1, 0))).cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32)
    (x0, y0), (x1, y1) = first.T, end.T
    return bool((sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]).any())
